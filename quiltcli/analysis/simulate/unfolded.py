"""The display unfolded: its images side by side in one picture, as far as it can be with their neighbours.

Flat facets are laid out as a net, curved ones as their rasters. Where each sample of the picture lies in
the quilt is worked out once; a frame is then one look-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown, look_up
from quiltcli.analysis.simulate.picture import outlined
from quiltcli.display import Facets, scaled
from quiltcli.geometry import Float32Array, FloatArray, Int32Array, facet_from_world
from quiltcli.images.preview import block_means
from quiltcli.job import PackSpec
from quiltcli.layout import Layout, pixel_owners
from quiltcli.layout.from_uv import QUARTER_TURNS
from quiltcli.layout.packing import pack
from quiltcli.projection.curved import inverse_affine

_AROUND = np.array([0.05, 0.052, 0.056], dtype=np.float32)
_DARK = np.float32(0.015)  # a facet that is off
_MARGIN = 0.03  # of the picture, on each side
_MOST_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class Unfolded:
    """Where the samples of a picture lie in the quilt.

    Attributes:
        size: width and height of the picture, pixels.
        samples: across and down a pixel.
        facet: (P,) facet of each sample, −1 for none; row by row.
        place: (2, P) pixels of its facet's page.
    """

    size: tuple[int, int]
    samples: int
    facet: Int32Array
    place: FloatArray

    def picture(self, shown: Shown, how: str = "linear", *, edges: bool = False) -> Float32Array:
        """The picture (H, W, 3) of the images of a frame, linear light; with lines along edges of facets."""
        light = np.repeat(_AROUND[:, None], self.facet.size, axis=1)
        on = np.flatnonzero(self.facet >= 0)
        lit = on[shown.lit[self.facet[on]]]
        light[:, on] = _DARK
        light[:, lit] = look_up(shown, self.facet[lit], self.place[:, lit], how)
        width = self.size[0] * self.samples
        if edges:
            light = outlined(light, self.facet, width)
        return block_means(light.reshape(3, -1, width).transpose(1, 2, 0), self.samples)


def unfold(facets: Facets, layout: Layout, size: tuple[int, int]) -> Unfolded:
    """A picture of so many pixels of a display unfolded.

    Args:
        facets: the display.
        layout: where its images lie in the quilt, one row a facet.
        size: width and height, pixels.

    Raises:
        LayoutError: the facets cannot be laid out.
    """
    net = _net(facets, size)
    owners = pixel_owners(net)
    page = int(np.bincount(net.page[net.page >= 0]).argmax())
    width, height = net.pages[page].tolist()
    start = int(net.page_offset[page])
    mine = owners[start : start + width * height].reshape(height, width)
    rows, columns = np.flatnonzero(mine.any(axis=1)), np.flatnonzero(mine.any(axis=0))
    low = np.array([columns[0], rows[0]], dtype=np.float64)
    extent = np.array([columns[-1] + 1, rows[-1] + 1]) - low
    maps = _maps(facets, layout, net)
    turn, step = _best_turn(facets, net, extent, size)
    samples = _samples(maps, step)
    across, down = ((np.arange(side * samples) + 0.5) / samples - side / 2 for side in size)
    middle = low + extent / 2
    x, y = (step * (turn[k, 0] * across + turn[k, 1] * down[:, None]) + middle[k] for k in range(2))
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    known = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    owner = mine[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    facet = (np.where(known, owner, 0) - 1).astype(np.int32).reshape(-1)
    place = np.zeros((2, facet.size))
    x, y = x.reshape(-1), y.reshape(-1)
    on = np.flatnonzero(facet >= 0)
    m = maps[facet[on]].transpose(1, 2, 0)
    for k in range(2):
        place[k, on] = m[k, 0] * x[on] + m[k, 1] * y[on] + m[k, 2]
    return Unfolded(size, samples, facet, place)


def _net(facets: Facets, size: tuple[int, int]) -> Layout:
    """The display's enabled facets on one page, with about as many pixels as a picture has samples."""
    pixels = float(facets.size[facets.enabled].astype(np.float64).prod(axis=1).sum())
    share = min(1.0, 2 * math.sqrt(size[0] * size[1] / max(pixels, 1.0)))
    small = scaled(facets, max(Fraction(share).limit_denominator(1000), Fraction(1, 1000)))
    # Rasters of surfaces are not glued to planes, which a net needs; they lie beside each other.
    method = "rows" if facets.charts else "net"
    return pack(small, PackSpec(method=method, padding=2, seconds=1.0))


def _best_turn(
    facets: Facets, net: Layout, extent: FloatArray, size: tuple[int, int]
) -> tuple[FloatArray, float]:
    """The quarter turn that puts the most images upright, or else shows them largest.

    Args:
        facets: the display.
        net: it, unfolded.
        extent: width and height of what is shown of it, pixels.
        size: of the picture.

    Returns:
        Net from picture (2, 2), and pixels of the net to one of the picture.
    """
    inner = np.array(size) * (1 - 2 * _MARGIN)
    rows = np.flatnonzero(net.page >= 0)
    area = net.size[rows].astype(np.float64).prod(axis=1)
    # Where the bottom of each facet's own image points: a net's rasters are new ones, at any angle.
    world = facet_from_world(net.origin, net.du, net.dv)[rows, :2, :3]
    down = np.einsum("nbc,nc->nb", world, facets.dv[net.facet[rows] - 1])
    lower = np.einsum("nab,nb->na", net.quilt_from_facet[rows, :, :2], down)
    lower /= np.sqrt((lower * lower).sum(axis=1))[:, None]
    found = []
    for k, turn in enumerate(QUARTER_TURNS):
        step = float((np.abs(turn.T @ extent) / inner).max())
        upright = float((area * (lower @ turn)[:, 1]).sum() / area.sum())
        found.append((round(upright, 1), -round(step, 6), -k))
    best = max(found)
    return np.asarray(QUARTER_TURNS[-best[2]], dtype=np.float64), -best[1]


def _maps(facets: Facets, layout: Layout, net: Layout) -> FloatArray:
    """Pixels (F, 2, 3) of the quilt's pages from pixels of the net's; for facets that both have."""
    world = facet_from_world(layout.origin, layout.du, layout.dv)
    result = np.zeros((facets.count, 2, 3))
    for row, facet in enumerate((net.facet - 1).tolist()):
        if net.page[row] < 0:
            continue
        steps = np.stack((net.du[row], net.dv[row], net.origin[row]), axis=1)
        # From the net's page to its facet, to the facet's plane in the world, and on to the other raster.
        inner = np.vstack((inverse_affine(net.quilt_from_facet[row]), [0, 0, 1]))
        own = world[facet, :2, :3] @ steps @ inner
        own[:, 2] += world[facet, :2, 3]
        result[facet] = layout.quilt_from_facet[facet][:, :2] @ own
        result[facet, :, 2] += layout.quilt_from_facet[facet][:, 2]
    return result


def _samples(maps: FloatArray, step: float) -> int:
    """Samples across a pixel of the picture, so that few pixels of the quilt are left out."""
    spread = np.sqrt(np.abs(np.linalg.det(maps[:, :, :2])))
    known = spread[spread > 0]
    return (
        int(np.clip(math.ceil(step * float(np.median(known)) / 1.5), 2, _MOST_SAMPLES)) if known.size else 2
    )
