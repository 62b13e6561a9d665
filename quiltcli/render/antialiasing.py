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

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.layout import Layout
from quiltcli.render.buffers import Buffers, background_of
from quiltcli.render.setup import Stage
from quiltcli.shading.aovs import shaded_for, wanted_for
from quiltcli.shading.layers import layers
from quiltcli.shading.once import may_be_once, shaded_once
from quiltcli.shading.shadows import Sample
from quiltcli.shading.sums import Sums, new_sums, write_alike
from quiltcli.visibility.draw import Cells, Frame, draw

_WORTH_SETTLING = 3  # samples; fewer are looked at faster one by one
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


def draw_samples(
    stage: Stage, frame: Frame, batch: tuple[int, int], buffers: Buffers, channels: tuple[str, ...]
) -> None:
    """Average samples of `channels` into the buffers; what misses the scene counts as background.

    Args:
        stage: what the job's frames share.
        frame: the frame.
        batch: the range of blocks.
        buffers: written to, at every pixel that any sample sees.
        channels: some of `sums.summed`.
    """
    sums, count = new_batch_sums(stage, batch, channels), stage.job.render.samples
    add_samples(stage, frame, batch, sums, sample_places(count), buffers)
    sums.store(buffers, count, background_of(stage, frame.rays))


def add_samples(
    stage: Stage,
    frame: Frame,
    batch: tuple[int, int],
    sums: Sums,
    places: Sequence[tuple[float, float]],
    buffers: Buffers | None = None,
) -> None:
    """Add samples of a batch to sums.

    Args:
        stage: what the job's frames share.
        frame: the frame.
        batch: the range of blocks.
        sums: added to.
        places: the samples' places in a pixel, from its centre.
        buffers: written to where these are all samples of a pixel and see alike, instead of being added.
    """
    scene, wanted, count = stage.scene, wanted_for(sums.channels, stage.scene), stage.job.render.samples
    done = None
    once = len(places) >= _WORTH_SETTLING and not stage.job.render.sample_shading
    if once and frame.order is None and may_be_once(scene):
        done = _add_settled(stage, frame, batch, sums, len(places), buffers)
    for place in places:
        sample = Sample(sample_places(count).index(place), count)
        cells = None
        if scene.textures is not None:
            cells = cells_in_quilt(stage.layout, *cell_of(place, count))
        drawing = draw(frame, batch, in_quilt(stage.layout, place), cells, done=done)
        for shaded in shaded_for(sums.channels, drawing, wanted, scene, frame.viewer.eye, sample):
            sums.add(shaded)
        for layer in layers(drawing, wanted, scene, frame.viewer.eye, sample):
            sums.add(layer.shaded, layer.weight)
        drawing.done()


def _add_settled(
    stage: Stage, frame: Frame, batch: tuple[int, int], sums: Sums, times: int, buffers: Buffers | None
) -> BoolArray:
    """Add what all of so many samples see alike: smooth light where one triangle is all they can see.

    The mean of smooth light over a pixel is that of its centre, nearly: it is worked out once for a triangle
    and pixel, as multisampling does. Where it is not smooth, at glints and shadows' edges, samples are looked
    at one by one.

    Returns:
        (m,) the microtiles of the batch's blocks in which nothing is left to be looked at.
    """
    scene, blocks = stage.scene, stage.blocks
    tiles = blocks.tiles(batch)
    done = np.zeros(tiles.stop - tiles.start, dtype=np.bool_)
    drawing = draw(frame, batch, settled=True)
    wanted = wanted_for(sums.channels, scene)
    for shaded, number in shaded_once(drawing.regions(wanted, scene), scene, frame.viewer.eye):
        if buffers is None:
            sums.add(shaded, times=times)
        else:
            write_alike(shaded, sums.channels, buffers, times)
        done[number - tiles.start] = True
    drawing.done()
    return done


def new_batch_sums(stage: Stage, batch: tuple[int, int], channels: tuple[str, ...]) -> Sums:
    """Sums of channels for the pixels of a batch."""
    first, size = _addresses(stage, batch)
    return Sums(new_sums(channels, lambda dtype: np.zeros(size, dtype)), channels, first)


def _addresses(stage: Stage, batch: tuple[int, int]) -> tuple[int, int]:
    """The first address of a batch's pixels, and how many there are up to the last.

    Addresses between that belong to other batches are memory that is never touched, and costs nothing.
    """
    blocks, block = stage.blocks, np.arange(*batch)
    ends = blocks.address[block] + (blocks.height[block] - 1) * blocks.stride[block] + blocks.width[block]
    first = int(blocks.address[block].min())
    return first, int(ends.max()) - first


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


@lru_cache(maxsize=8)
def sample_times(samples: int, most: int) -> tuple[tuple[float, tuple[tuple[float, float], ...]], ...]:
    """The samples by the times at which they look, as shares of an exposure, ascending.

    Sample i looks at ((i·b mod N) + ½)/N, the third coordinate of a rank-1 lattice; with more samples than
    `most` times, at the middle of the share of the exposure in which that lies.
    """
    places, step = sample_places(samples), time_step(samples)
    count = min(samples, most)
    groups: list[list[tuple[float, float]]] = [[] for _ in range(count)]
    for i, place in enumerate(places):
        groups[(2 * (i * step % samples) + 1) * count // (2 * samples)].append(place)
    return tuple(((k + 0.5) / count, tuple(group)) for k, group in enumerate(groups))


def time_step(samples: int) -> int:
    """The step `b` of times with which the nearest points of place and time are farthest apart."""
    step = _LATTICES.get(samples) or best_step(samples)
    i = np.arange(1, samples)
    across = np.minimum(i, samples - i) ** 2
    down = i * step % samples
    across += np.minimum(down, samples - down) ** 2

    def nearest(b: int) -> int:
        late = i * b % samples
        return int((across + np.minimum(late, samples - late) ** 2).min(initial=samples**2))

    coprime = [b for b in range(1, samples + 1) if np.gcd(b, samples) == 1]
    return max(coprime, key=lambda b: (nearest(b), -b))


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
