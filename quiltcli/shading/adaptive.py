"""Shading whole microtiles, and squares of them, by nine points each.

Across a few pixels of one triangle light hardly ever changes in a way that a polynomial of second degree
cannot follow. Where that is sure, colours are worked out at the nine nodes alone, and the polynomial
between them is closer to the others than half floats can tell. Everything else is shaded pixel by pixel.

    a square that one        nine nodes are       and its pixels lie on the polynomial
    triangle fills           shaded               through them
    ┌─────────────┐          ○──────○──────○      in x² y², x² y, … 1
    │ · · · · · · │          │      │      │
    │ · · · · · · │    →     ○──────○──────○      sure where the pole of every term of the
    │ · · · · · · │          │      │      │      light is far off, as `_FAR` has it: a lamp
    └─────────────┘          ○──────○──────○      nearby, a glint, a grazing normal

A shadow is never smooth: what share of a lamp is seen is asked pixel by pixel, and multiplies the light
of that lamp between the nodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.scene import Scene
from quiltcli.shading.brdf import alpha, mirrors
from quiltcli.shading.lights import Middle, asks_for_places, casting, has_surroundings, reaches, turns
from quiltcli.shading.materials import albedo_at, between_corners, emission_at, occlusion_at
from quiltcli.shading.nodes import NodeColors, nodes_of, points_at_nodes
from quiltcli.shading.shade import Lamps, Light, Shades, all_lamps, filled, shade, shade_apart
from quiltcli.shading.shadows import CENTRE, Sample, Shadows, casts
from quiltcli.shading.surface import Surface
from quiltcli.shading.textures import covers
from quiltcli.shading.textures.bumps import bent
from quiltcli.visibility.draw import Hits, MixedTiles, Region, WholeTiles
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import sum_of_products

_FAR = 24.0
"""A function is smooth in a square that reaches a 24th of the way to the function's nearest pole."""

_MOST = np.float32(2.0**100)
_VARIED = 8
"""Vertex colours are smooth where the brightest in a square is at most so many times the darkest."""

_TEXTURED = 512
"""Microtiles whose pixels fit the cache with all that is needed to look textures up."""

_FLOOR = 1 / 64
"""Where cosines are smaller, single precision is too coarse for a polynomial."""


@dataclass(frozen=True)
class NodeLight:
    """Light at the nodes of S squares in which it is smooth, worked out when it is first asked for.

    Attributes:
        scene: what is seen.
        eye: (3,) from where, world metres.
        squares: the squares.
        lamps: whose light; by default of all that cast no shadows, and of what emits.
    """

    scene: Scene
    eye: FloatArray
    squares: WholeTiles

    lamps: Lamps | None = None

    @cached_property
    def total(self) -> NodeColors:
        """All of it, but for lamps that cast shadows."""
        points = points_at_nodes(self.squares)
        return self._of(shade(self.scene, self.eye, points, self._lamps))

    @cached_property
    def apart(self) -> Light[NodeColors]:
        """Its parts."""
        light = shade_apart(self.scene, self.eye, points_at_nodes(self.squares), self._lamps)
        return Light(
            self._of(light.diffuse),
            self._of(light.specular),
            self._of(light.emission),
            None if light.around is None else self._of(light.around),
        )

    @property
    def _lamps(self) -> Lamps:
        others = tuple(light for light in self.scene.lights if not casts(light))
        return self.lamps or Lamps(others)

    @cached_property
    def cast(self) -> tuple[NodeLight, ...]:
        """The light of each lamp that casts shadows, if nothing hid it."""
        return tuple(replace(self, lamps=Lamps((light,), emits=False)) for light in casting(self.scene))

    @cached_property
    def reached(self) -> BoolArray:
        """Which squares (S,) the first lamp reaches, if nothing hides it."""
        surface = Surface(points_at_nodes(self.squares), self.eye)
        found = reaches(self._lamps.lights[0], surface)
        return np.broadcast_to(found, self.squares.triangle.shape)

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
        cover: how textures cover all of them, where that is known: `covers.PLAIN`, `UNLIT` or `BASE`;
            `FULL` where it differs or light is worked out at every point.
        sample: which sample of its pixels they are.
    """

    scene: Scene
    eye: FloatArray
    hits: Hits
    nodes: NodeLight | None = None
    part: slice = field(default_factory=lambda: slice(None))
    cover: int = covers.FULL
    sample: Sample = CENTRE

    @cached_property
    def points(self) -> Points:
        """The hits' points, their normals as normal maps bend them."""
        return bent(self.scene, self.hits.points)

    @property
    def total(self) -> NodeColors | Shades:
        """All light, at nodes or at points."""
        if self.cover == covers.UNLIT:
            return self.emission
        if self.nodes is None:
            return shade(self.scene, self.eye, self.points, all_lamps(self.scene, self.sample))
        if self.cover == covers.BASE:
            return self._composed
        base = self.nodes.total[self.part]
        cast = [lamp.total[self.part] for lamp in self.nodes.cast]
        return self._with_shadows(tuple(base.pixels()), cast) if cast else base

    def pixels(self) -> Shades:
        """All light, at points."""
        total = self.total
        return tuple(total.pixels()) if isinstance(total, NodeColors) else total

    @cached_property
    def apart(self) -> Light[NodeColors] | Light[Shades]:
        """The light's parts, at nodes or at points."""
        if self.nodes is None:
            return shade_apart(self.scene, self.eye, self.points, all_lamps(self.scene, self.sample))
        if self.cover == covers.BASE:
            return self._covered
        light, part = self.nodes.apart, self.part
        if not self.nodes.cast:
            return Light(light.diffuse[part], light.specular[part], light.emission[part])
        diffuse, specular = tuple(light.diffuse[part].pixels()), tuple(light.specular[part].pixels())
        return Light(*self._cast(diffuse, specular), tuple(light.emission[part].pixels()))

    def _cast(self, diffuse: Shades, specular: Shades) -> tuple[Shades, Shades]:
        """Diffuse and specular light at points, and what is shown of each lamp that casts shadows."""
        assert self.nodes is not None
        cast, part = [lamp.apart for lamp in self.nodes.cast], self.part
        if not cast:
            return diffuse, specular
        return (
            self._with_shadows(diffuse, [light.diffuse[part] for light in cast]),
            self._with_shadows(specular, [light.specular[part] for light in cast]),
        )

    def _with_shadows(self, base: Shades, cast: Sequence[NodeColors]) -> Shades:
        """Light of which nothing is hidden, and what is shown of each lamp, at points."""
        count = max(len(base), *(len(light.values) for light in cast))
        total = [*base] * (count // len(base))
        for light, shown in zip(cast, self._shown, strict=True):
            colors = light.pixels()
            for k in range(count):
                total[k] = total[k] + colors[k % len(colors)] * shown
        return tuple(total)

    @cached_property
    def _shown(self) -> tuple[Float32Array, ...]:
        """The share of each lamp that points see."""
        assert self.nodes is not None
        shadows = Shadows(self.scene, Surface(self.hits.points, self.eye), self.sample)
        drawn = np.ones(self.hits.depth.shape, dtype=np.bool_)
        if self.hits.chosen is not None:
            drawn[:] = False
            drawn.reshape(-1)[self.hits.chosen] = True
        return tuple(
            shadows.shown(light, lamp.reached[self.part][:, None] & drawn)
            for light, lamp in zip(casting(self.scene), self.nodes.cast, strict=True)
        )

    @property
    def albedo(self) -> Shades:
        """The base colour, at points: it may vary as it likes."""
        return filled(albedo_at(self.scene, self.hits.points), self.hits.points)

    @property
    def emission(self) -> Shades:
        """What needs no lamp, at points."""
        return filled(emission_at(self.scene, self.hits.points), self.hits.points)

    @cached_property
    def _covered(self) -> Light[Shades]:
        """The parts of light at nodes, and what textures do to them, at points."""
        assert self.nodes is not None
        light, part = self.nodes.apart, self.part
        diffuse = self._open(tuple(light.diffuse[part].pixels()), light.around)
        return Light(*self._cast(diffuse, tuple(light.specular[part].pixels())), self.emission)

    @property
    def _composed(self) -> Shades:
        """All light at points, of that at nodes and of textures that vary from point to point."""
        light = self._covered
        albedo, emission = self.albedo, light.emission
        diffuse, specular = (each * (3 // len(each)) for each in (light.diffuse, light.specular))
        result = []
        for k in range(3):
            total = albedo[k] * diffuse[k]
            total += specular[k]
            total += emission[k]
            result.append(total)
        return tuple(result)

    def _open(self, diffuse: Shades, around: NodeColors | None) -> Shades:
        """Diffuse light less what textures say that does not arrive from everywhere."""
        share = None if around is None else occlusion_at(self.scene, self.hits.points)
        if around is None or share is None:
            return diffuse
        lost = share - np.float32(1)
        return tuple(
            np.maximum(d + a * lost, np.float32(0))
            for d, a in zip(diffuse, around[self.part].pixels(), strict=True)
        )


def shaded(
    regions: Iterable[Region], scene: Scene, eye: FloatArray, sample: Sample = CENTRE
) -> Iterator[Shaded]:
    """The hits of all regions, with light at nodes where it is smooth.

    A square in which it is not is looked at by microtiles, a microtile pixel by pixel.
    """
    of_material = covers.covers_of(scene)
    for region in regions:
        if isinstance(region, MixedTiles):
            yield from (Shaded(scene, eye, hits, sample=sample) for hits in region.hits())
        elif of_material is None:
            yield from _shaded_whole(region, scene, eye, covers.PLAIN, sample)
        else:
            cover = of_material.take(scene.material.take(region.triangle))
            for each in np.unique(cover).tolist():
                yield from _shaded_whole(region.of(cover == each), scene, eye, each, sample)


def _shaded_whole(
    squares: WholeTiles, scene: Scene, eye: FloatArray, cover: int, sample: Sample
) -> Iterator[Shaded]:
    """As `shaded`, of squares that textures cover alike."""
    if cover in (covers.UNLIT, covers.FULL):
        for part in squares.parts(_TEXTURED):
            yield Shaded(scene, eye, squares[part].read(), cover=cover, sample=sample)
        return
    # Light at nine nodes a square where these tell enough of it.
    smooth = is_smooth(squares, scene, eye)
    some = squares.of(smooth)
    nodes = NodeLight(scene, eye, some)
    for part in some.parts(*((_TEXTURED,) if cover == covers.BASE else ())):
        yield Shaded(scene, eye, some[part].read(), nodes, part, cover, sample)
    # What is left: smaller squares, or if there are none, pixels.
    if squares.side > 1:
        for smaller in squares.split(~smooth):
            yield from _shaded_whole(smaller, scene, eye, cover, sample)
    else:
        yield from (Shaded(scene, eye, hits, sample=sample) for hits in squares.of(~smooth).hits())


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
    if has_surroundings(scene):
        # Its maps bend from texel to texel: light is the same where normals are, unless mirrored.
        result &= (normal_turn == 0) & ~mirrors(scene, squares.triangle)
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
