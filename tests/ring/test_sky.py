"""A sky on a spinning mirror: what each pixel's own viewpoint sees past the scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.geometry import rotation_deg
from quiltcli.job.lights import EnvironmentLight
from quiltcli.ring.cast import lines_of
from quiltcli.ring.hits import Cell
from quiltcli.ring.picture import draw_picture
from quiltcli.scene.environment.sky import sky_of
from quiltcli.scene.textures.pool import TextureStore
from tests.render.test_sky import write_panorama
from tests.ring.test_through import ANGLE, SIZE, show_of, small_soup


@pytest.mark.parametrize("samples", [1, 2])
def test_pixels_show_what_lies_behind_the_scene_in_their_direction(tmp_path, samples):
    write_panorama(tmp_path / "sky.exr")
    light = EnvironmentLight.model_validate(
        {"file": str(tmp_path / "sky.exr"), "rotate_deg": 30, "visible": True}, context={"base": tmp_path}
    )
    scene = replace(small_soup(1, 12), sky=sky_of(light, TextureStore()), background=np.zeros(3, np.float32))
    more = {} if samples == 1 else {"samples": ((-0.2, 0), (0.2, 0)), "cells": (Cell(), Cell())}
    show = show_of(scene, ("rgba",), **more)
    picture = draw_picture(show, ANGLE)
    empty = np.flatnonzero(picture.lit.ravel() & (picture.buffers["A"] == 0))
    assert empty.size > 200
    y, x = np.divmod(empty, SIZE[0])
    way = lines_of(picture.pose, show.curve, x + 0.5, y + 0.5).along @ rotation_deg((0.0, 30, 0.0))
    found = np.stack([picture.buffers[name][empty] for name in "RGB"], axis=1)
    np.testing.assert_allclose(found, (way + 1) / 2, atol=0.01)
    assert (picture.buffers["R"][~picture.lit.ravel()] == 0).all()
