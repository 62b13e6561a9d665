"""Turns of a spinning mirror: visibility by edge functions against rays, and whole turns.

`python -m tests.benchmarks.rings [--quick] [MESH.ply …]` prints a table. One thread each, in processor time,
by turns over the same positions of the mirror; whole turns in wall seconds of two workers.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array
from quiltcli.job import load_scene_file
from quiltcli.ring.cast import Target, aim_at, see_by_rays
from quiltcli.ring.curve import Curve
from quiltcli.ring.raster import Mesh, mesh_of, see
from quiltcli.ring.rays import Window, window_rays
from quiltcli.ring.rig import Pose, ideal_projector
from quiltcli.scene.load import load_scene
from tests.benchmarks.turns import whole_turn

SIZE = (768, 768)
RING = Curve(0.4, 1.0)
COUNTS = (47_000, 202_000, 871_000)
LIMITS = {47_000: 1.5, 202_000: 1.5, 871_000: 3.5}
"""Most that edge functions may take of the time of one Embree ray a pixel."""
SETTLED = 0.4
"""Most that they may take of the time of settled rays."""
TURN = 1.5
"""Most that a whole turn by two workers may take of the time of its visibility by one process."""
MEMORY = 2.5e9
"""Most memory of all processes of a turn, bytes."""
QUICK = 48
"""Positions of a turn where time is short."""


@dataclass(frozen=True)
class Row:
    """Seconds a picture for a mesh.

    Attributes:
        name: of the mesh.
        triangles: of it.
        exact: edge functions.
        embree: one ray a pixel with its generation, neither exact nor settled.
        settled: rays that are settled.
    """

    name: str
    triangles: int
    exact: float
    embree: float
    settled: float

    @property
    def limit(self) -> float:
        """Most that `exact` may take of `embree`."""
        return next(limit for count, limit in LIMITS.items() if self.triangles <= 1.2 * count)


def bumpy_ball(count: int) -> tuple[FloatArray, Int32Array]:
    """A ball with waves, of about so many triangles, 12 cm across."""
    rows = round(math.sqrt(count / 4))
    v, u = np.meshgrid(np.linspace(0.01, math.pi - 0.01, rows + 1), np.linspace(0, 2 * math.pi, 2 * rows + 1))
    radius = 0.055 + 0.004 * np.sin(7 * u) * np.sin(9 * v)
    points = np.stack((radius * np.sin(v) * np.cos(u), radius * np.cos(v), radius * np.sin(v) * np.sin(u)))
    at = np.arange(u.size).reshape(u.shape)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]
    faces = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (b, d, c))]
    return points.reshape(3, -1).T.copy(), np.concatenate(faces).astype(np.int32)


def read(path: Path) -> tuple[FloatArray, Int32Array]:
    """A mesh, 12 cm at its longest."""
    mesh = load_scene(load_scene_file(path))
    points = mesh.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - (low + high) / 2) * (0.12 / (high - low).max()), mesh.triangles


def embree_rays(pose: Pose, target: Target) -> np.ndarray:
    """What Embree names along one ray of every pixel of the disk."""
    window = Window(0, 0, *SIZE)
    rays = window_rays(pose, RING, window, (0.0, 0.0))
    row, column = np.divmod(np.arange(window.size), window.width)
    inside = np.flatnonzero((row - 384) ** 2 + (column - 384) ** 2 < 384**2)
    b, m, kappa = (part[inside].astype(np.float32) for part in (rays.b, rays.m, rays.kappa))
    axes = pose.axes.astype(np.float32)
    start = np.float32(-pose.origin[0] + 0.1)
    one = np.ones_like(b)
    origin = _world(axes, (start * one, b * start, kappa + m * start), pose.origin)
    along = _world(axes, (-one, -b, -m), np.zeros(3))
    return np.asarray(target.embree.run(origin, along))


def _world(axes: Float32Array, parts: tuple[Float32Array, ...], origin: FloatArray) -> Float32Array:
    shifted = [part + np.float32(shift) for part, shift in zip(parts, origin, strict=True)]
    return np.stack([sum(axes[k, j] * shifted[k] for k in range(3)) for j in range(3)], axis=-1)


def visibility(name: str, mesh: Mesh, rounds: int) -> Row:
    """Time one mesh at some angles."""
    target = aim_at(mesh)
    projector = ideal_projector(SIZE, 0.6, 0.13)
    times = {"exact": 0.0, "embree": 0.0, "settled": 0.0}
    works: dict[str, Callable[[Pose], object]] = {
        "exact": lambda pose: see(pose, RING, mesh, SIZE),
        "embree": lambda pose: embree_rays(pose, target),
        "settled": lambda pose: see_by_rays(pose, RING, mesh, SIZE),
    }
    for work in works.values():
        work(Pose(0.1, math.pi / 4, 0.0, projector))
    for number in range(rounds):
        pose = Pose(0.3 + 2.1 * number, math.pi / 4, 0.0, projector)
        for kind, work in works.items():
            if kind == "settled" and number:
                continue
            start = time.process_time()
            work(pose)
            times[kind] += time.process_time() - start
    return Row(name, mesh.count, times["exact"] / rounds, times["embree"] / rounds, times["settled"])


def table(rows: Iterable[Row]) -> Iterator[str]:
    """Lines of a table."""
    yield "| mesh | triangles | edge functions | one ray a pixel | settled rays | of one ray | of settled |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for row in rows:
        times = " | ".join(f"{1000 * each:.0f} ms" for each in (row.exact, row.embree, row.settled))
        first = f"{row.exact / row.embree:.2f} (≤ {row.limit:g})"
        second = f"{row.exact / row.settled:.3f} (≤ {SETTLED:g})"
        yield f"| {row.name} | {row.triangles:,} | {times} | {first} | {second} |"


def measure(rounds: int, positions: int = 288, paths: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Visibility of meshes, and whole turns of so many positions, as plain data."""
    shapes = [(path.stem, *read(path)) for path in paths]
    shapes += [] if paths else [(f"ball {count // 1000}K", *bumpy_ball(count)) for count in COUNTS]
    rows = [visibility(name, mesh_of(points, faces), rounds) for name, points, faces in shapes]
    found: dict[str, Any] = {"visibility": [asdict(row) | {"limit": row.limit} for row in rows], "turns": []}
    for name, points, faces in shapes if positions else ():
        with tempfile.TemporaryDirectory() as scratch:
            found["turns"].append({"name": name, **whole_turn(points, faces, positions, Path(scratch))})
    return found


def shares(turn: Mapping[str, Any]) -> dict[str, float]:
    """What a turn by two workers takes of its visibility by one, by the clock.

    In processor time both workers count half, as if neither waited: what a machine with other work would do.
    """
    return {
        "wall": turn["whole"]["wall"] / turn["seen"]["wall"],
        "cpu": turn["whole"]["cpu"] / 2 / turn["seen"]["cpu"],
    }


def told(found: Mapping[str, Any]) -> Iterator[str]:
    """What was measured, as lines."""
    rows = [{key: value for key, value in row.items() if key != "limit"} for row in found["visibility"]]
    yield from table(Row(**row) for row in rows)
    for turn in found["turns"]:
        share = shares(turn)
        yield (
            f"a turn of {turn['positions']}, {turn['name']}: {turn['whole']['wall']:.1f} s by two workers,"
            f" {share['wall']:.2f} of its visibility by one ({turn['seen']['wall']:.1f} s; ≤ {TURN:g}),"
            f" {share['cpu']:.2f} in processor time; {turn['memory'] / 1e9:.2f} GB (≤ {MEMORY / 1e9:g})"
        )


@click.command(help=__doc__)
@click.option("--quick", is_flag=True, help="One round, turns of 48 positions.")
@click.option("--positions", type=click.IntRange(0), help="Of whole turns; 0 for none.")
@click.argument("paths", nargs=-1, type=click.Path(exists=True, path_type=Path))
def main(quick: bool, positions: int | None, paths: tuple[Path, ...]) -> None:
    """Measure and print."""
    count = (QUICK if quick else 288) if positions is None else positions
    click.echo("\n".join(told(measure(1 if quick else 4, count, paths))))


if __name__ == "__main__":
    main()
