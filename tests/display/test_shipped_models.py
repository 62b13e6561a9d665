"""The display models: counts, sides, shared edges, and files that are what the program writes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import Facets, lit_facets, load_display, pitch_mm, shared_edges, triangulate
from quiltcli.job import load_display_file
from quiltcli.job.load import load_mirror_file

FOLDER = Path(__file__).parents[2] / "display_models"
sys.path.insert(0, str(FOLDER))
import generate  # noqa: E402 - a script beside the package, not a part of it

COUNTS = {
    "cube5": 5, "corner_billboard": 2, "cave5": 5, "icosahedron": 20, "dodecahedron": 12, "sphere840": 840,
    "sphere1620": 1620, "cylinder216": 216, "desk816": 816, "teapot1024": 1024, "spring902": 902,
    "knot1200": 1200,
}  # fmt: skip
# Facets meet others along every edge but these.
OPEN_EDGES = {
    "cube5": 4,
    "corner_billboard": 6,
    "cave5": 4,
    "cylinder216": 48,
    "desk816": 116,
    "teapot1024": 64,
}
EULER = {"icosahedron": 2, "dodecahedron": 2, "sphere840": 2, "sphere1620": 2, "spring902": 2, "knot1200": 0}


def load(name: str) -> Facets:
    return load_display(load_display_file(FOLDER / f"{name}.yaml"))


def test_every_model_is_in_the_table() -> None:
    assert list(generate.MODELS) == list(COUNTS)


@pytest.mark.parametrize("name", COUNTS)
def test_files_are_what_the_generator_writes(name: str) -> None:
    assert (FOLDER / f"{name}.obj").read_text() == generate.obj_text(name)
    assert (FOLDER / f"{name}.yaml").read_text() == generate.display_text(name)


@pytest.mark.parametrize("name", COUNTS)
def test_counts_pixels_and_pitch(name: str) -> None:
    facets = load(name)
    assert facets.count == COUNTS[name]
    assert 4e6 < np.prod(facets.size, axis=1, dtype=np.int64).sum() < 17e6
    low, high = pitch_mm(facets)
    assert 0.25 < low <= high < 4.1


@pytest.mark.parametrize("name", COUNTS)
def test_shared_edges(name: str) -> None:
    facets = load(name)
    edges = shared_edges(facets)
    assert 2 * edges.count == len(facets.corners) - OPEN_EDGES.get(name, 0)


def test_cube5_has_eight_shared_edges() -> None:
    assert shared_edges(load("cube5")).count == 8


@pytest.mark.parametrize("name", EULER)
def test_closed_shapes_obey_euler(name: str) -> None:
    facets = load(name)
    vertices = len(np.unique(facets.corners, axis=0))
    assert vertices - shared_edges(facets).count + facets.count == EULER[name]


@pytest.mark.parametrize("name", EULER)
def test_closed_shapes_are_wound_outwards(name: str) -> None:
    facets = load(name)
    a, b, c = facets.corners[triangulate(facets)[0]].transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() / 6 > 0.01


@pytest.mark.parametrize("name", COUNTS)
def test_neighbours_are_wound_alike(name: str) -> None:
    mesh = generate.MODELS[name].make()
    points = [generate.rounded(vertex) for vertex in mesh.vertices]
    edges = [(points[a], points[b]) for f in mesh.faces for a, b in zip(f, (*f[1:], f[0]), strict=True)]
    assert len(set(edges)) == len(edges)


@pytest.mark.parametrize(
    "name", ["cube5", "icosahedron", "dodecahedron", "sphere840", "sphere1620", "cylinder216"]
)
def test_convex_shapes_are_lit_outside(name: str) -> None:
    facets = load(name)
    inside = np.array([0.0, 0.2, 0.0])
    assert not lit_facets(facets, inside).any()
    outside = inside + 10 * facets.normal
    assert all(lit_facets(facets, eye)[k] for k, eye in enumerate(outside))


@pytest.mark.parametrize(("name", "eye"), [("cave5", (0, 1.7, 0)), ("desk816", (0, 1.2, 0))])
def test_displays_around_the_viewer_are_lit_inside(name: str, eye: tuple[float, ...]) -> None:
    assert lit_facets(load(name), np.array(eye, np.float64)).mean() > 0.9


def test_billboard_shows_both_walls_to_the_street() -> None:
    assert lit_facets(load("corner_billboard"), np.array([0, 1.6, 20.0])).all()


def test_teapot_parts_are_lit_outside() -> None:
    facets = load("teapot1024")
    part = np.arange(facets.count)
    edges = shared_edges(facets)
    while True:
        least = np.minimum(part[edges.facet_a], part[edges.facet_b])
        before = part.copy()
        np.minimum.at(part, edges.facet_a, least)
        np.minimum.at(part, edges.facet_b, least)
        if np.array_equal(part, before):
            break
    triangles, owner = triangulate(facets)
    for name, count in zip(np.unique(part), (528, 240, 128, 128), strict=True):
        corners = facets.corners[triangles[part[owner] == name]]
        assert len(corners) == count
        a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
        assert (np.cross(a, b) * c).sum() > 0


@pytest.mark.parametrize("name", ["cube5", "cave5"])
def test_floor_and_tops_continue_the_front_picture(name: str) -> None:
    facets = load(name)
    up = dict(zip(facets.names, (-facets.dv).tolist(), strict=True))
    flat = {"cube5": {"top": -1}, "cave5": {"floor": -1, "ceiling": 1}}[name]
    for wall, z in flat.items():
        assert np.sign(np.round(up[wall], 9)).tolist() == [0, 0, z]


def test_panels_of_cube5_are_whole_panels() -> None:
    facets = load("cube5")
    assert facets.size.tolist() == [[1920, 1080]] * 4 + [[1920, 1920]]
    np.testing.assert_allclose(np.linalg.norm(facets.du, axis=1), 0.27675e-3)
    np.testing.assert_allclose(np.linalg.norm(facets.dv, axis=1), 0.27675e-3)


@pytest.mark.parametrize("name", generate.CURVED)
def test_curved_displays_are_what_the_generator_writes_and_can_be_built(name: str) -> None:
    assert (FOLDER / f"{name}.yaml").read_text() == generate.curved_text(name)
    facets = load(name)
    assert facets.count == (4 if name == "projected_sphere" else 1)
    assert facets.curved.all()
    assert 1.5e6 < np.prod(facets.size, axis=1, dtype=np.int64).sum() < 17e6


@pytest.mark.parametrize("name", generate.MIRRORS)
def test_mirrors_are_what_the_generator_writes(name: str) -> None:
    assert (FOLDER / f"{name}.yaml").read_text() == generate.mirror_text(name)
    display = load_mirror_file(FOLDER / f"{name}.yaml")
    assert display.timing.rpm == display.packing.rpm == 1000
