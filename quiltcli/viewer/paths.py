"""The kinds of viewer path: a pose for every frame number, from keyframes, a circle or a recording.

A row of `PATHS` is all a new kind needs here; its keys stand in the job's models.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.formats.yaml.source import Source
from quiltcli.geometry import FloatArray, normalized, quaternions
from quiltcli.geometry.interpolation import TURNINGS, VALUES, arc, linear
from quiltcli.job import CsvSpec, KeyframeSpec, OrbitSpec, PathSpec, RecordedSpec
from quiltcli.viewer.recorded.head import pose_of, read_head
from quiltcli.viewer.recorded.rows import Track, read_track


@dataclass(frozen=True)
class Pose:
    """Eye (3,), metres; direction of view and up (3,), neither unit nor orthogonal yet; key to blame.

    A path that says nothing of a direction has none for `look`; then its words are in `unaimed`.
    """

    eye: FloatArray
    look: FloatArray | None
    up: FloatArray
    blame: tuple[str | int, ...]
    unaimed: str = ""


def _turned(eye: FloatArray, rotation: FloatArray, blame: tuple[str | int, ...]) -> Pose:
    """Pose of a head that is turned so: unturned it looks along −Z, with +Y up."""
    look, up = quaternions.rotated(rotation, np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))
    return Pose(eye, look, up, blame)


def keyframe_pose(path: PathSpec, frame: float, fps: float) -> Pose:
    """Pose between keyframes; before the first and after the last the ends are held."""
    numbered = sorted(enumerate(path.keyframes or ()), key=lambda item: item[1].frame)
    frames = np.array([key.frame for _, key in numbered], dtype=np.float64)
    keys = [key for _, key in numbered]
    # Points aimed at are interpolated as points; only directions are as directions.
    values = np.array([[*key.position, *_aim(key), *key.up] for key in keys])
    kind = path.interpolation or "linear"
    row = VALUES[kind](frames, values, float(frame))
    eye, aim, up = row[0:3], row[3:6], row[6:9]
    before = max(int(np.searchsorted(frames, frame, side="right")) - 1, 0)
    blame = ("keyframes", numbered[before][0])
    if keys[0].aim == "orientation":
        turns = quaternions.continuous(quaternions.unit(np.array([key.orientation for key in keys])))
        return _turned(eye, TURNINGS[kind](frames, turns, frame), blame)
    if not keys[0].aim:
        return Pose(eye, None, up, blame, "says no direction of view (give look_at, look or orientation)")
    return Pose(eye, aim if keys[0].look is not None else aim - eye, up, blame)


def _aim(key: KeyframeSpec) -> FloatArray:
    """Point looked at, or the unit direction of view."""
    if key.look is not None:
        return normalized(np.asarray(key.look))
    return np.asarray(key.look_at or key.position, dtype=np.float64)


def orbit_pose(path: PathSpec, frame: float, fps: float) -> Pose:
    """Pose on a circle: 0° is on the +Z side of the centre, 90° on the +X side."""
    orbit = path.orbit
    assert orbit is not None
    angle = math.radians(_orbit_degrees(orbit, frame))
    level, height = orbit.radius, orbit.height or 0.0
    if orbit.elevation_deg is not None:
        elevation = math.radians(orbit.elevation_deg)
        level, height = orbit.radius * math.cos(elevation), orbit.radius * math.sin(elevation)
    center = np.asarray(orbit.center, dtype=np.float64)
    eye = center + np.array([level * math.sin(angle), height, level * math.cos(angle)])
    target = center if orbit.look_at is None else np.asarray(orbit.look_at, dtype=np.float64)
    return Pose(eye, target - eye, np.asarray(orbit.up, dtype=np.float64), ("orbit",))


def _orbit_degrees(orbit: OrbitSpec, frame: float) -> float:
    """Angle of a frame, degrees."""
    passed = frame - orbit.start_frame
    if orbit.frames_per_turn is not None:
        # Reduced first: frame 1000001 of a hundred-frame turn is to the bit frame 1.
        return orbit.start_deg + 360 * (math.fmod(passed, orbit.frames_per_turn) / orbit.frames_per_turn)
    assert orbit.end_frame is not None
    assert orbit.end_deg is not None
    share = min(max(passed / (orbit.end_frame - orbit.start_frame), 0.0), 1.0)
    return orbit.start_deg + (orbit.end_deg - orbit.start_deg) * share


def csv_pose(path: PathSpec, frame: float, fps: float) -> Pose:
    """Pose of a recorded frame; a frame that was not recorded is an error, unless gaps may be filled."""
    spec = path.csv
    assert spec is not None
    track = read_track(spec.file)
    blame = path.source.at("csv")
    row = _track_row(spec, track, frame, blame)
    eye = row[0:3] * spec.metres
    if track.rotations is not None:
        return _turned(eye, arc(track.frames.astype(np.float64), track.rotations, frame), ("csv",))
    up = row[-3:] if track.has_up else np.asarray(spec.up, dtype=np.float64)
    if track.aim == "look_at":
        return Pose(eye, row[3:6] * spec.metres - eye, up, ("csv",))
    if track.aim == "look":
        return Pose(eye, row[3:6], up, ("csv",))
    return _given_aim(spec, eye, up, ("csv",))


def _given_aim(spec: CsvSpec | RecordedSpec, eye: FloatArray, up: FloatArray, blame: tuple[str]) -> Pose:
    """Pose with the direction of view from the job, for files that hold positions only."""
    if spec.look is not None:
        return Pose(eye, np.asarray(spec.look, dtype=np.float64), up, blame)
    if spec.look_at is not None:
        return Pose(eye, np.asarray(spec.look_at, dtype=np.float64) - eye, up, blame)
    words = f"{spec.file} holds positions only (add look_at, a point, or look, a direction)"
    return Pose(eye, None, up, blame, words)


def _track_row(spec: CsvSpec, track: Track, frame: float, blame: Source) -> FloatArray:
    """Numbers of a frame, from its row or from between two rows."""
    at = int(np.searchsorted(track.frames, frame))
    if at < track.frames.size and track.frames[at] == frame:
        row: FloatArray = track.values[at]
        return row
    first, last = int(track.frames[0]), int(track.frames[-1])
    if not first < frame < last:
        words = f"frame {frame:g} is not in {spec.file} (it holds frames {first} to {last})"
        raise ViewerError(blame.problem((), words))
    if not spec.fill:
        before, after = int(track.frames[at - 1]), int(track.frames[at])
        words = f"frame {frame:g} is missing between {before} and {after} (add it, or set fill: true)"
        raise ViewerError(track.problem(at, words))
    return linear(track.frames.astype(np.float64), track.values, float(frame))


def recorded_pose(path: PathSpec, frame: float, fps: float) -> Pose:
    """Pose of a take at the second that a frame shows."""
    spec = path.recorded
    assert spec is not None
    head = read_head(spec)
    seconds = spec.start + (frame - spec.start_frame) / fps
    eye, rotation = pose_of(head, spec, seconds, fps)
    if rotation is None or spec.look is not None or spec.look_at is not None:
        return _given_aim(spec, eye, np.asarray(spec.up, dtype=np.float64), ("recorded",))
    return _turned(eye, rotation, ("recorded",))


PATHS: dict[str, Callable[[PathSpec, float, float], Pose]] = {
    "keyframes": keyframe_pose,
    "orbit": orbit_pose,
    "csv": csv_pose,
    "recorded": recorded_pose,
}
