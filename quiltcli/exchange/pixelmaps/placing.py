"""Where a facet's picture lies in words: rectangle, rotation and mirror instead of a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, OutputError, Problem, first_of, raise_all
from quiltcli.geometry import FloatArray, Int32Array, segments
from quiltcli.layout import Layout, align, check_layout, whole_pixel
from quiltcli.layout.from_uv import MIRROR, QUARTER_TURNS

_CLOSE = 0.02  # pixels a raster may be off the display's, at its far corner, and still be meant to be it


@dataclass(frozen=True)
class Panel:
    """A facet as a rectangle of whole pixels on a page.

    The facet's image is mirrored left to right if `mirror`, then turned clockwise by `rotation`, then
    put with its top-left pixel at (x, y), where it takes up `width` × `height`.

    Attributes:
        page: 0-based.
        x, y: the rectangle's top-left pixel.
        width, height: pixels of the page; those of the facet's raster trade places at 90 and 270.
        rotation: 0, 90, 180 or 270 degrees.
        mirror: whether the image is mirrored.
    """

    page: int
    x: int
    y: int
    width: int
    height: int
    rotation: int
    mirror: bool

    @property
    def raster(self) -> tuple[int, int]:
        """Width and height of the facet's own raster."""
        return (self.height, self.width) if self.rotation % 180 else (self.width, self.height)

    @property
    def quilt_from_facet(self) -> FloatArray:
        """The map (2, 3) of this place."""
        turn = QUARTER_TURNS[self.rotation // 90 % 4] @ (MIRROR if self.mirror else np.eye(2))
        low = np.minimum(turn * self.raster, 0).sum(axis=1)
        return np.column_stack((turn, np.array([self.x, self.y]) - low)) + 0.0


def panel(layout: Layout, row: int) -> Panel:
    """The place of a facet that `whole_pixel` says is moved by whole pixels."""
    matrix = layout.quilt_from_facet[row]
    turn = matrix[:, :2]
    mirror = bool(np.linalg.det(turn) < 0)
    turns = QUARTER_TURNS @ (MIRROR if mirror else np.eye(2))
    quarter = int(np.abs(turns - turn).sum(axis=(1, 2)).argmin())
    low = np.minimum(turn * layout.size[row], 0).sum(axis=1) + matrix[:, 2]
    width, height = np.abs(turn) @ layout.size[row]
    page = int(layout.page[row])
    return Panel(page, int(low[0]), int(low[1]), int(width), int(height), 90 * quarter, mirror)


def placed_rows(layout: Layout) -> list[int]:
    """Rows of the facets that have a place."""
    return [int(row) for row in np.flatnonzero(layout.page >= 0)]


def demand_panels(layout: Layout, path: Path, what: str) -> None:
    """Raise unless all placed facets are moved by whole pixels with quarter turns (OutputError)."""
    odd = np.flatnonzero(~whole_pixel(layout) & (layout.page >= 0))
    message = "is not moved by whole pixels with quarter turns, and so"
    raise_all(
        OutputError,
        [Problem(f"facet {layout.facet[row]} {message} {what}", file=str(path)) for row in odd[:20]],
    )


def adopted(layout: Layout, display: Facets | None, path: Path) -> Layout:
    """The layout read from `path`, checked by itself and against its display when that is known.

    Raises:
        LayoutError: overlaps, places off their page, or a display it does not fit.
    """
    if display is not None:
        layout = replace(layout, display=display.path, display_sha256=display.sha256)
    layout = replace(layout, path=str(path), place=None, file_row=None)
    check_layout(layout)
    if display is not None:
        align(layout, display)
    return replace(layout, path="")


def rows_in_order(facet: Sequence[int]) -> list[int]:
    """Rows in the order of their ids, as a layout has them."""
    return sorted(range(len(facet)), key=lambda row: (facet[row], row))


def settled(layout: Layout, display: Facets) -> Layout:
    """The layout with the display's own rasters wherever its rasters are those but for rounding.

    Coordinates that went through a file of another tool come back with a little noise; a raster that
    fits the display's to 0.02 pixel is taken for the display's, moved by whole pixels.
    """
    known = display_rasters(display, layout.facet)
    area = known.size.astype(np.float64)
    away = layout.origin - known.origin
    offset = np.stack([_along(away, known.du), _along(away, known.dv)], axis=1)
    close = (np.abs(offset - np.rint(offset)) <= _CLOSE).all(axis=1) & whole_pixel(layout)
    for own, side in ((known.du, 0), (known.dv, 1)):
        difference = (layout.du, layout.dv)[side] - own
        close &= np.sqrt((difference**2).sum(axis=1) / (own**2).sum(axis=1)) * area[:, side] <= _CLOSE
    turn, shift = layout.quilt_from_facet[:, :, :2], layout.quilt_from_facet[:, :, 2]
    moved = shift - np.einsum("fij,fj->fi", turn, np.rint(offset))
    maps = np.where(close[:, None, None], np.concatenate((turn, moved[:, :, None]), axis=2), 0) + 0.0
    pick = close[:, None]
    corner, _ = segments(layout.corner_start)
    return replace(
        layout,
        size=np.where(pick, known.size, layout.size).astype(np.int32),
        quilt_from_facet=np.where(close[:, None, None], maps, layout.quilt_from_facet),
        origin=np.where(pick, known.origin, layout.origin),
        du=np.where(pick, known.du, layout.du),
        dv=np.where(pick, known.dv, layout.dv),
        polygon=np.where(close[corner, None], known.polygon, layout.polygon),
    )


def _along(vector: FloatArray, step: FloatArray) -> FloatArray:
    result: FloatArray = (vector * step).sum(axis=1) / (step * step).sum(axis=1)
    return result


@dataclass(frozen=True)
class Rasters:
    """Rasters of some facets: the columns of a layout that do not say where they lie in the quilt."""

    size: Int32Array
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    corner_start: np.ndarray
    polygon: FloatArray


def display_rasters(display: Facets, facet: Sequence[int] | Int32Array) -> Rasters:
    """The rasters the display itself gives facets with these ids, which it must have."""
    rows = np.asarray(facet, dtype=np.int64) - 1
    corners = corner_pixels(display)
    polygons = [corners[display.corner_start[row] : display.corner_start[row + 1]] for row in rows]
    return Rasters(
        size=display.size[rows],
        origin=display.origin[rows],
        du=display.du[rows],
        dv=display.dv[rows],
        corner_start=np.cumsum([0, *map(len, polygons)]),
        polygon=np.concatenate([np.zeros((0, 2)), *polygons]),
    )


def entries(path: Path, problems: Sequence[Problem], most: int = 50) -> None:
    """Raise one `LayoutError` with the problems in the order of their lines, if there are any."""
    in_order = sorted(problems, key=lambda problem: problem.line)
    raise_all(LayoutError, first_of(in_order, most, str(path)))
