"""Displays as other tools take them: a point of the world for each pixel, or a mesh with texture coordinates.

Maps are EXR (X, Y, Z) or PFM, single precision, row 0 at the top in EXR and at the bottom in PFM, metres;
pixels that are not there hold NaN. A projection's map has directions from the eye: right, up, back.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from quiltcli.charts import Chart
from quiltcli.charts.shapes import Placed
from quiltcli.charts.warps import CAMERA_ATTRIBUTE
from quiltcli.display import Facets
from quiltcli.errors import LayoutError, Problem
from quiltcli.exchange.pixelmaps.mpcdi3d import write_surfaces
from quiltcli.exchange.pixelmaps.points import facet_points, points_of
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.pfm import pfm_bytes
from quiltcli.formats.whole import write_bytes, write_text
from quiltcli.geometry import FloatArray
from quiltcli.job.model import suggest

CELLS = 128
"""Cells from left to right, and from top to bottom, of a mesh that stands for a surface."""
_MOST_SLOPE = float(np.tan(np.radians(80.0)))


def write_display_map(facets: Facets, path: Path, format_name: str | None) -> list[Path]:
    """Write what a display's pixels are; one file a facet where there are several.

    Args:
        facets: the display.
        path: the file; NAME_facet_0002.EXT and so on of several facets.
        format_name: a key of `FORMATS`; by default `obj`, `data` or `mpcdi` for such a file, else `xyz`.

    Raises:
        LayoutError: an unknown format or suffix.
        OutputError: a file cannot be written.
    """
    name = format_name or {".obj": "obj", ".data": "data", ".mpcdi": "mpcdi"}.get(path.suffix.lower(), "xyz")
    if name == "mpcdi":
        return write_surfaces(facets, path)
    if name not in FORMATS:
        near = suggest(name, FORMATS)
        hint = f"; did you mean {near}?" if near else ""
        known = ", ".join((*FORMATS, "mpcdi"))
        words = f"a display has no form {name!r} (known: {known}{hint}; others belong to layouts)"
        raise LayoutError(Problem(words))
    written = []
    for facet in np.flatnonzero(facets.enabled).tolist():
        file = path
        if np.count_nonzero(facets.enabled) > 1:
            file = path.with_name(f"{path.stem}_facet_{facet + 1:04d}{path.suffix}")
        FORMATS[name](facets, facet, file)
        written.append(file)
    return written


def _write_points(facets: Facets, facet: int, path: Path) -> None:
    """A map of points in EXR or PFM."""
    points = facet_points(facets, facet)
    if path.suffix.lower() == ".pfm":
        write_bytes(path, pfm_bytes(np.moveaxis(points, 0, 2)))
        return
    if path.suffix.lower() != ".exr":
        raise LayoutError(Problem(f"has the suffix {path.suffix!r} (expected .exr or .pfm)", file=str(path)))
    write_exr(path, dict(zip("XYZ", points, strict=True)), {"quilt:facet": facet + 1})


def _write_mesh(facets: Facets, facet: int, path: Path) -> None:
    """An OBJ of quadrilaterals with texture coordinates: the texture is the facet's image."""
    width, height = facets.size[facet].tolist()
    columns, rows = min(width, CELLS), min(height, CELLS)
    at, _ = points_of(facets, facet)
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    points = np.moveaxis(np.broadcast_to(at(s * width, t * height), (3, *s.shape)), 0, 2).reshape(-1, 3)
    number = np.arange(1, len(points) + 1).reshape(s.shape)
    a, b, c, d = number[1:, :-1], number[1:, 1:], number[:-1, 1:], number[:-1, :-1]
    faces = np.stack((a, b, c, d), axis=-1).reshape(-1, 4)
    known = np.asarray(np.isfinite(points).all(axis=1))
    faces = faces[known[faces - 1].all(axis=1)]
    points = np.where(np.isfinite(points), points, 0.0)
    if facets.mirrored[facet]:
        faces = faces[:, ::-1]
    lines = [f"g {facets.names[facet] or f'facet_{facet + 1:04d}'}"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points.tolist()]
    lines += [f"vt {u:.9g} {1 - v:.9g}" for u, v in zip(s.flat, t.flat, strict=True)]
    lines += ["f " + " ".join(f"{k}/{k}" for k in face) for face in faces.tolist()]
    write_text(path, "\n".join(lines) + "\n")


def _write_warp_mesh(facets: Facets, facet: int, path: Path) -> None:
    """A warp mesh (Bourke's `.data`) of a projection: where in an equidistant fisheye of 180° it looks.

    Raises:
        LayoutError: the facet is no projection.
    """
    chart: Chart | None = facets.charts[facet] if facets.charts else None
    if chart is None or chart.stands:
        words = (
            f"facet {facet + 1} is no projection (a warp mesh says where in a fisheye picture pixels look)"
        )
        raise LayoutError(Problem(words, file=facets.path))
    width, height = chart.size
    columns, rows = min(width, CELLS) + 1, min(height, CELLS) + 1
    s, t = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    x, y, z = _own_directions(chart, s, t)
    with np.errstate(invalid="ignore"):
        radius = np.sqrt(x * x + y * y)
        angle = np.arctan2(radius, -z) / (np.pi / 2)
        scale = angle / np.where(radius > 0, radius, 1.0)
        shown = angle <= 1.0
    lines = ["2", f"{columns} {rows}"]
    for j in range(rows):
        for i in range(columns):
            u, v = (0.5 + scale[j, i] * w[j, i] / 2 if shown[j, i] else 0.0 for w in (x, y))
            place = (2 * s[j, i] - 1) * width / height, 1 - 2 * t[j, i]
            lines.append(f"{place[0]:.9g} {place[1]:.9g} {u:.9g} {v:.9g} {1 if shown[j, i] else -1}")
    write_text(path, "\n".join(lines) + "\n")


def _write_st_map(facets: Facets, facet: int, path: Path) -> None:
    """An ST map of a projection: where in a plain picture, taken straight ahead, each pixel looks.

    That picture is as wide as what is ahead, up to 80 degrees to each side; its angle and aspect stand in the
    attribute `quilt:camera`. Pixels that look elsewhere have an alpha of 0.

    Raises:
        LayoutError: the facet is no projection, or looks nowhere ahead.
    """
    chart: Chart | None = facets.charts[facet] if facets.charts else None
    if chart is None or chart.stands:
        words = f"facet {facet + 1} is no projection (of a layout an ST map says where its pixels lie)"
        raise LayoutError(Problem(words, file=facets.path))
    if path.suffix.lower() != ".exr":
        raise LayoutError(Problem(f"has the suffix {path.suffix!r} (expected .exr)", file=str(path)))
    width, height = chart.size
    s, t = (np.arange(width) + 0.5) / width, ((np.arange(height) + 0.5) / height)[:, None]
    x, y, z = _own_directions(chart, s, t)
    with np.errstate(invalid="ignore", divide="ignore"):
        across, up = x / -z, y / -z
        shown = (z < 0) & (np.maximum(np.abs(across), np.abs(up)) <= _MOST_SLOPE)
    if not shown.any():
        raise LayoutError(Problem(f"facet {facet + 1} looks nowhere ahead", file=facets.path))
    half = [float(np.abs(slope[shown]).max()) for slope in (across, up)]
    # A little more, so that its outermost pixels are inside when the numbers have been rounded.
    fov = round(2 * float(np.degrees(np.arctan(half[1]))) + 0.01, 2)
    high = float(np.tan(np.radians(fov) / 2))
    aspect = round(half[0] / high + 0.001, 3)
    red, green = ((slope / scale + 1) / 2 for slope, scale in ((across, high * aspect), (up, high)))
    channels = {
        name: np.where(shown, values, 0.0).astype(np.float32) for name, values in (("R", red), ("G", green))
    }
    channels |= {"B": np.zeros_like(channels["R"]), "A": shown.astype(np.float32)}
    words = "R = x from the left, G = y from the bottom, of a plain picture"
    camera = json.dumps({"fov_deg": fov, "aspect": aspect})
    attributes = {"quilt:facet": facet + 1, "quilt:stmap": words, CAMERA_ATTRIBUTE: camera}
    write_exr(path, channels, attributes)


def _own_directions(chart: Chart, s: FloatArray, t: FloatArray) -> FloatArray:
    """Directions (3, ...) of a projection before it is turned to its heading."""
    shape = chart.shape.shape if isinstance(chart.shape, Placed) else chart.shape
    found = shape.at(s, t)
    return np.broadcast_to(found, (3, *np.broadcast_shapes(np.shape(s), np.shape(t))))


FORMATS: dict[str, Callable[[Facets, int, Path], None]] = {
    "xyz": _write_points,
    "obj": _write_mesh,
    "data": _write_warp_mesh,
    "st": _write_st_map,
}
"""Forms of a facet by name."""
