"""What files of a display with a spinning mirror are: light fields and calibrations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, counted, number
from quiltcli.calibration import clicks
from quiltcli.job import load_lightfield_file
from quiltcli.lightfield import load_field


def calibration_info(path: Path) -> Info:
    """The projector that a calibration file gives, and by how much its points are off.

    Raises:
        JobError, DisplayError: the file is wrong, or its points leave the projector open.
    """
    file, found = clicks.calibrate_file(path)
    data: dict[str, Any] = {"path": str(path), **clicks.figures(found)}
    return Info("calibration", data, clicks.lines(found), clicks.COLUMNS, clicks.rows(file, found))


def lightfield_info(path: Path) -> Info:
    """Cameras and pictures of a light field.

    Raises:
        JobError: the file is wrong, or pictures are missing.
    """
    file = load_lightfield_file(path)
    field = load_field(file, () if file.is_animated else (1,))
    cameras = field.cameras
    width, height = cameras.lens.size
    steps = [_widest(row.azimuth) for row in cameras.rows]
    data: dict[str, Any] = {
        "path": str(path),
        "rows": [
            {"height": row.height, "views": len(row.azimuth), "widest_step_deg": step}
            for row, step in zip(cameras.rows, steps, strict=True)
        ],
        "distance": cameras.distance,
        "size": [width, height],
        "focal": cameras.lens.focal.tolist(),
        "centre": cameras.lens.centre.tolist(),
        "animated": file.is_animated,
        "focus": file.focus,
        "slices": file.slices,
    }
    views = sum(len(row.azimuth) for row in cameras.rows)
    focal = cameras.lens.focal[0]
    lines = [
        ("cameras", f"{views:,} in {counted(len(cameras.rows), 'row')}, {number(cameras.distance)} m away"),
        ("pictures", f"{width}×{height}, {'of every frame' if file.is_animated else 'still'}"),
        ("at the axis", f"{number(1000 * cameras.distance / focal)} mm a pixel"),
        ("focus", file.focus),
        ("rows are", {"linear": "blended", "nearest": "the nearest one"}.get(file.slices, file.slices)),
    ]
    rows = [
        [str(i), number(row.height), f"{len(row.azimuth):,}", f"{step:.4g}"]
        for i, (row, step) in enumerate(zip(cameras.rows, steps, strict=True), start=1)
    ]
    return Info("lightfield", data, lines, ("row", "height m", "views", "widest step deg"), rows)


def _widest(azimuth: Any) -> float:
    """The widest gap between neighbours, degrees."""
    turn = np.concatenate((azimuth, azimuth[:1] + 2 * np.pi))
    return float(np.degrees(np.diff(turn).max()))
