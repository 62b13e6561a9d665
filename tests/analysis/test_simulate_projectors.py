"""What an eye sees of a screen that projectors light."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.analysis.simulate.picture import picture_rays
from quiltcli.analysis.verify import VerifyOptions, verify
from quiltcli.display import Facets
from quiltcli.geometry import FloatArray
from quiltcli.job import load_job
from quiltcli.projection.camera import camera_display, frame_display
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_view
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from tests.helpers.curved_jobs import boxes
from tests.helpers.even_light import COLOR, even_job
from tests.helpers.projected import LEFT, RIGHT, SPHERE, WALL, projected_text
from tests.helpers.verified_jobs import obj

SIZE = (160, 120)
EYE = (0.1, 0.3, 3.4)
MIDDLE = "- {name: middle, pixels: [200, 160], lens: {at: [0.4, 0.5, 3.5], look_at: [0, 0, 0], throw: 1.7}}\n"


def seen(job, **more):
    return next(simulate(job, [1], PictureOptions(SIZE, threads=1, samples=1, **more)))


def coverage(facets: Facets, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How many of the wall's two projectors light points (..., 3), and how near in metres a border is."""
    count, near = np.zeros(points.shape[:-1]), np.full(points.shape[:-1], np.inf)
    for chart in facets.charts:
        assert chart is not None
        wide, high = chart.size
        corners = chart.points(np.array([0, wide, wide, 0.0]), np.array([0, 0, high, high * 1.0]))[:2].T
        inner = np.full(points.shape[:-1], np.inf)
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            along = (q - p) / np.linalg.norm(q - p)
            inner = np.minimum(inner, along[1] * (points[..., 0] - p[0]) - along[0] * (points[..., 1] - p[1]))
        count += inner > 0
        near = np.minimum(near, np.abs(inner))
    return count, near


@pytest.mark.parametrize("black", [0.0, 0.01])
def test_two_projectors_overlap_evenly(tmp_path, black):
    job = even_job(
        tmp_path, projected_text(tmp_path, WALL, LEFT + RIGHT, f"blend: {{black: {black}}}\n"), eye=EYE
    )
    picture = seen(job, compare=False, look_at=(0.0, 0.0, 0.0), fov=38)
    bare = seen(job, compare=False, look_at=(0.0, 0.0, 0.0), fov=38, corrected=False)
    # Where on the wall each pixel looks.
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    half = np.tan(np.radians(19))
    ahead = -np.array(EYE) / np.linalg.norm(EYE)
    right = np.cross(ahead, [0, 1, 0]) / np.linalg.norm(np.cross(ahead, [0, 1, 0]))
    u, v = (x + 0.5 - SIZE[0] / 2) / (SIZE[1] / 2) * half, (SIZE[1] / 2 - y - 0.5) / (SIZE[1] / 2) * half
    rays = ahead + u[..., None] * right + v[..., None] * np.cross(right, ahead)
    points = np.array(EYE) - rays * (EYE[2] / rays[..., 2:])
    count, near = coverage(set_stage(job).facets, points)
    inner = near > 0.06  # pixels of the projectors are 1 cm
    both, one = (count == 2) & inner, (count == 1) & inner
    assert both.sum() > 500
    assert one.sum() > 2000
    expected = np.array(COLOR) + 2 * black
    for part in (both, one):
        assert picture.picture[part] == pytest.approx(np.broadcast_to(expected, (part.sum(), 3)), rel=0.01)
    # Without blending there is twice the light, and black is what each projector leaks.
    assert bare.picture[both] == pytest.approx(
        np.broadcast_to(2 * np.array(COLOR) + 2 * black, (both.sum(), 3)), rel=2e-3
    )
    assert bare.picture[one] == pytest.approx(
        np.broadcast_to(np.array(COLOR) + black, (one.sum(), 3)), rel=2e-3
    )


def test_black_is_even_in_every_frame(tmp_path):
    text = projected_text(tmp_path, WALL, LEFT + RIGHT, "blend: {black: 0.02}\n")
    job = even_job(tmp_path, text, eye=EYE)
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- {mesh: ball.obj, transform: {scale: 0.001, translate: [0, 0, 9]}}\n"
    )
    render(job, RenderOptions(folder=tmp_path / "both", threads=1))
    render(job, RenderOptions(folder=tmp_path / "alone", threads=2, frames=[2]))
    name = "quilt/page_01.0002.exr"
    assert (tmp_path / "both" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    picture = seen(job, compare=False).picture
    shown = picture[picture[..., 0] < 0.045]  # what is not the wall is brighter
    assert (np.abs(shown - 0.04) < 4e-4).mean() > 0.97  # steep where both pictures end


def sphere_job(folder, pixels):
    text = projected_text(folder, SPHERE, MIDDLE.replace("[200, 160]", pixels))
    even_job(folder, text, eye=EYE)
    points, faces = boxes(40, 0.6, 1.2)
    (folder / "ball.obj").write_text(obj(points, faces))
    return load_job(folder / "job.yaml")


def test_a_projected_sphere_is_the_direct_picture_resampled_once(tmp_path):
    job = sphere_job(tmp_path, "[400, 320]")
    found = seen(job, resampled=True)
    assert found.comparison is not None
    assert found.comparison.share > 0.3
    assert found.comparison.mean / found.comparison.resampled == pytest.approx(1, abs=1e-3)
    # The same by hand: rays meet the sphere, the projector's matrix says at which pixel, and the image that
    # verify holds against rays is looked up there, in proportion between pixels.
    stage = set_stage(job)
    view = stage.views([1])[0]
    buffers = new_buffers(stage)
    draw_view(stage, view, buffers, 1)
    viewer = view.viewer
    chart = stage.facets.charts[0]
    assert chart is not None
    from quiltcli.analysis.simulate.skin import skin_of

    camera, fov = frame_display(viewer, skin_of(stage.facets, viewer).vertices, SIZE[0] / SIZE[1], turn=True)
    through = camera_display(camera, *SIZE, fov)
    rays = picture_rays(camera, through, np.arange(SIZE[0] * SIZE[1]))
    eye = viewer.eye
    aa, ab, bb = (rays * rays).sum(axis=0), eye @ rays, eye @ eye - 1
    under = ab * ab - aa * bb
    points = eye[:, None] + rays * ((-ab - np.sqrt(np.maximum(under, 0))) / aa)
    at, target = np.array([0.4, 0.5, 3.5]), np.zeros(3)
    ahead = (target - at) / np.linalg.norm(target - at)
    right = np.cross(ahead, [0, 1, 0])
    right /= np.linalg.norm(right)
    local = np.stack((right, np.cross(ahead, right), ahead)) @ (points - at[:, None])
    x = 1.7 * 400 * local[0] / local[2] + 200
    y = 1.7 * 400 * local[1] / local[2] + 160
    facing = (points * (at[:, None] - points)).sum(axis=0) > 0.35  # away from the rim of what is lit
    safe = (under > 0.05 * ab * ab) & facing & (x > 2) & (x < 398) & (y > 2) & (y < 318)
    assert safe.sum() > 3000
    start = stage.layout.quilt_from_facet[0][:, 2]
    page = stage.layout.pages[0]
    for k, name in enumerate("RGB"):
        image = buffers[name].reshape(page[1], page[0]).astype(float)
        places = (y[safe] + start[1] - 0.5, x[safe] + start[0] - 0.5)
        expected = ndimage.map_coordinates(image, places, order=1)
        assert np.abs(found.picture.reshape(-1, 3)[safe, k] - expected).max() < 2e-3


def test_finer_projectors_err_less_as_resampling_does(tmp_path):
    means = []
    for pixels in ("[200, 160]", "[400, 320]"):
        comparison = seen(sphere_job(tmp_path, pixels)).comparison
        assert comparison is not None
        means.append(comparison.mean)
    assert means[1] < 0.7 * means[0]


def test_images_of_projectors_are_within_tolerance_of_rays(tmp_path):
    job = sphere_job(tmp_path, "[100, 80]")
    (result,) = verify(job, VerifyOptions(everything=True, threads=1))
    assert result.verdict.passed, result.verdict.faults
    assert result.verdict.inside.counts["covered"] > 1000
