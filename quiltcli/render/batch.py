"""One batch of a frame: rasterize its blocks, shade what they see and write it into the buffers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.projection.gaze import Gaze
from quiltcli.render.antialiasing import draw_samples, new_batch_sums
from quiltcli.render.buffers import (
    Buffers,
    background_of,
    empty_values,
    lay_background,
    lay_sky,
    mends_itself,
)
from quiltcli.render.setup import Stage
from quiltcli.shading.aovs import fill, shaded_for, wanted_for
from quiltcli.shading.layers import Layer, layers
from quiltcli.shading.sums import Background, Sums, summed
from quiltcli.visibility.draw import Drawing, Frame, Hits, Wanted, draw
from quiltcli.visibility.scan.depth_buffers import DepthOrder, depth_order


@dataclass(frozen=True)
class Drawn:
    """What has been drawn of a batch.

    Attributes:
        visible: how many pixels of facets, bleed left out, show the scene.
        tiles: (m,) microtiles of the batch's blocks that have pixels that do.
    """

    visible: int
    tiles: BoolArray


def draw_batch(
    stage: Stage,
    frame: Frame,
    batch: tuple[int, int],
    buffers: Buffers,
    stale: BoolArray,
    *,
    exposed: bool = False,
) -> Drawn:
    """Draw one batch into the buffers; its pixels belong to no other batch.

    Args:
        stage: what the job's frames share.
        frame: the frame.
        batch: the range of blocks.
        buffers: written to.
        stale: (m,) microtiles of these blocks that still hold another frame and have to be emptied where
            nothing is seen.
        exposed: whether what is made of samples is left to exposures, which are drawn by themselves.
    """
    frame = ordered(stage, frame)
    block = np.arange(*batch)
    lit = block[frame.rays.lit[stage.blocks.facet[block]]]
    lay_background(stage, lit, buffers, frame.rays)
    channels = stage.job.output.channels
    light = summed(channels) if exposed or stage.job.render.samples > 1 else ()
    if light:
        if not exposed:
            draw_samples(stage, frame, batch, buffers, light)
        channels = tuple(name for name in channels if name not in light)
    wanted = wanted_for(channels, stage.scene)
    if frame.order is not None:
        wanted |= Wanted.POSITION
    visible, first = 0, stage.blocks.tiles(batch).start
    drawing, gaze = draw(frame, batch), Gaze(frame.viewer, frame.rays)
    for shaded in shaded_for(channels, drawing, wanted, stage.scene, frame.viewer.eye):
        fill(buffers, channels, gaze, shaded)
        if frame.order is not None:
            fill_stored(buffers, frame.order, shaded.hits)
        visible += shaded.hits.inside
    if stale.any():
        empty_missed(stage, drawing, stale, first, buffers)
    if drawing.soft is not None:
        visible += draw_layers(stage, drawing, batch, buffers, channels, wanted, gaze, frame.order)
    lay_sky(stage, lit, buffers, frame.rays)
    tiles = np.full(stale.size, not mends_itself(stage))
    tiles[drawing.drawn() - first] = True
    drawing.done()
    return Drawn(visible, tiles)


def draw_layers(
    stage: Stage,
    drawing: Drawing,
    batch: tuple[int, int],
    buffers: Buffers,
    channels: tuple[str, ...],
    wanted: Wanted,
    gaze: Gaze,
    order: DepthOrder | None,
) -> int:
    """Write `channels` at the pixels that are seen through something; how many inside facets show the scene.

    Light goes through all layers; other channels are those of the first that holds up any.
    """
    assert gaze.rays is not None
    found = layers(drawing, wanted, stage.scene, gaze.viewer.eye)
    sums = new_batch_sums(stage, batch, summed(channels))
    return put_layers(found, sums, buffers, channels, gaze, background_of(stage, gaze.rays), order)


def put_layers(
    found: Iterable[Layer],
    sums: Sums,
    buffers: Buffers,
    channels: tuple[str, ...],
    gaze: Gaze,
    background: Background,
    order: DepthOrder | None = None,
) -> int:
    """Write channels at the pixels of layers, see `draw_layers`; `sums`, empty, are of those of light."""
    light = sums.channels
    data, visible = tuple(name for name in channels if name not in light), 0
    for layer in found:
        if light:
            sums.add(layer.shaded, layer.weight)
        if layer.first.any():
            visible += int(np.count_nonzero(layer.first & layer.inside))
            mine = np.flatnonzero(layer.first)
            fill(buffers, data, gaze, layer.shaded, mine)
            if order is not None:
                fill_stored(buffers, order, layer.shaded.hits, mine)
    if light:
        sums.store(buffers, 1, background)
    return visible


def empty_missed(stage: Stage, drawing: Drawing, stale: BoolArray, first: int, buffers: Buffers) -> None:
    """Empty the pixels at which the drawing shows nothing, in microtiles as `Drawing.missed` is told them."""
    empty = {name: np.full(1, value, buffers[name].dtype) for name, value in empty_values(stage).items()}
    for places in drawing.missed(stale, first):
        for name, value in empty.items():
            places.put(buffers[name], value)


def ordered(stage: Stage, frame: Frame) -> Frame:
    """The frame with the depth buffer the job asks for; as it is where depth is exact."""
    how = stage.job.render
    if how.method == "homography" and how.depth_bits is None:
        return frame
    return replace(
        frame, order=depth_order(how.method, how.depth_bits, frame.viewer, stage.facets, frame.rays)
    )


def fill_stored(buffers: Buffers, order: DepthOrder, hits: Hits, some: IntArray | None = None) -> None:
    """Write into `zv` what the depth buffer holds, and into `Z` the depth that it is taken for."""
    wanted = [name for name in ("zv", "Z") if name in buffers]
    if wanted:
        assert hits.position is not None
        stored = dict(zip(("zv", "Z"), order.stored(hits.facet, hits.position), strict=True))
        for name in wanted:
            hits.put(buffers[name], stored[name], some)
