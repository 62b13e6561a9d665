"""Textured scenes on a spinning mirror."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.formats.png import save_png
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.ring.hits import WHOLE, Cell, met, ring_hits
from quiltcli.ring.maps import backward
from quiltcli.ring.picture import draw_picture
from quiltcli.ring.raster import see
from quiltcli.visibility.resolve.footprints import PointEdges
from tests.helpers.ring_job import ring_job

# A wall through the axis, seen from +Z.
WALL = """\
v -0.06 -0.05 0
v 0.06 -0.05 0
v 0.06 0.05 0
v -0.06 0.05 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3
f 1/1 3/3 4/4
"""


def textured(folder: Path, picture: np.ndarray, repeat: int = 1, method: str = "exact") -> Path:
    """A job of a wall with a picture on it."""
    job = ring_job(folder, size=96, lobe=15, method=method)
    (folder / "wall.obj").write_text(WALL)
    save_png(folder / "picture.png", picture)
    how = f"textures: {{color: picture.png, scale: [{repeat}, {repeat}]}}"
    (folder / "scene.yaml").write_text(
        f"quilt_scene: 1\nobjects: [{{mesh: wall.obj, material: {{unlit: true, {how}}}}}]\n"
    )
    return job


@pytest.mark.parametrize("method", ["exact", "raycast"])
def test_every_pixel_shows_the_texture_where_its_ray_meets_it(tmp_path: Path, method: str) -> None:
    """A picture whose red grows to the right and whose green grows upwards says where it is."""
    values = np.zeros((128, 128, 3), np.uint8)
    values[..., 0] = np.linspace(40, 240, 128)[None, :]
    values[..., 1] = np.linspace(240, 40, 128)[:, None]
    stage = set_ring_stage(load_job(textured(tmp_path, values, method=method)))
    show = stage.show(1)
    for angle in (np.pi / 2, 1.2):
        picture = draw_picture(show, angle)
        light = picture.rgb().astype(float)
        row, column = np.nonzero((picture.buffers["A"].reshape(96, 96) > 0) & picture.lit)
        assert row.size > 2000
        rays = backward(picture.pose, show.curve, column + 0.5, row + 0.5)
        viewer, mirror = (picture.pose.to_world(places.T) for places in (rays.viewer, rays.mirror))
        way = mirror - viewer
        place = viewer - (viewer[:, 2] / way[:, 2])[:, None] * way
        # The picture repeats, and bleeds into itself at its rim.
        inner = (np.abs(place[:, 0]) < 0.058) & (np.abs(place[:, 1]) < 0.048)
        row, column, place = row[inner], column[inner], place[inner]
        linear = np.where(values <= 10, values / 3294.6, ((values / 255 + 0.055) / 1.055) ** 2.4)
        centre = (np.arange(128) + 0.5) / 128
        red = np.interp((place[:, 0] + 0.06) / 0.12, centre, linear[0, :, 0])
        green = np.interp((place[:, 1] + 0.05) / 0.1, centre, linear[::-1, 0, 1])
        np.testing.assert_allclose(light[row, column, 0], red, atol=0.012)
        np.testing.assert_allclose(light[row, column, 1], green, atol=0.012)


def test_fine_patterns_are_filtered_and_do_not_alias(tmp_path: Path) -> None:
    """Of checkers much finer than a pixel their mean is left."""
    checkers = np.indices((64, 64)).sum(axis=0) % 2 * 255
    values = np.repeat(checkers[..., None], 3, axis=2).astype(np.uint8)
    stage = set_ring_stage(load_job(textured(tmp_path, values, repeat=8)))
    picture = draw_picture(stage.show(1), np.pi / 2)
    light = picture.rgb()[..., 0].astype(float).reshape(96, 96)
    inner = np.zeros((96, 96), np.bool_)
    inner[36:60, 36:60] = True
    assert light[inner].mean() == pytest.approx(0.5, abs=0.02)
    assert light[inner].std() < 0.05


def test_a_sample_looks_textures_up_in_the_middle_of_its_cell_and_over_it(tmp_path: Path) -> None:
    """Where the ray through the cell's middle meets the triangle; slopes go over the cell, not the pixel."""
    stage = set_ring_stage(load_job(textured(tmp_path, np.zeros((4, 4, 3), np.uint8))))
    show, pose = stage.show(1), stage.rig.at(1.2)
    place, cell = (0.125, -0.375), Cell((-0.0625, 0.125), (0.25, 0.5))
    seen, there = (
        see(pose, show.curve, show.mesh, (96, 96), beside=(place[0] + x, place[1] + y))
        for x, y in ((0.0, 0.0), cell.middle)
    )
    every = np.arange(seen.pixel.size)
    whole, part = (
        ring_hits(pose, show.mesh, show.scene, seen, slice(None), every, one).edges for one in (WHOLE, cell)
    )
    assert isinstance(whole, PointEdges)
    assert isinstance(part, PointEdges)
    assert np.array_equal(part.slopes[:, 0], whole.slopes[:, 0] / 4)
    assert np.array_equal(part.slopes[:, 1], whole.slopes[:, 1] / 2)
    both = np.isin(seen.pixel, there.pixel) & (seen.window == there.window)
    wanted, _ = met(show.mesh, replace(seen, rays=there.rays), seen.pixel[both], seen.triangle[both])
    assert both.sum() > 2000
    # What is left is how the map bends within a pixel.
    assert np.abs(part.known[:, both] - wanted).max() < 0.01 * np.abs(whole.slopes).max()
    assert np.abs(whole.known[:, both] - wanted).max() > 0.1 * np.abs(whole.slopes).max()
