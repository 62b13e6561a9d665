"""The scenes of the study: hollow, connected, marked, and as far from start to goal as they say."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, shortest_path

from quiltcli.job import load_job
from quiltcli.render.setup import set_stage
from quiltcli.scene import load_scene
from quiltcli.viewer.view import viewers_of

FOLDER = Path(__file__).parents[2] / "scenes" / "study"
TOLD = json.loads((FOLDER / "tasks.json").read_text())
LEVELS = [task["task"] for task in TOLD["tasks"]]


def task_of(level: str):
    return next(task for task in TOLD["tasks"] if task["task"] == level)


def generated(folder: Path, seed: int | None = None) -> Path:
    """The folder with scenes as the generator writes them."""
    program = [sys.executable, str(FOLDER.parent / "generate_study.py"), "-o", str(folder)]
    subprocess.run([*program, *(() if seed is None else ("--seed", str(seed)))], check=True)
    return folder


def steps_between(task) -> np.ndarray:
    """Struts from every node to every other, by SciPy's search."""
    a, b = np.array(task["struts"]).T
    count = len(task["nodes"])
    graph = coo_array((np.ones(a.size), (a, b)), shape=(count, count))
    assert connected_components(graph, directed=False)[0] == 1
    return shortest_path(graph, directed=False, unweighted=True)


def test_the_generator_wrote_the_scenes(tmp_path: Path) -> None:
    made = generated(tmp_path)
    names = sorted(path.name for path in made.iterdir())
    by_hand = {"sphere.yaml", "panel.yaml", "flat_panel.yaml"}
    assert names == sorted(path.name for path in FOLDER.iterdir() if path.name not in by_hand)
    for name in names:
        assert (made / name).read_bytes() == (FOLDER / name).read_bytes(), name


@pytest.mark.parametrize("level", LEVELS)
def test_the_optimal_length_is_what_a_search_finds(level: str) -> None:
    task = task_of(level)
    start, goal = task["start"], task["goal"]
    assert steps_between(task)[start, goal] == task["optimal_length"]
    assert (task["path"][0], task["path"][-1]) == (start, goal)
    assert len(task["path"]) == task["optimal_length"] + 1
    struts = {frozenset(strut) for strut in task["struts"]}
    assert all(frozenset(step) in struts for step in zip(task["path"], task["path"][1:], strict=False))


@pytest.mark.parametrize("level", LEVELS)
def test_nodes_are_all_of_a_hollow_lattice_and_struts_its_edges(level: str) -> None:
    task = task_of(level)
    steps, nodes = task["steps"], np.array(task["nodes"])
    assert len({tuple(node) for node in task["nodes"]}) == len(nodes) == (steps + 1) ** 3 - (steps - 1) ** 3
    assert ((nodes == 0) | (nodes == steps)).any(axis=1).all()
    a, b = np.array(task["struts"]).T
    assert (np.abs(nodes[a] - nodes[b]).sum(axis=1) == 1).all()
    assert len({frozenset(strut) for strut in task["struts"]}) == a.size >= len(nodes)  # there are detours
    sides = (nodes[task["start"]] == nodes[task["goal"]]) & np.isin(nodes[task["start"]], (0, steps))
    assert not sides.any()


@pytest.mark.parametrize("level", LEVELS)
def test_the_mesh_is_of_these_nodes_and_struts_from_green_to_red(level: str) -> None:
    task = task_of(level)
    scene = load_scene(FOLDER / f"{level}.yaml")
    assert scene.notices == ()
    vertices = scene.vertices - (0, 0.3, 0)
    assert np.linalg.norm(vertices, axis=1).max() < 0.29
    nodes = (np.array(task["nodes"]) / task["steps"] - 0.5) * TOLD["side"]
    # A point close about a node or a strut's middle for each, and none elsewhere: no strut too few or many.
    middles = np.array([(nodes[a] + nodes[b]) / 2 for a, b in task["struts"]])
    thick = 0.0046
    ends = np.array([[nodes[a], nodes[b]] for a, b in task["struts"]])
    way = ends[:, 1] - ends[:, 0]
    along = np.clip(((vertices[:, None] - ends[:, 0]) * way).sum(axis=2) / (way * way).sum(axis=1), 0, 1)[
        ..., None
    ]
    to_strut = np.linalg.norm(vertices[:, None] - ends[:, 0] - along * way, axis=2).min(axis=1)
    to_node = np.linalg.norm(vertices[:, None] - nodes, axis=2).min(axis=1)
    assert ((to_strut < thick) | (to_node < 0.02)).all()
    triangles = vertices[scene.triangles].mean(axis=1)
    for middle in middles:
        side = np.linalg.norm(triangles - middle, axis=1)
        assert (side < TOLD["side"] / task["steps"] / 2).any()
    color = scene.materials.color[scene.material]
    for mark, channel in ((task["start"], 1), (task["goal"], 0)):
        mine = (color.argmax(axis=1) == channel) & (
            color[:, channel] > 4 * np.delete(color, channel, 1).max(1)
        )
        assert mine.any()
        np.testing.assert_allclose(triangles[mine].mean(axis=0), nodes[mark], atol=1e-5)


def test_levels_grow(tmp_path: Path) -> None:
    lengths = [task["optimal_length"] for task in TOLD["tasks"]]
    assert lengths == sorted(lengths) == [7, 10, 14, 18]
    other = json.loads((generated(tmp_path, 5) / "tasks.json").read_text())
    assert other["seed"] == 5
    for task, shipped in zip(other["tasks"], TOLD["tasks"], strict=True):
        assert task["struts"] != shipped["struts"]
        assert steps_between(task)[task["start"], task["goal"]] == task["optimal_length"]
        assert abs(task["optimal_length"] - shipped["optimal_length"]) <= 2


@pytest.mark.parametrize("level", LEVELS)
def test_the_cube_stays_within_the_panel_however_it_is_turned(level: str) -> None:
    job = load_job(FOLDER / "panel.yaml", (f"scene={FOLDER / f'{level}_on_panel.yaml'}", "frames=1"))
    stage = set_stage(job)
    eye = viewers_of(job, [1])[0].eye
    points = stage.scene.vertices - (0, 0.28, -0.16)
    for turn in np.radians(np.arange(0, 90, 5)):
        c, s = np.cos(turn), np.sin(turn)
        there = points @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + (0, 0.28, -0.16)
        assert (there[:, 2] < 0.1).all()
        on = eye + (there - eye) * (eye[2] / (eye[2] - there[:, 2]))[:, None]
        assert (np.abs(on[:, 0]) < 0.2592).all()
        assert (np.abs(on[:, 1] - 0.3) < 0.162).all()
