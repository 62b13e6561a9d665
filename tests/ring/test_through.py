"""Surfaces that light may pass on a spinning mirror, held against rays that gather all they meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.errors import SceneError
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.ring.cast import Lines, Target, lines_of, meet
from quiltcli.ring.hits import Cell
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.picture import Show, draw_picture
from quiltcli.ring.raster import mesh_of, see
from quiltcli.ring.vertexwise import see_by_vertices
from quiltcli.scene.scene import ALPHAS
from quiltcli.visibility.setup.planes import LATTICE
from tests.helpers.ring_job import ring_job
from tests.helpers.ring_scenes import RING, rig
from tests.render.test_transparency import scene_of, soup

SIZE = (96, 72)
ANGLE = 0.4


def small_soup(seed=1, count=30):
    scene = soup(seed, count)
    return replace(scene, vertices=scene.vertices * 0.05, background=np.float32([0.1, 0.2, 0.4]))


def show_of(scene, channels=("rgba", "Z", "triangle"), method=see, **more):
    return Show(
        rig=rig(SIZE), curve=RING, scene=scene, mesh=mesh_of(scene.vertices, scene.triangles),
        channels=channels, see=method, **more,
    )  # fmt: skip


def gathered(scene, show):
    """Colour, alpha, nearest triangle and its distance of each pixel that lights the mirror."""
    pose = show.rig.at(ANGLE, 0)
    pixels = np.flatnonzero(lit_pixels(show.rig, pose))
    y, x = np.divmod(pixels, SIZE[0])
    lines = lines_of(pose, show.curve, x + 0.5 + LATTICE[0], y + 0.5 + LATTICE[1])
    count = len(scene.triangles)
    target = Target(scene.vertices, scene.triangles, None, None, None, 1.0)
    row, triangle = np.repeat(np.arange(pixels.size), count), np.tile(np.arange(count), pixels.size)
    hit, distance = meet(target, Lines(lines.eye, lines.along), row, triangle, False)
    distance = np.where(hit, distance, np.inf).reshape(-1, count)
    table = scene.materials
    alpha = np.where(
        table.alpha == ALPHAS.index("mask"), table.opacity >= table.cutoff, table.opacity.astype(float)
    )
    alpha = np.where(table.alpha == 0, 1.0, alpha)[scene.material]
    order = np.argsort(distance, axis=1)
    through, light = np.ones(pixels.size), np.zeros((pixels.size, 3))
    nearest = np.full(pixels.size, -1)
    for column in order.T:
        there = np.isfinite(distance[np.arange(pixels.size), column])
        own = np.where(there, alpha[column], 0.0)
        light += (through * own)[:, None] * table.color[scene.material[column]]
        through = through * (1 - own)
        nearest = np.where((nearest < 0) & (own > 0), column, nearest)
    light += through[:, None] * scene.background
    return pixels, light, 1 - through, nearest


@pytest.mark.parametrize("seed", [1, 2])
def test_layers_are_blended_as_each_pixels_own_ray_meets_them(seed):
    scene = small_soup(seed)
    show = show_of(scene)
    picture = draw_picture(show, ANGLE)
    pixels, light, alpha, nearest = gathered(scene, show)
    assert np.unique(np.round(alpha, 3)).size > 6
    buffers = picture.buffers
    same = buffers["triangle"][pixels] == nearest + 1
    assert same.mean() > 0.995
    for k, name in enumerate("RGB"):
        off = np.abs(buffers[name][pixels].astype(float) - light[:, k])
        assert np.quantile(off, 0.99) < 2e-3, name
    assert np.quantile(np.abs(buffers["A"][pixels].astype(float) - alpha), 0.99) < 2e-3
    assert (np.isfinite(buffers["Z"][pixels]) == (buffers["A"][pixels] > 0)).all()
    assert picture.counts.visible == np.count_nonzero(np.isfinite(buffers["Z"]))


def test_straight_edges_and_samples_show_the_same_layers():
    scene = small_soup(3)
    exact = draw_picture(show_of(scene), ANGLE).buffers
    straight = draw_picture(show_of(scene, method=see_by_vertices), ANGLE).buffers
    assert (exact["triangle"] == straight["triangle"]).mean() > 0.99
    assert np.abs(exact["R"].astype(float) - straight["R"]).mean() < 5e-3
    places = ((-0.25, 0.0), (0.25, 0.0))
    several = show_of(scene, samples=places, cells=(Cell(), Cell()))
    halves = [draw_picture(show_of(scene, ("rgba",), samples=(place,)), ANGLE).buffers for place in places]
    mean = (halves[0]["G"].astype(float) + halves[1]["G"]) / 2
    found = draw_picture(several, ANGLE).buffers["G"].astype(float)
    assert np.abs(found - mean).mean() < 0.02


def test_opaque_scenes_keep_their_bytes():
    """A pane that holds up everything is drawn as a wall is."""
    plates = np.array([(-0.03, -0.03, 0.01), (0.03, -0.03, 0.0), (0, 0.03, 0.0)])
    wall = scene_of(plates, [(0, 1, 2)], [((1, 0.5, 0.2), "opaque", 1.0)], [0])
    pane = scene_of(plates, [(0, 1, 2)], [((1, 0.5, 0.2), "blend", 1.0)], [0])
    first, second = (draw_picture(show_of(scene), ANGLE).buffers for scene in (wall, pane))
    for name, values in first.items():
        np.testing.assert_array_equal(second[name], values, err_msg=name)


def test_rays_say_that_they_do_not(tmp_path):
    job = ring_job(tmp_path)
    text = job.read_text()
    (tmp_path / "scene.obj").write_text("v -0.02 0 0\nv 0.02 0 0\nv 0 0.03 0\nf 1 2 3\n")
    (tmp_path / "glass.yaml").write_text(
        "quilt_scene: 1\nobjects: [{mesh: scene.obj, material: {opacity: 0.5}}]\n"
    )
    lines = [line if not line.startswith("scene:") else "scene: glass.yaml" for line in text.splitlines()]
    job.write_text("\n".join(lines) + "\n")
    set_ring_stage(load_job(job))
    job.write_text("\n".join(lines).replace("method: exact", "method: raycast") + "\n")
    with pytest.raises(SceneError, match="expected method exact or vertex"):
        set_ring_stage(load_job(job))
