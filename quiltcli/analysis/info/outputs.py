"""What an output folder is: the frames that a render has left in it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from quiltcli.analysis.info.record import Info, counted
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.capacity import bytes_text
from quiltcli.formats.inputs import is_regular, read_input
from quiltcli.images.names import names_in
from quiltcli.images.turns import is_ring_output
from quiltcli.job.frames import format_frames


def output_info(path: Path) -> Info:
    """Frames, images and warnings of a render.

    Raises:
        OutputError: nothing in the folder says that a render wrote it.
    """
    if not (is_regular(path / "job.yaml") and is_regular(path / "report.json")):
        words = (
            "is a directory without a render in it (expected a file, or one with job.yaml and report.json)"
        )
        raise OutputError(Problem(words, file=str(path)))
    if is_ring_output(path):
        from quiltcli.analysis.info.mirrors import ring_output_info

        return ring_output_info(path)
    entries = _entries(path / "report.json")
    found = list(names_in(path).found(path))
    names, images = [name for name, _ in found], [file for _, file in found]
    counts = Counter(name.kind for name in names)
    frames = sorted({name.frame for name in names})
    size = sum(file.stat().st_size for file in images)
    reported = sorted({int(entry["frame"]) for entry in entries})
    warnings = [f"frame {entry['frame']}: {text}" for entry in entries for text in entry["warnings"]]
    data = {
        "path": str(path),
        "frames": frames,
        "reported_frames": reported,
        "images": {kind: counts[kind] for kind in ("page", "facet")},
        "bytes": size,
        "warnings": warnings,
    }
    lines = [
        ("frames", f"{format_frames(frames)} ({len(frames):,})" if frames else "none"),
        ("reported", format_frames(reported) or "none"),
        ("images", f"{counted(counts['page'], 'page')}, {counted(counts['facet'], 'facet image')}"),
        ("size", bytes_text(size)),
        ("job", str(path / "job.yaml")),
        *(("warning", text) for text in warnings),
    ]
    columns = ("frame", "lit facets", "pixels that show it", "seconds")
    rows = [
        [str(entry["frame"]), *(f"{entry[key]:,}" for key in ("lit_facets", "visible_pixels")),
         f"{entry['wall_seconds']:.2f}"]
        for entry in entries
    ]  # fmt: skip
    return Info("output", data, lines, columns, rows)


_FIELDS: dict[str, Any] = {
    "frame": int,
    "lit_facets": int,
    "visible_pixels": int,
    "wall_seconds": (int, float),
    "warnings": list,
}


def _entries(path: Path) -> list[dict[str, Any]]:
    """Records of the frames in a report (OutputError)."""
    try:
        entries = json.loads(read_input(path, OutputError))["frames"]
        good = all(isinstance(entry[key], kind) for entry in entries for key, kind in _FIELDS.items())
    except (ValueError, KeyError, TypeError, RecursionError):
        entries, good = [], False
    if not good:
        raise OutputError(Problem("is no report of a render", file=str(path)))
    return list(entries)
