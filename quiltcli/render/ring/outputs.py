"""The files of a turn beside its packed pictures: light of every position, settings, the report."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli import __version__
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.formats.whole import write_text
from quiltcli.images.names import frame_digits
from quiltcli.job import dump_job, dump_yaml
from quiltcli.job.dump import plain
from quiltcli.render.ring.setup import RingStage
from quiltcli.ring.curve import Curve
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.picture import Counts, Picture, Show
from quiltcli.shading.mattes import matte_attributes

_FORMAT = 1


def tones_path(folder: Path, turn: int, position: int, side: int = 0) -> Path:
    """File of a position's light: turn and position from 0, told from 1."""
    part = f".side{side + 1}" if side else ""
    return folder / "tones" / f"turn_{turn + 1:04d}{part}.{frame_digits(position + 1)}.exr"


def write_tones(
    path: Path, stage: RingStage, show: Show, picture: Picture, frame: int, position: int, job_sha: str
) -> None:
    """Write the light of one side at one position (OutputError)."""
    height, width = picture.lit.shape
    channels = {name: values.reshape(height, width) for name, values in picture.buffers.items()}
    projector = " ".join(repr(float(number)) for number in picture.pose.projector.reshape(12))
    attributes: dict[str, object] = {
        "framesPerSecond": stage.job.fps,
        "quilt:frame": frame,
        "quilt:near": show.near,
        "quilt:far": show.far,
        "quilt:depth": "radial",
        "quilt:job": job_sha,
        "quilt:version": __version__,
        "quilt:mirror_deg": math.degrees(stage.rig.angle(position)),
        "quilt:projector": projector,
        "quilt:viewers": json.dumps(viewers_json(show.curve)),
        "quilt:reflection": stage.display.diffuser.reflection,
        **matte_attributes(show.scene, stage.job.output.channels),
    }
    write_exr(path, channels, attributes, stage.job.output.compression)


def read_tones(folder: Path, stage: RingStage, turn: int, position: int, side: int) -> Picture:
    """The light of one side at one position, as `write_tones` has written it (OutputError)."""
    found = read_exr(tones_path(folder, turn, position, side)).channels
    pose = stage.rig.at(stage.rig.angle(position), side)
    buffers = {name: values.reshape(-1) for name, values in found.items()}
    return Picture(pose, lit_pixels(stage.rig, pose), buffers, Counts())


def viewers_json(curve: Curve) -> dict[str, Any]:
    """The viewers for programs."""
    users = [
        {
            "azimuth_deg": math.degrees(user.azimuth),
            "height": user.height,
            "distance": user.distance,
            "hold_deg": math.degrees(user.hold),
            "blend_deg": math.degrees(user.blend),
        }
        for user in curve.users
    ]
    return {"height": curve.height, "distance": curve.distance, "users": users}


def write_settings(stage: RingStage, folder: Path) -> None:
    """Write the display and the job as they were resolved (OutputError)."""
    data = plain(stage.display, lambda path: path.absolute().as_posix())
    data["projector"] = {"matrix": stage.rig.sides[0].projector.tolist()}
    pose = stage.rig.at(stage.rig.first)
    seen = np.round(pose.to_world(np.zeros(3)), 12) + 0.0
    head = f"# P' at the first position: {seen.tolist()} m\n"
    write_text(folder / "display.yaml", head + dump_yaml(data))
    job = stage.job.model_copy(update={"display": folder / "display.yaml"})
    write_text(folder / "job.yaml", dump_job(job, folder))


def read_report(folder: Path, job_sha: str) -> dict[int, dict[str, Any]]:
    """Frames of a folder's report by number, as far as they are of the same job."""
    try:
        data = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        if data["job"] != job_sha:
            return {}
        return {int(entry["frame"]): entry for entry in data["frames"]}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def write_report(
    folder: Path, stage: RingStage, job_sha: str, frames: Mapping[int, Mapping[str, Any]]
) -> None:
    """Write `report.json` (OutputError)."""
    timing = stage.display.timing
    data = {
        "quilt_report": _FORMAT,
        "version": __version__,
        "job": job_sha,
        "kind": "lightfield360",
        "timing": {
            "refresh": timing.refresh,
            "images_per_second": timing.images_a_second,
            "turns_per_second": timing.turns_a_second,
            "rpm": timing.rpm,
        },
        "frames": [frames[frame] for frame in sorted(frames)],
    }
    write_text(folder / "report.json", json.dumps(data, indent=2, allow_nan=False) + "\n")
