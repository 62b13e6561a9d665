"""What a mesh's corners carry: primvars and normals by their interpolation and indices."""

from __future__ import annotations

from typing import Any

import numpy as np

from quiltcli.formats.corners import Carried, Corners, CornersError, carried
from quiltcli.formats.usd.stage import Stage, library
from quiltcli.geometry import IntArray


def read_primvar(stage: Stage, primvar: Any, corners: Corners, width: int, time: Any) -> Carried | None:
    """Values of a primvar; None where it has none.

    Raises:
        MeshError: there are not as many as its interpolation asks for, of that width, or indices are wrong.
    """
    if not primvar or not primvar.HasValue():
        return None
    values = primvar.GetAttr().Get(time)
    if values is None:
        return None
    indices = primvar.GetIndices(time) if primvar.IsIndexed() else None
    named = None if indices is None else np.asarray(indices, dtype=np.int64).reshape(-1)
    return _carried(stage, primvar.GetAttr(), values, primvar.GetInterpolation(), corners, width, named)


def read_normals(stage: Stage, mesh: Any, corners: Corners, time: Any) -> Carried | None:
    """Normals of a mesh's corners, those of the primvar before those of the schema; None without any."""
    primvar = library().UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    found = read_primvar(stage, primvar, corners, 3, time)
    if found is not None:
        return found
    attribute = mesh.GetNormalsAttr()
    values = attribute.Get(time)
    if values is None or not len(values):
        return None
    return _carried(stage, attribute, values, mesh.GetNormalsInterpolation(), corners, 3, None)


def _carried(
    stage: Stage,
    attribute: Any,
    values: Any,
    interpolation: str,
    corners: Corners,
    width: int,
    indices: IntArray | None,
) -> Carried:
    try:
        return carried(values, interpolation, corners, width, indices)
    except CornersError as error:
        raise stage.error(attribute, str(error)) from None
