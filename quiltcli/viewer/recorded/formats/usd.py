"""Cameras and other prims of USD files, with their animation (extra `usd`).

A prim's place in the world is taken at every time code at which it, or a prim above it, has a sample,
and many times between them, as what several prims and operations make together is not straight. Seconds
are time codes over timeCodesPerSecond; the stage says its unit and which axis is up.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MissingExtraError
from quiltcli.geometry import quaternions
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.formats.gltf import DENSE, MOST_SAMPLES
from quiltcli.viewer.recorded.take import Y_UP, Z_UP, Recording, choose, wrong


def read_usd(spec: RecordedSpec) -> Recording:
    """Samples of a camera, or of the prim that is named by its path or name.

    Raises:
        MissingExtraError: the packages of the extra `usd` are not installed.
        ViewerError: the stage cannot be opened, or the prim is not told.
    """
    try:
        from pxr import Tf, Usd, UsdGeom
    except ImportError:
        words = "USD takes need the package usd-core: pip install 'quiltcli[usd]'"
        raise MissingExtraError(words) from None
    try:
        stage = Usd.Stage.Open(str(spec.file))
    except Tf.ErrorException as error:
        raise wrong(spec.file, f"is no USD file that can be opened: {_first_line(error)}") from None
    prim = _prim(spec, stage, UsdGeom)
    rate = stage.GetTimeCodesPerSecond()
    codes = _codes(prim, UsdGeom, rate, spec.file)
    poses = np.array([_pose(UsdGeom.Xformable(prim), code) for code in codes])
    # USD's matrices act on rows.
    turns = poses[:, :3, :3].transpose(0, 2, 1)
    turns = turns / np.sqrt((turns * turns).sum(axis=1, keepdims=True))
    return Recording(
        subject=str(prim.GetPath()),
        positions=poses[:, 3, :3],
        rotations=quaternions.from_matrices(turns),
        times=np.array(codes) / rate,
        metres=UsdGeom.GetStageMetersPerUnit(stage),
        settled=stage.HasAuthoredMetadata("metersPerUnit"),
        axes=Z_UP if UsdGeom.GetStageUpAxis(stage) == "Z" else Y_UP,
        is_camera=True,
        is_curve=True,
    )


def _first_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _prim(spec: RecordedSpec, stage: Any, geom: Any) -> Any:
    """The prim asked for, or the only camera."""
    prims = [prim for prim in stage.Traverse() if prim.IsA(geom.Xformable)]
    if spec.subject is None:
        prims = [prim for prim in prims if prim.IsA(geom.Camera)]
    names = [str(prim.GetPath()) for prim in prims]
    return prims[choose(spec, names, "cameras" if spec.subject is None else "prims")]


def _codes(prim: Any, geom: Any, rate: float, path: Path) -> list[float]:
    """Time codes at which the prim or one above it has a sample, and many between."""
    found: set[float] = set()
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(geom.Xformable):
            found.update(geom.Xformable(prim).GetTimeSamples())
        prim = prim.GetParent()
    if not found:
        return [0.0]
    first, last = min(found), max(found)
    count = int(np.ceil((last - first) / rate * DENSE)) + 1
    if count > MOST_SAMPLES:
        raise wrong(path, f"its animation of {(last - first) / rate:.0f} s is longer than can be sampled")
    return sorted(found | set(np.linspace(first, last, count).tolist()))


def _pose(prim: Any, code: float) -> list[list[float]]:
    return [list(row) for row in prim.ComputeLocalToWorldTransform(code)]
