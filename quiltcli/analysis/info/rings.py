"""What a 360° light field display is, and a job for it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, number, size, vector
from quiltcli.job import job_sha256, load_job
from quiltcli.job.dump import plain
from quiltcli.job.frames import format_frames
from quiltcli.job.load import load_mirror_file
from quiltcli.job.mirror import MirrorDisplayFile
from quiltcli.ring.build import rig_of
from quiltcli.ring.rig import Rig
from quiltcli.ring.seen import slices_seen

_DISTANCES = (0.56, 1.0, 3.0, math.inf)


def mirror_info(path: Path) -> Info:
    """Projector, mirror and timing of such a display.

    Raises:
        JobError: the file is wrong.
    """
    display = load_mirror_file(path)
    rig = rig_of(display)
    pose, timing = rig.at(rig.first), display.timing
    seen = pose.to_world(np.zeros(3))
    pitch = _pitch(rig)
    data = {
        "path": str(path),
        "display": plain(display, str),
        "projector": (np.round(pose.eye, 12) + 0.0).tolist(),
        "projector_mirrored": (np.round(seen, 12) + 0.0).tolist(),
        "pixels_per_mm": pitch,
        "images_per_second": timing.images_a_second,
        "turns_per_second": timing.turns_a_second,
        "rpm": timing.rpm,
        "slices": {number(d): slices_seen(rig, d) for d in _DISTANCES if d < math.inf},
        "notices": list(timing.notices()),
    }
    return Info("display", data, list(_lines(display, rig, data)))


def _lines(display: MirrorDisplayFile, rig: Rig, data: dict[str, Any]) -> Iterator[tuple[str, str]]:
    outline, timing = display.mirror.outline, display.timing
    inferred = display.projector.height is not None
    yield "kind", "lightfield360: a projector above a spinning mirror"
    yield "picture", f"{size(display.image)} pixels of one bit, {number(data['pixels_per_mm'])} a millimetre"
    yield "projector", f"at {vector(data['projector'])} m" + " (ideal: on the axis, looking down)" * inferred
    yield "seen in the mirror", f"at {vector(data['projector_mirrored'])} m, at the first position"
    form = (
        f"disk of {outline.disk:g} m"
        if outline.disk
        else f"rectangle of {size(map(number, rig.rectangle))} m"  # type: ignore[arg-type]
    )
    sides = "one plane" if len(rig.sides) == 1 else "a tent of two planes"
    yield "mirror", f"{form}, tilted {number(display.mirror.tilt_deg)}°, {sides}"
    rotation, lobe = display.rotation, display.diffuser.horizontal_deg
    yield (
        "rotation",
        f"{rotation.positions} positions, {rotation.direction}, {number(360 / rotation.positions)}° each",
    )
    yield "diffuser", f"{number(lobe)}° to the sides, light leaves in a {display.diffuser.reflection}"
    slices = [f"{number(slices_seen(rig, d))} at {d:g} m" for d in _DISTANCES[:3]]
    yield "positions seen", f"{', '.join(slices)}, {number(slices_seen(rig, 1e9))} from far away"
    yield "packing", f"{timing.planes} pictures in one, {display.packing.order}, {display.packing.bits} first"
    rate = f"{number(timing.refresh)} Hz, {number(timing.images_a_second)} pictures and"
    yield "timing", f"{rate} {number(timing.turns_a_second)} turns a second, {number(timing.rpm)} a minute"
    for notice in data["notices"]:
        yield "note", notice


def _pitch(rig: Rig) -> float:
    """Pixels a millimetre at the mirror's middle."""
    matrix = rig.sides[0].projector
    here, there = (matrix @ [x, 0.0, 0.0, 1.0] for x in (-5e-4, 5e-4))
    return float(np.linalg.norm(here[:2] / here[2] - there[:2] / there[2]))


def ring_job_info(path: Path) -> Info:
    """Every value of a job with a ring of viewers, defaults included.

    Raises:
        JobError: the job or its display is wrong.
    """
    job = load_job(path)
    assert job.ring is not None
    display = load_mirror_file(job.display)
    rig = rig_of(display)
    elevation = math.degrees(math.atan2(job.ring.height, job.ring.distance))
    values = plain(job, str) | {"frames": format_frames(job.frames)}
    data = {
        "path": str(path),
        "job": values,
        "frame_count": len(job.frames),
        "seconds": len(job.frames) / display.timing.turns_a_second,
        "elevation_deg": elevation,
        "slices": slices_seen(rig, job.ring.distance),
        "sha256": job_sha256(job),
    }
    lines = [
        ("display", str(job.display)),
        ("scene", str(job.scene)),
        ("frames", f"{len(job.frames)}, a turn of {rig.positions} positions each"),
        (
            "ring",
            f"{number(job.ring.height)} m high, {number(job.ring.distance)} m away: {elevation:.1f}° up",
        ),
        ("tracked", f"{len(job.ring.users)} users" if job.ring.heads is None else str(job.ring.heads.csv)),
        ("positions seen", f"{data['slices']:.1f} from the ring"),
        ("method", job.render.method),
        ("hash", str(data["sha256"])),
    ]
    if not rig.cone and abs(elevation) > 15:
        lines.append(
            ("note", "light leaves in planes, which is off by over half a pixel this high: try a cone")
        )
    return Info("job", data, lines)
