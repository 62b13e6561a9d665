"""Write the scenes of a study of displays anew: paths along the edges of hollow cubes.

    python scenes/generate_study.py [--seed N] [-o FOLDER]

The task is that of Harish & Narayanan's user study (*Designing Perspectively-Correct Multiplanar Displays*,
§5, figure 22): a hollow cube of nodes and struts, all of it connected, and the way to be found from the green
node to the red one along the struts. One can see through the cube, and not all of it from one side.

Nodes are the points of a lattice on the surface of a cube. Struts are a random tree that reaches all of them
(Kruskal's, with random weights) and some other lattice edges, so that there are detours. Start and goal
are two nodes that share no side of the cube, as far apart along the struts as the level says, or as near to
that as the struts allow. How far they are is found by breadth-first search and written down in `tasks.json`,
with all nodes and struts.

The same seed makes the same scenes everywhere: chance here is a formula.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from generate import PALETTE, Mesh, mesh_text, paint, palette_text  # noqa: E402  # beside this file
from shapes import icosahedron, revolved  # noqa: E402

Node = tuple[int, int, int]
Strut = tuple[int, int]

SEED = 22
SIDE = 0.31  # metres, so that the balls at the corners stay inside a sphere of 0.3 m
STRUT, BALL, MARK = 0.0045, 0.0085, 0.019  # radii, metres
EXTRA = 0.25  # share of the lattice's other edges that are struts too
LEVELS = {"practice": (2, 7), "easy": (3, 10), "medium": (4, 14), "hard": (5, 18)}
"""Lattice steps along an edge of the cube, and struts from start to goal."""


@dataclass(frozen=True)
class Task:
    """A path to find.

    Attributes:
        level: its name.
        steps: lattice steps along an edge of the cube.
        nodes: places in the lattice.
        struts: pairs of nodes, the lesser first.
        start: the green node.
        goal: the red one.
        path: the nodes of one of the shortest ways from start to goal.
    """

    level: str
    steps: int
    nodes: list[Node]
    struts: list[Strut]
    start: int
    goal: int
    path: list[int]

    @property
    def optimal_length(self) -> int:
        """Struts of the shortest way."""
        return len(self.path) - 1


class Dice:
    """Numbers from 0 to 1 that a seed decides, alike on all machines (an LCG of 64 bits, Knuth's)."""

    def __init__(self, seed: int) -> None:
        self._state = seed * 2862933555777941757 + 3037000493
        for _ in range(8):
            self.roll()

    def roll(self) -> float:
        """The next number."""
        self._state = (self._state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self._state >> 11) / 2**53


def make_task(level: str, seed: int) -> Task:
    """The task of a level."""
    steps, wanted = LEVELS[level]
    dice = Dice(1000 * seed + steps)
    every = [(x, y, z) for x in range(steps + 1) for y in range(steps + 1) for z in range(steps + 1)]
    nodes = [node for node in every if {0, steps} & set(node)]
    struts = _struts(nodes, dice)
    ways = [_search(struts, len(nodes), start) for start in range(len(nodes))]
    pairs = [
        (abs(len(_way(ways[a], b)) - 1 - wanted), dice.roll(), a, b)
        for a in range(len(nodes))
        for b in range(len(nodes))
        if not any(p == q and p in (0, steps) for p, q in zip(nodes[a], nodes[b], strict=True))
    ]
    *_, start, goal = min(pairs)
    return Task(level, steps, nodes, struts, start, goal, _way(ways[start], goal))


def _struts(nodes: list[Node], dice: Dice) -> list[Strut]:
    """A tree that reaches all nodes, and some edges more."""
    number = {node: k for k, node in enumerate(nodes)}
    edges = []
    for (x, y, z), k in number.items():
        ahead = [node for node in ((x + 1, y, z), (x, y + 1, z), (x, y, z + 1)) if node in number]
        edges += [(dice.roll(), k, number[node]) for node in ahead]
    root = list(range(len(nodes)))

    def top(k: int) -> int:
        while root[k] != k:
            k = root[k]
        return k

    chosen, left = [], []
    for _, a, b in sorted(edges):
        if top(a) == top(b):
            left.append((a, b))
        else:
            root[top(a)] = top(b)
            chosen.append((a, b))
    return sorted(chosen + [edge for edge in left if dice.roll() < EXTRA])


def _search(struts: list[Strut], count: int, start: int) -> list[int]:
    """Breadth-first search: the node before each node on a shortest way from `start`, itself at `start`."""
    beside: list[list[int]] = [[] for _ in range(count)]
    for a, b in struts:
        beside[a].append(b)
        beside[b].append(a)
    before = [-1] * count
    before[start] = start
    waiting = deque([start])
    while waiting:
        here = waiting.popleft()
        for node in beside[here]:
            if before[node] < 0:
                before[node] = here
                waiting.append(node)
    return before


def _way(before: list[int], goal: int) -> list[int]:
    """The nodes from the start of a search to a node."""
    way = [goal]
    while before[way[-1]] != way[-1]:
        way.append(before[way[-1]])
    return way[::-1]


def task_mesh(task: Task) -> Mesh:
    """Balls and struts about the origin."""
    places = (np.array(task.nodes) / task.steps - 0.5) * SIDE
    mesh = Mesh()
    paint(mesh, "strut")
    rod = revolved([(STRUT, 0.0), (STRUT, 1.0)], 10)
    for a, b in task.struts:
        way = places[b] - places[a]
        along = np.roll(np.eye(3), int(np.abs(way).argmax()) - 1, axis=1)  # turns Y to the strut's axis
        _add(mesh, rod, np.array([1, np.abs(way).max(), 1]), along, places[a])
    ball = icosahedron()
    for k, place in enumerate(places):
        if k not in (task.start, task.goal):
            _add(mesh, ball, np.full(3, BALL / 0.3), np.eye(3), place, (0, 0.3, 0))
    turns = np.linspace(0, np.pi, 9)
    large = revolved([(float(np.sin(t)), float(-np.cos(t))) for t in turns], 16)
    for name, k in (("start", task.start), ("goal", task.goal)):
        paint(mesh, name)
        _add(mesh, large, np.full(3, MARK), np.eye(3), places[k])
    return mesh


def _add(
    mesh: Mesh, part: Mesh, scale: np.ndarray, turn: np.ndarray, place: np.ndarray, middle: tuple = (0, 0, 0)
) -> None:
    """Add a part: taken about its middle, scaled, turned and put in a place."""
    first = mesh.add_points((np.array(part.vertices) - middle) * scale @ turn + place)
    mesh.faces += [tuple(first + corner for corner in face) for face in part.faces]


LIGHTS = """lights:
- {type: directional, direction: [-0.55, -1, -0.6], color: [3.2, 3.0, 2.7]}
- {type: directional, direction: [0.9, -0.35, 0.25], color: [0.8, 0.9, 1.2]}
- {type: directional, direction: [0.1, -0.5, 1], color: [0.75, 0.7, 0.65]}
- {type: ambient, color: [0.25, 0.27, 0.3]}
background: [0.012, 0.016, 0.03]
"""

IN_SPHERE = """# yaml-language-server: $schema=../../docs/schema/scene.schema.json
# From green to red along the struts: {length} at least. In the middle of the display sphere840.
# Made by generate_study.py.
quilt_scene: 1
objects:
- name: {level}
  mesh: {level}.obj
  transform: {{translate: [0, 0.3, 0]}}
  normals: smooth
"""

BEHIND_PANEL = """# yaml-language-server: $schema=../../docs/schema/scene.schema.json
# The same cube, smaller, in a flat panel; it turns once in 96 frames, as walking about it would show it.
# Made by generate_study.py.
quilt_scene: 1
objects:
- name: {level}
  mesh: {level}.obj
  transform:
    keyframes:
    - {{frame: 1, translate: [0, 0.28, -0.16], scale: 0.7}}
    - {{frame: 33, translate: [0, 0.28, -0.16], scale: 0.7, rotate_deg: [0, -120, 0]}}
    - {{frame: 65, translate: [0, 0.28, -0.16], scale: 0.7, rotate_deg: [0, -240, 0]}}
    - {{frame: 97, translate: [0, 0.28, -0.16], scale: 0.7, rotate_deg: [0, -360, 0]}}
  normals: smooth
"""


def files(seed: int = SEED) -> Iterator[tuple[str, str]]:
    """Names and texts of all files."""
    tasks = [make_task(level, seed) for level in LEVELS]
    for task in tasks:
        words = {"level": task.level, "length": task.optimal_length}
        yield f"{task.level}.obj", mesh_text(task_mesh(task), task.level, "generate_study.py")
        yield f"{task.level}.mtl", palette_text(sorted({"strut", "start", "goal"} & PALETTE.keys()))
        yield f"{task.level}.yaml", IN_SPHERE.format(**words) + LIGHTS
        yield f"{task.level}_on_panel.yaml", BEHIND_PANEL.format(**words) + LIGHTS
    yield "tasks.json", _json(tasks, seed)


def _json(tasks: list[Task], seed: int) -> str:
    """All that is known of the tasks, a line for each list."""
    parts = []
    for task in tasks:
        facts = {
            "task": task.level,
            "steps": task.steps,
            "optimal_length": task.optimal_length,
            "start": task.start,
            "goal": task.goal,
            "path": task.path,
            "nodes": task.nodes,
            "struts": task.struts,
        }
        parts.append(
            ",\n  ".join(f"{json.dumps(name)}: {json.dumps(value)}" for name, value in facts.items())
        )
    body = "},\n {".join(parts)
    return f'{{"seed": {seed},\n "side": {SIDE},\n "tasks": [\n {{{body}}}\n]}}\n'


def write(folder: Path, seed: int = SEED) -> None:
    """Write all files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files(seed):
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write scenes of paths along the edges of hollow cubes.")
    parser.add_argument("--seed", type=int, default=SEED, help="which paths; %(default)s as shipped")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "study", help="folder, here by default")
    said = parser.parse_args()
    write(said.output, said.seed)
