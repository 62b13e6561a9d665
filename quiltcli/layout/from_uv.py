"""Layouts that come with the mesh: texture coordinates say where a facet lies on the canvas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import FloatArray, Int32Array, offsets
from quiltcli.layout.check import check_layout
from quiltcli.layout.layout import PIXEL_TOLERANCE, Layout

# Facet raster → quilt by turning the picture clockwise 0, 1, 2, 3 quarter turns; y runs down.
_FARTHEST = 1e9  # pixels
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
    problems = []
    fits = []
    pixels = corner_pixels(facets)
    rows = np.flatnonzero(facets.enabled & (page >= 0))
    for row in rows:
        corners = slice(int(facets.corner_start[row]), int(facets.corner_start[row + 1]))
        try:
            fits.append(_fit(facets, int(row), pixels[corners], quilt[corners]))
        except _BentError as bent:
            name = f" ({facets.names[row]})" if facets.names[row] else ""
            problems.append(Problem(f"facet {row + 1}{name}: {bent}", file=facets.path))
    raise_all(LayoutError, problems)
    count = np.array([len(fit.polygon) for fit in fits], dtype=np.int64)
    return Layout(
        facet=(rows + 1).astype(np.int32),
        page=page[rows].astype(np.int32),
        size=np.array([fit.size for fit in fits], dtype=np.int32).reshape(-1, 2),
        quilt_from_facet=np.array([fit.quilt_from_facet for fit in fits]).reshape(-1, 2, 3),
        origin=np.array([fit.origin for fit in fits]).reshape(-1, 3),
        du=np.array([fit.du for fit in fits]).reshape(-1, 3),
        dv=np.array([fit.dv for fit in fits]).reshape(-1, 3),
        corner_start=offsets(count),
        polygon=np.concatenate([np.zeros((0, 2)), *(fit.polygon for fit in fits)]),
        pages=pages.astype(np.int32),
        padding=padding,
        method=method,
        display=facets.path,
        display_sha256=facets.sha256,
    )


class _BentError(Exception):
    """A facet that no affine map takes to its place; the message says why."""


@dataclass(frozen=True)
class _Fit:
    """One facet's raster and place."""

    size: tuple[int, int]
    quilt_from_facet: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    polygon: FloatArray


def _fit(facets: Facets, row: int, pixels: FloatArray, quilt: FloatArray) -> _Fit:
    """Raster of one facet whose corners lie at `pixels` (n, 2) of the display's raster and `quilt` (n, 2)."""
    if not np.isfinite(quilt).all():
        raise _BentError("a corner has no texture coordinate, or one that is not finite")
    linear, offset = _affine(pixels, quilt)
    turn = _nearest_turn(linear)
    low = np.floor(quilt.min(axis=0) + PIXEL_TOLERANCE)
    high = np.ceil(quilt.max(axis=0) - PIXEL_TOLERANCE)
    box = turn.T @ np.stack((low, high), axis=1)
    corner = turn @ box.min(axis=1)  # the quilt corner where the turned raster starts
    size = np.ptp(box, axis=1)
    display_from_quilt = np.linalg.inv(linear)
    start = display_from_quilt @ (corner - offset)
    steps = display_from_quilt @ turn
    axes = np.stack((facets.du[row], facets.dv[row]))
    return _Fit(
        size=(int(size[0]), int(size[1])),
        quilt_from_facet=np.concatenate((turn, corner[:, None]), axis=1),
        origin=facets.origin[row] + start @ axes,
        du=steps[:, 0] @ axes,
        dv=steps[:, 1] @ axes,
        polygon=(quilt - corner) @ turn,
    )


def _affine(pixels: FloatArray, quilt: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least-squares map quilt = linear @ pixels + offset; refuses more than 0.01 pixel of residual."""
    farthest = float(np.abs(quilt).max())
    if farthest > _FARTHEST:
        raise _BentError(
            f"its place in the quilt is {farthest:.3g} pixels off (are the texture coordinates right?)"
        )
    centre, goal = pixels.mean(axis=0), quilt.mean(axis=0)
    solution, _, rank, _ = np.linalg.lstsq(pixels - centre, quilt - goal, rcond=None)
    linear: FloatArray = solution.T
    area = abs(linear[0, 0] * linear[1, 1] - linear[0, 1] * linear[1, 0])
    if rank < 2 or area <= 1e-9 * (linear * linear).sum():
        raise _BentError("its place in the quilt has no area")
    miss = np.sqrt((((pixels - centre) @ solution + goal - quilt) ** 2).sum(axis=1))
    if miss.max() > PIXEL_TOLERANCE:
        raise _BentError(
            f"corner {int(miss.argmax()) + 1} is {miss.max():.3g} pixels from where an affine map would"
            f" have it; texture coordinates must not bend a facet (at most {PIXEL_TOLERANCE} pixel)"
        )
    return linear, goal - linear @ centre


def _nearest_turn(linear: FloatArray) -> FloatArray:
    """Quarter turn (2, 2), mirrored if `linear` mirrors, that is closest to it; the first of equals."""
    units = linear / np.linalg.norm(linear, axis=0)
    mirror = MIRROR if np.linalg.det(linear) < 0 else np.eye(2)
    turns = QUARTER_TURNS @ mirror
    likeness = np.round(np.einsum("kij,ij->k", turns, units), 9)
    return np.asarray(turns[int(likeness.argmax())])
