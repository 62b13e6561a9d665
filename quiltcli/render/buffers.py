"""The buffers of a quilt, and what they hold where nothing is seen."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import MOST_HALF, empty_buffers, exr_channels
from quiltcli.geometry import BoolArray, Float32Array, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.setup import Stage
from quiltcli.shading.sky import sky_at
from quiltcli.visibility.draw import Frame, block_window
from quiltcli.visibility.rays.pixels import places

Buffers = dict[str, NDArray[Any]]


def new_buffers(stage: Stage) -> Buffers:
    """Flat buffers of every channel the job asks for, over all pages."""
    return empty_buffers(stage.job.output.channels, stage.owners.size)


def clear(stage: Stage, buffers: Buffers, only: BoolArray | None) -> None:
    """Empty the pixels of the facets in `only`, or everything."""
    mine = slice(None) if only is None else np.concatenate(([False], only))[np.abs(stage.owners)]
    for name, value in empty_values(stage).items():
        buffers[name][mine] = value


def clear_blocks(stage: Stage, blocks: IntArray, buffers: Buffers) -> None:
    """Empty the pixels of the blocks with these indices."""
    empty = empty_values(stage)
    for block in blocks.tolist():
        for name, value in empty.items():
            block_window(buffers[name], stage.blocks, block).fill(value)


def empty_values(stage: Stage) -> dict[str, float]:
    """What every buffer holds where nothing is seen."""
    return {name: value for name, (_, value) in exr_channels(stage.job.output.channels).items()}


def has_background(stage: Stage) -> bool:
    """Whether pixels that do not see the scene have a colour."""
    shows = stage.scene.sky is not None or bool(stage.scene.background.any())
    return "rgba" in stage.job.output.channels and shows


def mends_itself(stage: Stage) -> bool:
    """Whether drawing a batch may empty what it does not fill, which is less to write.

    Not with a background, which lies under everything, nor with several samples a pixel, which see more.
    """
    return not has_background(stage) and not stage.job.render.averages


def lay_background(stage: Stage, blocks: IntArray, buffers: Buffers, rays: QuiltRays) -> None:
    """Give the pixels of these blocks that their facets own the background's colour, if there is one.

    Of curved facets only the pixels that show an image to the eye.
    """
    if not has_background(stage) or stage.scene.sky is not None:
        return
    for block in blocks.tolist():
        mine = _lit_pixels(stage, block, rays)
        for name, value in zip("RGB", stage.scene.background, strict=True):
            pixels = block_window(buffers[name], stage.blocks, block)
            # The brightest that half floats hold is bright enough for a background.
            np.copyto(pixels, min(value, np.finfo(pixels.dtype).max), where=mine, casting="same_kind")


def lay_sky(stage: Stage, blocks: IntArray, buffers: Buffers, rays: QuiltRays) -> None:
    """Give those pixels of these blocks the sky that show nothing else, once everything else is drawn."""
    if not has_background(stage) or stage.scene.sky is None:
        return
    for block in blocks.tolist():
        mine = _lit_pixels(stage, block, rays)
        mine &= block_window(buffers["A"], stage.blocks, block) == 0
        row, column = np.nonzero(mine)
        if row.size:
            address = int(stage.blocks.address[block]) + row * int(stage.blocks.stride[block]) + column
            for name, values in zip("RGB", sky_behind(stage, rays, address), strict=True):
                buffers[name][address] = values


def sky_behind(stage: Stage, rays: QuiltRays, address: IntArray) -> Float32Array:
    """The sky (3, P) in the directions of pixels of facets that are lit, at quilt addresses (P,)."""
    assert stage.scene.sky is not None
    pixels = places(address, stage.layout, stage.owners, rays)
    steps = (np.ascontiguousarray(pixels.ray[:, :, k].T) for k in (0, 1))
    found = sky_at(stage.scene.sky, np.ascontiguousarray(pixels.rays().T), *steps)
    return np.minimum(found, MOST_HALF)


def background_of(stage: Stage, rays: QuiltRays) -> Float32Array | Callable[[IntArray], Float32Array]:
    """What samples see that see nothing else, as `sums.Sums.store` takes it."""
    return stage.scene.background if stage.scene.sky is None else partial(sky_behind, stage, rays)


def _lit_pixels(stage: Stage, block: int, rays: QuiltRays) -> BoolArray:
    """Which pixels (h, w) of a block its facet owns; of curved facets those that show an image to the eye."""
    owner = block_window(stage.owners, stage.blocks, block)
    facet = int(stage.blocks.facet[block]) + 1
    mine = (owner == facet) | (owner == -facet)
    view = rays.views[facet - 1] if rays.views else None
    if view is not None:
        height, width = mine.shape
        x, y = (float(first[block]) + 0.5 for first in (stage.blocks.x0, stage.blocks.y0))
        mine[:, : stage.blocks.margin[block]] = False
        mine &= view.lit(x + np.arange(width), y + np.arange(height)[:, None])
    return np.asarray(mine)


def empty_before(
    stage: Stage,
    frame: Frame,
    buffers: Buffers,
    only: BoolArray | None,
    dirty: BoolArray | None,
    clear_some: Callable[[IntArray, Buffers], None],
) -> BoolArray:
    """Empty what the frame before has left, but for what drawing empties itself.

    Args:
        stage: what the job's frames share.
        frame: the frame that is about to be drawn.
        buffers: emptied.
        only: (F,) the only facets whose pixels are touched, None for all.
        dirty: (M,) microtiles that may hold something, None where it is not known.
        clear_some: empties blocks, as `clear_blocks`.

    Returns:
        (M,) microtiles that still hold something, which drawing has to empty where nothing is seen.
    """
    stale = np.zeros(stage.blocks.used.size, dtype=np.bool_)
    if only is not None or dirty is None:
        clear(stage, buffers, only)
        return stale
    mended = (frame.pairs.per_block > 0) & mends_itself(stage)
    clear_some(np.flatnonzero(stage.blocks.any_tile(dirty) & ~mended), buffers)
    return np.asarray(dirty & mended.repeat(np.diff(stage.blocks.tile_start)))


def written_blocks(stage: Stage, frame: Frame) -> BoolArray:
    """Blocks (B,) into whose pixels a frame writes: those with triangles, and where a background shows."""
    written: BoolArray = frame.pairs.per_block > 0
    return written | frame.rays.lit[stage.blocks.facet] if has_background(stage) else written


def note_drawn(
    stage: Stage,
    drawn: Iterable[tuple[tuple[int, int], BoolArray]],
    only: BoolArray | None,
    dirty: BoolArray,
) -> None:
    """Note in `dirty` (M,) which microtiles hold something now, from batches and theirs that do."""
    if only is None:
        dirty[:] = False
    for batch, tiles in drawn:
        dirty[stage.blocks.tiles(batch)] |= tiles
