"""Warps of pictures, as camera textures, ST maps and warp meshes give them: a direction for each pixel."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.charts.grids import drawn_pixels
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.exr.image import read_header
from quiltcli.formats.inputs import read_input
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import FloatArray
from quiltcli.job.projections import PlanarCamera

CAMERA_ATTRIBUTE = "quilt:camera"
"""Of an ST map: angle and aspect of the plain picture, as JSON."""


def camera_directions(spec: Any, u: FloatArray, v: FloatArray) -> FloatArray:
    """Directions (3, ...) through places of a plain picture: u from the left, v from the bottom, 0 to 1."""
    camera = spec.camera or PlanarCamera.model_validate(_noted(spec.file))
    aspect = camera.aspect or spec.pixels[0] / spec.pixels[1]
    half = math.tan(math.radians(camera.fov_deg) / 2)
    x, y = (2 * u - 1) * (half * aspect), (2 * v - 1) * half
    return np.stack((x, y, np.where(np.isfinite(x + y), -1.0, np.nan)))


def _noted(path: Path) -> dict[str, Any]:
    """What a map's file says of its plain picture; nothing where it says nothing."""
    if path.suffix.lower() != ".exr":
        return {}
    try:
        found = json.loads(str(read_header(path).attributes.get(CAMERA_ATTRIBUTE, "{}")))
    except ValueError:
        return {}
    return {key: value for key, value in found.items() if key in PlanarCamera.model_fields}


def st_directions(spec: Any) -> FloatArray:
    """Directions (3, H, W) of an ST map."""
    picture = read_numbers(spec.file, 2, exact=True)
    u, v = picture.values[:2]
    if picture.alpha is not None:
        u = np.where(picture.alpha > 0, u, np.nan)
    return camera_directions(spec, u, v)


def offset_directions(spec: Any) -> FloatArray:
    """Directions (3, H, W) of a camera texture: two triangles a cell, each an affine map (Lorenz, Döllner).

    Raises:
        DisplayError: it folds; the cell is named.
    """
    picture = read_numbers(spec.file, 2, exact=True)
    off = picture.values[:2]
    rows, columns = off.shape[1:]
    if rows < 2 or columns < 2 or not np.isfinite(off).all():
        words = f"has {columns} × {rows} nodes (expected at least 2 × 2, all of them numbers)"
        raise DisplayError(Problem(words, file=str(spec.file)))
    width, height = spec.pixels
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))  # v from the top
    place = np.stack((u * width + off[0] * height, v * height - off[1] * height), axis=-1)
    return _warped(spec, place, np.stack((u, 1 - v), axis=-1), lambda u, v: camera_directions(spec, u, v))


def mesh_directions(spec: Any, lens: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Directions (3, H, W) of a warp mesh whose coordinates refer to a fisheye picture."""
    place, uv, shown = read_warp_mesh(spec)

    def direction(u: FloatArray, v: FloatArray) -> FloatArray:
        x, y = 2 * u - 1, 2 * v - 1
        r = np.sqrt(x * x + y * y)
        theta, safe = lens(np.where(r <= 1, r, np.nan)), np.where(r > 0, r, 1.0)
        return np.stack((np.sin(theta) * x / safe, np.sin(theta) * y / safe, -np.cos(theta)))

    return _warped(spec, place, uv, direction, shown)


def read_warp_mesh(spec: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A warp mesh (Bourke's `.data`): places in pixels (rows, columns, 2), uv likewise, and brightness.

    Raises:
        DisplayError: it is none.
    """
    path = spec.file
    lines = read_input(path, DisplayError, "a warp mesh").decode("utf-8", "replace").splitlines()
    words = [(number, line.split()) for number, line in enumerate(lines, 1) if line.split()]
    if len(words) < 2 or len(words[0][1]) != 1 or words[0][1][0] not in ("1", "2"):
        line = words[0][0] if words else 0
        raise DisplayError(
            Problem("expected the mesh's type, 1 or 2, alone in the first line", str(path), line)
        )
    columns, rows = (int(word) if word.isdigit() else 0 for word in (words[1][1] + ["", ""])[:2])
    if columns < 2 or rows < 2:
        found = " ".join(words[1][1])[:40]
        message = f"expected two numbers of nodes, 2 or more each, got {found!r}"
        raise DisplayError(Problem(message, str(path), words[1][0]))
    if len(words) - 2 != columns * rows:
        message = f"has {len(words) - 2} nodes (expected {columns} × {rows} = {columns * rows})"
        raise DisplayError(Problem(message, str(path), words[1][0]))
    nodes = np.array([_node(path, number, parts) for number, parts in words[2:]])
    nodes = nodes.reshape(rows, columns, 5)
    width, height = spec.pixels
    x = (nodes[..., 0] / (width / height) + 1) / 2 * width
    y = (1 - nodes[..., 1]) / 2 * height
    return np.stack((x, y), axis=-1), nodes[..., 2:4], nodes[..., 4]


def _node(path: Any, line: int, words: list[str]) -> list[float]:
    """X y u v i."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 5 or not all(map(math.isfinite, numbers)):
        message = f"expected five numbers, x y u v i, got {' '.join(words)[:40]!r}"
        raise DisplayError(Problem(message, str(path), line))
    return numbers


def _warped(
    spec: Any,
    place: FloatArray,
    uv: FloatArray,
    direction: Callable[[FloatArray, FloatArray], FloatArray],
    shown: FloatArray | None = None,
) -> FloatArray:
    """Directions (3, H, W): what lies under each pixel of nodes (rows, columns, 2) that were moved there."""
    width, height = spec.pixels
    cells = list(_triangles(place.shape[:2], shown))
    index = np.array([corners for _, corners in cells]).reshape(-1, 3)
    flat, coordinates = place.reshape(-1, 2), uv.reshape(-1, 2)
    _unfolded(spec, flat[index], [cell for cell, _ in cells])
    result = np.full((2, height * width), np.nan)
    for corners, (pixel, weights) in zip(index, drawn_pixels(flat[index], width, height), strict=True):
        result[:, pixel] = (weights @ coordinates[corners]).T
    u, v = result.reshape(2, height, width)
    return direction(u, v)


def _triangles(
    shape: tuple[int, ...], shown: FloatArray | None
) -> Iterator[tuple[tuple[int, int], tuple[int, int, int]]]:
    """Two triangles a cell, along its rising diagonal, as nodes; those with a node not shown are left out."""
    rows, columns = shape
    for j in range(rows - 1):
        for i in range(columns - 1):
            a, b = j * columns + i, j * columns + i + 1
            c, d = a + columns, b + columns
            for corners in ((a, b, c), (b, d, c)):
                if shown is None or all(shown.reshape(-1)[corner] >= 0 for corner in corners):
                    yield (i, j), corners


def _unfolded(spec: Any, triangles: FloatArray, cells: list[tuple[int, int]]) -> None:
    """All triangles must keep the side that most have."""
    p, q = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    most = np.sign(np.sign(area).sum()) or 1.0
    wrong = np.flatnonzero(area * most <= 0)
    if wrong.size:
        i, j = cells[wrong[0]]
        words = f"cell ({i}, {j}) is folded over (expected nodes that keep their order)"
        raise DisplayError(Problem(words, file=str(spec.file)))
