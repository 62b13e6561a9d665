"""Shapes by formula (UsdGeomCube, Sphere, Cylinder, Cone, Capsule, Plane) as meshes of a stage of their own.

Round ones have 96 sides: their outline is within 0.06 % of the radius of the true one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.formats.usd.stage import Stage, library, path_of
from quiltcli.geometry import FloatArray

SIDES = 96
_COPIED = ("displayColor", "displayOpacity")


@dataclass(frozen=True, eq=False)
class Polygons:
    """Points (V, 3) and faces, each the rows of its corners, anticlockwise from outside."""

    points: FloatArray
    faces: list[list[int]]


def is_shape(kind: str) -> bool:
    """Whether prims of a type are such shapes."""
    return kind in _SHAPES


def shape_mesh(stage: Stage, shelf: Any, prim: Any, time: Any) -> Any:
    """A mesh of a shape, of `pxr.UsdGeom`, with its colours.

    Args:
        stage: of the shape.
        shelf: the stage in which the mesh is made.
        prim: the shape.
        time: when it is looked at.

    Raises:
        MeshError: a size is not what it must be.
    """
    pxr = library()
    found = _SHAPES[str(prim.GetTypeName())](_Sizes(stage, prim, time))
    path = pxr.Sdf.Path(f"/shape_{sum(1 for _ in shelf.GetPseudoRoot().GetChildren())}")
    mesh = pxr.UsdGeom.Mesh.Define(shelf, path)
    mesh.CreatePointsAttr(pxr.Vt.Vec3fArray.FromNumpy(found.points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr([len(face) for face in found.faces])
    mesh.CreateFaceVertexIndicesAttr([corner for face in found.faces for corner in face])
    mesh.CreateSubdivisionSchemeAttr("none")
    gprim = pxr.UsdGeom.Gprim(prim)
    mesh.CreateDoubleSidedAttr(bool(gprim.GetDoubleSidedAttr().Get()))
    for name in _COPIED:
        given = pxr.UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        value = given.ComputeFlattened(time) if given and given.HasValue() else None
        if value is not None and len(value) == 1:
            api = pxr.UsdGeom.PrimvarsAPI(mesh)
            api.CreatePrimvar(name, given.GetTypeName(), "constant").Set(value)
    return mesh


@dataclass(frozen=True)
class _Sizes:
    """The numbers of a shape."""

    stage: Stage
    prim: Any
    time: Any

    def get(self, name: str) -> float:
        """A length, in the stage's units."""
        attribute = self.prim.GetAttribute(name)
        value = float(attribute.Get(self.time))
        if not 0 <= value < math.inf:
            raise self.stage.error(attribute, f"is {value:g} (expected a number, 0 or more)")
        return value

    def along_axis(self, points: FloatArray) -> FloatArray:
        """Points whose Z is the shape's axis."""
        axis = str(self.prim.GetAttribute("axis").Get(self.time))
        if axis not in ("X", "Y", "Z"):
            words = f"is {axis!r} (expected X, Y or Z)"
            raise self.stage.error(path_of(self.prim) + ".axis", words)
        return np.roll(points, {"Z": 0, "X": 1, "Y": 2}[axis], axis=1)


def _cube(sizes: _Sizes) -> Polygons:
    half = sizes.get("size") / 2
    points = half * np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=np.float64)
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return Polygons(points, faces)


def _plane(sizes: _Sizes) -> Polygons:
    # Of the axis X the width runs along Z, of the others along X.
    width, length = sizes.get("width") / 2, sizes.get("length") / 2
    flat = np.array([(-width, -length, 0), (width, -length, 0), (width, length, 0), (-width, length, 0)])
    axis = str(sizes.prim.GetAttribute("axis").Get(sizes.time))
    if axis == "X":
        return Polygons(np.stack((flat[:, 2], flat[:, 1], -flat[:, 0]), axis=1), [[0, 1, 2, 3]])
    if axis == "Y":
        return Polygons(np.stack((flat[:, 0], flat[:, 2], -flat[:, 1]), axis=1), [[0, 1, 2, 3]])
    return Polygons(flat, [[0, 1, 2, 3]])


def _sphere(sizes: _Sizes) -> Polygons:
    radius = sizes.get("radius")
    up = np.linspace(-math.pi / 2, math.pi / 2, SIDES // 2 + 1)
    return _turned([(radius * math.cos(a), radius * math.sin(a)) for a in up[1:-1]], -radius, radius)


def _capsule(sizes: _Sizes) -> Polygons:
    radius, half = sizes.get("radius"), sizes.get("height") / 2
    up = np.linspace(0, math.pi / 2, SIDES // 4 + 1)
    lower = [(radius * math.cos(a), -half - radius * math.sin(a)) for a in up[::-1][1:]]
    upper = [(radius * math.cos(a), half + radius * math.sin(a)) for a in up[:-1]]
    found = _turned([*lower, *upper], -half - radius, half + radius)
    return Polygons(sizes.along_axis(found.points), found.faces)


def _cylinder(sizes: _Sizes) -> Polygons:
    radius, half = sizes.get("radius"), sizes.get("height") / 2
    found = _turned([(radius, -half), (radius, half)], None, None)
    return Polygons(sizes.along_axis(found.points), found.faces)


def _cone(sizes: _Sizes) -> Polygons:
    radius, half = sizes.get("radius"), sizes.get("height") / 2
    found = _turned([(radius, -half)], None, half)
    return Polygons(sizes.along_axis(found.points), found.faces)


def _turned(rings: list[tuple[float, float]], bottom: float | None, top: float | None) -> Polygons:
    """A body of revolution about Z.

    Args:
        rings: radius and height of each ring, upwards.
        bottom: height of the point below the lowest, None for a flat end.
        top: likewise above the highest.
    """
    angle = 2 * math.pi * np.arange(SIDES) / SIDES
    circle = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    rows = [np.column_stack((radius * circle, np.full(SIDES, height))) for radius, height in rings]
    points = np.concatenate([*rows, [(0, 0, z) for z in (bottom, top) if z is not None] or np.empty((0, 3))])
    side = range(SIDES)
    faces = [
        [k * SIDES + i, k * SIDES + (i + 1) % SIDES, (k + 1) * SIDES + (i + 1) % SIDES, (k + 1) * SIDES + i]
        for k in range(len(rings) - 1)
        for i in side
    ]
    last, tip = (len(rings) - 1) * SIDES, len(rings) * SIDES
    if bottom is None:
        faces.append(list(reversed(side)))
    else:
        faces += [[(i + 1) % SIDES, i, tip] for i in side]
    if top is None:
        faces.append([last + i for i in side])
    else:
        faces += [[last + i, last + (i + 1) % SIDES, len(points) - 1] for i in side]
    return Polygons(points, faces)


_SHAPES: dict[str, Callable[[_Sizes], Polygons]] = {
    "Cube": _cube,
    "Sphere": _sphere,
    "Cylinder": _cylinder,
    "Cone": _cone,
    "Capsule": _capsule,
    "Plane": _plane,
}
