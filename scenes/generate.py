"""Write the meshes of this folder's scenes.

    python scenes/generate.py [NAME…]

Everything is built from formulas, so the same program always writes the same bytes. Meshes are OBJ
in metres with Y up; each stands on the ground with its middle at the origin unless its line below
says otherwise. Where a mesh has several materials, these are in an MTL file beside it. The scene files are
written by hand: they say where things stand, what they are made of and how they are lit.

To add a mesh, write a function that returns a `Mesh` and add a row to `MESHES`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "display_models"))

from shapes import Mesh, grid, icosahedron, revolved, tube  # noqa: E402  # stand in the folder added above
from teapot import teapot_patches  # noqa: E402

FloatArray = NDArray[np.float64]

# Linear reflectances of the meshes that have materials of their own.
PALETTE = {
    "cream": (0.62, 0.55, 0.43),
    "slate": (0.045, 0.06, 0.085),
    "rim": (0.12, 0.085, 0.06),
    "oak": (0.34, 0.19, 0.085),
    "walnut": (0.11, 0.055, 0.028),
    "chalk": (0.66, 0.64, 0.58),
    "sage": (0.19, 0.29, 0.21),
    "clay": (0.46, 0.19, 0.105),
    "dusk": (0.085, 0.14, 0.25),
    "street": (0.16, 0.16, 0.17),
    "strut": (0.42, 0.43, 0.46),
    "start": (0.02, 0.5, 0.05),
    "goal": (0.62, 0.015, 0.012),
} | {
    # The quarters of the city.
    f"quarter{k:02d}": (
        round(0.34 + 0.22 * math.cos(k * 2.4), 3),
        round(0.33 + 0.18 * math.cos(k * 2.4 + 2.1), 3),
        round(0.34 + 0.22 * math.cos(k * 2.4 + 4.2), 3),
    )
    for k in range(13)
}

# Materials of pictures, which pictures.py draws.
COVERED = {
    "tiles": "map_Kd tiles.png\nPr 0.35\n",
    "bricks": "map_Kd bricks.png\nnorm bricks_normal.png\nmap_Pr bricks_roughness.png\n",
}
SPAN = 1.5  # metres that a picture covers


@dataclass
class CoveredMesh(Mesh):
    """A mesh with texture coordinates (u, v) of the corners of all faces."""

    places: list[list[tuple[float, float]]] = field(default_factory=list)

    def add_panel(self, corner: tuple[float, ...], right: tuple[float, ...], up: tuple[float, ...]) -> None:
        """Add a rectangle from its lower left corner, seen from the front, covered to scale."""
        o, r, u = (np.array(vector, dtype=np.float64) for vector in (corner, right, up))
        first = self.add_points([o, o + r, o + r + u, o + u])
        self.faces.append(tuple(range(first, first + 4)))
        wide, high = float(np.linalg.norm(r)) / SPAN, float(np.linalg.norm(u)) / SPAN
        self.places.append([(0, 0), (wide, 0), (wide, high), (0, high)])


def teapot() -> Mesh:
    """The Utah teapot, a tenth of Newell's units in metres, every patch 10 × 10 quads."""
    t = np.arange(11) / 10
    basis = np.stack(((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3), axis=1)
    mesh = Mesh()
    for patch in teapot_patches():
        points = np.einsum("ik,jl,klc->ijc", basis, basis, patch)
        world = np.stack((points[..., 0], points[..., 2], -points[..., 1]), axis=2) * 0.1
        grid(mesh, world[::-1])
    return mesh


def knot() -> Mesh:
    """A (2, 3) torus knot lying flat, 1 m across, its tube 0.16 m thick."""
    t = np.linspace(0, 2 * math.pi, 181)
    t[-1] = 0

    def curve(s: FloatArray) -> FloatArray:
        r = 0.3 + 0.12 * np.cos(3 * s)
        return np.stack((r * np.cos(2 * s), 0.12 * np.sin(3 * s) + 0.2, -r * np.sin(2 * s)), axis=1)

    step = 1e-4
    before, here, after = curve(t - step), curve(t), curve(t + step)
    mesh = Mesh()
    tube(mesh, here, (after - before) / (2 * step), (after - 2 * here + before) / step**2, 0.08, 18)
    return mesh


def ball() -> Mesh:
    """A sphere of 1 m diameter around the origin."""
    turns = [math.pi * k / 32 for k in range(33)]
    return revolved([(0.5 * math.sin(t), -0.5 * math.cos(t)) for t in turns], 64)


def cone() -> Mesh:
    """A cone 1 m wide and high."""
    steps = [k / 6 for k in range(7)]
    return revolved([(0, 0), *((0.5 * (1 - s), s) for s in steps)], 64)


def cylinder() -> Mesh:
    """A cylinder 1 m wide and high."""
    return revolved([(0, 0), (0.5, 0), (0.5, 1), (0, 1)], 64)


def cube() -> Mesh:
    """A cube of 1 m."""
    mesh = Mesh()
    box(mesh, (-0.5, 0, -0.5), (0.5, 1, 0.5))
    return mesh


def box(mesh: Mesh, low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
    """Add the six sides of a box."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    first = mesh.add_points([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)])
    for side in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        mesh.faces.append(tuple(first + corner for corner in side))


def checker(mesh: Mesh, low: float, high: float, cells: int, colors: tuple[str, str]) -> None:
    """Add a square floor of tiles at height 0."""
    edge = np.linspace(low, high, cells + 1)
    for i in range(cells):
        for j in range(cells):
            tile = [
                (edge[i], edge[j + 1]),
                (edge[i + 1], edge[j + 1]),
                (edge[i + 1], edge[j]),
                (edge[i], edge[j]),
            ]
            paint(mesh, colors[(i + j) % 2])
            first = mesh.add_points([(x, 0, z) for x, z in tile])
            mesh.faces.append(tuple(range(first, first + 4)))


def paint(mesh: Mesh, name: str) -> None:
    """Let the faces that follow have a material."""
    mesh.names[len(mesh.faces)] = name


def board() -> Mesh:
    """A board of 8 × 8 tiles, 1 m wide, with a rim; its top is at height 0."""
    mesh = Mesh()
    checker(mesh, -0.46, 0.46, 8, ("cream", "slate"))
    paint(mesh, "rim")
    frame = [(0.46, 0.0), (0.5, -0.008), (0.5, -0.03), (0.46, -0.03)]
    corners = [(-1, 1), (1, 1), (1, -1), (-1, -1), (-1, 1)]
    grid(mesh, np.array([[(r * x, y, r * z) for x, z in corners] for r, y in reversed(frame)]))
    return mesh


def dish() -> Mesh:
    """A round board of tiles in five rings, 1 m wide, with a rim; its top is at height 0."""
    mesh = Mesh()
    sides = 48

    def ring(r: float, y: float) -> list[tuple[float, float, float]]:
        turns = [2 * math.pi * (k % sides) / sides for k in range(sides + 1)]
        return [(r * math.sin(t), y, r * math.cos(t)) for t in turns]

    radii = np.linspace(0, 0.46, 6)
    for i in range(5):
        inner, outer = ring(radii[i], 0), ring(radii[i + 1], 0)
        for k in range(sides):
            paint(mesh, ("cream", "slate")[(i + k // 4) % 2])
            grid_of = [[outer[k], outer[k + 1]], [inner[k], inner[k + 1]]]
            grid(mesh, np.array(grid_of))
    paint(mesh, "rim")
    grid(mesh, np.array([ring(0.46, -0.03), ring(0.5, -0.03), ring(0.5, -0.008), ring(0.46, 0)]))
    return mesh


def plate() -> Mesh:
    """A thin upright plate, 1 m × 0.7 m × 4 mm around the origin."""
    mesh = Mesh()
    box(mesh, (-0.5, -0.35, -0.002), (0.5, 0.35, 0.002))
    return mesh


def mosaic() -> CoveredMesh:
    """A round floor 1 m wide at height 0, one polygon; a picture lies on it as seen from above."""
    mesh = CoveredMesh()
    turns = [2 * math.pi * k / 64 for k in range(64)]
    places = [(0.5 * math.cos(t), 0.5 * math.sin(t)) for t in turns]
    first = mesh.add_points([(x, 0, -y) for x, y in places])
    mesh.faces.append(tuple(range(first, first + 64)))
    mesh.places.append([(x + 0.5, y + 0.5) for x, y in places])
    return mesh


def pavilion() -> Mesh:
    """Eight columns under a ring, on a round step below height 0; 1 m wide, 0.62 m high, for `mosaic`."""
    mesh = Mesh()
    paint(mesh, "chalk")
    turn(mesh, [(0, -0.05), (0.49, -0.05), (0.5, -0.04), (0.5, 0)], 64)
    column = [
        (0.045, 0),
        (0.045, 0.02),
        (0.03, 0.03),
        (0.024, 0.44),
        (0.024, 0.46),
        (0.042, 0.47),
        (0.042, 0.49),
    ]
    for k in range(8):
        angle = 2 * math.pi * (k + 0.5) / 8
        turn(mesh, [(0, 0), *column, (0, 0.49)], 20, (0.43 * math.cos(angle), 0.43 * math.sin(angle)))
    ring = [(0.37, 0.49), (0.49, 0.49), (0.49, 0.53), (0.5, 0.54), (0.5, 0.57), (0.38, 0.57), (0.37, 0.56)]
    turn(mesh, [*ring, ring[0]], 64)
    return mesh


def turn(
    mesh: Mesh, profile: list[tuple[float, float]], sides: int, at: tuple[float, float] = (0, 0)
) -> None:
    """Add what a profile makes around an upright axis at a place."""
    part = revolved(profile, sides)
    first = mesh.add_points([(x + at[0], y, z + at[1]) for x, y, z in part.vertices])
    mesh.faces += [tuple(first + corner for corner in face) for face in part.faces]


def room() -> Mesh:
    """A room of 6 m × 6 m, 3.2 m high, seen from inside: tiled floor, coloured walls, a beamed ceiling."""
    mesh = Mesh()
    checker(mesh, -3, 3, 12, ("chalk", "dusk"))
    h, w = 3.2, 3.0
    walls = {
        "sage": [(-w, -w), (w, -w)],
        "clay": [(w, -w), (w, w)],
        "cream": [(w, w), (-w, w)],
        "dusk": [(-w, w), (-w, -w)],
    }
    for color, ((x0, z0), (x1, z1)) in walls.items():
        paint(mesh, color)
        grid(mesh, np.array([[(x0, 0.12, z0), (x1, 0.12, z1)], [(x0, h, z0), (x1, h, z1)]]))
        paint(mesh, "walnut")
        grid(mesh, np.array([[(x0, 0, z0), (x1, 0, z1)], [(x0, 0.12, z0), (x1, 0.12, z1)]]))
    paint(mesh, "chalk")
    grid(mesh, np.array([[(-w, h, -w), (w, h, -w)], [(-w, h, w), (w, h, w)]]))
    paint(mesh, "oak")
    for x in (-2.25, -0.75, 0.75, 2.25):
        box(mesh, (x - 0.09, h - 0.16, -w), (x + 0.09, h, w))
    return mesh


def table() -> Mesh:
    """A table 1.2 m × 0.7 m, 0.74 m high."""
    mesh = Mesh()
    paint(mesh, "oak")
    box(mesh, (-0.6, 0.70, -0.35), (0.6, 0.74, 0.35))
    paint(mesh, "walnut")
    for x in (-0.56, 0.49):
        for z in (-0.31, 0.24):
            box(mesh, (x, 0, z), (x + 0.07, 0.70, z + 0.07))
    return mesh


def city() -> Mesh:
    """A city of 3,499 blocks on 600 m × 600 m around a square: 35,000 triangles in 14 groups.

    As many as the city of Lorenz and Döllner's paper has; heights and sides are pseudo-random, to 0.1 m.
    """
    mesh, state = Mesh(), 18

    def chance() -> float:
        nonlocal state
        state = (state * 1103515245 + 12345) % 2**31
        return state / 2**31

    lots = [(i, j) for i in range(-30, 30) for j in range(-30, 30) if i * i + j * j + i + j > 30]
    lots.sort(key=lambda lot: (13 * (math.atan2(lot[1] + 0.5, lot[0] + 0.5) + math.pi) // (2 * math.pi), lot))
    paint(mesh, "street")
    for k in range(5):
        z0, z1 = -300.0 + 120 * k, -180.0 + 120 * k
        grid(mesh, np.array([[(-300.0, 0, z1), (300.0, 0, z1)], [(-300.0, 0, z0), (300.0, 0, z0)]]))
    for i, j in lots[:3499]:
        quarter = int(13 * (math.atan2(j + 0.5, i + 0.5) + math.pi) // (2 * math.pi)) % 13
        paint(mesh, f"quarter{quarter:02d}")
        wide, deep = (round(3 + 4.5 * chance(), 1) for _ in range(2))
        near = 1 - math.hypot(i, j) / 42
        high = round(3 + 9 * chance() + 60 * max(near, 0) ** 2 * chance() ** 3, 1)
        x, z = round(10 * i + 1.2 + 0.8 * chance(), 1), round(10 * j + 1.2 + 0.8 * chance(), 1)
        south, north = round(z + deep, 1), z
        west, east = x, round(x + wide, 1)
        ring = [(west, south), (east, south), (east, north), (west, north)]
        first = mesh.add_points([(u, v, w) for v in (0, high) for u, w in ring])
        walls = [(k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4)]
        mesh.faces += [tuple(first + k for k in face) for face in (*walls, (4, 5, 6, 7))]
    return mesh


def hall() -> CoveredMesh:
    """A hall of 6 m × 6 m, 3.2 m high, seen from inside: tiles, brick walls and two brick pillars."""
    mesh = CoveredMesh()
    w, h = 3.0, 3.2
    paint(mesh, "tiles")
    mesh.add_panel((-w, 0, w), (2 * w, 0, 0), (0, 0, -2 * w))
    paint(mesh, "bricks")
    mesh.add_panel((-w, 0, -w), (2 * w, 0, 0), (0, h, 0))
    mesh.add_panel((w, 0, -w), (0, 0, 2 * w), (0, h, 0))
    mesh.add_panel((w, 0, w), (-2 * w, 0, 0), (0, h, 0))
    mesh.add_panel((-w, 0, w), (0, 0, -2 * w), (0, h, 0))
    for x, z, high in ((-1.6, -1.9, 2.4), (1.2, -1.6, 0.9)):
        r = 0.3
        sides = [(x - r, z + r, 1, 0), (x + r, z + r, 0, -1), (x + r, z - r, -1, 0), (x - r, z - r, 0, 1)]
        for x0, z0, dx, dz in sides:
            mesh.add_panel((x0, 0, z0), (2 * r * dx, 0, 2 * r * dz), (0, high, 0))
        mesh.add_panel((x - r, high, z + r), (2 * r, 0, 0), (0, 0, -2 * r))
    paint(mesh, "chalk")
    mesh.add_panel((-w, h, -w), (2 * w, 0, 0), (0, 0, 2 * w))
    return mesh


MESHES: dict[str, Callable[[], Mesh]] = {
    "teapot": teapot,
    "knot": knot,
    "icosahedron": icosahedron,
    "ball": ball,
    "cone": cone,
    "cylinder": cylinder,
    "cube": cube,
    "board": board,
    "dish": dish,
    "plate": plate,
    "mosaic": mosaic,
    "pavilion": pavilion,
    "hall": hall,
    "room": room,
    "table": table,
    "city": city,
}


def obj_text(name: str) -> str:
    """One of `MESHES` as OBJ."""
    return mesh_text(MESHES[name](), name)


def mesh_text(mesh: Mesh, name: str, maker: str = "generate.py") -> str:
    """A mesh as OBJ, to a micrometre."""
    lines = [f"# {name}: made by {maker}, metres, Y up"]
    if mesh.names:
        lines.append(f"mtllib {name}.mtl")
    lines += ["v " + " ".join(f"{round(c, 6) + 0.0:.6g}" for c in point) for point in mesh.vertices]
    places = mesh.places if isinstance(mesh, CoveredMesh) else []
    lines += [f"vt {round(u, 6):.6g} {round(v, 6):.6g}" for corners in places for u, v in corners]
    current = ""
    for index, face in enumerate(mesh.faces):
        if mesh.names.get(index, current) != current:
            current = mesh.names[index]
            lines.append(f"usemtl {current}")
        corners = [str(corner + 1) for corner in face]
        if places:
            corners = [f"{corner}/{4 * index + k + 1}" for k, corner in enumerate(corners)]
        lines.append("f " + " ".join(corners))
    return "\n".join(lines) + "\n"


def mtl_text(name: str) -> str:
    """The materials a mesh uses, empty when it has none of its own."""
    names = set(MESHES[name]().names.values())
    plain = sorted(names & PALETTE.keys())
    return palette_text(plain) + "".join(
        f"newmtl {m}\nKd 1 1 1\n{COVERED[m]}" for m in sorted(names & COVERED.keys())
    )


def palette_text(names: Iterable[str]) -> str:
    """Materials of the palette as MTL."""
    return "".join(f"newmtl {m}\nKd {' '.join(map(str, PALETTE[m]))}\nNs 30\n" for m in names)


def write(folder: Path, names: Iterable[str]) -> None:
    """Write meshes, and their materials, into a folder."""
    for name in names:
        (folder / f"{name}.obj").write_text(obj_text(name), encoding="utf-8")
        if materials := mtl_text(name):
            (folder / f"{name}.mtl").write_text(materials, encoding="utf-8")


if __name__ == "__main__":
    write(HERE, sys.argv[1:] or MESHES)
