"""`quilt calibrate`: what a calibration says, and the display file that comes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display.clicks import Calibration, calibrate
from quiltcli.errors import CheckFailedError, OutputError, Problem
from quiltcli.formats.whole import write_text
from quiltcli.formats.yaml.source import read_yaml
from quiltcli.job import dump_yaml, load_calibration_file
from quiltcli.job.calibration import CalibrationFile

COLUMNS = ("point", "name", "seen at", "lit at", "off by px")
HEAD = "# The projector stands where quilt calibrate has found it; what is lit of the mirror is to be set.\n"
_DISK = 0.13  # metres: the mirror of the paper


def calibrate_file(path: Path) -> tuple[CalibrationFile, Calibration]:
    """Read a calibration file and find the projector (JobError, DisplayError)."""
    file = load_calibration_file(path)
    return file, calibrate(file)


def figures(found: Calibration) -> dict[str, Any]:
    """All that was found, for programs."""
    projector, deviation = found.projector, found.deviation
    return {
        "matrix": projector.matrix.tolist(),
        "focal": projector.focal,
        "focal_deviation": float(deviation[0]),
        "centre": projector.centre.tolist(),
        "centre_deviation": deviation[1:3].tolist(),
        "rotation": projector.rotation.tolist(),
        "rotation_deviation_deg": np.degrees(deviation[3:6]).tolist(),
        "position": projector.position.tolist(),
        "position_deviation": deviation[6:].tolist(),
        "mirrored": projector.mirrored,
        "rms": found.rms,
        "errors": found.errors.tolist(),
    }


def lines(found: Calibration) -> list[tuple[str, str]]:
    """What was found, for people."""
    projector, deviation = found.projector, found.deviation
    x, height, z = projector.position
    worst = found.distances.max()
    aside = float(np.hypot(*deviation[[6, 8]]))
    centre = f"({projector.centre[0]:.2f}, {projector.centre[1]:.2f})"
    return [
        ("focal length", f"{projector.focal:.2f} px{_give_or_take(deviation[0], 'px')}"),
        ("centre", f"{centre} px{_give_or_take(float(np.hypot(*deviation[1:3])), 'px')}"),
        ("height", f"{height:.5f} m{_give_or_take(1000 * deviation[7], 'mm')}"),
        ("aside", f"({1000 * x:.2f}, {1000 * z:.2f}) mm{_give_or_take(1000 * aside, 'mm')}"),
        ("image", "mirrored left to right" if projector.mirrored else "not mirrored"),
        ("points", f"{len(found.points)}, off by {found.rms:.3g} px rms, {worst:.3g} at most"),
    ]


def _give_or_take(deviation: float, unit: str) -> str:
    return f" ± {deviation:.2g} {unit}" if deviation > 0 else ""


def rows(file: CalibrationFile, found: Calibration) -> list[list[str]]:
    """The points, worst first, as rows of a table."""
    table = []
    for i in np.argsort(-found.distances, kind="stable"):
        seen = np.array(file.points[i].pixel)
        lit = seen + found.errors[i]
        texts = (f"({x:.2f}, {y:.2f})" for x, y in (seen, lit))
        table.append([str(i + 1), file.points[i].name, *texts, f"{found.distances[i]:.3f}"])
    return table


def within(path: Path, found: Calibration, tolerance: float) -> None:
    """Raise CheckFailedError where points are off by more than a tolerance, pixels rms."""
    if found.rms > tolerance:
        worst = int(np.argmax(found.distances)) + 1
        words = f"points are off by {found.rms:.3g} px rms, more than {tolerance:g} (worst: point {worst})"
        raise CheckFailedError(Problem(words, file=str(path)))


def write_display(path: Path, file: CalibrationFile, found: Calibration, *, overwrite: bool = False) -> None:
    """Write a display file with the projector; one that exists keeps its other keys.

    Raises:
        OutputError: the file is there and was not to be replaced, or cannot be written.
        JobError: it is there and is no YAML file.
    """
    data: dict[str, Any] = {"quilt_display": 1, "kind": "lightfield360"}
    if path.exists():
        if not overwrite:
            wanted = "exists already, expected to be told to overwrite it (its projector is replaced)"
            raise OutputError(Problem(wanted, file=str(path)))
        data, _ = read_yaml(path)
        if data.get("kind") != "lightfield360":
            words = "is no display of the kind lightfield360, whose projector could be replaced"
            raise OutputError(Problem(words, file=str(path)))
    else:
        data["mirror"] = {"tilt_deg": file.tilt_deg, "outline": {"disk": _DISK}}
    data["image"] = list(file.image)
    data["projector"] = {"matrix": found.projector.matrix.tolist()}
    write_text(path, HEAD + dump_yaml(data))
