"""Light that is worked out once for all samples of a pixel, as multisampling does.

Where one triangle is all that the samples of some pixels can see, and its light is smooth, the light of a
pixel's centre is the mean of it, nearly. Textures and shadows are not: they are asked for every sample.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import NodeLight, Shaded, is_smooth
from quiltcli.shading.textures import covers
from quiltcli.visibility.draw import MixedTiles, Region, WholeTiles

_IN_A_PIXEL = 1 / 4
"""So much of what counts as near for a microtile is thirty pixels and more from every pixel in it: over one
of them the mean of light is that of its centre within a quarter of a percent, of a glint within one."""


def may_be_once(scene: Scene) -> bool:
    """Whether there is anything in a scene whose light samples may share."""
    return not any(getattr(light, "shadows", False) for light in scene.lights)


def shaded_once(
    regions: Iterable[Region], scene: Scene, eye: FloatArray
) -> Iterator[tuple[Shaded, IntArray]]:
    """Hits whose pixels have nearly the same light all over, and the microtiles they fill.

    Nothing is said of microtiles in which it is not so for all pixels.

    Args:
        regions: their pixels see one triangle each, wherever in them one looks.
        scene: the scene.
        eye: (3,) from where it is seen.
    """
    of_material = covers.covers_of(scene)
    for region in regions:
        if isinstance(region, MixedTiles):
            continue
        if of_material is not None:
            region = region.of(of_material.take(scene.material.take(region.triangle)) == covers.PLAIN)
        yield from _once(region, scene, eye)


def _once(squares: WholeTiles, scene: Scene, eye: FloatArray) -> Iterator[tuple[Shaded, IntArray]]:
    """As `shaded_once`, of squares without textures."""
    if not squares.triangle.size:
        return
    smooth = is_smooth(squares, scene, eye)
    some = squares.of(smooth)
    nodes = NodeLight(scene, eye, some)
    for part in some.parts():
        yield Shaded(scene, eye, some[part].read(), nodes, part, covers.PLAIN), _microtiles(some[part])
    if squares.side > 1:
        for smaller in squares.split(~smooth):
            yield from _once(smaller, scene, eye)
        return
    rest = squares.of(~smooth)
    if rest.triangle.size:
        rest = rest.of(is_smooth(rest, scene, eye, _IN_A_PIXEL))
        for part in rest.parts():
            yield Shaded(scene, eye, rest[part].read()), rest.tiles[part].number


def _microtiles(squares: WholeTiles) -> IntArray:
    """The microtiles of squares, by their index among those of all blocks."""
    first, side = squares.tiles, squares.side
    if side == 1:
        return first.number
    return np.asarray(first.split(side, squares.reader.canvas.tiles_across.take(first.block)).number)
