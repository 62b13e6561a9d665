"""What a 360° light field display is, a job for one, and the output of such a job."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, counted, number, vector
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.capacity import bytes_text
from quiltcli.formats.inputs import read_input
from quiltcli.job import JobFile, job_sha256
from quiltcli.job.dump import plain
from quiltcli.job.frames import format_frames
from quiltcli.job.load import load_mirror_file
from quiltcli.job.mirror import KIND
from quiltcli.ring.build import rig_of
from quiltcli.ring.elevation import plane_error
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.rig import Pose, Rig
from quiltcli.ring.seen import slices_seen

DISTANCES = (0.56, 1.0, 3.0, math.inf)
"""How far from the axis people are told about, metres."""


def mirror_info(path: Path) -> Info:
    """Projector, mirror and timing of a display with a spinning mirror.

    Raises:
        JobError, DisplayError: the file is wrong, or its calibration leads to nothing.
    """
    display = load_mirror_file(path)
    rig = rig_of(display)
    timing, pose = display.timing, rig.at(rig.first)
    image = pose.to_world(np.zeros(3))
    lit = int(np.count_nonzero(lit_pixels(rig, pose)))
    data: dict[str, Any] = {
        "path": str(path),
        "kind": KIND,
        "image": list(rig.size),
        "projector": {"position": pose.eye.tolist(), "matrix": pose.projector.tolist()},
        "mirror_image": image.tolist(),
        "pixels_per_mm": pixels_per_mm(rig, pose),
        "lit_pixels": lit,
        "sides": len(rig.sides),
        "tilt_deg": math.degrees(rig.tilt),
        "radius": rig.radius,
        "positions": rig.positions,
        "lobe_deg": math.degrees(rig.lobe),
        "reflection": display.diffuser.reflection,
        "slices": {number(distance): slices_seen(rig, distance) for distance in DISTANCES[:-1]}
        | {"far": slices_seen(rig, math.inf)},
        "timing": {
            "refresh": timing.refresh,
            "images_per_second": timing.images_a_second,
            "turns_per_second": timing.turns_a_second,
            "rpm": timing.rpm,
        },
        "notices": list(timing.notices()),
    }
    share = lit / (rig.size[0] * rig.size[1])
    lines = [
        ("kind", KIND),
        ("image", f"{rig.size[0]}×{rig.size[1]}, {100 * share:.0f} % of it on the mirror"),
        ("projector", f"at {_place(pose.eye)} m; seen in the mirror at {_place(image)} m"),
        ("at the axis", f"{data['pixels_per_mm']:.3g} pixels a millimetre"),
        (
            "mirror",
            f"{_sides(len(rig.sides))}, tilted {number(data['tilt_deg'])}°, to {number(rig.radius)} m",
        ),
        ("reaches", f"{number(rig.radius)} m from the axis"),
        ("diffuser", f"{number(data['lobe_deg'])}°, {display.diffuser.reflection}"),
        ("positions", f"{rig.positions:,}, {display.rotation.direction}"),
        ("an eye sees", ", ".join(_seen(rig, distance) for distance in DISTANCES)),
        ("timing", _timing_text(data["timing"])),
        *(("note", notice) for notice in data["notices"]),
    ]
    return Info("display", data, lines)


def pixels_per_mm(rig: Rig, pose: Pose) -> float:
    """Pixels a millimetre across, where the axis meets the mirror."""
    middle = pose.projector @ [0.0, pose.ridge, 0.0, 1.0]
    aside = pose.projector @ [0.001, pose.ridge, 0.0, 1.0]
    return float(np.hypot(*(aside[:2] / aside[2] - middle[:2] / middle[2])))


def ring_job_info(path: Path, job: JobFile) -> Info:
    """Every value of a job with a ring of viewers."""
    from quiltcli.analysis.info.jobs import value_lines

    display = load_mirror_file(job.display)
    rig = rig_of(display)
    values = plain(job, str) | {"frames": format_frames(job.frames)}
    turns = len(job.frames)
    data = {
        "path": str(path),
        "job": values,
        "frame_count": turns,
        "positions": turns * rig.positions,
        "packed": turns * -(-rig.positions // display.packing.images) * len(rig.streams),
        "sha256": job_sha256(job),
    }
    lines = list(value_lines(values))
    if job.ring is not None and not rig.cone:
        off = plane_error(rig, job.ring.distance, job.ring.height)
        data["plane_error"] = off
        lines.append(("planes are off by", f"{off:.2g} pixels rms on the ring (0 with reflection: cone)"))
    lines += [
        ("length", f"{counted(turns, 'turn')}, {counted(int(data['positions']), 'mirror position')}"),
        ("files", counted(int(data["packed"]), "packed picture")),
        ("hash", str(data["sha256"])),
    ]
    return Info("job", data, lines)


def ring_output_info(path: Path) -> Info:
    """Turns and pictures in the output folder of such a job.

    Raises:
        OutputError: its report cannot be read.
    """
    try:
        report = json.loads(read_input(path / "report.json", OutputError))
        entries = [(int(entry["frame"]), entry) for entry in report["frames"]]
        timing = report["timing"]
        rows = [
            [
                str(frame),
                f"{entry['positions']:,}",
                f"{entry['visible_pixels']:,}",
                f"{entry['seconds']['turn']:.2f}",
            ]
            for frame, entry in entries
        ]
        text = _timing_text(timing)
    except (ValueError, KeyError, TypeError, RecursionError):
        raise OutputError(Problem("is no report of a render", file=str(path / "report.json"))) from None
    packed, tones = (
        sorted((path / name).glob(f"*.{kind}")) for name, kind in (("packed", "png"), ("tones", "exr"))
    )
    data = {
        "path": str(path),
        "kind": KIND,
        "frames": [frame for frame, _ in entries],
        "packed": len(packed),
        "tones": len(tones),
        "bytes": sum(file.stat().st_size for file in (*packed, *tones)),
        "timing": timing,
    }
    lines = [
        ("kind", KIND),
        ("turns", f"{format_frames(data['frames'])} ({len(entries):,})" if entries else "none"),
        ("pictures", f"{counted(len(packed), 'packed picture')}, {counted(len(tones), 'image')} of tones"),
        ("size", bytes_text(int(data["bytes"]))),
        ("timing", text),
    ]
    return Info("output", data, lines, ("frame", "mirror positions", "pixels that show it", "seconds"), rows)


def _place(point: Any) -> str:
    return vector((np.round(point, 9) + 0.0).tolist())


def _sides(count: int) -> str:
    return "one plane" if count == 1 else f"a tent of {count} planes"


def _seen(rig: Rig, distance: float) -> str:
    where = f"at {number(distance)} m" if math.isfinite(distance) else "far away"
    return f"{slices_seen(rig, distance):.1f} pictures {where}"


def _timing_text(timing: dict[str, float]) -> str:
    return (
        f"{number(timing['refresh'])} Hz, {number(timing['images_per_second'])} pictures and "
        f"{number(timing['turns_per_second'])} turns a second, {number(timing['rpm'])} rpm"
    )
