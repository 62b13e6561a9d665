"""What pictures cut out of surfaces is not there for rays either; what blends is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from quiltcli.analysis.verify.frame import make_trial
from quiltcli.job import load_job
from tests.helpers.verified_jobs import found, shoot

PANE = (
    "v -1 -1 {z}\nv 1 -1 {z}\nv 1 1 {z}\nv -1 1 {z}\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n"
)


def leaves(folder, alpha, cutoff=0.5, leaned=False):
    """Two panes of leaves before a wall, on a box of three panels."""
    dice = np.random.default_rng(5)
    pixels = np.full((24, 24, 4), 255, np.uint8)
    pixels[..., 3] = np.where(dice.uniform(size=(24, 24)) < 0.5, 0, dice.integers(60, 255, (24, 24)))
    Image.fromarray(pixels).save(folder / "leaf.png")
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd leaf.png\n")
    for name, z in (("near", 0.0), ("far", -0.4)):
        (folder / f"{name}.obj").write_text("mtllib m.mtl\n" + PANE.format(z=z))
    (folder / "wall.obj").write_text("v -2 -2 -1\nv 1 -2 -1\nv 1 2 -1\nv -2 2 -1\nf 1 2 3 4\n")
    (folder / "d.obj").write_text(
        "v -0.9 -0.7 0.5\nv 0 -0.7 1\nv 0 0.7 1\nv -0.9 0.7 0.5\nv 0.9 -0.7 0.5\nv 0.9 0.7 0.5\n"
        "f 1 2 3 4\nf 2 5 6 3\n"
    )
    (folder / "d.yaml").write_text("quilt_display: 1\nmesh: d.obj\nresolution: {pixels_per_metre: 60}\n")
    look = f"material: {{alpha: {alpha}, cutoff: {cutoff}}}"
    turned = ", transform: {rotate_deg: [0, 65, 0]}" if leaned else ""
    (folder / "s.yaml").write_text(
        f"quilt_scene: 1\nobjects:\n- {{mesh: near.obj, {look}{turned}}}\n- {{mesh: far.obj, {look}}}\n"
        "- {mesh: wall.obj}\nlights: [{type: ambient, color: [1, 1, 1]}]\n"
    )
    (folder / "j.yaml").write_text(
        "quilt_job: 1\ndisplay: d.yaml\nscene: s.yaml\nframes: 1\n"
        "output: {channels: [rgba, Z, triangle, object]}\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes: "
        "[{frame: 1, position: [0.1, 0.05, 2.3], look_at: [0, 0, 0]}]}}\n"
    )
    return load_job(folder / "j.yaml")


@pytest.mark.parametrize(
    ("alpha", "cutoff", "leaned"),
    [
        ("mask", 0.5, False),
        ("mask", 0.5, True),
        ("mask", 0.01, False),
        ("blend", 0.5, False),
        ("blend", 0.5, True),
    ],
)
def test_rays_pass_where_pictures_leave_nothing(tmp_path, alpha, cutoff, leaned):
    shot = shoot(leaves(tmp_path, alpha, cutoff, leaned))
    verdict = shot.verify()
    assert found(verdict) == {}, verdict.faults[:3]
    assert verdict.passed
    shown = np.bincount(shot.images.channels["triangle"], minlength=7)
    assert shown[1:3].sum() > 500
    assert shown[3:5].sum() > 200
    assert alpha == "blend" or shown[5:].sum() > 200
    assert verdict.inside["triangles"] > verdict.inside["covered"] // 2


def test_what_is_cut_out_may_not_be_shown_and_what_is_there_not_passed(tmp_path):
    shot = shoot(leaves(tmp_path, "mask"))
    opaque = replace(shot.stage.scene, materials=replace(shot.stage.scene.materials, alpha=None))
    solid = shoot(leaves(tmp_path, "opaque"))
    assert found(replace(shot, images=solid.images).verify()) != {}
    # The other way round: leaves that hold up light everywhere, and a picture with holes in them.
    through = replace(solid, stage=replace(solid.stage, scene=opaque), images=shot.images)
    assert make_trial(through.stage, through.viewer, through.images).scene.soft is None
    assert found(through.verify()) != {}
