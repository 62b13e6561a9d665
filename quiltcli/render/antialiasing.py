"""Anti-aliasing: where the samples of a pixel lie, and how they are summed.

A pixel's colour is the mean of samples all over it. They lie on a rank-1 lattice, the same in every pixel
and frame, so nothing flickers; its points have one in every cell of a grid where their number has such a
lattice, and the error at edges falls as the number to the power of −3/4, which is the limit for half-planes.
Samples are placed in the facet's own pixels: its image does not depend on how it is turned in the quilt.
Past a facet's edge they see the plane go on, so its border pixels are those of a larger facet.

Whether a sample sees a surface is decided at its place; textures are looked up in the middle of its cell,
over the cell, so that the footprints of a pixel's samples tile it.

Sums are kept for the pixels of a batch, whatever the number of samples: memory does not grow with it. Depth,
ids and other data are those of the pixel's centre.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from quiltcli.channels import CHANNELS, MOST_HALF
from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.layout import Layout
from quiltcli.render.buffers import Buffers
from quiltcli.render.setup import Stage
from quiltcli.shading.aovs import light_at_points, shaded_for, wanted_for
from quiltcli.visibility.draw import Cells, Frame, draw

_LONGEST = 5  # times as wide as high a cell's grid may be
_TURN = 1e-6  # by which a map's linear part may be off a whole turn
_LATTICES = {
    2: 1,
    3: 2,
    4: 3,
    5: 3,
    6: 5,
    8: 5,
    9: 4,
    10: 7,
    12: 5,
    16: 5,
    20: 13,
    24: 17,
    25: 21,
    32: 25,
    36: 31,
    48: 37,
    64: 41,
    100: 71,
    128: 81,
    144: 85,
    256: 209,
}


def averaged(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the channels that are light, whose samples are averaged."""
    return tuple(name for name in channels if CHANNELS[name].averaged)


def draw_samples(
    stage: Stage, frame: Frame, batch: tuple[int, int], buffers: Buffers, channels: tuple[str, ...]
) -> None:
    """Average samples of `channels` into the buffers; what misses the scene counts as background.

    Args:
        stage: what the job's frames share.
        frame: the frame.
        batch: the range of blocks.
        buffers: written to, at every pixel that any sample sees.
        channels: some of `averaged`.
    """
    sums = _Sums(stage, batch, channels)
    scene, eye = stage.scene, frame.viewer.eye
    count = stage.job.render.samples
    for sample in sample_places(count):
        place, cells = in_quilt(stage.layout, sample), None
        if scene.textures is not None:
            cells = cells_in_quilt(stage.layout, *cell_of(sample, count))
        drawing = draw(frame, batch, place, cells)
        for shaded in shaded_for(channels, drawing, wanted_for(channels, scene), scene, eye):
            pixel = shaded.hits.pixel - sums.first
            sums.hits[pixel] += 1
            for name in channels:
                for values, total in zip(light_at_points(name, shaded), sums.light[name], strict=True):
                    total[pixel] += shaded.hits.drawn(np.minimum(values, MOST_HALF))
        drawing.done()
    sums.store(buffers, count, scene.background)


class _Sums:
    """Sums over the samples of a batch's pixels, from the first to the last address that is a pixel of it.

    Addresses between that belong to other batches are memory that is never touched, and costs nothing.
    """

    def __init__(self, stage: Stage, batch: tuple[int, int], channels: tuple[str, ...]) -> None:
        blocks, block = stage.blocks, np.arange(*batch)
        ends = blocks.address[block] + (blocks.height[block] - 1) * blocks.stride[block] + blocks.width[block]
        self.first = int(blocks.address[block].min())
        size = int(ends.max()) - self.first
        self.hits = np.zeros(size, dtype=np.uint16)
        self.light = {name: [np.zeros(size, dtype=np.float32) for _ in range(3)] for name in channels}

    def store(self, buffers: Buffers, count: int, background: Float32Array) -> None:
        """Write the means into the pixels of which any sample sees something."""
        pixel = np.flatnonzero(self.hits)
        seen = self.hits[pixel].astype(np.float32)
        for name, totals in self.light.items():
            layers = CHANNELS[name].layers
            for k, (layer, total) in enumerate(zip(layers, totals, strict=False)):
                values = total[pixel]
                if name == "rgba":
                    values += (count - seen) * background[k]
                self._put(buffers, layer, pixel, values / np.float32(count))
            if name == "rgba":
                self._put(buffers, "A", pixel, seen / np.float32(count))

    def _put(self, buffers: Buffers, layer: str, pixel: np.ndarray, values: Float32Array) -> None:
        buffers[layer][pixel + self.first] = np.minimum(values, MOST_HALF).astype(np.float16)


def in_quilt(layout: Layout, sample: tuple[float, float]) -> FloatArray:
    """A place in a facet's pixel, from its centre, as every facet's (F, 2) lies turned in the quilt.

    Where a facet is not moved by whole pixels its pixels are not the quilt's, and the place is the quilt's.
    """
    return np.asarray(_turns(layout) @ np.array(sample))


def cells_in_quilt(layout: Layout, offset: tuple[float, float], size: tuple[float, float]) -> Cells:
    """A cell of facets' pixels, by its way from the sample and its size, turned as facets are."""
    turns = _turns(layout)
    return Cells(np.asarray(turns @ np.array(offset)), np.asarray(np.abs(turns) @ np.array(size)))


def _turns(layout: Layout) -> FloatArray:
    """How facets' pixels (F, 2, 2) are turned in the quilt."""
    linear = layout.quilt_from_facet[:, :, :2]
    whole = np.rint(linear)
    turned = (np.abs(linear - whole).max(axis=(1, 2)) < _TURN) & (np.abs(whole).sum(axis=(1, 2)) == 2)
    return np.where(turned[:, None, None], whole, np.eye(2))


def cell_of(sample: tuple[float, float], count: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """The part of a pixel that one of `count` samples stands for: its middle from the sample, its size.

    Cells of a grid tile the pixel. Where the lattice has no grid, it is as large a square at the sample.
    """
    across, down = cell_grid(count)
    if not across:
        side = count**-0.5
        return (0.0, 0.0), (side, side)
    x, y = (
        (np.floor((place + 0.5) * cells) + 0.5) / cells - 0.5 - place
        for place, cells in zip(sample, (across, down), strict=True)
    )
    return (float(x), float(y)), (1 / across, 1 / down)


@lru_cache(maxsize=8)
def cell_grid(count: int) -> tuple[int, int]:
    """Cells across and down of the grid with one sample in each, as square as there is one; 0 without any."""
    places = np.array(sample_places(count)) + 0.5
    for down in range(int(count**0.5), 0, -1):
        across = count // down
        cells = np.floor(places * (across, down)) @ (1, across)
        if across * down == count and np.unique(cells).size == count and across <= _LONGEST * down:
            return across, down
    return 0, 0


@lru_cache(maxsize=8)
def sample_places(samples: int) -> tuple[tuple[float, float], ...]:
    """Places of the samples in a pixel, from its centre: (i + ½)/N and (i·a mod N + ½)/N, less ½."""
    step = _LATTICES.get(samples) or best_step(samples)
    return tuple(
        ((i + 0.5) / samples - 0.5, (i * step % samples + 0.5) / samples - 0.5) for i in range(samples)
    )


def best_step(samples: int) -> int:
    """The step `a` of the lattice of N points whose nearest points are farthest apart."""
    coprime = [a for a in range(1, samples + 1) if np.gcd(a, samples) == 1]
    return max(coprime, key=lambda a: (_shortest(samples, a), -a))


def _shortest(samples: int, step: int) -> int:
    """Squared length, in 1/N, of the shortest vector of the lattice of (1, a) and (0, N) (Gauss)."""
    u, v = (1, step), (0, samples)
    while True:
        if u[0] * u[0] + u[1] * u[1] > v[0] * v[0] + v[1] * v[1]:
            u, v = v, u
        length = u[0] * u[0] + u[1] * u[1]
        times = round((u[0] * v[0] + u[1] * v[1]) / length)
        if not times:
            return length
        v = (v[0] - times * u[0], v[1] - times * u[1])
