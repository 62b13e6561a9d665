"""Facets of one pixel for single lights: a small square around each point of a list.

The ray through a light's pixel goes through its point, however the square is turned: to all sides
squares are lit, and they face away from the middle of all points, or out of the plane that holds them all.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display.facets import Facets, Places
from quiltcli.errors import DisplayError, Problem, first_of, raise_all
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import BoolArray, FloatArray, IntArray, applied, cross, dot, normalized
from quiltcli.job.display import DisplayFile
from quiltcli.job.lengths import exact_metres
from quiltcli.job.model import FARTHEST, describe

MOST_POINTS = 1 << 17
"""Each is a facet, and has to be held against every triangle near it."""

_MOST_PROBLEMS = 20
_FLAT = 1e-6  # of their extent, by which points may lie beside a plane or a line that holds them all


def point_facets(spec: DisplayFile) -> Facets:
    """The facets of a display that is a list of points, each at its place in the quilt, row by row.

    Raises:
        DisplayError: the list cannot be read, or has no points.
    """
    points = spec.points
    assert points is not None
    number, found, count = read_points(points.file)
    place = found * spec.metres
    matrix = spec.world_from_local
    if matrix is not None:
        place = applied(matrix[:3, :3], place) + matrix[:3, 3]
    half = float(exact_metres(points.size, spec.metres)) / 2
    if spec.transform is not None:
        half *= float(np.cbrt(np.linalg.det(spec.transform.array[:3, :3])))
    right, up = _squares(place)
    right, up = half * right, half * up
    corners = place[:, None] + np.stack((-right - up, right - up, right + up, up - right), axis=1)
    columns = min(points.columns, count)
    row = np.arange(number.size, dtype=np.int32)
    spots = np.stack((number % columns, number // columns), axis=1).astype(np.int32)
    listed = Places(
        facet=row + 1,
        page=np.zeros(number.size, dtype=np.int32),
        turn=np.zeros(number.size, dtype=np.int32),
        mirror=np.zeros(number.size, dtype=np.bool_),
        corner=spots,
        source=spec.source,
        keys=dict.fromkeys(range(1, number.size + 1), ("points",)),
        page_size=(columns, -(-count // columns)),
    )
    return Facets(
        names=tuple(f"point_{k + 1}" for k in number.tolist()),
        corner_start=4 * np.arange(number.size + 1, dtype=np.int64),
        corners=corners.reshape(-1, 3),
        origin=place - right + up,
        du=2 * right,
        dv=-2 * up,
        size=np.ones((number.size, 2), dtype=np.int32),
        normal=normalized(cross(right, up)),
        both_sides=True,
        enabled=np.ones(number.size, dtype=np.bool_),
        mirrored=np.zeros(number.size, dtype=np.bool_),
        uv=None,
        path=str(spec.source.path),
        places=listed,
    )


def read_points(path: Path) -> tuple[IntArray, FloatArray, int]:
    """A list of points.

    Returns:
        The number (N,) of every point that is there, counted from 0; the points (N, 3), in the file's
        units; and the length of the list.

    Raises:
        DisplayError: no JSON, no list, things in it that are no points, none or too many of them.
    """
    data = read_input(path, DisplayError, "a JSON")
    try:
        entries = json.loads(data.decode("utf-8-sig", "strict"))
    except UnicodeDecodeError as error:
        raise DisplayError(Problem(f"is no text in UTF-8 (byte {error.start})", str(path))) from None
    except json.JSONDecodeError as error:
        raise DisplayError(
            Problem(f"is no JSON: {error.msg}", str(path), error.lineno, error.colno)
        ) from None
    except RecursionError:
        raise DisplayError(Problem("is nested too deeply (expected a list of points)", str(path))) from None
    if not isinstance(entries, list):
        words = f"expected a list such as [[0, 1, 0], [0, 2, 0]], got {describe(entries)}"
        raise DisplayError(Problem(words, str(path)))
    if len(entries) > MOST_POINTS:
        words = f"has {len(entries):,} points (expected at most {MOST_POINTS:,}; a wall is a panel)"
        raise DisplayError(Problem(words, str(path)))
    points = [_point(entry) for entry in entries]
    raise_all(DisplayError, first_of(list(_odd(points, path)), _MOST_PROBLEMS, str(path)))
    number = np.array([k for k, point in enumerate(points) if point is not None], dtype=np.int64)
    if not number.size:
        raise DisplayError(Problem("has no points (expected one or more)", str(path)))
    return number, np.array([point for point in points if point is not None], dtype=np.float64), len(points)


def _point(entry: Any) -> Any:
    """Coordinates of an entry, None for a light that is not there, or a text that says what is wrong."""
    if entry is None:
        return None
    found = entry
    if isinstance(entry, dict):
        if "point" not in entry:
            known = ", ".join(map(repr, entry)) or "nothing"
            return f'expected a key "point" of three numbers, got {known}'
        found = entry["point"]
    numbers = isinstance(found, list) and all(
        isinstance(value, (int, float)) and not isinstance(value, bool) for value in found
    )
    if not numbers or len(found) != 3:
        return f"expected three numbers, x, y and z, got {describe(found)}"
    if not all(abs(value) <= FARTHEST for value in found):
        return f"expected numbers up to {FARTHEST:.0e}, got {describe(found)}"
    return found


def _odd(points: list[Any], path: Path) -> Iterator[Problem]:
    for k, point in enumerate(points):
        if isinstance(point, str):
            yield Problem(f"point {k + 1} of {len(points)}: {point}", str(path))


def _squares(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors right and up (N, 3) of the squares around points (N, 3)."""
    middle = points - points.mean(axis=0)
    _, extent, axes = np.linalg.svd(middle, full_matrices=len(points) < 3)
    extent = np.append(extent, np.zeros(3 - extent.size))
    facing = normalized(middle)
    if not extent[0] > 0:
        facing[:] = (0.0, 0.0, 1.0)
    elif extent[2] <= _FLAT * extent[0]:
        # In one plane they face out of it; on one line as much as may be to +Z, or else to +X.
        out = axes[2]
        if extent[1] <= _FLAT * extent[0]:
            along = axes[0]
            to = np.eye(3)[0 if abs(along[2]) > 0.9 else 2]
            out = to - along * (along @ to)
        facing[:] = out / np.sqrt(out @ out) * (1.0 if out[np.abs(out).argmax()] >= 0 else -1.0)
    facing[~(dot(facing, facing) > 0.5)] = (0.0, 0.0, 1.0)
    level: BoolArray = np.abs(facing[:, 1]) > 0.9
    upright = np.where(level[:, None], (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    right = normalized(cross(upright, facing))
    return right, cross(facing, right)
