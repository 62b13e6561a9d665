"""Shading whole microtiles, and squares of them, by nine points each.

Across a few pixels of one triangle light hardly ever changes in a way that a polynomial of second degree
cannot follow. Where that is sure, colours are worked out at the nine nodes alone, and the polynomial
between them is closer to the others than half floats can tell. Everything else is shaded pixel by pixel.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.scene import Scene
from quiltcli.shading.nodes import NodeColors, nodes_of, points_at_nodes
from quiltcli.shading.shade import LEAST_DISTANCE, alpha, shade, vertex_colors
from quiltcli.visibility.draw import Hits, MixedTiles, Region, WholeTiles
from quiltcli.visibility.resolve.vectors import sum_of_products

_CALM = 24.0
"""A function is calm in a square that reaches a 24th of the way to the function's nearest pole."""

_MOST = np.float32(2.0**100)
_VARIED = 8
"""Vertex colours are calm where the brightest in a square is at most so many times the darkest."""

_FLOOR = 1 / 64
"""Where cosines are smaller, single precision is too coarse for a polynomial."""


def shaded(regions: Iterable[Region], shader: NodeShader) -> Iterator[tuple[Hits, NodeColors | None]]:
    """The hits of all regions; with the colours at nodes where light is smooth.

    A square in which it is not is looked at by microtiles, a microtile pixel by pixel.
    """
    for region in regions:
        if isinstance(region, MixedTiles):
            for hits in region.hits():
                yield hits, None
            continue
        calm = shader.calm(region)
        if calm.any():
            some = region.of(calm)
            colors = shader.colors(some)
            for part in some.parts():
                yield some[part].read(), colors[part]
        rest = region.of(~calm)
        if region.side > 1:
            yield from shaded(rest.split(), shader)
            continue
        for hits in rest.hits():
            yield hits, None


def pixel_colors(
    scene: Scene, eye: FloatArray, hits: Hits, colors: NodeColors | None = None
) -> tuple[Float32Array, ...]:
    """As `shading.shade`, of hits whose colours may be known at nodes."""
    return shade(scene, eye, hits.points) if colors is None else tuple(colors.pixels())


@dataclass(frozen=True)
class NodeShader:
    """Shades squares of a scene by their nodes, for an eye (3,)."""

    scene: Scene
    eye: FloatArray

    def colors(self, squares: WholeTiles) -> NodeColors:
        """Colours at the nodes of S squares."""
        colors = shade(self.scene, self.eye, points_at_nodes(squares))
        nodes = np.empty((len(colors), max(map(len, colors)), squares.triangle.size))
        for values, color in zip(nodes, colors, strict=True):
            values[:] = np.minimum(color, _MOST)  # sums with infinity would be no numbers
        return NodeColors(nodes_of(squares.side).on_grids(nodes), nodes_of(squares.side))

    def calm(self, squares: WholeTiles) -> BoolArray:
        """Which squares (S,) have no glint, no shadow's edge and no grazing view in or near them.

        Light is made of few functions: the lengths of vectors, Schlick's and Smith's of the angle between
        normal and eye or lamp, and GGX's of the angle between normal and half vector, all with poles or
        kinks that are known. What a polynomial misses falls with the third power of the distance to them.
        """
        assert squares.normal is not None
        nodes, rays = nodes_of(squares.side), squares.rays.vectors
        ray, normal = nodes.middle_vectors(rays), nodes.middle_vectors(squares.normal)
        ray_over, normal_over = _over_length(ray), _over_length(normal)
        eye, normal = -ray * ray_over, normal * normal_over
        eye_turn = nodes.vectors_reach(rays) * ray_over
        normal_turn = nodes.vectors_reach(squares.normal) * normal_over
        depth_turn = nodes.reach(squares.inverse) / nodes.middle(squares.inverse)
        nv = sum_of_products(normal, eye)
        result: BoolArray = nv > np.maximum(_CALM * (eye_turn + normal_turn), _FLOOR)
        if len(self.scene.lights.point_position) or len(squares.weights):
            result &= _CALM * depth_turn < 1
        if self.scene.corner_colors is not None:
            hues = vertex_colors(self.scene.corner_colors, points_at_nodes(squares))
            result &= (_VARIED * hues.min(axis=1) >= hues.max(axis=1)).all(axis=0)
        rough = alpha(self.scene, squares.triangle)
        for lamp, lamp_turn in self._lamps(squares, eye, eye_turn, eye_turn + depth_turn):
            nl = sum_of_products(normal, lamp)
            half2 = np.maximum(1 + sum_of_products(eye, lamp), 1e-12)  # 2 (v·h)²
            sine2 = np.maximum(1 - np.maximum(nv + nl, 0) ** 2 / (2 * half2), 0)  # of the angle n, h
            lamp_reach = _CALM * (normal_turn + lamp_turn)
            half_reach = _CALM * (normal_turn + (eye_turn + lamp_turn) / np.sqrt(2 * half2))
            pole2 = sine2 + rough * rough
            result &= np.abs(nl) > np.maximum(lamp_reach, _FLOOR)
            result &= half2 > 2 * (_CALM * (eye_turn + lamp_turn)) ** 2
            result &= (pole2 > half_reach**2) & (pole2 * half2 > 2 * _FLOOR)
        return np.broadcast_to(result, squares.triangle.shape)

    def _lamps(
        self, squares: WholeTiles, eye: FloatArray, eye_turn: FloatArray, move: FloatArray
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Unit directions (3, S) or (3, 1) to the lamps, and the angle (S,) or (1,) they turn by.

        Args:
            squares: S squares.
            eye: (3, S) unit directions to the eye.
            eye_turn: (S,) the angle they turn by.
            move: (S,) how far points of the squares are from their middle, over their distance.
        """
        lights = self.scene.lights
        for direction in lights.directional_direction:
            yield -direction.astype(np.float64)[:, None], np.zeros(1)
        if lights.headlight:
            yield eye, eye_turn
        if len(lights.point_position):
            point = nodes_of(squares.side).middle(squares.rays.axes) / nodes_of(squares.side).middle(
                squares.inverse
            )
            distance = np.sqrt(sum_of_products(point, point))
            for place in lights.point_position:
                offset = (place - self.eye)[:, None] - point
                over = _over_length(offset)
                turn = move * distance * over
                # Nearer than that, the light does not grow any more.
                yield offset * over, np.where((1 - turn) > over * LEAST_DISTANCE, turn, np.inf)


def _over_length(vectors: FloatArray) -> FloatArray:
    """One over the lengths (G,) of vectors (3, G)."""
    return np.asarray(1 / np.sqrt(sum_of_products(vectors, vectors) + 1e-300))
