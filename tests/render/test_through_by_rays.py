"""Surfaces that light may pass as rays meet them: `method: raycast`, and the verdicts of `quilt verify`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods.raycast import cast_frame
from quiltcli.render.setup import set_stage
from tests.analysis.test_verify_through import leaves
from tests.helpers.curved_jobs import bumpy_ball, curved_job
from tests.helpers.verified_jobs import found, shoot
from tests.render.test_transparency import EYE, drawn, gathered, scene_of, soup
from tests.render.test_transparent_textures import saved, seen


def cast(scene, channels=("rgba", "Z", "triangle", "cryptoobject")):
    stage, rasterized, record = drawn(scene, channels=channels)
    buffers = new_buffers(stage)
    return stage, rasterized, buffers, record, cast_frame(stage, EYE, buffers)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rays_go_on_behind_what_light_passes(seed):
    scene = soup(seed)
    stage, rasterized, buffers, record, by_rays = cast(scene)
    light, alpha, depth, nearest, certain = gathered(scene, stage, EYE)
    for k, name in enumerate("RGB"):
        np.testing.assert_allclose(buffers[name][certain], light[k][certain], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(buffers["A"][certain], alpha[certain], atol=1e-3)
    np.testing.assert_array_equal(buffers["triangle"][certain], nearest[certain] + 1)
    np.testing.assert_allclose(buffers["Z"][certain], depth[certain], rtol=1e-5)
    # The rasterizer's edges are decided by the same lattice: all of its pixels are the rays', too.
    for name in rasterized:
        same = rasterized[name] == buffers[name]
        assert same.mean() > 0.999 or name in "RGBAZ", name
    np.testing.assert_array_equal(rasterized["triangle"], buffers["triangle"])
    np.testing.assert_allclose(rasterized["R"], buffers["R"], atol=1e-3)
    assert record.visible_pixels == by_rays.visible_pixels


def test_plates_in_one_place_are_all_met():
    """The second of two plates in one plane lies no farther than the first, and holds up its share."""
    corners = [(-0.6, -0.6, 0.2), (0.7, -0.5, 0.2), (0.1, 0.6, 0.2)]
    twice = scene_of(corners, [(0, 1, 2), (0, 1, 2)], [((1, 0, 0), "blend", 0.5)], [0, 0])
    _, rasterized, buffers, _, _ = cast(twice)
    assert rasterized["A"].max() == pytest.approx(0.75, abs=1e-3)
    np.testing.assert_array_equal(buffers["A"], rasterized["A"])


@pytest.mark.parametrize("more", [", alpha: mask", ", alpha: blend"])
def test_pictures_cut_out_and_blend_what_rays_meet(tmp_path, more):
    saved(tmp_path, 51)
    (rasterized, first), (cast_red, cast_first) = (
        seen(tmp_path, "map_Kd leaf.png\n", more=more, method=method) for method in ("homography", "raycast")
    )
    assert np.unique(rasterized).size > 1
    np.testing.assert_allclose(cast_red, rasterized, atol=1e-3)
    np.testing.assert_array_equal(cast_first, first)


CURVED = {
    "sphere": ("surfaces:\n- {kind: sphere, radius: 1, pixels: [96, 64]}", (1.2, 0.6, 3.1)),
    "cylinder": (
        "surfaces:\n- {kind: cylinder, radius: 2, height: 1, arc_deg: [-60, 60], lit: inside,"
        " pixels: [96, 64]}",
        (0.1, 0.3, -0.2),
    ),
    "equirect": ("projection: {kind: equirect, pixels: [128, 64]}", (0.2, 0.1, -0.3)),
    "fisheye": (
        "projection: {kind: fisheye, mapping: equisolid, fov_deg: 200, pixels: [96, 96]}",
        (0.1, 0.1, 0.9),
    ),
}


@pytest.mark.parametrize("name", CURVED)
@pytest.mark.parametrize("samples", [1, 3])
def test_curved_facets_show_what_rays_gather(name, samples, tmp_path):
    display, eye = CURVED[name]
    at = (0, 0, 1) if name == "cylinder" else (0, 0, 0)
    job = curved_job(tmp_path, display, bumpy_ball(splits=1), eye, at)
    stage = set_stage(job)
    here = stage.views([1])[0].viewer
    channels = ("rgba", "Z", "triangle", "cryptoobject")
    output = job.output.model_copy(update={"channels": channels})
    how = job.render.model_copy(update={"samples": samples})
    drawn_job = job.model_copy(update={"output": output, "render": how})
    stage = replace(stage, scene=soup(4, 60), job=drawn_job)
    buffers, rays = new_buffers(stage), new_buffers(stage)
    record = draw_frame(stage, here, buffers)
    by_rays = cast_frame(stage, here, rays)
    assert np.unique(rays["A"]).size > 8
    np.testing.assert_array_equal(buffers["triangle"], rays["triangle"])
    np.testing.assert_allclose(buffers["Z"], rays["Z"], rtol=1e-5)
    if samples == 1:
        np.testing.assert_allclose(buffers["R"], rays["R"], atol=1e-3)
        np.testing.assert_allclose(buffers["A"], rays["A"], atol=1e-3)
        np.testing.assert_array_equal(buffers["CryptoObject00.R"], rays["CryptoObject00.R"])
        assert record.visible_pixels == by_rays.visible_pixels
    else:
        assert np.abs(buffers["R"].astype(float) - rays["R"]).mean() < 0.05


def test_pictures_cut_out_on_curved_facets_are_verified(tmp_path):
    leaves(tmp_path, "mask")
    (tmp_path / "d.yaml").write_text(
        "quilt_display: 1\nsurfaces:\n"
        "- {kind: cylinder, radius: 1, height: 1.4, arc_deg: [-50, 50], pixels: [120, 96], lit: outside}\n"
    )
    shot = shoot(load_job(tmp_path / "j.yaml"))
    verdict = shot.verify()
    assert found(verdict) == {}, verdict.faults[:3]
    shown = np.bincount(shot.images.channels["triangle"], minlength=7)
    assert shown[1:3].sum() > 500
    assert shown[3:5].sum() > 200
    assert shown[5:].sum() > 100
