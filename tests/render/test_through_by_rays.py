"""Surfaces that light may pass as rays meet them: `method: raycast`, and the verdicts of `quilt verify`."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods.raycast import cast_frame
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
