"""Shading whole microtiles, and squares of them, by nine points each.

Across a few pixels of one triangle light hardly ever changes in a way that a polynomial of second degree
cannot follow. Where that is sure, colours are worked out at the nine nodes alone, and the polynomial
between them is closer to the others than half floats can tell. Everything else is shaded pixel by pixel.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.scene import Scene
from quiltcli.shading.brdf import alpha
from quiltcli.shading.lights import Middle, asks_for_places, turns
from quiltcli.shading.materials import albedo_at, between_corners
from quiltcli.shading.nodes import NodeColors, nodes_of, points_at_nodes
from quiltcli.shading.shade import Light, Shades, filled, shade, shade_apart
from quiltcli.visibility.draw import Hits, MixedTiles, Region, WholeTiles
from quiltcli.visibility.resolve.vectors import sum_of_products

_FAR = 24.0
"""A function is smooth in a square that reaches a 24th of the way to the function's nearest pole."""

_IN_A_PIXEL = 1 / 6
"""So much of `_FAR` from the middle of a microtile is some twenty pixels from every pixel in it: over one pixel,
the mean of light is that of its centre within half a percent."""

_MOST = np.float32(2.0**100)
_VARIED = 8
"""Vertex colours are smooth where the brightest in a square is at most so many times the darkest."""

_FLOOR = 1 / 64
"""Where cosines are smaller, single precision is too coarse for a polynomial."""


@dataclass(frozen=True)
class NodeLight:
    """Light at the nodes of S squares in which it is smooth, worked out when it is first asked for."""

    scene: Scene
    eye: FloatArray
    squares: WholeTiles

    @cached_property
    def total(self) -> NodeColors:
        """All of it."""
        return self._of(shade(self.scene, self.eye, points_at_nodes(self.squares)))

    @cached_property
    def apart(self) -> Light[NodeColors]:
        """Its parts."""
        light = shade_apart(self.scene, self.eye, points_at_nodes(self.squares))
        return Light(self._of(light.diffuse), self._of(light.specular), self._of(light.emission))

    def microtiles(self, part: slice) -> IntArray:
        """The microtiles of some of the squares, by their index among those of all blocks."""
        first, side = self.squares.tiles[part], self.squares.side
        if side == 1:
            return first.number
        return first.split(side, self.squares.reader.canvas.tiles_across.take(first.block)).number

    def _of(self, colors: Shades) -> NodeColors:
        nodes = nodes_of(self.squares.side)
        values = np.empty((len(colors), max(map(len, colors)), self.squares.triangle.size))
        for row, color in zip(values, colors, strict=True):
            row[:] = np.minimum(color, _MOST)  # sums with infinity would be no numbers
        return NodeColors(nodes.on_grids(values, out=values), nodes)


@dataclass(frozen=True)
class Shaded:
    """What channels are made of: hits, and the light that leaves them, when it is asked for.

    Attributes:
        scene: what is seen.
        eye: (3,) from where, world metres.
        hits: its visible points.
        nodes: the light of squares, of which these hits are a part; None where light is not smooth.
        part: which of the squares.
    """

    scene: Scene
    eye: FloatArray
    hits: Hits
    nodes: NodeLight | None = None
    part: slice = field(default_factory=lambda: slice(None))

    @property
    def total(self) -> NodeColors | Shades:
        """All light, at nodes or at points."""
        if self.nodes is not None:
            return self.nodes.total[self.part]
        return shade(self.scene, self.eye, self.hits.points)

    def pixels(self) -> Shades:
        """All light, at points."""
        total = self.total
        return tuple(total.pixels()) if isinstance(total, NodeColors) else total

    @cached_property
    def apart(self) -> Light[NodeColors] | Light[Shades]:
        """The light's parts, at nodes or at points."""
        if self.nodes is None:
            return shade_apart(self.scene, self.eye, self.hits.points)
        light, part = self.nodes.apart, self.part
        return Light(light.diffuse[part], light.specular[part], light.emission[part])

    @property
    def albedo(self) -> Shades:
        """The base colour, at points: it may vary as it likes."""
        return filled(albedo_at(self.scene, self.hits.points), self.hits.points)


def shaded(regions: Iterable[Region], scene: Scene, eye: FloatArray) -> Iterator[Shaded]:
    """The hits of all regions, with light at nodes where it is smooth.

    A square in which it is not is looked at by microtiles, a microtile pixel by pixel.
    """
    for region in regions:
        if isinstance(region, MixedTiles):
            yield from (Shaded(scene, eye, hits) for hits in region.hits())
            continue
        # Light at nine nodes a square where these tell enough of it.
        smooth = is_smooth(region, scene, eye)
        some = region.of(smooth)
        nodes = NodeLight(scene, eye, some)
        for part in some.parts():
            yield Shaded(scene, eye, some[part].read(), nodes, part)
        # What is left: smaller squares, or if there are none, pixels.
        if region.side > 1:
            yield from shaded(region.split(~smooth), scene, eye)
        else:
            yield from (Shaded(scene, eye, hits) for hits in region.of(~smooth).hits())


def shaded_once(
    regions: Iterable[Region], scene: Scene, eye: FloatArray
) -> Iterator[tuple[Shaded, IntArray]]:
    """Hits whose pixels have nearly the same light all over, and the microtiles they fill.

    Of regions whose pixels see one triangle each, wherever in them one looks: the light of a pixel's centre
    is the mean of it then. Nothing is said of microtiles in which it is not so for all pixels.
    """
    for region in regions:
        if isinstance(region, MixedTiles):
            continue
        smooth = is_smooth(region, scene, eye)
        some = region.of(smooth)
        nodes = NodeLight(scene, eye, some)
        for part in some.parts():
            yield Shaded(scene, eye, some[part].read(), nodes, part), nodes.microtiles(part)
        if region.side > 1:
            yield from shaded_once(region.split(~smooth), scene, eye)
            continue
        rest = region.of(~smooth)
        if not rest.triangle.size:
            continue
        rest = rest.of(is_smooth(rest, scene, eye, _IN_A_PIXEL))
        for part in rest.parts():
            yield Shaded(scene, eye, rest[part].read()), rest.tiles[part].number


def is_smooth(squares: WholeTiles, scene: Scene, eye: FloatArray, share: float = 1.0) -> BoolArray:
    """Which squares (S,) have no glint, no shadow's edge and no grazing view in or near them.

    They are seen from an eye (3,); `share` is of the distance that counts as near.
    Light is made of few functions: the lengths of vectors, Schlick's and Smith's of the angle between
    normal and eye or lamp, and GGX's of the angle between normal and half vector, all with poles or
    kinks that are known. What a polynomial misses falls with the third power of the distance to them.
    """
    assert squares.normal is not None
    nodes, rays = nodes_of(squares.side), squares.rays.vectors
    # Directions in the middle, and the angles by which they turn up to the farthest pixel.
    ray, normal = nodes.middle_vectors(rays), nodes.middle_vectors(squares.normal)
    ray_over, normal_over = _over_length(ray), _over_length(normal)
    view, normal = -ray * ray_over, normal * normal_over
    eye_turn = nodes.vectors_reach(rays) * ray_over * share
    normal_turn = nodes.vectors_reach(squares.normal) * normal_over * share
    depth_turn = nodes.reach(squares.inverse) / nodes.middle(squares.inverse) * share
    middle = Middle(squares, eye, view, eye_turn, depth_turn)
    # The view: not grazing; where light or colour changes from place to place, not too steep.
    nv = sum_of_products(normal, view)
    result: BoolArray = nv > np.maximum(_FAR * (eye_turn + normal_turn), _FLOOR)
    if asks_for_places(scene) or len(squares.weights):
        result &= _FAR * depth_turn < 1
    if scene.corner_colors is not None:
        hues = between_corners(scene.corner_colors, points_at_nodes(squares))
        result &= (_VARIED * hues.min(axis=1) >= hues.max(axis=1)).all(axis=0)
    # Each lamp: not about to set, not behind the surface as the eye sees it, its image not near.
    rough = alpha(scene, squares.triangle)
    for lamp, lamp_turn in turns(scene, middle):
        nl = sum_of_products(normal, lamp)
        half2 = np.maximum(1 + sum_of_products(view, lamp), 1e-12)  # 2 (v·h)²
        sine2 = np.maximum(1 - np.maximum(nv + nl, 0) ** 2 / (2 * half2), 0)  # of the angle n, h
        lamp_reach = _FAR * (normal_turn + lamp_turn)
        half_reach = _FAR * (normal_turn + (eye_turn + lamp_turn) / np.sqrt(2 * half2))
        pole2 = sine2 + rough * rough
        result &= np.abs(nl) > np.maximum(lamp_reach, _FLOOR)
        result &= half2 > 2 * (_FAR * (eye_turn + lamp_turn)) ** 2
        result &= (pole2 > half_reach**2) & (pole2 * half2 > 2 * _FLOOR)
    return np.broadcast_to(result, squares.triangle.shape)


def _over_length(vectors: FloatArray) -> FloatArray:
    """One over the lengths (G,) of vectors (3, G)."""
    return np.asarray(1 / np.sqrt(sum_of_products(vectors, vectors) + 1e-300))
