"""The closed surfaces, sheets, patches and formulas of display files as shapes, in the file's units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from quiltcli.charts.grids import height_shape, map_shape, mesh_shape
from quiltcli.charts.shapes import Known, Shape, Smooth, over, stacked
from quiltcli.charts.splines import bezier_shape, nurbs_shape
from quiltcli.geometry import FloatArray
from quiltcli.geometry.formulas import parse
from quiltcli.job import surfaces as models
from quiltcli.job.lengths import exact_metres

Metres = Callable[[Any], float]


def metres_by(unit: float) -> Metres:
    """What turns lengths of a file, whose unit is so many metres, into metres."""
    return lambda value: float(exact_metres(value, unit))


def plane(spec: models.PlaneSurface, metres: Metres) -> Shape:
    """A rectangle that faces +Z."""
    width, height = metres(spec.width), metres(spec.height)
    return Smooth(lambda s, t: stacked(width * (s - 0.5), height * (0.5 - t), np.zeros(1)))


def sphere(spec: models.SphereSurface, metres: Metres) -> Shape:
    """R (sin b sin a, cos b, sin b cos a)."""
    radius, a_of, b_of = metres(spec.radius), over(*spec.arc_deg), over(*spec.zenith_deg)
    turn = (spec.arc_deg[1] - spec.arc_deg[0]) * (spec.zenith_deg[1] - spec.zenith_deg[0]) > 0

    def unit(s: FloatArray, t: FloatArray) -> FloatArray:
        a, b = a_of(s), b_of(t)
        ring = np.sin(b)
        return stacked(ring * np.sin(a), np.cos(b), ring * np.cos(a))

    side = radius**2 * (1.0 if turn else -1.0)
    return Known(lambda s, t: radius * unit(s, t), lambda s, t: side * unit(s, t))


def cylinder(spec: models.CylinderSurface, metres: Metres) -> Shape:
    """(r sin a, h(½ − t), r cos a)."""
    radius = metres(spec.radius)
    return _turned_line(spec.arc_deg, (radius, radius), metres(spec.height))


def cone(spec: models.ConeSurface, metres: Metres) -> Shape:
    """(r(t) sin a, h(½ − t), r(t) cos a)."""
    radii = metres(spec.radius_top or 0.0), metres(spec.radius_bottom or 0.0)
    return _turned_line(spec.arc_deg, radii, metres(spec.height))


def _turned_line(arc: tuple[float, float], radii: tuple[float, float], height: float) -> Shape:
    """A line turned about the vertical."""
    a_of, (top, bottom) = over(*arc), radii
    side = 1.0 if arc[1] > arc[0] else -1.0

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        a, r = a_of(s), top + t * (bottom - top)
        return stacked(r * np.sin(a), height * (0.5 - t), r * np.cos(a))

    def normal(s: FloatArray, t: FloatArray) -> FloatArray:
        a = a_of(s)
        shape = np.broadcast_shapes(np.shape(s), np.shape(t))
        rise = np.full(shape, side * (bottom - top))
        return stacked(side * height * np.sin(a), rise, side * height * np.cos(a))

    return Known(point, normal)


def torus(spec: models.TorusSurface, metres: Metres) -> Shape:
    """((R + r cos b) sin a, −r sin b, (R + r cos b) cos a)."""
    ring, tube = metres(spec.radius), metres(spec.tube)
    a_of, b_of = over(*spec.arc_deg), over(*spec.tube_deg)
    turn = (spec.arc_deg[1] - spec.arc_deg[0]) * (spec.tube_deg[1] - spec.tube_deg[0]) > 0
    side = 1.0 if turn else -1.0

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        a, b = a_of(s), b_of(t)
        out = ring + tube * np.cos(b)
        return stacked(out * np.sin(a), -tube * np.sin(b), out * np.cos(a))

    def normal(s: FloatArray, t: FloatArray) -> FloatArray:
        a, b = a_of(s), b_of(t)
        out = side * np.cos(b)
        return stacked(out * np.sin(a), -side * np.sin(b), out * np.cos(a))

    # Normals of a spindle torus turn over where its tube passes the axis; differences say so.
    return Known(point, normal) if ring > tube else Smooth(point)


def paraboloid(spec: models.ParaboloidSurface, metres: Metres) -> Shape:
    """X = w(2s − 1), z = w(2t − 1), y = k(x² + z²)."""
    width, k = metres(spec.half_width), spec.coefficient / metres(1.0)

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        x, z = width * (2 * s - 1), width * (2 * t - 1)
        return stacked(x, k * (x * x + z * z), z)

    def normal(s: FloatArray, t: FloatArray) -> FloatArray:
        x, z = width * (2 * s - 1), width * (2 * t - 1)
        return stacked(-2 * k * x, np.ones(1), -2 * k * z)

    return Known(point, normal)


def superquadric(spec: models.SuperquadricSurface, metres: Metres) -> Shape:
    """Barr's superquadric ellipsoid (1981), with the poles on the vertical."""
    radii = [metres(radius) for radius in spec.radii]
    e1, e2 = spec.exponents
    a_of, b_of = over(*spec.arc_deg), over(*spec.latitude_deg)
    turn = (spec.arc_deg[1] - spec.arc_deg[0]) * (spec.latitude_deg[1] - spec.latitude_deg[0]) > 0
    # From the zenith down and from +X towards +Z one goes to the left, as seen from outside.
    side = 1.0 if turn else -1.0

    def parts(s: FloatArray, t: FloatArray, p: float, q: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        a, b = a_of(s), b_of(t)
        ring = _power(np.cos(b), p)
        return ring * _power(np.cos(a), q), _power(np.sin(b), p), ring * _power(np.sin(a), q)

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        x, y, z = parts(s, t, e1, e2)
        return stacked(radii[0] * x, radii[1] * y, radii[2] * z)

    def normal(s: FloatArray, t: FloatArray) -> FloatArray:
        x, y, z = parts(s, t, 2 - e1, 2 - e2)
        return stacked(side * x / radii[0], side * y / radii[1], side * z / radii[2])

    return Known(point, normal)


def _power(value: FloatArray, exponent: float) -> FloatArray:
    """Signed powers; of values that are 0 but for rounding those of 0."""
    size = np.abs(value)
    size = np.where(size < 1e-15, 0.0, size)
    with np.errstate(divide="ignore"):
        return np.asarray(np.copysign(np.minimum(np.float_power(size, exponent), 1e30), value))


def formula(spec: models.FormulaBase, metres: Metres) -> Shape:
    """Formulas of s and t, in the file's units."""
    unit, names = metres(1.0), ("s", "t", *spec.constants)
    parts = [parse(text, names) for text in (spec.x, spec.y, spec.z)]

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        shape = np.broadcast_shapes(np.shape(s), np.shape(t))
        values: dict[str, Any] = {
            **spec.constants,
            "s": np.broadcast_to(s, shape),
            "t": np.broadcast_to(t, shape),
        }
        return stacked(*(unit * np.broadcast_to(part(values), shape) for part in parts))

    return Smooth(point)


KINDS: dict[str, Callable[[Any, Metres], Shape]] = {
    "plane": plane,
    "sphere": sphere,
    "cylinder": cylinder,
    "cone": cone,
    "torus": torus,
    "paraboloid": paraboloid,
    "superquadric": superquadric,
    "bezier": bezier_shape,
    "nurbs": nurbs_shape,
    "height": height_shape,
    "formula": formula,
    "implicit": formula,
    "mesh": mesh_shape,
    "map": map_shape,
}
"""What makes the shape of a surface, in metres, by its kind."""

OUTWARD = {"sphere": 1, "cylinder": 1, "cone": 1, "torus": 1, "superquadric": -1}
"""Whether s runs right as seen from outside where ranges ascend (1), or to the left (−1)."""
