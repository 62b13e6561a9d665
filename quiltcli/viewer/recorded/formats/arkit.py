"""JSON of phones: ARKit camera poses, in metres, y up, looking along −z of a phone held landscape-right.

Shapes that are read: a list of samples, or one under `frames`, `samples` or `poses`; a sample has a
`transform` (4×4 rows, or 16 numbers by columns) or a position and a rotation. Tracky's `.bren` keeps
`timestamps` and `transforms` under `camera_frames`; Record3D's `poses` are qx, qy, qz, qw, x, y, z.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.formats.yaml.syntax import read_text
from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.tables import check_size
from quiltcli.viewer.recorded.take import Y_UP, Recording, wrong

_TIMES = ("timestamp", "time", "t", "seconds")
_MATRICES = ("transform", "cameraTransform", "camera_transform", "cameraPoseARFrame", "matrix", "pose")
_PLACES = ("position", "translation", "pos")
_TURNS = ("rotation", "orientation", "quaternion")
_LOST = np.full((4, 4), np.nan)


def read_arkit(spec: RecordedSpec) -> Recording:
    """Samples of a JSON file of camera poses.

    Raises:
        ViewerError: the file is no JSON, or no shape that is known.
    """
    check_size(spec.file)
    try:
        data = json.loads(read_text(spec.file))
    except ValueError as error:
        line, column = getattr(error, "lineno", 0), getattr(error, "colno", 0)
        raise wrong(spec.file, f"not JSON: {getattr(error, 'msg', error)}", line, column) from None
    except RecursionError:
        raise wrong(spec.file, "the values are nested too deeply") from None
    stamps, samples, rate = _samples(data, spec.file)
    if not samples:
        raise wrong(spec.file, "holds no samples (expected frames, samples, poses or camera_frames)")
    poses = np.stack([_pose(sample, k, spec.file) for k, sample in enumerate(samples)])
    return Recording(
        subject="camera",
        positions=poses[:, :3, 3],
        rotations=quaternions.from_matrices(_orthogonal(poses[:, :3, :3])),
        times=stamps,
        metres=1.0,
        axes=Y_UP,
        is_camera=True,
        rate=rate,
    )


def _samples(data: Any, path: Path) -> tuple[FloatArray | None, Sequence[Any], float | None]:
    """Stamps, samples and rate, wherever the file has them."""
    rate = None
    if isinstance(data, Mapping):
        render = data.get("render_data")
        rate = _number(data.get("fps")) or _number(render.get("fps") if isinstance(render, Mapping) else None)
        frames = data.get("camera_frames")
        if isinstance(frames, Mapping):
            samples = frames.get("transforms")
            stamps = frames.get("timestamps")
            return _stamps(stamps, samples, path), samples if isinstance(samples, list) else (), rate
        data = next((data[key] for key in ("frames", "samples", "poses") if key in data), ())
    if not isinstance(data, list):
        return None, (), rate
    name = next((key for key in _TIMES if data and isinstance(data[0], Mapping) and key in data[0]), None)
    if name is None:
        return None, data, rate
    stamps = [item.get(name) if isinstance(item, Mapping) else None for item in data]
    return _stamps(stamps, data, path), data, rate


def _stamps(stamps: Any, samples: Any, path: Path) -> FloatArray | None:
    """Stamps (N,) of the samples."""
    if stamps is None:
        return None
    numbers = [_number(stamp) for stamp in stamps] if isinstance(stamps, list) else []
    if not isinstance(samples, list) or len(numbers) != len(samples) or None in numbers:
        raise wrong(path, f"expected a number of seconds for each of {len(samples or ())} samples")
    return np.array(numbers, dtype=np.float64)


def _number(value: Any) -> float | None:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < float("inf")
    return float(value) if good else None


def _pose(sample: Any, index: int, path: Path) -> FloatArray:
    """Camera to world (4, 4) of a sample; not numbers where it was lost."""
    if isinstance(sample, Mapping):
        matrix = next((sample[key] for key in _MATRICES if key in sample), None)
        if matrix is None:
            place = next((sample[key] for key in _PLACES if key in sample), None)
            turn = next((sample[key] for key in _TURNS if key in sample), None)
            return _placed(_numbers(place, "xyz", index, path), _numbers(turn, "xyzw", index, path))
        sample = matrix
    if sample is None:
        return _LOST
    values = _flat(sample, index, path)
    if values.size == 7:
        return _placed(values[4:], values[:4])
    if values.size != 16:
        raise wrong(path, f"sample {index}: expected 4 × 4 numbers or a position and a rotation")
    pose = values.reshape(4, 4)
    # simd's columns, written one after another, have the place last; rows have it on the right.
    return pose.T if np.array_equal(pose[:3, 3], np.zeros(3)) else pose


def _flat(value: Any, index: int, path: Path) -> FloatArray:
    try:
        flat = np.asarray(value, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise wrong(path, f"sample {index}: expected numbers") from None
    return flat


def _numbers(value: Any, names: str, index: int, path: Path) -> FloatArray:
    """Numbers of a list, or of a mapping with these keys; not numbers where there is nothing."""
    if value is None:
        return np.full(len(names), np.nan)
    if isinstance(value, Mapping):
        value = [value.get(name) for name in names]
    flat = _flat(value, index, path)
    if flat.size != len(names):
        raise wrong(path, f"sample {index}: expected {len(names)} numbers, {', '.join(names)}")
    return flat


def _placed(place: FloatArray, turn: FloatArray) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3] = quaternions.matrices(quaternions.unit(turn))
    pose[:3, 3] = place
    return pose


def _orthogonal(m: FloatArray) -> FloatArray:
    """The matrices (N, 3, 3) with columns of length 1, which is all that single precision leaves to mend."""
    length = np.sqrt((m * m).sum(axis=1, keepdims=True))
    return np.asarray(m / np.where(length > 0, length, np.nan))
