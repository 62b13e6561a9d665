"""Cameras and other prims of USD files, with their animation (extra `usd`).

A prim's place in the world is taken at every time code at which it, or a prim above it, has a sample;
seconds are time codes over timeCodesPerSecond. The stage says its unit and which axis is up.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from quiltcli.errors import MissingExtraError
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded import quaternions
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
    codes = _codes(prim, UsdGeom)
    poses = np.array([_pose(UsdGeom.Xformable(prim), code) for code in codes])
    # USD's matrices act on rows.
    turns = poses[:, :3, :3].transpose(0, 2, 1)
    turns = turns / np.sqrt((turns * turns).sum(axis=1, keepdims=True))
    return Recording(
        subject=str(prim.GetPath()),
        positions=poses[:, 3, :3],
        rotations=quaternions.from_matrices(turns),
        times=np.array(codes) / stage.GetTimeCodesPerSecond(),
        metres=UsdGeom.GetStageMetersPerUnit(stage),
        settled=stage.HasAuthoredMetadata("metersPerUnit"),
        axes=Z_UP if UsdGeom.GetStageUpAxis(stage) == "Z" else Y_UP,
        is_camera=True,
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


def _codes(prim: Any, geom: Any) -> list[float]:
    """Time codes at which the prim or one above it has a sample."""
    found: set[float] = set()
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(geom.Xformable):
            found.update(geom.Xformable(prim).GetTimeSamples())
        prim = prim.GetParent()
    return sorted(found) or [0.0]


def _pose(prim: Any, code: float) -> list[list[float]]:
    return [list(row) for row in prim.ComputeLocalToWorldTransform(code)]
