"""What a job is: its values as resolved, and where its viewer goes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, bounds, bounds_text, counted, number, vector
from quiltcli.display import Facets, lit_facets, load_display
from quiltcli.geometry import FloatArray
from quiltcli.job import job_sha256, load_display_file, load_job
from quiltcli.job.dump import plain
from quiltcli.job.frames import format_frames
from quiltcli.viewer.view import viewers_of
from quiltcli.viewer.viewer import Viewer


def job_info(path: Path) -> Info:
    """Every value of a job, defaults included, and its viewer's path over all frames.

    Raises:
        JobError, ViewerError, MeshError, DisplayError: the job, its path or its display is wrong.
    """
    job = load_job(path)
    if job.ring is not None:
        from quiltcli.analysis.info.mirrors import ring_job_info

        return ring_job_info(path, job)
    viewers = viewers_of(job, job.frames)
    table = _frame_table(viewers, load_display(load_display_file(job.display)))
    eyes = np.stack([viewer.eye for viewer in viewers])
    length = _longest_way(viewers)
    values = plain(job, str) | {"frames": format_frames(job.frames)}
    data = {
        "path": str(path),
        "job": values,
        "frame_count": len(job.frames),
        "seconds": float(len(job.frames) / job.fps),
        "path_length_m": length,
        "eye_bounds": bounds(eyes),
        "sha256": job_sha256(job),
        "frames": table,
    }
    lines = [
        *value_lines(values),
        ("length", f"{counted(len(job.frames), 'frame')}, {number(data['seconds'])} s"),
        ("eye's way", f"{number(length)} m"),
        ("eye's bounds", bounds_text(data["eye_bounds"])),
        ("hash", data["sha256"]),
    ]
    columns = ("frame", "eye", "look", "lit facets")
    return Info("job", data, lines, columns, [_row(entry) for entry in table])


def _longest_way(viewers: Sequence[Viewer]) -> float:
    """How far a head moves over the frames, metres: of several people's, the farthest."""
    ways: dict[str, dict[int, FloatArray]] = {}
    for viewer in viewers:
        place = viewer.eye if viewer.head is None else viewer.head
        ways.setdefault(viewer.name, {})[viewer.frame] = place
    steps = ([np.linalg.norm(b - a) for a, b in pairwise(way.values())] for way in ways.values())
    return max(float(sum(each)) for each in steps)


def _frame_table(viewers: list[Viewer], facets: Facets) -> list[dict[str, Any]]:
    return [
        {
            "frame": viewer.frame,
            "eye": viewer.eye.tolist(),
            "look": viewer.look.tolist(),
            "up": viewer.up.tolist(),
            "lit_facets": int(np.count_nonzero(lit_facets(facets, viewer.eye))),
        }
        for viewer in viewers
    ]


def _row(entry: dict[str, Any]) -> list[str]:
    return [str(entry["frame"]), vector(entry["eye"]), vector(entry["look"]), str(entry["lit_facets"])]


def value_lines(values: Any, above: str = "") -> Iterator[tuple[str, str]]:
    """Dotted key and value of everything the job says, keyframes counted."""
    for key, value in values.items():
        name = f"{above}.{key}" if above else key
        if isinstance(value, dict):
            yield from value_lines(value, name)
        elif key == "keyframes":
            yield name, counted(len(value), "keyframe")
        elif above or key not in ("quilt_job",):
            yield name, _text(value)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return number(value) if isinstance(value, float) else str(value)
