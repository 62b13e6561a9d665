"""Triangles on patches of curved facets: the same planes, read where each pixel's ray goes through.

Microtiles keep the box that the samples of their lit pixels lie in. Where a plane is least and greatest in
that box tells whether a triangle lies outside, inside or on an edge there, as at the corners of flat ones.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, offsets, segments, slices
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.keys import make_keys, serial_part
from quiltcli.visibility.scan.large import covering_keys, not_behind, rounds
from quiltcli.visibility.scan.soft import Fragments, taken_over, together
from quiltcli.visibility.scan.spans import MICROTILE, Spans, held
from quiltcli.visibility.setup.blocks import Canvas, least_keys
from quiltcli.visibility.setup.planes import Planes, facing
from quiltcli.visibility.setup.samples import Samples

_CELLS = 1 << 17
_ROUND = 512  # microtiles whose pixels are evaluated at a time: their values fit the cache


def draw_displaced(planes: Planes, canvas: Canvas, samples: Samples, limits: DepthRange, bits: int) -> None:
    """Draw pairs of any size on patches.

    Args:
        planes: the pairs.
        canvas: whose keys are raised; its `owned` pixels are lit.
        samples: the canvas's.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
    """
    spans = displaced_spans(planes, canvas, samples)
    covering = covering_keys(planes, spans, canvas, bits)
    spans = not_behind(spans, covering, bits)
    # Backs come last: most of them are hidden by then.
    last = facing(planes, spans.row, limits.handed) < 0
    first, rest = spans.take(np.flatnonzero(~last)), spans.take(np.flatnonzero(last))
    _draw(planes, first, canvas, samples, limits, bits)
    if rest.row.size:
        left = np.zeros(canvas.touched.size, dtype=np.bool_)
        left[rest.tile] = True
        _draw(planes, not_behind(rest, least_keys(canvas, left), bits), canvas, samples, limits, bits)
    # What is not lit shows nothing, whatever was drawn on the lattice there.
    touched = np.flatnonzero(canvas.touched)
    keys = canvas.keys[touched]
    keys[~samples.lit[touched]] = 0
    canvas.keys[touched] = keys


def displaced_fragments(
    planes: Planes, canvas: Canvas, samples: Samples, limits: DepthRange, bits: int
) -> Fragments | None:
    """Gather the fragments of pairs that light may pass; see `soft.soft_fragments`.

    Args:
        planes: the pairs.
        canvas: everything opaque; its `owned` pixels are lit.
        samples: the canvas's.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
    """
    spans, found = displaced_spans(planes, canvas, samples), []
    for part in slices(0, spans.row.size, _ROUND):
        few = spans[part]
        keys = _tile_keys(planes, few, samples, limits, bits)
        seen = np.flatnonzero(keys > np.maximum(canvas.keys.take(few.tile, axis=0), 0))
        tile, place = np.divmod(seen, MICROTILE * MICROTILE)
        found.append((few.tile.take(tile) * 64 + place, keys.reshape(-1).take(seen)))
    return taken_over(canvas, *together(found))


def displaced_spans(planes: Planes, canvas: Canvas, samples: Samples) -> Spans:
    """The microtiles that pairs may show in."""
    x0, x1, y0, y1 = (planes.box >> 3).astype(np.int64)
    across = x1 - x0 + 1
    counts = across * (y1 - y0 + 1)
    start = offsets(counts)
    shown = samples.lit.any(axis=1)
    found = []
    for part in slices(0, counts.size, max(1, _CELLS * max(counts.size, 1) // max(int(start[-1]), 1))):
        row, rank = segments(start[part.start : part.stop + 1] - start[part.start])
        row += part.start
        y, x = (part.astype(np.int64) for part in np.divmod(rank, across.take(row)))
        x += x0.take(row)
        y += y0.take(row)
        block = planes.block.take(row)
        tile = canvas.tile_start.take(block) + y * canvas.tiles_across.take(block) + x
        keep = np.flatnonzero(shown.take(tile))
        row, x, y, tile = row.take(keep), x.take(keep), y.take(keep), tile.take(keep)
        box = np.take(samples.box, tile, axis=1)
        inside = np.ones(row.size, dtype=np.bool_)
        crossed = np.zeros(row.size, dtype=np.uint8)
        for k in range(3):
            least, greatest = _extremes(np.take(planes.edge[k], row, axis=1), box)
            inside &= greatest > 0
            crossed |= (least <= 0).view(np.uint8) << np.uint8(k)
        keep = np.flatnonzero(inside)
        row, x, y, tile = row.take(keep), x.take(keep), y.take(keep), tile.take(keep)
        least, greatest = _extremes(np.take(planes.inverse, row, axis=1), np.take(box, keep, axis=1))
        low, high = planes.low.take(row), planes.high.take(row)
        found.append(
            Spans(
                row=row,
                tile=tile,
                x=8 * x,
                y=8 * y,
                crossed=crossed.take(keep),
                least=held(least, low, high),
                greatest=held(greatest, low, high),
            )
        )
    columns = zip(*(vars(spans).values() for spans in found), strict=True)
    if not found:
        whole, real = np.zeros(0, dtype=np.int64), np.zeros(0)
        return Spans(whole, whole, whole, whole, np.zeros(0, dtype=np.uint8), real, real)
    return Spans(*(np.concatenate(column) for column in columns))


def _extremes(plane: FloatArray, box: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest values (S,) of planes (3, S) in boxes (4, S), and a little more for rounding."""
    a, b, c = plane
    x0, x1, y0, y1 = box
    left, right, top, bottom = a * x0, a * x1, b * y0, b * y1
    least = np.minimum(left, right) + np.minimum(top, bottom) + c
    greatest = np.maximum(left, right) + np.maximum(top, bottom) + c
    return least, greatest


def _draw(
    planes: Planes, spans: Spans, canvas: Canvas, samples: Samples, limits: DepthRange, bits: int
) -> None:
    """Evaluate the pixels of spans, in rounds in which every microtile occurs once."""
    canvas.touched[spans.tile] = True
    group, order = rounds(spans)
    spans = spans.take(order)
    bounds = np.flatnonzero(np.diff(group, prepend=-1, append=-1))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        for part in slices(first, last, _ROUND):
            few = spans[part]
            keys = canvas.keys.take(few.tile, axis=0)
            canvas.keys[few.tile] = np.maximum(keys, _tile_keys(planes, few, samples, limits, bits), out=keys)


def _tile_keys(planes: Planes, spans: Spans, samples: Samples, limits: DepthRange, bits: int) -> IntArray:
    """Keys (S, 64) of some microtiles; negative where they are not covered."""
    row = spans.row
    crossed = int(np.bitwise_or.reduce(spans.crossed))
    wanted = [planes.inverse, *(planes.edge[k] for k in range(3) if crossed >> k & 1)]
    table = np.empty((row.size, len(wanted), 3))
    for k, plane in enumerate(wanted):
        table[:, k] = np.take(plane, row, axis=1).T
    points = samples.points.take(spans.tile, axis=0)
    # Every product and sum is exact on these grids: the same in any order.
    values = table[:, :, :2] @ points
    values += table[:, :, 2:]
    inverse = np.ascontiguousarray(values[:, 0])
    np.maximum(inverse, planes.low.take(row)[:, None], out=inverse)
    np.minimum(inverse, planes.high.take(row)[:, None], out=inverse)
    cut = planes.cut.take(row)
    if cut.any():
        kept = limits.keeps(planes.block.take(row)[:, None], points[:, 0], points[:, 1], inverse)
        np.negative(inverse, out=inverse, where=~kept & cut[:, None])
    if len(wanted) > 1:
        inside = values[:, 1:].min(axis=1)
        np.copysign(inverse, np.minimum(inverse, inside), out=inverse)
    return make_keys(serial_part(planes.serial.take(row), bits)[:, None], bits, out=inverse)
