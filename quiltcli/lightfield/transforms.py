"""Poses of pictures in a transforms.json, as programs that work with radiance fields exchange them.

`frames[].file_path` is a picture beside the file, `transform_matrix` (4, 4) the world from its camera,
which looks along its −z with its y up. The lens is `camera_angle_x`, or `fl_x`, `fl_y`, `cx` and `cy`, and
`w` and `h`. Such poses may be anything; here they have to lie on rings around one axis.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import JobError, Problem, first_of
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import FloatArray
from quiltcli.job.lightfield import posed_picture
from quiltcli.lightfield.cameras import Cameras, Lens, Row

OFF = 0.01
"""Share of a ring's radius by which a pose may lie beside the ring."""
_MOST = 10


@dataclass(frozen=True)
class Posed:
    """Cameras of a file of poses.

    Attributes:
        cameras: the cameras, whose views count through the file.
        files: picture of every view.
    """

    cameras: Cameras
    files: tuple[Path, ...]


def read_transforms(path: Path, up_axis: str = "y") -> Posed:
    """Read a file of poses.

    Args:
        path: the file.
        up_axis: which of its axes is up, y or z.

    Raises:
        JobError: it is no such file, or its poses lie on no rings around the vertical axis.
    """
    data = _json(path)
    frames = data.get("frames")
    if not isinstance(frames, list) or not frames:
        raise JobError(Problem("has no frames (expected a list of pictures and poses)", str(path)))
    problems: list[Problem] = []
    poses, files = [], []
    for i, frame in enumerate(frames):
        try:
            poses.append(_pose(frame))
            files.append(_picture(path, frame))
        except ValueError as error:
            problems.append(Problem(str(error), str(path), key=f"frames[{i}]"))
    if problems:
        raise JobError(first_of(problems, _MOST, str(path)))
    return Posed(_cameras(path, _lens(path, data, files[0]), np.array(poses), up_axis), tuple(files))


def _cameras(path: Path, lens: Lens, poses: FloatArray, up_axis: str) -> Cameras:
    if up_axis == "z":  # x stays, z becomes y, y becomes −z
        poses = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]]) @ poses
    position = poses[:, :3, 3]
    # Columns of the matrix are the camera's right, up and back.
    rotation = np.stack((poses[:, :3, 0], -poses[:, :3, 1], -poses[:, :3, 2]), axis=1)
    rotation = rotation / np.linalg.norm(rotation, axis=2)[:, :, None]
    radius = np.hypot(position[:, 0], position[:, 2])
    distance = float(np.median(radius))
    far = np.flatnonzero(np.abs(radius - distance) > OFF * distance)
    if far.size or distance == 0:
        words = "is {:.4g} m from the axis, the ring {:.4g} m (expected poses on rings, to 1 %)"
        found = [
            Problem(words.format(radius[i], distance), str(path), key=f"frames[{i}]") for i in far.tolist()
        ]
        raise JobError(first_of(found, _MOST, str(path)) or Problem("has all poses on the axis", str(path)))
    azimuth = np.mod(np.arctan2(position[:, 2], position[:, 0]), 2 * np.pi)
    rows = []
    for members in _levels(position[:, 1], OFF * distance):
        order = members[np.argsort(azimuth[members], kind="stable")]
        height = float(position[order, 1].mean())
        rows.append(Row(height, azimuth[order], position[order], rotation[order], order))
    return Cameras(lens, distance, tuple(rows))


def _levels(height: FloatArray, apart: float) -> Iterator[Any]:
    """Indices of poses of one height, from the lowest; heights nearer than `apart` are one."""
    order = np.argsort(height, kind="stable")
    yield from np.split(order, np.flatnonzero(np.diff(height[order]) > apart) + 1)


def _json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(read_input(path, JobError, "a JSON file of poses"))
    except (ValueError, RecursionError) as error:
        raise JobError(Problem(f"is no JSON: {error}", str(path))) from None
    if not isinstance(data, dict):
        raise JobError(Problem("is no file of poses (expected a mapping with frames)", str(path)))
    return data


def _pose(frame: Any) -> FloatArray:
    """World from camera (4, 4) of an entry of `frames` (ValueError)."""
    matrix = frame.get("transform_matrix") if isinstance(frame, dict) else None
    try:
        pose = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError):
        pose = np.zeros(0)
    if pose.shape not in ((3, 4), (4, 4)) or not np.isfinite(pose).all():
        raise ValueError("has no transform_matrix (expected 4 rows of 4 numbers)")
    turn = pose[:3, :3] / np.maximum(np.linalg.norm(pose[:3, :3], axis=0), 1e-300)
    if not np.allclose(turn.T @ turn, np.eye(3), atol=1e-3) or np.linalg.det(turn) < 0:
        raise ValueError("has a transform_matrix that is no rotation and shift")
    return np.vstack((pose[:3], [0, 0, 0, 1]))


def _picture(path: Path, frame: Any) -> Path:
    """The picture of an entry, whose suffix may be left out (ValueError)."""
    name = frame.get("file_path")
    if not isinstance(name, str) or not name:
        raise ValueError("has no file_path (expected the name of a picture)")
    picture = posed_picture(path.parent, name)
    if picture is None:
        raise ValueError(f"names {name}, and there is no such picture")
    return picture


def _lens(path: Path, data: dict[str, Any], picture: Path) -> Lens:
    from quiltcli.lightfield.pictures import picture_size

    size = tuple(data.get(name) for name in ("w", "h"))
    if not all(isinstance(side, (int, float)) and side > 0 for side in size):
        size = picture_size(picture)
    width, height = (int(side) for side in size)  # type: ignore[arg-type]
    angle, focal = data.get("camera_angle_x"), data.get("fl_x")
    if isinstance(focal, (int, float)) and focal > 0:
        across = float(focal)
    elif isinstance(angle, (int, float)) and 0 < angle < math.pi:
        across = width / 2 / math.tan(angle / 2)
    else:
        words = "has no lens (expected fl_x in pixels, or camera_angle_x in radians)"
        raise JobError(Problem(words, str(path)))
    down = data.get("fl_y", across)
    centre = (data.get("cx", width / 2), data.get("cy", height / 2))
    if not all(isinstance(value, (int, float)) for value in (down, *centre)) or down <= 0:
        raise JobError(Problem("has a lens that is none (fl_y, cx and cy are numbers of pixels)", str(path)))
    return Lens(np.array([across, down], dtype=float), np.array(centre, dtype=float), (width, height))
