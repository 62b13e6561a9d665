"""Markers on a display: which ones, at which pixels of which facet.

A camera that finds a marker knows four points of a facet by name: its corners are at known pixels, and a
facet's pixels are points of a plane. Several markers, far from each other, tell how the plane lies.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.calibration.dictionaries import DICTIONARIES, dictionary
from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import DisplayError, JobError, Problem, counted
from quiltcli.formats.inputs import read_input
from quiltcli.formats.whole import write_text
from quiltcli.geometry import BoolArray, FloatArray, dot

PHOTO = (4000, 3000)
PER_FACET = 8
_SEEN = 4
"""Photo pixels a module of a marker should have where the photo just holds the display, seen head on."""
_SHARE = 0.22
"""Side of a marker as a share of its facet's shorter side, where the photo does not ask for more."""
_STEPS = 24


@dataclass(frozen=True)
class Marker:
    """A marker on a facet.

    Attributes:
        id: its number in the dictionary.
        facet: id, 1-based.
        at: x, y of its top-left pixel in the facet's raster; around it is white for a module.
        size: width and height, pixels.
        mirrored: whether the facet's image is mirrored, and the marker in it with it.
    """

    id: int
    facet: int
    at: tuple[int, int]
    size: tuple[int, int]
    mirrored: bool = False

    @property
    def corners(self) -> FloatArray:
        """Facet pixels (4, 2) of its corners, clockwise from its own top left, as a camera sees it."""
        (x, y), (width, height) = self.at, self.size
        around = np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], float)
        return around[[1, 0, 3, 2]] if self.mirrored else around


@dataclass(frozen=True)
class MarkerSet:
    """The markers of a display.

    Attributes:
        dictionary: name of the dictionary, a key of `dictionaries.DICTIONARIES`.
        markers: by ascending id.
    """

    dictionary: str
    markers: tuple[Marker, ...]

    def without(self, facets: Facets) -> list[int]:
        """Ids of the facets that take part and have no marker, for want of room."""
        marked = {marker.facet for marker in self.markers}
        return [row + 1 for row in np.flatnonzero(facets.enabled).tolist() if row + 1 not in marked]

    def of(self, facet: int) -> Iterator[Marker]:
        """The markers of a facet (1-based id)."""
        return (marker for marker in self.markers if marker.facet == facet)


def place_markers(
    facets: Facets, name: str = "5x5", per_facet: int = PER_FACET, photo: tuple[int, int] = PHOTO
) -> MarkerSet:
    """Markers for all facets that take part, ids unique over the display.

    A module has as many pixels as it takes to fill four pixels of a photo that just holds the display,
    or more where the facet has room: a marker is about a fifth of a facet's shorter side.

    Args:
        facets: the display.
        name: name of the dictionary.
        per_facet: markers wanted on each facet; fewer, or none, where a facet or the dictionary is too small.
        photo: width and height of the photos, pixels.

    Raises:
        JobError: an unknown dictionary, or one with fewer markers than there are facets.
        DisplayError: no facet has room for a marker that a photo can resolve.
    """
    words = dictionary(name)
    rows = np.flatnonzero(facets.enabled)
    if len(rows) > words.count:
        raise JobError(
            f"dictionary {name} has {words.count} markers, fewer than the {len(rows)} facets "
            "(expected one a facet at least; 5x5 has most)"
        )
    wanted = max(1, min(per_facet, words.count // max(len(rows), 1)))
    extent = float(np.ptp(facets.corners, axis=0).max())
    module = _SEEN * extent / min(photo)  # metres
    pixels, start = corner_pixels(facets), facets.corner_start
    markers: list[Marker] = []
    for row in rows.tolist():
        polygon = pixels[start[row] : start[row + 1]]
        places, size = _on_facet(facets, row, polygon, words.modules, module, wanted)
        mirrored = _mirrored(facets, row)
        markers += [Marker(len(markers) + k, row + 1, at, size, mirrored) for k, at in enumerate(places)]
    if not markers:
        raise DisplayError(
            Problem(
                f"no facet has room for a marker of {words.modules} modules of {1000 * module:.3g} mm, which "
                f"photos of {photo[0]} × {photo[1]} pixels ask for (expected larger photos: --photo)",
                file=facets.path,
            )
        )
    return MarkerSet(name, tuple(markers))


def draw_markers(markers: MarkerSet, facet: int, image: NDArray[np.float32]) -> None:
    """Draw a facet's markers on its raster (H, W, 3), which becomes grey; each with its quiet zone."""
    words = dictionary(markers.dictionary)
    image[:] = 0.35
    for marker in markers.of(facet):
        bits = np.pad(words.bits(marker.id), 1, constant_values=1).astype(np.float32)
        if marker.mirrored:
            bits = bits[:, ::-1]
        (x, y), (width, height) = marker.at, marker.size
        across, down = width // words.modules, height // words.modules
        large = np.repeat(np.repeat(bits, down, axis=0), across, axis=1)
        image[y - down : y + height + down, x - across : x + width + across] = large[..., None]


def _on_facet(
    facets: Facets, row: int, polygon: FloatArray, modules: int, module: float, wanted: int
) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Top-left pixels of as many markers as wanted, or fewer, and their size in pixels."""
    pitch = np.sqrt(np.array((dot(facets.du[row], facets.du[row]), dot(facets.dv[row], facets.dv[row]))))
    side = float((np.ptp(polygon, axis=0) * pitch).min())
    least = np.maximum(np.ceil(module / pitch - 1e-9), 1).astype(int)
    best: tuple[list[tuple[int, int]], tuple[int, int]] = ([], (0, 0))
    # From a fifth of the facet down to what the photo can resolve, until all that are wanted fit.
    for share in (_SHARE, 0.75 * _SHARE, 0.55 * _SHARE, 0.4 * _SHARE, 0.0):
        pixels = np.maximum(np.floor(share * side / (modules * pitch)).astype(int), least)
        places = _spread(polygon, pixels, modules, wanted)
        if len(places) > len(best[0]):
            best = places, (int(pixels[0]) * modules, int(pixels[1]) * modules)
        if len(places) == wanted or (pixels == least).all():
            break
    return best


def _spread(
    polygon: FloatArray, pixels: NDArray[np.integer[Any]], modules: int, wanted: int
) -> list[tuple[int, int]]:
    """Places where a marker fits with its quiet zone, as far from each other as a grid of them allows."""
    whole = pixels * (modules + 2)
    low, high = np.ceil(polygon.min(axis=0)), np.floor(polygon.max(axis=0)) - whole
    if (high < low).any():
        return []
    axes = [np.unique(np.floor(np.linspace(a, b, _STEPS))) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[_boxes_inside(polygon, grid, grid + whole)]
    if not len(grid):
        return []
    middle = polygon.mean(axis=0) - whole / 2
    # The first is the farthest from the middle, each other one the farthest from those before.
    chosen = [int(np.argmax(np.abs(grid - middle).sum(axis=1)))]
    free = np.full(len(grid), np.inf)
    while len(chosen) < wanted:
        apart = np.abs(grid - grid[chosen[-1]])
        free = np.where((apart >= whole).any(axis=1), np.minimum(free, apart.max(axis=1)), -1)
        if free.max() < 0:
            break
        chosen.append(int(np.argmax(free)))
    return [(int(x + pixels[0]), int(y + pixels[1])) for x, y in grid[sorted(chosen)]]


def _boxes_inside(polygon: FloatArray, low: FloatArray, high: FloatArray) -> BoolArray:
    """Which boxes (n,) lie in a polygon (m, 2): no edge enters them, and their middles are inside."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    run = b - a
    # An edge enters a box where the parts of it between the box's sides have something in common.
    first, last = np.zeros((len(low), len(a))), np.ones((len(low), len(a)))
    apart = np.zeros(first.shape, np.bool_)
    for axis in (0, 1):
        level = np.abs(run[:, axis]) < 1e-9
        step = np.where(level, 1.0, run[:, axis])
        near = (low[:, axis, None] + 1e-6 - a[:, axis]) / step
        far = (high[:, axis, None] - 1e-6 - a[:, axis]) / step
        within = (low[:, axis, None] < a[:, axis] - 1e-6) & (a[:, axis] + 1e-6 < high[:, axis, None])
        apart |= level & ~within
        first = np.where(level, first, np.maximum(first, np.minimum(near, far)))
        last = np.where(level, last, np.minimum(last, np.maximum(near, far)))
    entered = (~apart & (first < last)).any(axis=1)
    x, y = np.split((low + high) / 2, 2, axis=1)
    passes = (a[:, 1] <= y) != (b[:, 1] <= y)
    cut = a[:, 0] + (y - a[:, 1]) / np.where(run[:, 1] == 0, 1, run[:, 1]) * run[:, 0]
    result: BoolArray = ((passes & (x >= cut)).sum(axis=1) % 2 == 1) & ~entered
    return result


def _mirrored(facets: Facets, row: int) -> bool:
    """Whether a facet's raster runs to the left, seen from its lit side."""
    right_down = np.cross(facets.du[row], facets.dv[row])
    return bool(right_down @ facets.normal[row] > 0)


def marker_places(facets: Facets, markers: Sequence[Marker]) -> FloatArray:
    """World metres (m, 4, 3) of the corners of markers."""
    row = np.array([marker.facet - 1 for marker in markers])
    pixels = np.array([marker.corners for marker in markers])[..., None]
    steps = np.stack((facets.du[row], facets.dv[row]), axis=1)[:, None]
    result: FloatArray = facets.origin[row][:, None] + (pixels * steps).sum(axis=2)
    return result


def write_markers(path: Path, markers: MarkerSet) -> None:
    """Write where the markers are, for whoever takes the photos apart (OutputError)."""
    rows = ",\n ".join(json.dumps(asdict(marker)) for marker in markers.markers)
    head = f'{{"quilt_markers": 1, "dictionary": {json.dumps(markers.dictionary)}, "markers": [\n '
    write_text(path, f"{head}{rows}\n]}}\n")


def read_markers(path: Path) -> MarkerSet:
    """Read what `write_markers` wrote.

    Raises:
        JobError: no such file, or not one of these.
    """
    name = ""
    markers: tuple[Marker, ...] = ()
    try:
        found = json.loads(read_input(path, JobError, "a markers.json"))
        name = found["dictionary"]
        markers = tuple(_marker(entry) for entry in found["markers"])
        known = found["quilt_markers"] == 1 and name in DICTIONARIES
    except (ValueError, KeyError, TypeError, RecursionError):
        known = False
    if not known:
        message = "is no list of markers (expected what quilt pattern --kind markers wrote)"
        raise JobError(Problem(message, file=str(path)))
    if len({marker.id for marker in markers}) < len(markers):
        raise JobError(Problem("names a marker twice", file=str(path)))
    return MarkerSet(name, markers)


def _marker(entry: Mapping[str, Any]) -> Marker:
    """A marker of the file; ValueError and the like where it is none."""
    numbers = [entry["id"], entry["facet"], *entry["at"], *entry["size"]]
    if not all(type(number) is int and 0 <= number < 2**31 for number in numbers):
        raise ValueError("numbers")
    (x, y), (width, height) = entry["at"], entry["size"]
    if not (entry["facet"] and width and height and math.isfinite(x + y)):
        raise ValueError("numbers")
    return Marker(entry["id"], entry["facet"], (x, y), (width, height), bool(entry["mirrored"]))


def unknown_markers(markers: MarkerSet, facets: Facets, path: Path) -> Iterator[Problem]:
    """Problems with markers that are on no facet of the display, or past its raster."""
    for marker in markers.markers:
        if marker.facet > facets.count:
            yield Problem(
                f"marker {marker.id} is on facet {marker.facet} "
                f"(the display has {counted(facets.count, 'facet')}; is it another display's file?)",
                file=str(path),
            )
        elif (np.add(marker.at, marker.size) > facets.size[marker.facet - 1]).any():
            width, height = facets.size[marker.facet - 1]
            yield Problem(
                f"marker {marker.id} lies outside facet {marker.facet}, which has {width} × {height} pixels",
                file=str(path),
            )
