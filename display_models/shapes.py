"""The shapes of the display models: planar faces in metres, Y up, wound towards the front."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Face = tuple[int, ...]


@dataclass
class Mesh:
    """Vertices (x, y, z) in metres, faces of vertex indices, and names of some faces by index."""

    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    faces: list[Face] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)

    def add_points(self, points: Iterable[Sequence[float]]) -> int:
        """Append points; return the index of the first."""
        first = len(self.vertices)
        self.vertices += [(float(x), float(y), float(z)) for x, y, z in points]
        return first


def grid(mesh: Mesh, points: FloatArray, *, triangles: bool = False) -> None:
    """Add the faces between points (rows, columns, 3); seen from the front, columns run right, rows up.

    Points that coincide are one vertex, and faces lose the corners that coincide, so a row that
    has shrunk to a pole gives triangles and a seam closes.
    """
    rows, columns = points.shape[:2]
    known: dict[tuple[float, ...], int] = {}
    for vertex, position in enumerate(mesh.vertices):
        known.setdefault(rounded(position), vertex)
    number = np.empty((rows, columns), np.int64)
    for i in range(rows):
        for j in range(columns):
            key = rounded(points[i, j])
            if key not in known:
                known[key] = mesh.add_points([points[i, j]])
            number[i, j] = known[key]
    for i in range(rows - 1):
        for j in range(columns - 1):
            a, b, c, d = (int(number[k]) for k in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
            for face in ((a, b, c), (a, c, d)) if triangles else ((a, b, c, d),):
                corners = tuple(dict.fromkeys(face))
                if len(corners) > 2:
                    mesh.faces.append(corners)


def rounded(point: Sequence[float] | FloatArray) -> tuple[float, ...]:
    """Where a point is to a nanometre, as vertices are written and compared."""
    return tuple(round(float(c), 9) + 0.0 for c in point)


# Boxes and walls


def panels(**walls: Sequence[Sequence[float]]) -> Mesh:
    """Named panels, each of corners counter-clockwise seen from its front."""
    mesh = Mesh()
    for name, corners in walls.items():
        first = mesh.add_points(corners)
        mesh.names[len(mesh.faces)] = name
        mesh.faces.append(tuple(range(first, first + len(corners))))
    return mesh


def cube5() -> Mesh:
    """Four 24-inch 1920 × 1080 panels (531.36 × 298.89 mm) around a square top of the same pitch."""
    w, h = 0.53136 / 2, 0.29889
    return panels(
        front=[(-w, 0, w), (w, 0, w), (w, h, w), (-w, h, w)],
        right=[(w, 0, w), (w, 0, -w), (w, h, -w), (w, h, w)],
        back=[(w, 0, -w), (-w, 0, -w), (-w, h, -w), (w, h, -w)],
        left=[(-w, 0, -w), (-w, 0, w), (-w, h, w), (-w, h, -w)],
        top=[(-w, h, w), (w, h, w), (w, h, -w), (-w, h, -w)],
    )


def corner_billboard() -> Mesh:
    """Two LED walls on the corner of a building, 9.6 m and 5.76 m wide, 5.76 m high, 4 m up."""
    s, low, high = math.sqrt(0.5), 4.0, 9.76
    a, b = 9.6 * s, 5.76 * s
    return panels(
        left=[(-a, low, -a), (0, low, 0), (0, high, 0), (-a, high, -a)],
        right=[(0, low, 0), (b, low, -b), (b, high, -b), (0, high, 0)],
    )


def cave5() -> Mesh:
    """Three walls, floor and ceiling of a 3 m room that is open behind the viewer, wound outwards.

    Floor and ceiling start with the edge that is at the bottom of their images: a picture runs on
    from the floor over the front wall to the ceiling.
    """
    r, h = 1.5, 3.0
    return panels(
        front=[(r, 0, -r), (-r, 0, -r), (-r, h, -r), (r, h, -r)],
        left=[(-r, 0, -r), (-r, 0, r), (-r, h, r), (-r, h, -r)],
        right=[(r, 0, r), (r, 0, -r), (r, h, -r), (r, h, r)],
        floor=[(r, 0, r), (-r, 0, r), (-r, 0, -r), (r, 0, -r)],
        ceiling=[(r, h, -r), (-r, h, -r), (-r, h, r), (r, h, r)],
    )


# Platonic solids


def icosahedron() -> Mesh:
    """A regular icosahedron in a sphere of 0.3 m, a vertex at the top, standing on another."""
    r = 0.3
    ring, height = r * 2 / math.sqrt(5), r / math.sqrt(5)
    mesh = Mesh()
    mesh.add_points([(0, 2 * r, 0)])
    mesh.add_points(_ring(5, ring, r + height, 0.0))
    mesh.add_points(_ring(5, ring, r - height, 0.5))
    mesh.add_points([(0, 0, 0)])
    for k in range(5):
        upper, lower, n = 1 + k, 6 + k, (k + 1) % 5
        mesh.faces += [(0, upper, 1 + n), (upper, lower, 1 + n), (1 + n, lower, 6 + n), (lower, 11, 6 + n)]
    return mesh


def dodecahedron() -> Mesh:
    """A regular dodecahedron in a sphere of 0.3 m, standing on a face: the icosahedron's dual."""
    dual = icosahedron()
    points = np.array(dual.vertices) - (0, 0.3, 0)
    centres = np.array([points[list(face)].mean(axis=0) for face in dual.faces])
    centres *= 0.3 / np.linalg.norm(centres, axis=1)[:, None]
    mesh = Mesh()
    mesh.add_points(centres - np.array([0, centres[:, 1].min(), 0]))
    for vertex, axis in enumerate(points):
        around = [k for k, face in enumerate(dual.faces) if vertex in face]
        x = centres[around[0]] - axis * (centres[around[0]] @ axis) / (axis @ axis)
        y = np.cross(axis, x) / 0.3
        # In fifths of a turn: the first stands at zero, which noise may put just below a whole turn.
        turn = [math.atan2(float(centres[k] @ y), float(centres[k] @ x)) for k in around]
        step = np.round(np.array(turn) / (2 * math.pi / 5)) % 5
        mesh.faces.append(tuple(k for _, k in sorted(zip(step, around, strict=True))))
    return mesh


def _ring(count: int, radius: float, height: float, offset: float) -> list[tuple[float, float, float]]:
    """Points counter-clockwise seen from above, the first towards the viewer at +Z."""
    turns = [2 * math.pi * (k + offset) / count for k in range(count)]
    return [(radius * math.sin(t), height, radius * math.cos(t)) for t in turns]


# Surfaces of revolution


def revolved(profile: Sequence[tuple[float, float]], sides: int) -> Mesh:
    """Planar quads (triangles at the axis) around Y; the (radius, height) profile runs upwards."""
    mesh = Mesh()
    rows = [_ring(sides, r, y, 0.0) for r, y in profile]
    grid(mesh, np.array([[*row, row[0]] for row in rows]))
    return mesh


def sphere(sides: int, rows: int) -> Mesh:
    """A lat-long sphere of radius 0.3 m that stands on the ground: `sides` × `rows` facets."""
    turns = [math.pi * k / rows for k in range(rows + 1)]
    return revolved([(0.3 * math.sin(t), 0.3 - 0.3 * math.cos(t)) for t in turns], sides)


def cylinder216() -> Mesh:
    """A column of 24 × 9 nearly square panels, radius 0.25 m, height 0.6 m, open at both ends."""
    return revolved([(0.25, 0.6 * k / 9) for k in range(10)], 24)


# A desk


def desk816() -> Mesh:
    """A folded workspace around a seated viewer: desk, slope, back wall and visor on three legs.

    One profile of 24 strips is swept along three straight legs with mitred joints, 34 columns in
    all. A quad between two lines along the same leg has two parallel edges, so it is planar.
    """
    bends = [(0.35, 0.72, 9), (0.80, 0.72, 4), (1.00, 0.84, 8), (1.00, 1.34, 3), (0.88, 1.46, 0)]
    profile = []
    for (d0, y0, count), (d1, y1, _) in pairwise(bends):
        profile += [(d0 + (d1 - d0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count)]
    profile.append(bends[-1][:2])
    half = math.radians(50) / 2
    mesh = Mesh()
    for angle, columns, side in ((-2 * half, 10, -1), (0.0, 14, 0), (2 * half, 10, 1)):
        out = np.array([math.sin(angle), 0, -math.cos(angle)])
        along = np.array([math.cos(angle), 0, math.sin(angle)])
        rows = []
        for distance, height in profile:
            mitre = distance * math.tan(half)
            left, right = (-0.6 if side < 0 else -mitre), (0.6 if side > 0 else mitre)
            steps = [left + (right - left) * k / columns for k in range(columns + 1)]
            rows.append([distance * out + step * along + (0, height, 0) for step in steps])
        grid(mesh, np.array(rows))
    return mesh


# Tubes


def tube(
    mesh: Mesh, centres: FloatArray, tangents: FloatArray, bends: FloatArray, radius: float, sides: int
) -> None:
    """Triangles around a curve.

    Args:
        mesh: where to add them.
        centres: (N, 3) points of the curve.
        tangents: (N, 3) its directions.
        bends: (N, 3) its second derivatives, which orient the cross-sections.
        radius: metres.
        sides: corners of a cross-section.
    """
    forward = tangents / np.linalg.norm(tangents, axis=1)[:, None]
    across = np.cross(forward, bends)
    across /= np.linalg.norm(across, axis=1)[:, None]
    inward = np.cross(across, forward)
    turn = 2 * math.pi * np.arange(sides + 1) / sides
    turn[-1] = 0
    circle = np.cos(turn)[:, None, None] * inward + np.sin(turn)[:, None, None] * across
    grid(mesh, (centres + radius * circle).transpose(1, 0, 2), triangles=True)


def spring902() -> Mesh:
    """A helical tube of 45 × 10 × 2 triangles with a decagon at either end."""
    turn = np.linspace(0, 2 * math.pi * 2.5, 46)
    radius, rise = 0.22, 0.16 / (2 * math.pi)
    zero = np.zeros_like(turn)
    circle = np.stack((np.sin(turn), zero, np.cos(turn)), axis=1)
    quarter = np.stack((np.cos(turn), zero, -np.sin(turn)), axis=1)
    up = np.array([0.0, 1.0, 0.0])
    mesh = Mesh()
    centres = radius * circle + (rise * turn + 0.07)[:, None] * up
    tube(mesh, centres, radius * quarter + rise * up, -radius * circle, 0.055, 10)
    ring = tuple(range(10))
    mesh.faces += [ring[::-1], tuple(450 + k for k in ring)]
    return mesh


def knot1200() -> Mesh:
    """A trefoil: the (2, 3) torus knot as a closed tube of 75 × 8 × 2 triangles."""
    t = np.linspace(0, 2 * math.pi, 76)
    t[-1] = 0
    big, small = 0.18, 0.09

    def curve(s: FloatArray) -> FloatArray:
        r = big + small * np.cos(3 * s)
        return np.stack((r * np.cos(2 * s), r * np.sin(2 * s) + 0.32, small * np.sin(3 * s)), axis=1)

    step = 1e-4
    before, here, after = curve(t - step), curve(t), curve(t + step)
    mesh = Mesh()
    tube(mesh, here, (after - before) / (2 * step), (after - 2 * here + before) / step**2, 0.045, 8)
    return mesh
