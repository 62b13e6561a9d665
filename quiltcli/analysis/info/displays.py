"""What a display is, and what a polygon mesh is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, bounds, bounds_text, counted, number, size, spread
from quiltcli.display import Facets, load_display, pitch_mm, shared_edges
from quiltcli.formats.mesh.polygons import area_vectors
from quiltcli.geometry import FloatArray, IntArray, dot
from quiltcli.job import DisplayFile, load_display_file

_POLYGONS = {3: "triangle", 4: "quadrilateral", 5: "pentagon", 6: "hexagon", 8: "octagon"}


def display_info(path: Path) -> Info:
    """Facets, polygons, area, pixels and pitch of a display.

    Raises:
        JobError, MeshError, DisplayError: the display cannot be built.
    """
    spec = load_display_file(path)
    facets = load_display(spec)
    table = _facet_table(facets)
    data = _display_data(spec, facets) | {"facet_table": table}
    lit = {"front": "front (walked around)", "back": "back (seen from inside)", "both": "both sides"}
    low, high = data["pitch_mm"]
    lines = [
        *_sources(spec),
        ("facets", _facets_text(data)),
        ("lit side", lit[spec.viewing_side]),
        ("area", f"{number(data['area_m2'])} m²"),
        ("pixels", f"{data['pixels']:,}"),
        *([] if spec.projection else [("pitch", spread(low, high, "mm"))]),
        ("bounds", bounds_text(data["bounds"])),
        ("shared edges", f"{data['shared_edges']:,}"),
        ("geometry", facets.sha256),
    ]
    columns = ("facet", "name", "corners", "pixels", "area m²", "pitch mm", "normal", "")
    return Info("display", data, lines, columns, [_row(entry) for entry in table])


def _sources(spec: DisplayFile) -> Iterator[tuple[str, str]]:
    """What the display is made of."""
    if spec.mesh is not None:
        yield "mesh", str(spec.mesh)
    if spec.panels is not None:
        yield "panels", f"{len(spec.panels):,}"
    if spec.surfaces is not None:
        yield "surfaces", ", ".join(surface.kind for surface in spec.surfaces)
    if spec.projection is not None:
        projection = spec.projection
        yield "projection", f"{projection.kind}, which follows the {projection.follows}"


def _display_data(spec: DisplayFile, facets: Facets) -> dict[str, Any]:
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
