"""From the models of the YAML files to projector, mirror and viewers."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from quiltcli.display.clicks import calibrate
from quiltcli.errors import JobError, Problem, ViewerError, raise_all
from quiltcli.formats.bitplanes import STREAMS
from quiltcli.formats.inputs import check_input
from quiltcli.geometry import FloatArray
from quiltcli.job import load_calibration_file
from quiltcli.job.mirror import MirrorDisplayFile
from quiltcli.job.ring import RingSpec
from quiltcli.ring.curve import Curve, User, overlapping
from quiltcli.ring.rig import Rig, Side, ideal_projector

_COLUMNS = ("frame", "user", "x", "y", "z")


def rig_of(display: MirrorDisplayFile) -> Rig:
    """Projector and mirror of a display file.

    Raises:
        JobError, DisplayError: a calibration file is wrong, or its points leave the projector open.
    """
    turn = -1 if display.rotation.direction == "decreasing" else 1
    outline, own = display.mirror.outline, _projector(display)
    sides = [Side(0.0, 0.0, own)]
    if display.sides is not None:
        sides = [
            Side(
                math.radians(side.azimuth_deg),
                side.ridge,
                own if side.matrix is None else np.array(side.matrix),
                side.filter,
            )
            for side in display.sides
        ]
    return Rig(
        size=display.image,
        sides=tuple(sides),
        tilt=math.radians(display.mirror.tilt_deg),
        disk=outline.disk or 0.0,
        rectangle=outline.rectangle or (0.0, 0.0),
        positions=display.rotation.positions,
        first=math.radians(display.rotation.first_deg),
        step=turn * 2 * math.pi / display.rotation.positions,
        lobe=math.radians(display.diffuser.horizontal_deg),
        cone=display.diffuser.reflection == "cone",
        streams=STREAMS if display.filters else ("",),
    )


def _projector(display: MirrorDisplayFile) -> FloatArray:
    """K[R | −RP] (3, 4)."""
    spec = display.projector
    if spec.matrix is not None:
        return np.array(spec.matrix)
    if spec.height is not None and spec.diameter is not None:
        return ideal_projector(display.image, spec.height, spec.diameter)
    assert spec.calibration is not None
    clicks = load_calibration_file(spec.calibration)
    if clicks.image != display.image:
        sizes = (f"{width} × {height}" for width, height in (clicks.image, display.image))
        words = "{} is for an image of {} pixels, and the display has {}".format(spec.calibration, *sizes)
        raise JobError(spec.source.problem(("calibration",), words))
    return calibrate(clicks).projector.matrix


def curve_of(ring: RingSpec, frame: int, rig: Rig) -> Curve:
    """Where the viewers of a frame are.

    Raises:
        ViewerError: users who contradict one another, or a curve that some pixel would meet twice.
    """
    users = tuple(_users(ring, frame))
    problems = []
    if pair := overlapping(users):
        words = "hold azimuths that overlap, and stand at different places"
        names = " and ".join(f"users[{i}]" for i in pair) if ring.users else "two heads"
        key = ("users", pair[1]) if ring.users else ("heads",)
        problems.append(ring.source.problem(key, f"at frame {frame}, {names} {words}"))
    curve = Curve(ring.height, ring.distance, users)
    if not problems and curve.too_steep(rig.radius):
        words = (
            f"at frame {frame} the viewers' curve is too steep: widen blend_deg, or move users nearer to it"
        )
        problems.append(ring.source.problem(("users",) if ring.users else ("heads",), words))
    raise_all(ViewerError, problems)
    return curve


def _users(ring: RingSpec, frame: int) -> Iterator[User]:
    for user in ring.users:
        yield User(
            math.radians(user.azimuth_deg),
            user.height,
            user.distance,
            math.radians(user.hold_deg),
            math.radians(user.blend_deg),
        )
    if ring.heads is None:
        return
    spec = ring.heads
    places = read_heads(spec.csv).get(frame)
    if places is None:
        words = f"has no row for frame {frame}"
        raise ViewerError(spec.source.problem(("csv",), f"{spec.csv} {words}"))
    for x, y, z in places:
        distance = math.hypot(x, z)
        if not y > -distance:
            words = f"frame {frame}: a head at {x:g}, {y:g}, {z:g} is below the mirror's plane"
            raise ViewerError(spec.source.problem(("csv",), words))
        yield User(math.atan2(z, x), y, distance, math.radians(spec.hold_deg), math.radians(spec.blend_deg))


def read_heads(path: Path) -> Mapping[int, tuple[tuple[float, float, float], ...]]:
    """Places of the users by frame, in the order of their names.

    Raises:
        ViewerError: a column is missing, a row makes no sense, or a user comes twice in a frame.
    """
    check_input(path, ViewerError, "a CSV file")
    return _heads(path, path.stat().st_mtime_ns, path.stat().st_size)


@lru_cache(maxsize=4)
def _heads(path: Path, changed: int, size: int) -> Mapping[int, tuple[tuple[float, float, float], ...]]:
    """The file as it was when it was last changed, read once."""
    text = path.read_text(encoding="utf-8-sig")
    lines = [line for line in csv.reader(text.splitlines()) if line]
    names = [name.strip().lower() for name in lines[0]] if lines else []
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        words = f"has no column {', '.join(missing)} (expected {', '.join(_COLUMNS)})"
        raise ViewerError(Problem(words, file=str(path), line=1))
    found: dict[int, dict[str, tuple[float, float, float]]] = {}
    problems: list[Problem] = []
    for number, line in enumerate(lines[1:], start=2):
        row = dict(zip(names, (cell.strip() for cell in line), strict=False))
        try:
            frame, place = int(row["frame"]), tuple(float(row[axis]) for axis in "xyz")
        except (KeyError, ValueError):
            problems.append(
                Problem(f"expected {', '.join(_COLUMNS)}, got {','.join(line)}", str(path), number)
            )
            continue
        if not all(map(math.isfinite, place)) or math.hypot(place[0], place[2]) < 1e-6:
            problems.append(Problem("a head must be beside the axis, at a finite place", str(path), number))
        elif row["user"] in found.setdefault(frame, {}):
            problems.append(Problem(f"user {row['user']} comes twice in frame {frame}", str(path), number))
        else:
            found[frame][row["user"]] = (place[0], place[1], place[2])
    raise_all(ViewerError, problems[:20])
    return {frame: tuple(users[name] for name in sorted(users)) for frame, users in found.items()}


def scene_problems(vertices: FloatArray, rig: Rig, curve: Curve) -> Iterable[str]:
    """Why a scene with vertices (V, 3) cannot be shown; nothing where it can."""
    radius = float(np.sqrt((vertices[:, [0, 2]] ** 2).sum(axis=1).max(initial=0.0)))
    nearest = min([curve.distance, *(user.distance for user in curve.users)])
    if radius >= nearest:
        where = f"reaches {radius:g} m from the axis"
        yield f"{where}, and viewers stand at {nearest:g} m (expected them outside of it)"
    for side in range(len(rig.sides)):
        pose = rig.at(0.0, side)
        reach = math.hypot(float(pose.origin[0]), float(pose.origin[1]))
        if radius >= reach:
            yield f"reaches {radius:g} m from the axis, as far as the projector ({reach:g} m)"
            return
