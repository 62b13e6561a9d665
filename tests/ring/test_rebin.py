"""Light fields on a spinning mirror, against a ball whose every ray is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quiltcli.job import load_lightfield_file
from quiltcli.lightfield import Field, load_field
from quiltcli.lightfield.cameras import ring_cameras
from quiltcli.ring.curve import Curve, User
from quiltcli.ring.rebin import rays_of, rebinned
from quiltcli.ring.rig import Pose, ideal_projector
from tests.helpers.ring_photos import ball, field_text, write_pictures

SIZE = (96, 96)


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Field:
    folder = tmp_path_factory.mktemp("field")
    (folder / "field.yaml").write_text(field_text(72, [0.0, 0.15, 0.3, 0.45], size=96, exr=True))
    file = load_lightfield_file(folder / "field.yaml")
    write_pictures(ring_cameras(file), folder, exr=True)
    return load_field(file)


def lit(radius: float = 0.42) -> np.ndarray:
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    return np.hypot(x / SIZE[0] - 0.5, y / SIZE[1] - 0.5) < radius


def psnr(found: np.ndarray, expected: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((found - expected) ** 2)))


@pytest.mark.parametrize("cone", [False, True])
@pytest.mark.parametrize(
    "curve",
    [Curve(0.2, 1.0), Curve(0.2, 0.6), Curve(0.3, 2.0), Curve(0.2, 1.0, (User(0.4, 0.1, 0.6, 0.1, 0.25),))],
    ids=["on the ring", "nearer", "farther", "tracked"],
)
def test_viewers_anywhere_see_what_rays_see(field: Field, curve: Curve, cone: bool) -> None:
    mask = lit()
    for angle in (0.3, 2.9):
        pose = Pose(angle, math.pi / 4, 0.0, ideal_projector(SIZE, 0.6, 0.13), cone)
        light = rebinned(field, pose, curve, mask)
        assert not light[~mask].any()
        row, column = np.nonzero(mask)
        rays = rays_of(pose, curve, column + 0.5, row + 0.5)
        expected = ball(rays.viewer, rays.mirror - rays.viewer)[0]
        assert psnr(light[mask], expected) >= 24
        # Another angle's picture is another one.
        other = rebinned(field, Pose(angle + 0.3, math.pi / 4, 0.0, pose.projector, cone), curve, mask)
        assert psnr(other[mask], expected) < 22


def test_the_viewer_that_is_served_is_in_the_middle_of_those_that_pixels_serve() -> None:
    pose, curve = Pose(1.0, math.pi / 4, 0.0, ideal_projector(SIZE, 0.6, 0.13)), Curve(0.2, 1.0)
    rays = rays_of(pose, curve, np.array([48.0]), np.array([48.0]))
    np.testing.assert_allclose(rays.viewer[0], rays.served, atol=1e-12)
