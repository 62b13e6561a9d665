"""Tangents that a glTF file brings, against normals that can be written down."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

import quiltcli
from quiltcli.geometry import rotation_deg
from tests.helpers.gltf_files import SQUARE, GltfFile

SLOPE = np.array([0.48, 0.6, 0.64])
UPRIGHT = [(0, 1), (1, 1), (1, 0), (0, 0)]


def square_file(path, tangents, uv=UPRIGHT, **node):
    """A square in z = 0 with a map of one slope everywhere."""
    data = io.BytesIO()
    Image.fromarray(np.full((4, 4, 3), np.rint((SLOPE + 1) * 127.5), np.uint8)).save(data, "PNG")
    file = GltfFile()
    image = file.add("images", bufferView=file.view(data.getvalue()), mimeType="image/png")
    file.json["textures"] = [{"source": image}]
    file.json["materials"] = [{"normalTexture": {"index": 0}}]
    corners = np.array(SQUARE, np.float32) * 2 - (1, 1, 0)
    attributes = {
        "NORMAL": file.accessor(np.tile(np.float32([0, 0, 1]), (4, 1))),
        "TEXCOORD_0": file.accessor(np.float32(uv)),
    }
    if tangents is not None:
        attributes["TANGENT"] = file.accessor(np.tile(np.float32(tangents), (4, 1)))
    file.node(mesh=file.mesh(file.primitive(corners, material=0, attributes=attributes)), **node)
    return file.write(path)


def normal_of(folder, tangents, **more):
    """The normal that the middle of the display sees."""
    square_file(folder / "m.glb", tangents, **more)
    (folder / "d.obj").write_text("v -0.1 -0.1 1\nv 0.1 -0.1 1\nv 0.1 0.1 1\nv -0.1 0.1 1\nf 1 2 3 4\n")
    (folder / "d.yaml").write_text("quilt_display: 1\nmesh: d.obj\nresolution: {facet_pixels: [8, 8]}\n")
    (folder / "s.yaml").write_text("quilt_scene: 1\nobjects: [{mesh: m.glb}]\n")
    (folder / "j.yaml").write_text(
        "quilt_job: 1\ndisplay: d.yaml\nscene: s.yaml\nframes: 1\noutput: {channels: [rgba, N]}\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes: "
        "[{frame: 1, position: [0, 0, 3], look_at: [0, 0, 0]}]}}\n"
    )
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    picture = frame.facet(1)
    assert picture["A"][4, 4] == 1
    return np.array([picture[f"N.{axis}"][4, 4] for axis in "XYZ"], float)


def expected(tangent, side):
    t = np.array(tangent, float)
    up = np.cross((0, 0, 1), t) * side
    return SLOPE[0] * t + SLOPE[1] * up + SLOPE[2] * np.array([0, 0, 1])


@pytest.mark.parametrize("tangent", [(1, 0, 0), (0, 1, 0), (-0.6, 0.8, 0)])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("uv", [UPRIGHT, [(1, 1), (0, 1), (0, 0), (1, 0)]])
def test_slopes_lie_on_the_tangents_of_the_file(tmp_path, tangent, side, uv):
    found = normal_of(tmp_path, (*tangent, side), uv=uv)
    np.testing.assert_allclose(found, expected(tangent, side), atol=6e-3)


def test_tangents_that_would_be_made_change_nothing(tmp_path):
    made = normal_of(tmp_path, None)
    np.testing.assert_allclose(made, expected((1, 0, 0), 1), atol=6e-3)
    np.testing.assert_array_equal(normal_of(tmp_path, (1, 0, 0, 1)), made)


@pytest.mark.parametrize("tangent", [(0, 0, 0, 1), (np.nan, 0, 0, 1), (1, 0, 0, 0.3), (0, 0, 1, 1)])
def test_what_is_no_tangent_is_made(tmp_path, tangent):
    np.testing.assert_array_equal(normal_of(tmp_path, tangent), normal_of(tmp_path, None))


def test_they_turn_and_are_mirrored_with_their_node(tmp_path):
    turn = rotation_deg((0, 0, 40))
    half = np.deg2rad(20)
    found = normal_of(tmp_path, (0, 1, 0, 1), rotation=[0, 0, float(np.sin(half)), float(np.cos(half))])
    np.testing.assert_allclose(found, turn @ expected((0, 1, 0), 1), atol=6e-3)
    found = normal_of(tmp_path, (0, 1, 0, 1), scale=[-1, 1, 1])
    np.testing.assert_allclose(found, expected((0, 1, 0), 1) * (-1, 1, 1), atol=6e-3)
