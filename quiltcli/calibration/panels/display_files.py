"""A display file with facets where they really are."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import FloatArray, dot, normalized
from quiltcli.job import DisplayFile, PanelSpec, dump_yaml
from quiltcli.job.dump import plain

_HEAD = "# Facets where they were measured; metres, Y up.\n"


def moved_display(
    spec: DisplayFile,
    facets: Facets,
    turns: FloatArray,
    middles: FloatArray,
    shifts: FloatArray,
    mesh: str,
    scale: float = 1.0,
) -> dict[str, str]:
    """Texts of the display whose facets have moved rigidly: turned about their middles, then shifted.

    Args:
        spec: the display's file.
        facets: its facets.
        turns: (F, 3, 3) rotations.
        middles: (F, 3) what facets turn about, world metres.
        shifts: (F, 3) metres.
        mesh: name of the mesh file, where the display has one.
        scale: how many times as large as the file says the facets are.

    Returns:
        Text of the display file under an empty name, and of the mesh under its own.
    """
    row = np.repeat(np.arange(facets.count), np.diff(facets.corner_start))
    corners = _carried(turns[row], facets.corners - middles[row]) + (middles + shifts)[row]
    up = _carried(turns, -normalized(facets.dv))
    if spec.panels is None:
        return mesh_display(spec, facets, corners, up, mesh, scale)
    facing = _carried(turns, facets.normal)
    middle = _carried(turns, _panel_middles(facets) - middles) + middles + shifts
    panels = [
        _panel(spec, facets, k, panel, middle[k], facing[k], up[k], scaled=scale != 1)
        for k, panel in enumerate(spec.panels)
    ]
    data: dict[str, Any] = {"quilt_display": 1, "panels": panels, "viewing_side": spec.viewing_side}
    if spec.corrections is not None:
        data["corrections"] = plain(spec.corrections, str)
    return {"": _HEAD + dump_yaml(data)}


def mesh_display(
    spec: DisplayFile,
    facets: Facets,
    corners: FloatArray,
    up: FloatArray,
    mesh: str,
    scale: float = 1.0,
) -> dict[str, str]:
    """Texts of a display of these polygons (C, 3), whose images have these directions (F, 3) up.

    They are so many times as large as the file says, and have as many pixels as there.
    """
    lines = [f"v {' '.join(f'{value:.12g}' for value in corner)}" for corner in corners.tolist()]
    if facets.uv is not None:
        lines += [f"vt {u!r} {v!r}" for u, v in facets.uv.tolist()]
    for first, last in zip(facets.corner_start[:-1], facets.corner_start[1:], strict=True):
        names = range(int(first) + 1, int(last) + 1)
        lines.append("f " + " ".join(f"{k}/{k}" if facets.uv is not None else str(k) for k in names))
    known = {facet: plain(own, str) for facet, own in spec.facets.items()}
    each = {}
    for k in range(facets.count):
        own = {name: value for name, value in known.get(k + 1, {}).items() if value not in ("", False)}
        if facets.names[k]:
            own = {"name": facets.names[k]} | own
        own.pop("rotate", None)  # the direction that is up says it all
        if own.get("enabled") is not False and not facets.enabled[k]:
            own["enabled"] = False
        elif facets.enabled[k]:
            own.pop("enabled", None)
        each[k + 1] = own | {"up": [round(value, 12) for value in up[k].tolist()]}
    data: dict[str, Any] = {"quilt_display": 1, "mesh": mesh, "viewing_side": spec.viewing_side}
    if spec.resolution is not None:
        data["resolution"] = plain(spec.resolution, str)
        if scale != 1 and spec.resolution.density is not None:
            data["resolution"] = {"pixels_per_metre": spec.resolution.density / scale}
    data["facets"] = each
    if spec.corrections is not None:
        data["corrections"] = plain(spec.corrections, str)
    if spec.layout is not None:
        data["layout"] = plain(spec.layout, str)
    return {"": _HEAD + dump_yaml(data), mesh: "\n".join(lines) + "\n"}


def panel_angles(facing: FloatArray, up: FloatArray) -> tuple[float, float, float]:
    """Yaw, pitch and roll in degrees of a panel that faces there, with this direction up."""
    x, y, z = facing.tolist()
    pitch = math.asin(max(-1.0, min(1.0, y)))
    # A panel that faces straight up or down has no yaw of its own.
    yaw = math.atan2(x, z) if math.hypot(x, z) > 1e-9 else 0.0
    level = np.array((math.cos(yaw), 0.0, -math.sin(yaw)))
    raised = np.cross(facing, level)
    roll = math.atan2(float(up @ level), float(up @ raised))
    return math.degrees(yaw), math.degrees(pitch), math.degrees(roll)


def display_name(path: Path) -> str:
    """Name of the mesh beside a display file."""
    return f"{path.stem}.obj"


def _panel(
    spec: DisplayFile,
    facets: Facets,
    row: int,
    panel: PanelSpec,
    middle: FloatArray,
    facing: FloatArray,
    up: FloatArray,
    *,
    scaled: bool,
) -> dict[str, Any]:
    """A panel's entry: what it was, elsewhere."""
    kept = plain(panel, str)
    entry = {name: kept[name] for name in ("name", "pixels") if kept[name]}
    if spec.transform is None and spec.metres == 1 and panel.pitch is not None and not scaled:
        entry["pitch"] = kept["pitch"]
    else:
        width, height = facets.size[row]
        sides = (
            math.sqrt(dot(facets.du[row], facets.du[row])) * width,
            math.sqrt(dot(facets.dv[row], facets.dv[row])) * height,
        )
        entry["size"] = [round(float(side), 9) for side in sides]
    entry["at"] = [round(value, 9) for value in middle.tolist()]
    angles = zip(("yaw_deg", "pitch_deg", "roll_deg"), panel_angles(facing, up), strict=True)
    entry |= {name: round(value, 9) for name, value in angles}
    entry |= {name: kept[name] for name in ("mirror", "place") if kept.get(name)}
    return entry | ({} if panel.enabled else {"enabled": False})


def _panel_middles(facets: Facets) -> FloatArray:
    """Middles (F, 3) of rectangles."""
    result: FloatArray = facets.corners.reshape(-1, 4, 3).mean(axis=1)
    return result


def _carried(turns: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) turned, one matrix (n, 3, 3) each."""
    result: FloatArray = (turns @ vectors[..., None])[..., 0]
    return result
