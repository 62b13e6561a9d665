"""What a display is, and what a polygon mesh is."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, bounds, bounds_text, counted, number, size, spread
from quiltcli.charts.measure import measure
from quiltcli.display import Facets, load_display, pitch_mm, pitch_of, shared_edges
from quiltcli.display.projectors import projector_facets, screened
from quiltcli.formats.mesh.polygons import area_vectors
from quiltcli.geometry import FloatArray, IntArray, dot, segments
from quiltcli.job import DisplayFile
from quiltcli.job.load import load_any_display

_POLYGONS = {3: "triangle", 4: "quadrilateral", 5: "pentagon", 6: "hexagon", 8: "octagon"}


def display_info(path: Path) -> Info:
    """Facets, polygons, area, pixels and pitch of a display.

    Raises:
        JobError, MeshError, DisplayError: the display cannot be built.
    """
    spec = load_any_display(path)
    if not isinstance(spec, DisplayFile):
        from quiltcli.analysis.info.mirrors import mirror_info

        return mirror_info(path)
    facets = load_display(spec)
    table = _facet_table(facets)
    data = _display_data(spec, facets) | {"facet_table": table}
    lit = {"front": "front (walked around)", "back": "back (seen from inside)", "both": "both sides"}
    low, high = data["pitch_mm"]
    lines = [
        *_sources(spec),
        ("facets", _facets_text(data)),
        ("lit side", "all sides" if spec.points is not None else lit[spec.viewing_side]),
        *_corrections(spec),
        ("area", f"{number(data['area_m2'])} m²"),
        ("pixels", f"{data['pixels']:,}"),
        *([] if spec.projection else [("pitch", spread(low, high, "mm"))]),
        ("bounds", bounds_text(data["bounds"])),
        *_surface_lines(spec, data),
        ("shared edges", f"{data['shared_edges']:,}"),
        ("geometry", facets.sha256),
    ]
    columns = ("facet", "name", "corners", "pixels", "area m²", "pitch mm", "normal", "")
    return Info("display", data, lines, columns, [_row(entry) for entry in table])


def _surface_lines(spec: DisplayFile, data: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Curved facets in words, projectors by where they stand."""
    if spec.projectors is None:
        yield from (_surface_line(found) for found in data.get("surfaces", ()))
        return
    for facet, projector in enumerate(projector_facets(spec, load_display)[1], 1):
        yield f"facet {facet}", f"projector {screened(projector)}"


def _surface_line(found: dict[str, Any]) -> tuple[str, str]:
    """A curved facet in words."""
    radius = found["least_radius_m"]
    bent = "flat" if radius is None else f"least radius {number(radius)} m"
    low, high = found["pitch_mm"]
    words = f"{found['kind']}, {number(found['area_m2'])} m², pitch {spread(low, high, 'mm')}, {bent}"
    return f"facet {found['facet']}", words + (", closes left to right" if found["wraps"] else "")


def _sources(spec: DisplayFile) -> Iterator[tuple[str, str]]:
    """What the display is made of."""
    if spec.mesh is not None:
        yield "mesh", str(spec.mesh)
    if spec.panels is not None:
        yield "panels", f"{len(spec.panels):,}"
    if spec.points is not None:
        yield "points", str(spec.points.file)
    if spec.surfaces is not None:
        yield "surfaces", ", ".join(surface.kind for surface in spec.surfaces)
    if spec.projectors is not None:
        yield "projectors", f"{len(spec.projectors)}"
    if spec.screen is not None:
        yield "screen", str(spec.screen)
    if spec.projection is not None:
        projection = spec.projection
        yield "projection", f"{projection.kind}, which follows the {projection.follows}"


def _corrections(spec: DisplayFile) -> Iterator[tuple[str, str]]:
    """What images make up for, in words."""
    given = spec.corrections
    if given is None:
        return
    words = []
    if given.brightness is not None:
        table, limit = given.brightness.table, given.brightness.limit
        fall = (
            f"a table of {len(table)} rows" if table else f"cosine to the power {given.brightness.exponent:g}"
        )
        words.append(f"brightness by the angle ({fall}, up to {limit:g} times)")
    if given.facets:
        words.append(f"light of {counted(len(given.facets), 'facet')}")
    if given.level != 1:
        words.append(f"level {given.level:g}")
    yield "corrections", ", ".join(words)


def _display_data(spec: DisplayFile, facets: Facets) -> dict[str, Any]:
    """The display for programs; curved facets count by their own area and pitch."""
    data = _flat_data(spec, facets)
    surfaces = _surfaces(facets)
    if not facets.charts:
        return data
    flat = np.flatnonzero(facets.enabled & ~facets.curved)
    area = areas(facets.corners, facets.corner_start)[flat].sum() + sum(s["area_m2"] for s in surfaces)
    row, _ = segments(facets.corner_start)
    points = [facets.corners[np.isin(row, flat)]]
    points += [np.array((found["bounds"]["min"], found["bounds"]["max"])) for found in surfaces]
    pitch = [*pitch_of(facets.du[flat], facets.dv[flat])] if flat.size else []
    pitch += [step for found in surfaces for step in found["pitch_mm"]]
    everything = np.concatenate(points)
    told = {"area_m2": float(area), "surfaces": surfaces}
    if len(everything):
        told |= {"pitch_mm": [min(pitch), max(pitch)], "bounds": bounds(everything)}
    return data | told


def _surfaces(facets: Facets) -> list[dict[str, Any]]:
    """The curved facets that stand in the world."""
    found = []
    for facet, chart in enumerate(facets.charts):
        if chart is None or not chart.stands:
            continue
        figures = measure(chart)
        found.append(
            {
                "facet": facet + 1,
                "kind": json.loads(chart.record)["kind"],
                "area_m2": figures.area,
                "pitch_mm": [1000 * step for step in figures.pitch],
                "least_radius_m": figures.radius if np.isfinite(figures.radius) else None,
                "bounds": bounds(np.stack((figures.low, figures.high))),
                "wraps": chart.wraps,
            }
        )
    return found


def _flat_data(spec: DisplayFile, facets: Facets) -> dict[str, Any]:
    return {
        "path": facets.path,
        "mesh": None if spec.mesh is None else str(spec.mesh),
        "facets": facets.count,
        "enabled": int(np.count_nonzero(facets.enabled)),
        "polygons": polygon_counts(facets.corner_start),
        "viewing_side": spec.viewing_side,
        "area_m2": float(areas(facets.corners, facets.corner_start)[facets.enabled].sum()),
        "pixels": int(facets.size[facets.enabled].astype(np.int64).prod(axis=1).sum()),
        "pitch_mm": list(pitch_mm(facets)),
        "bounds": bounds(facets.corners),
        "shared_edges": len(shared_edges(facets).facet_a),
        "from_uv": spec.layout is not None,
        **({"corrections": json.loads(facets.response.record)} if facets.response is not None else {}),
        "sha256": facets.sha256,
    }


def _facet_table(facets: Facets) -> list[dict[str, Any]]:
    area = areas(facets.corners, facets.corner_start)
    step = [np.sqrt(dot(d, d)) * 1000 for d in (facets.du, facets.dv)]
    return [
        {
            "id": i + 1,
            "name": facets.names[i],
            "corners": int(facets.corner_start[i + 1] - facets.corner_start[i]),
            "size": facets.size[i].tolist(),
            "area_m2": float(area[i]),
            "pitch_mm": [float(step[0][i]), float(step[1][i])],
            "normal": (facets.normal[i] + 0.0).tolist(),
            "enabled": bool(facets.enabled[i]),
            "mirrored": bool(facets.mirrored[i]),
        }
        for i in range(facets.count)
    ]


def _row(entry: dict[str, Any]) -> list[str]:
    remarks = ["mirrored"] * entry["mirrored"] + ["not enabled"] * (not entry["enabled"])
    return [
        str(entry["id"]),
        entry["name"],
        str(entry["corners"]),
        size(entry["size"]),
        f"{entry['area_m2']:.4g}",
        " × ".join(dict.fromkeys(f"{step:.4g}" for step in entry["pitch_mm"])),
        f"[{', '.join(f'{c:.3g}' for c in entry['normal'])}]",
        ", ".join(remarks),
    ]


def _facets_text(data: dict[str, Any]) -> str:
    text = f"{data['facets']:,}: {polygons_text(data['polygons'])}"
    return text if data["enabled"] == data["facets"] else f"{text}, {data['enabled']:,} enabled"


def areas(corners: FloatArray, start: IntArray) -> FloatArray:
    """Areas (F,) of polygons, in the square of the corners' unit."""
    twice = area_vectors(corners, start)
    result: FloatArray = np.sqrt(dot(twice, twice)) / 2
    return result


def polygon_counts(start: IntArray) -> dict[str, int]:
    """How many polygons have how many corners; keys are texts, as JSON would have them."""
    corners, count = np.unique(np.diff(start), return_counts=True)
    return {str(n): int(k) for n, k in zip(corners, count, strict=True)}


def polygons_text(counts: dict[str, int]) -> str:
    """`12 pentagons, 20 hexagons`."""
    named = ((_POLYGONS.get(int(corners)), corners, count) for corners, count in counts.items())
    return ", ".join(
        counted(k, name) if name else f"{counted(k, 'polygon')} of {n} corners" for name, n, k in named
    )
