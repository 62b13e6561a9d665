"""Textures whose alpha cuts surfaces out or lets light pass, before a wall of one colour."""

import numpy as np
import pytest
from PIL import Image

import quiltcli

PANE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n"
WALL = "v -3 -3 -1\nv 3 -3 -1\nv 3 3 -1\nv -3 3 -1\nf 1 2 3 4\n"


def seen(folder, mtl, *, more="", method="homography", samples=1):
    """Red of a pane over a wall of red 0.5, and whether the pane is what is seen first, by columns."""
    (folder / "m.mtl").write_text(f"newmtl a\n{mtl}")
    (folder / "pane.obj").write_text("mtllib m.mtl\n" + PANE)
    (folder / "wall.obj").write_text(WALL)
    (folder / "d.obj").write_text("v -0.5 -0.5 1\nv 0.5 -0.5 1\nv 0.5 0.5 1\nv -0.5 0.5 1\nf 1 2 3 4\n")
    (folder / "d.yaml").write_text("quilt_display: 1\nmesh: d.obj\nresolution: {facet_pixels: [64, 8]}\n")
    (folder / "s.yaml").write_text(
        f"quilt_scene: 1\nobjects:\n- {{mesh: pane.obj, material: {{unlit: true{more}}}}}\n"
        "- {mesh: wall.obj, material: {color: [0.5, 0.5, 0.5], unlit: true}}\n"
    )
    (folder / "j.yaml").write_text(
        "quilt_job: 1\ndisplay: d.yaml\nscene: s.yaml\nframes: 1\noutput: {channels: [rgba, object]}\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes: "
        "[{frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}]}}\n"
        f"render: {{method: {method}, samples: {samples}}}\n"
    )
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    picture = frame.facet(1)
    return picture["R"][4].astype(np.float64), picture["object"][4]


def saved(folder, alpha):
    """A white picture of which the left half is opaque; the right half has this alpha."""
    pixels = np.full((16, 64, 4), 255, np.uint8)
    pixels[:, 32:, 3] = alpha
    Image.fromarray(pixels).save(folder / "leaf.png")
    Image.fromarray(pixels[..., 3]).save(folder / "grey.png")


@pytest.mark.parametrize("samples", [1, 4])
def test_a_mask_cuts_a_picture_out_and_a_blend_lets_light_pass(tmp_path, samples):
    saved(tmp_path, 51)
    kd = "map_Kd leaf.png\n"
    red, first = seen(tmp_path, kd, more=", alpha: mask", samples=samples)
    np.testing.assert_allclose(red[:30], 1, atol=1e-3)
    np.testing.assert_allclose(red[34:], 0.5, atol=1e-3)
    assert (first[:30] == 1).all()
    assert (first[34:] == 2).all()
    red, first = seen(tmp_path, kd, more=", alpha: blend", samples=samples)
    np.testing.assert_allclose(red[34:62], 0.2 + 0.8 * 0.5, atol=1e-3)
    assert (first == 1).all()
    red, first = seen(tmp_path, kd, samples=samples)
    np.testing.assert_allclose(red, 1, atol=1e-3)


def test_a_picture_of_opacity_is_enough(tmp_path):
    saved(tmp_path, 0)
    red, first = seen(tmp_path, "Kd 1 1 1\nmap_d grey.png\n")
    np.testing.assert_allclose(red[:30], 1, atol=1e-3)
    np.testing.assert_allclose(red[34:], 0.5, atol=1e-3)
    assert (first[34:] == 2).all()
    saved(tmp_path, 51)
    red, _ = seen(tmp_path, "Kd 1 1 1\nd 0.5\nmap_d grey.png\n")
    np.testing.assert_allclose(red[34:], 0.1 + 0.9 * 0.5, atol=1e-3)
