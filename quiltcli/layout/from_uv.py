"""Layouts that come with the mesh: texture coordinates say where a facet lies on the canvas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import FloatArray, Int32Array, IntArray, segments, some_rows
from quiltcli.layout.check import check_layout
from quiltcli.layout.layout import PIXEL_TOLERANCE, Layout

_FARTHEST = 1e9  # pixels
# Facet raster → quilt by turning the picture clockwise 0, 1, 2, 3 quarter turns; y runs down.
QUARTER_TURNS: FloatArray = np.array(
    [[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]], dtype=np.float64
)
MIRROR: FloatArray = np.array([[-1.0, 0.0], [0.0, 1.0]])


def layout_from_uv(facets: Facets, size: tuple[int, int], *, padding: int = 0) -> Layout:
    """Layout of a display mesh whose texture coordinates are places on a canvas of `size` pixels.

    The interchange form of media servers: u·W is the quilt's x, and v counts from the bottom as in
    OBJ files, so y is (1 − v)·H. All facets lie on one page.

    Raises:
        LayoutError: no texture coordinates, a facet that they bend or squeeze to nothing, or a
            layout that `check_layout` refuses.
    """
    if facets.uv is None:
        message = "the mesh has no texture coordinates, which from_uv reads the layout from"
        raise LayoutError(Problem(message, file=facets.path))
    width, height = size
    quilt = np.stack((facets.uv[:, 0] * width, (1 - facets.uv[:, 1]) * height), axis=1)
    page = np.zeros(facets.count, dtype=np.int32)
    pages = np.array([size], dtype=np.int32)
    layout = layout_from_polygons(facets, quilt, page, pages, padding=padding, method="uv")
    check_layout(layout)
    return layout


def layout_from_polygons(
    facets: Facets, quilt: FloatArray, page: Int32Array, pages: Int32Array, *, padding: int, method: str
) -> Layout:
    """Layout of facets whose places are given by their polygons; rasters are taken from the quilt.

    A facet's raster is the box of whole quilt pixels around its polygon, turned by quarter turns so
    that it stands as the display has it, and mirrored when the quilt shows the facet mirrored. So
    `quilt_from_facet` copies pixels and nothing is resampled, while `du` and `dv` may be sheared.

    Args:
        facets: the display.
        quilt: (C, 2) corners of all facets in page pixels; those of disabled facets are not looked at.
        page: (F,) 0-based page of each facet.
        pages: (G, 2) page sizes.
        padding: pixels between facets, for the record.
        method: name of what made the places, for the record.

    Raises:
        LayoutError: facets whose polygon is not an affine picture of the facet, all together.
    """
    rows = np.flatnonzero(facets.enabled & (page >= 0))
    start, kept = some_rows(facets.corner_start, rows)
    # Whatever is wrong, the numbers of the other facets stand.
    with np.errstate(all="ignore"):
        fit = _affine(corner_pixels(facets)[kept], quilt[kept], start)
    wrong = np.flatnonzero(fit.fault).tolist()
    raise_all(LayoutError, [_bent(facets, int(rows[at]), fit, at) for at in wrong])
    size, turn, corner, polygon = _rasters(quilt[kept], start, fit.linear)
    inverse = _inverse(fit.linear)
    begin = _product(inverse, (corner - fit.offset)[:, :, None])[:, :, 0]
    steps = _product(inverse, turn)
    axes = np.stack((facets.du[rows], facets.dv[rows]), axis=1)
    return Layout(
        facet=(rows + 1).astype(np.int32),
        page=page[rows].astype(np.int32),
        size=size,
        quilt_from_facet=np.concatenate((turn, corner[:, :, None]), axis=2),
        origin=facets.origin[rows] + _product(begin[:, None, :], axes)[:, 0],
        du=_product(steps[:, None, :, 0], axes)[:, 0],
        dv=_product(steps[:, None, :, 1], axes)[:, 0],
        corner_start=start,
        polygon=polygon,
        pages=pages.astype(np.int32),
        padding=padding,
        method=method,
        display=facets.path,
        display_sha256=facets.sha256,
    )


@dataclass(frozen=True)
class _Fit:
    """Affine maps from the display's raster to the quilt, n facets.

    Attributes:
        linear: (n, 2, 2) and
        offset: (n, 2): quilt = linear @ pixels + offset.
        miss: (C,) pixels by which each corner misses its place.
        farthest: (n,) greatest coordinate of a place.
        start: (n+1,) offsets of the facets' corners.
        fault: (n,) what is wrong: 0 nothing, or a row of `_FAULTS`, the first that is.
    """

    linear: FloatArray
    offset: FloatArray
    miss: FloatArray
    farthest: FloatArray
    start: IntArray
    fault: IntArray


_FAULTS = (
    "",
    "a corner has no texture coordinate, or one that is not finite",
    "its place in the quilt is {farthest:.3g} pixels off (are the texture coordinates right?)",
    "its place in the quilt has no area",
    "corner {corner} is {miss:.3g} pixels from where an affine map would have it; texture coordinates must"
    f" not bend a facet (at most {PIXEL_TOLERANCE} pixel)",
)


def _affine(pixels: FloatArray, quilt: FloatArray, start: IntArray) -> _Fit:
    """Least-squares maps from pixels (C, 2) to the quilt (C, 2), a facet each.

    The regression on two variables that are made perpendicular first (Gram–Schmidt), summed corner by
    corner: the same on every machine.
    """
    row, _ = segments(start)
    count = np.diff(start)

    def total(values: FloatArray) -> FloatArray:
        return _of_rows(np.add, values, start)

    def greatest(values: FloatArray) -> FloatArray:
        return _of_rows(np.maximum, values, start)

    centre, goal = (total(points) / count[:, None] for points in (pixels, quilt))
    x, y = (pixels - centre[row]).T
    aim = quilt - goal[row]
    xx = total(x * x)
    slope = total(x * y) / xx
    across = y - slope[row] * x
    second = total(across[:, None] * aim) / total(across * across)[:, None]
    first = total(x[:, None] * aim) / xx[:, None] - slope[:, None] * second
    linear = np.stack((first, second), axis=2)
    off = aim - x[:, None] * first[row] - y[:, None] * second[row]
    miss = np.sqrt((off * off).sum(axis=1))
    area = np.abs(linear[:, 0, 0] * linear[:, 1, 1] - linear[:, 0, 1] * linear[:, 1, 0])
    farthest = greatest(np.abs(quilt)).max(axis=1)
    wrong = (
        ~np.isfinite(total(quilt)).all(axis=1),
        ~(farthest <= _FARTHEST),
        ~(area > 1e-9 * (linear * linear).sum(axis=(1, 2))),
        ~(greatest(miss) <= PIXEL_TOLERANCE),
    )
    fault = np.select(wrong, range(1, 1 + len(wrong)), 0)
    offset = goal - _product(linear, centre[:, :, None])[:, :, 0]
    return _Fit(linear, offset, miss, farthest, start, fault)


def _bent(facets: Facets, row: int, fit: _Fit, at: int) -> Problem:
    """Why no affine map takes a facet of the display to its place, which is the fit's `at`."""
    miss = fit.miss[fit.start[at] : fit.start[at + 1]]
    worst = int(miss.argmax())
    words = _FAULTS[fit.fault[at]].format(farthest=fit.farthest[at], corner=worst + 1, miss=miss[worst])
    name = f" ({facets.names[row]})" if facets.names[row] else ""
    return Problem(f"facet {row + 1}{name}: {words}", file=facets.path)


def _rasters(
    quilt: FloatArray, start: IntArray, linear: FloatArray
) -> tuple[Int32Array, FloatArray, FloatArray, FloatArray]:
    """The boxes of whole quilt pixels around polygons (C, 2), turned as the display has the facets.

    Returns:
        size (n, 2), turn (n, 2, 2), the quilt corner (n, 2) where the turned raster starts, and the
        polygons (C, 2) on their rasters.
    """
    turn = _nearest_turns(linear)
    low = np.floor(_of_rows(np.minimum, quilt, start) + PIXEL_TOLERANCE)
    high = np.ceil(_of_rows(np.maximum, quilt, start) - PIXEL_TOLERANCE)
    box = _product(turn.transpose(0, 2, 1), np.stack((low, high), axis=2))
    corner = _product(turn, box.min(axis=2)[:, :, None])[:, :, 0]
    row, _ = segments(start)
    polygon = _product((quilt - corner[row])[:, None, :], turn[row])[:, 0]
    return np.ptp(box, axis=2).astype(np.int32), turn, corner, polygon


def _nearest_turns(linear: FloatArray) -> FloatArray:
    """Quarter turns (n, 2, 2), mirrored where a map (n, 2, 2) mirrors, closest to it; the first of equals."""
    units = linear / np.sqrt((linear * linear).sum(axis=1))[:, None, :]
    mirrors = linear[:, 0, 0] * linear[:, 1, 1] < linear[:, 0, 1] * linear[:, 1, 0]
    turns = np.where(mirrors[:, None, None, None], QUARTER_TURNS @ MIRROR, QUARTER_TURNS)
    likeness = np.round((turns * units[:, None]).sum(axis=(2, 3)), 9)
    return np.asarray(turns[np.arange(len(turns)), likeness.argmax(axis=1)])


def _of_rows(what: np.ufunc, values: FloatArray, start: IntArray) -> FloatArray:
    """What a sum or an extreme makes of the elements of each row of a ragged array; there may be no rows."""
    return np.asarray(what.reduceat(values, start[:-1]) if start.size > 1 else values[:0])


def _inverse(a: FloatArray) -> FloatArray:
    """Inverses of matrices (n, 2, 2)."""
    det = a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
    swapped = np.stack((a[:, 1, 1], -a[:, 0, 1], -a[:, 1, 0], a[:, 0, 0]), axis=1)
    result: FloatArray = (swapped / det[:, None]).reshape(-1, 2, 2)
    return result


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of matrices (n, i, 2) and (n, 2, j), with sums in a fixed order."""
    result: FloatArray = a[:, :, :1] * b[:, :1] + a[:, :, 1:] * b[:, 1:]
    return result
