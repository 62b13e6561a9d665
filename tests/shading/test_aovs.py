"""Channels: names, types, empty values and what they hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.channels import CHANNELS, empty_buffers, exr_channels
from quiltcli.projection.gaze import Gaze
from quiltcli.projection.planar import QuiltRays
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import SOURCES, canonical_depth, fill
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.hits import single_places
from tests.helpers.wall_scene import EYE, STRAIGHT, hits, lights, wall

VIEWER = Viewer(1, EYE, np.array([0.0, 0, -1]), np.array([0.0, 1, 0]), 0.5, 10.0, "planar")
SCENE = wall(lights(ambient=(1, 0.5, 0.25)))


def filled(name, viewer=VIEWER, seen=STRAIGHT, scene=SCENE, pixels=2):
    buffers = empty_buffers([name], pixels)
    rays = QuiltRays(viewer.eye, np.ones(1, bool), np.eye(3)[None], np.eye(3)[None])
    fill(buffers, [name], Gaze(viewer, rays), Shaded(scene, viewer.eye, seen))
    return buffers


def test_every_channel_of_the_schema_is_computed_and_no_other():
    assert tuple(CHANNELS) == tuple(SOURCES)


def test_default_channels_have_the_types_everyone_expects():
    types = {name: (dtype.name, empty) for name, (dtype, empty) in exr_channels(["rgba", "Z"]).items()}
    half = ("float16", 0.0)
    assert types == {"R": half, "G": half, "B": half, "A": half, "Z": ("float32", np.inf)}


@pytest.mark.parametrize("name", ["facet", "object", "triangle"])
def test_ids_are_unsigned_and_start_at_one(name):
    ids = filled(name)[name]
    assert ids.dtype == np.uint32
    assert ids.tolist() == [1, 0]


def test_color_is_written_with_full_coverage():
    buffers = filled("rgba")
    assert [float(buffers[c][0]) for c in "RGBA"] == [1, 0.5, 0.25, 1]
    assert [float(buffers[c][1]) for c in "RGBA"] == [0, 0, 0, 0]


def test_too_bright_for_half_is_the_largest_half():
    glowing = wall(lights(), emission=(1e6, 0, 0))
    assert float(filled("rgba", scene=glowing)["R"][0]) == 65504


def test_planar_and_radial_depth():
    seen = hits([[3.0], [0.0], [-4.0]])
    assert VIEWER.depth_of(seen.position).tolist() == [[4]]
    assert replace(VIEWER, depth="radial").depth_of(seen.position).tolist() == [[5]]
    assert filled("Z", seen=seen)["Z"].tolist() == [4, np.inf]


def test_depth_is_rounded_once():
    position = np.array([[0.1], [0.2], [-(1 + 1e-9)]])
    assert filled("Z", seen=hits(position))["Z"][0] == np.float32(1 + 1e-9)


def test_canonical_depth_runs_from_near_to_far():
    assert canonical_depth(VIEWER, np.array([0.5, 10.0])) == pytest.approx([-1, 1], abs=1e-15)
    # Equation 4 of the paper by hand: (10.5 / 9.5) − 10 / (9.5 · 2)
    assert filled("zv")["zv"][0] == pytest.approx(10.5 / 9.5 - 10 / 19, rel=1e-7)
    assert filled("zv")["zv"][1] == np.inf


def test_points_are_in_the_world():
    seen = hits([[0.5], [-0.25], [-2.0]])
    buffers = filled("P", seen=seen)
    assert [float(buffers[f"P.{axis}"][0]) for axis in "XYZ"] == [0.5, -0.25, 0]
    assert buffers["P.X"].dtype == np.float32


def test_normals_face_the_eye():
    buffers = filled("N")
    assert [float(buffers[f"N.{axis}"][0]) for axis in "XYZ"] == [0, 0, 1]


def test_hits_go_to_their_own_pixels():
    seen = replace(hits([[0.0, 0], [0, 0], [-2, -3]]), places=single_places(np.array([3, 1])))
    assert filled("Z", seen=seen, pixels=4)["Z"].tolist() == [np.inf, 3, np.inf, 2]


def test_the_parts_of_light_have_layers_of_their_own():
    glowing = wall(lights(ambient=(1, 0.5, 0.25)), color=(0.5, 1, 1), emission=(0, 2, 0))
    for name, expected in (
        ("albedo", (0.5, 1, 1)),
        ("diffuse", (1, 0.5, 0.25)),
        ("specular", (0, 0, 0)),
        ("emission", (0, 2, 0)),
        ("rgba", (0.5, 2.5, 0.25)),
    ):
        buffers = filled(name, scene=glowing)
        assert [float(b[0]) for b in buffers.values()][:3] == list(expected)
        assert [float(b[1]) for b in buffers.values()][:3] == [0, 0, 0]
        assert {b.dtype.name for b in buffers.values()} == {"float16"}
