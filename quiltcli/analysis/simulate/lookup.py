"""What a ray that meets the display sees there: the pixels of the facets' images.

Rays go to the quilt by the same matrices that made it, only from another eye, so an image is looked
up where it lies, turned and mirrored as the layout has it, without being unmapped first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.display import Facets, shared_edges
from quiltcli.geometry import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    IntArray,
    OwnerArray,
    offsets,
    segments,
)
from quiltcli.layout import Layout
from quiltcli.projection.curved import inverse_affine
from quiltcli.projection.planar import QuiltRays, quilt_rays
from quiltcli.render.buffers import Buffers

_BLOCK = 1 << 17
_AROUND = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1)]


@dataclass(frozen=True)
class Shown:
    """The images a display shows in a frame.

    Attributes:
        facets: the display, F facets.
        layout: their places in the quilt.
        lit: (F,) facets that were drawn for the viewer.
        buffers: R, G and B of the quilt, flat.
        owners: flat: the facet's id inside its polygon, negative where its image goes on past the
            polygon's edge, 0 elsewhere.
        eye: (3,) the viewer's, for whom the images are; world metres.
    """

    facets: Facets
    layout: Layout
    lit: BoolArray
    buffers: Buffers
    owners: OwnerArray
    eye: FloatArray

    @cached_property
    def neighbours(self) -> IntArray:
        """Lit facets (F, n) that share an edge with each facet, −1 where there are no more."""
        shared = shared_edges(self.facets)
        pairs = np.unique(np.stack((shared.facet_a, shared.facet_b), axis=1), axis=0)
        pairs = np.concatenate((pairs, pairs[:, ::-1]))[np.tile(self.lit[pairs].all(axis=1), 2)]
        pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
        count = np.bincount(pairs[:, 0], minlength=self.facets.count)
        _, rank = segments(offsets(count))
        result = np.full((self.facets.count, int(count.max(initial=0))), -1)
        result[pairs[:, 0], rank] = pairs[:, 1]
        return result

    @cached_property
    def wrapping(self) -> tuple[int, ...]:
        """Facets whose left and right edges are the same line, where filters go on at the other end."""
        charts = enumerate(self.facets.charts)
        return tuple(row for row, chart in charts if chart is not None and chart.wraps and self.lit[row])

    @cached_property
    def rays(self) -> QuiltRays:
        """The viewer's rays through the quilt."""
        flat = self.lit & ~self.facets.curved if self.facets.charts else self.lit
        return quilt_rays(self.layout, flat, self.eye)


def quilt_places(
    shown: Shown, facet: Int32Array, rays: FloatArray, eye: FloatArray, lit: BoolArray
) -> FloatArray:
    """Where rays meet their facets' planes, in pixels of the facets' pages.

    Args:
        shown: the display and its layout.
        facet: (P,) facet index of every ray.
        rays: (3, P) directions from the eye.
        eye: (3,) world metres.
        lit: (F,) facets whose lit side faces the eye; `facet` holds no others.

    Returns:
        (2, P) continuous pixels.
    """
    flat = lit & ~shown.facets.curved if shown.facets.charts else lit
    matrices = quilt_rays(shown.layout, flat, eye).quilt_from_eye
    result = np.empty((2, facet.size))
    for start in range(0, facet.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        m = matrices[facet[part]].transpose(1, 2, 0)
        x, y, w = (
            m[i, 0] * rays[0, part] + m[i, 1] * rays[1, part] + m[i, 2] * rays[2, part] for i in range(3)
        )
        # Curved facets have no matrix: whoever asks about them asks their charts.
        w = np.where(w == 0, 1.0, w)
        result[0, part], result[1, part] = x / w, y / w
    return result


def look_up(shown: Shown, facet: Int32Array, place: FloatArray, how: str = "linear") -> Float32Array:
    """Light (3, P) of the facets' images at places (2, P) in pixels of their pages.

    Args:
        shown: the images.
        facet: (P,) facet index.
        place: from `quilt_places`.
        how: a name of `FILTERS`.
    """
    result = np.empty((3, facet.size), dtype=np.float32)
    for start in range(0, facet.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        result[:, part] = FILTERS[how](shown, facet[part], place[:, part])
    return result


def nearest(shown: Shown, facet: Int32Array, place: FloatArray) -> Float32Array:
    """The light (3, P) of the pixel under each place, unchanged."""
    address = nearest_pixels(shown, facet, place)
    return np.stack([shown.buffers[name][address].astype(np.float32) for name in "RGB"])


def nearest_pixels(shown: Shown, facet: Int32Array, place: FloatArray) -> IntArray:
    """Flat address (P,) of the pixel under each place.

    Where the edge of a polygon cuts through a pixel whose centre is outside, and the image has no
    bleed, it is the nearest pixel of the facet around.
    """
    x, y = np.floor(place).astype(np.int64)
    result, mine = _address(shown, facet, x, y)
    lost = np.flatnonzero(~mine)
    best = np.full(lost.size, np.inf)
    for dx, dy in _AROUND:
        there, owned = _address(shown, facet[lost], x[lost] + dx, y[lost] + dy)
        away = (place[:, lost] - (x[lost] + dx + 0.5, y[lost] + dy + 0.5)) ** 2
        distance = np.where(owned, away.sum(axis=0), np.inf)
        better = distance < best
        result[lost[better]], best[better] = there[better], distance[better]
    return result


def linear(shown: Shown, facet: Int32Array, place: FloatArray) -> Float32Array:
    """The light (3, P) between the four pixels around each place.

    Past a facet's edge those are its bleed. Where the layout left no room for that, as at the edges of
    a page, what they would hold is found on the facet beyond the edge; where there is none, those that
    belong to the facet have to do.
    """
    light, total, lost = _between(shown, facet, place)
    for at, weight, centre in lost:
        beyond, found = across_edges(shown, facet[at], centre)
        light[:, at] += np.where(found, weight, 0) * beyond
        total[at] += np.where(found, weight, 0)
    return _weighted(shown, facet, place, light, total)


def across_edges(shown: Shown, facet: Int32Array, place: FloatArray) -> tuple[FloatArray, BoolArray]:
    """What a facet's image would hold past its edges: light (3, P), and where (P,) it is known.

    The viewer sees through such a place a point of the facet beyond the edge, where the image of the
    same ray is; facets that share an edge are looked at.

    Args:
        shown: the images.
        facet: (P,) facet index.
        place: (2, P) pixels of its page, outside its polygon.
    """
    light, found = np.zeros((3, facet.size)), np.zeros(facet.size, dtype=np.bool_)
    matrix = shown.rays.eye_from_quilt[facet]
    rays = matrix[:, :, 0] * place[0, :, None] + matrix[:, :, 1] * place[1, :, None] + matrix[:, :, 2]
    for column in shown.neighbours.T:
        other = column[facet]
        at = np.flatnonzero(~found & (other >= 0))
        there = np.einsum("pij,pj->ip", shown.rays.quilt_from_eye[other[at]], rays[at])
        ahead = there[2] > 0
        at, there = at[ahead], there[:2, ahead] / there[2, ahead]
        next_door = other[at].astype(np.int32)
        _, mine = _address(shown, next_door, *np.floor(there).astype(np.int64))
        at, there, next_door = at[mine], there[:, mine], next_door[mine]
        some, total, _ = _between(shown, next_door, there)
        light[:, at], found[at] = _weighted(shown, next_door, there, some, total), True
    return light, found


def _between(
    shown: Shown, facet: Int32Array, place: FloatArray
) -> tuple[FloatArray, FloatArray, list[tuple[IntArray, FloatArray, FloatArray]]]:
    """Sums over the four pixels around each place, of those that belong to the facet.

    Returns:
        Weighted light (3, P); sums of the weights (P,); and of those that do not belong to it, index,
        weight and centre, the first, second, third and fourth of each place.
    """
    corner = np.floor(place - 0.5)
    share_x, share_y = place - 0.5 - corner
    x, y = corner.astype(np.int64)
    total = np.zeros(facet.size)
    light = np.zeros((3, facet.size))
    lost = []
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        address, mine = _address(shown, facet, x + dx, y + dy)
        weight = (share_x if dx else 1 - share_x) * (share_y if dy else 1 - share_y)
        at = np.flatnonzero(~mine & (weight > 0))
        lost.append((at, weight[at], corner[:, at] + [[dx + 0.5], [dy + 0.5]]))
        weight = weight * mine
        total += weight
        for k, name in enumerate("RGB"):
            light[k] += weight * shown.buffers[name][address]
    return light, total, lost


def _weighted(
    shown: Shown, facet: Int32Array, place: FloatArray, light: FloatArray, total: FloatArray
) -> Float32Array:
    """Sums divided by their weights (3, P), of the nearest pixel where there is none."""
    alone = total < 1e-6
    light[:, alone] = nearest(shown, facet[alone], place[:, alone])
    total[alone] = 1
    result: Float32Array = (light / total).astype(np.float32)
    return result


def _address(shown: Shown, facet: Int32Array, x: IntArray, y: IntArray) -> tuple[IntArray, BoolArray]:
    """Flat addresses (P,) of page pixels, and whether they hold the facet's image; 0 where off the page."""
    page = shown.layout.page[facet]
    width, height = shown.layout.pages[page].T.astype(np.int64)
    for row in shown.wrapping:
        x, y = _wrapped(shown.layout, row, x, y, np.flatnonzero(facet == row))
    on = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    address = np.where(on, shown.layout.page_offset[page] + y * width + x, 0)
    mine: BoolArray = on & (np.abs(shown.owners[address]) == shown.layout.facet[facet])
    return address, mine


def _wrapped(layout: Layout, row: int, x: IntArray, y: IntArray, mine: IntArray) -> tuple[IntArray, IntArray]:
    """Page pixels (P,), those `mine` (n,) of a facet that closes left to right taken to its other edge."""
    matrix = layout.quilt_from_facet[row]
    i, j = inverse_affine(matrix) @ np.stack((x[mine] + 0.5, y[mine] + 0.5, np.ones(mine.size)))
    i = np.mod(i, int(layout.size[row, 0]))
    there = np.floor(matrix @ np.stack((i, j, np.ones(mine.size)))).astype(np.int64)
    x, y = x.copy(), y.copy()
    x[mine], y[mine] = there
    return x, y


FILTERS: dict[str, Callable[[Shown, Int32Array, FloatArray], Float32Array]] = {
    "nearest": nearest,
    "linear": linear,
}
