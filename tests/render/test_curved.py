"""Curved displays and projections drawn, and held against rays and closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.verify import verify_images
from quiltcli.analysis.verify.images import draw_images
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.methods import draw_frame
from quiltcli.render.setup import Stage, set_stage
from quiltcli.render.workers import Pool, shared_buffers
from quiltcli.viewer.viewer import Viewer
from tests.helpers.curved_jobs import PROJECTIONS, SURFACES, boxes, bumpy_ball, curved_job
from tests.helpers.in_memory import icosphere
from tests.helpers.verified_jobs import EVERY

METHODS = ("homography", "raycast")


def staged(job: object) -> tuple[Stage, Viewer]:
    stage = set_stage(job)  # type: ignore[arg-type]
    return stage, stage.views([1])[0].viewer


def drawn(stage: Stage, viewer: Viewer) -> Buffers:
    buffers = new_buffers(stage)
    draw_frame(stage, viewer, buffers)
    return buffers


def page(stage: Stage, flat: np.ndarray) -> np.ndarray:
    width, height = stage.layout.pages[0]
    return flat[: width * height].reshape(height, width)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("method", METHODS)
def test_surfaces_are_verified(name: str, method: str, tmp_path: Path) -> None:
    vertices, faces = boxes(30, 0.5, 1.2)
    display = f"surfaces:\n- {{{SURFACES[name]}, pixels: [96, 64]}}"
    inside = "lit: inside" in SURFACES[name]
    eye = (0.1, 0.3, 0.2) if inside else (1.2, 2.6, 3.1)
    job = curved_job(tmp_path, display, (vertices, faces), eye, more=f"render: {{method: {method}}}\n")
    stage, viewer = staged(job)
    images = draw_images(stage, stage.views([1])[0], 1)
    verdict = verify_images(stage, viewer, images, EVERY)
    assert verdict.passed, verdict.faults
    assert verdict.inside.counts["covered"] > 300
    assert verdict.outside == 0


@pytest.mark.parametrize("name", PROJECTIONS)
@pytest.mark.parametrize("method", METHODS)
def test_projections_are_verified_and_full(name: str, method: str, tmp_path: Path) -> None:
    size = {"cross": (128, 96), "row": (192, 32)}.get(name, (128, 64))
    display = f"projection: {{{PROJECTIONS[name]}, pixels: [{size[0]}, {size[1]}]}}"
    more = f"render: {{method: {method}}}\n"
    job = curved_job(tmp_path, display, bumpy_ball(splits=2), (0.2, 0.1, -0.3), (1, 0, 2), more)
    stage, viewer = staged(job)
    images = draw_images(stage, stage.views([1])[0], 1)
    verdict = verify_images(stage, viewer, images, EVERY)
    assert verdict.passed, verdict.faults
    # The ball is closed: every pixel that has a direction sees it.
    assert verdict.inside.counts["covered"] == verdict.inside.counts["pixels"] == (stage.owners > 0).sum()


@pytest.mark.parametrize("method", METHODS)
def test_a_panorama_sees_a_wall_where_it_is(method: str, tmp_path: Path) -> None:
    wall = ([(-50, -50, -3.0), (50, -50, -3.0), (50, 50, -3.0), (-50, 50, -3.0)], [(0, 1, 2, 3)])
    more = f"render: {{method: {method}}}\n"
    display = "projection: {kind: equirect, pixels: [128, 64]}"
    stage, viewer = staged(curved_job(tmp_path, display, wall, (0.3, 0.1, 0), (0.3, 0.1, -1), more))
    z = page(stage, drawn(stage, viewer)["Z"])
    x, y = np.meshgrid(np.arange(128) + 0.5, np.arange(64) + 0.5)
    a, b = 2 * np.pi * (x / 128 - 0.5), np.pi * (0.5 - y / 64)
    ahead = np.cos(b) * np.cos(a)
    expected = np.where(ahead > 0, 3 / np.where(ahead > 0, ahead, 1), np.inf)
    near = expected < 40
    assert np.abs(z[near] / expected[near] - 1).max() < 1e-6
    assert np.isinf(z[ahead < 0]).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_sphere_is_lit_where_the_eye_is_above_its_pixels(method: str, tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [128, 64]}"
    ball = icosphere(3)
    room = (ball[0] * 30, ball[1])
    more = f"render: {{method: {method}}}\n"
    stage, viewer = staged(curved_job(tmp_path, display, room, (0.4, 1.0, 3.0), more=more))
    z = page(stage, drawn(stage, viewer)["Z"])[:64, :128]
    x, y = np.meshgrid(np.arange(128) + 0.5, np.arange(64) + 0.5)
    a, b = 2 * np.pi * (x / 128 - 0.5), np.pi * y / 64
    normal = np.stack((np.sin(b) * np.sin(a), np.cos(b), np.sin(b) * np.cos(a)))
    lit = np.tensordot(viewer.eye, normal, 1) - 1 > 1e-9
    assert (np.isfinite(z) == lit).all()
    share = (np.sin(b) * lit).sum() / np.sin(b).sum()
    assert share == pytest.approx((1 - 1 / np.sqrt(viewer.eye @ viewer.eye)) / 2, abs=0.015)


def test_a_mask_leaves_pixels_to_nobody(tmp_path: Path) -> None:
    from tests.helpers.curved_jobs import write_map

    mask = np.ones((3, 32, 64))
    mask[:, :, 20:30] = 0
    write_map(tmp_path / "mask.exr", mask)
    display = "surfaces:\n- {kind: sphere, radius: 1, lit: inside, pixels: [64, 32], mask: mask.exr}"
    stage, viewer = staged(curved_job(tmp_path, display, bumpy_ball(), (0.1, 0, 0)))
    owners = page(stage, stage.owners)[:32, :64]
    assert (owners[:, 20:30] == 0).all()
    z = page(stage, drawn(stage, viewer)["Z"])[:32, :64]
    assert (np.isfinite(z) == (owners == 1)).all()


def test_a_projection_that_follows_the_view_turns_with_it(tmp_path: Path) -> None:
    display = "projection: {kind: fisheye, fov_deg: 120, follows: view, pixels: [48, 48]}"
    target = icosphere(2)
    scene = (target[0] * 0.5 + np.array([4.0, 1.0, 2.0]), target[1])
    stage, viewer = staged(curved_job(tmp_path, display, scene, (0, 0, 0), (4, 1, 2)))
    z = page(stage, drawn(stage, viewer)["Z"])
    rows, columns = np.nonzero(np.isfinite(z))
    assert abs(rows.mean() - 23.5) < 0.5
    assert abs(columns.mean() - 23.5) < 0.5
    away = replace(viewer, look=-viewer.look)
    assert not np.isfinite(drawn(stage, away)["Z"]).any()


@pytest.mark.parametrize("method", METHODS)
def test_a_background_lies_where_pixels_are_lit_and_nowhere_else(method: str, tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [128, 64]}"
    target = icosphere(1)
    scene = (target[0] * 0.3, target[1])
    job = curved_job(tmp_path, display, scene, (0.4, 1.0, 3.0), more=f"render: {{method: {method}}}\n")
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- {mesh: scene.obj}\nbackground: [0, 0, 1]\n"
    )
    job = job.model_copy(update={"scene": tmp_path / "scene.yaml"})
    stage, viewer = staged(job)
    buffers = drawn(stage, viewer)
    blue, z = page(stage, buffers["B"]), page(stage, buffers["Z"])
    x, y = np.meshgrid(np.arange(128) + 0.5, np.arange(64) + 0.5)
    a, b = 2 * np.pi * (x / 128 - 0.5), np.pi * y / 64
    normal = np.stack((np.sin(b) * np.sin(a), np.cos(b), np.sin(b) * np.cos(a)))
    lit = np.tensordot(viewer.eye, normal, 1) - 1 > 1e-9
    assert np.isfinite(z).any()
    bare = ~np.isfinite(z[:64, :128])
    assert (blue[:64, :128][lit & bare] == 1).all()
    assert (blue[:64, :128][~lit] == 0).all()


def test_frames_that_follow_each_other_leave_nothing_behind(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [128, 64]}"
    job = curved_job(tmp_path, display, boxes(20, 0.5, 0.7), (0.4, 1.0, 3.0))
    stage, viewer = staged(job)
    other = replace(viewer, eye=np.array([-2.5, 0.3, -1.0]), look=np.array([0.93, 0.0, 0.37]))
    buffers, dirty = new_buffers(stage), np.zeros(stage.blocks.used.size, dtype=bool)
    draw_frame(stage, viewer, buffers, dirty=dirty)
    draw_frame(stage, other, buffers, dirty=dirty)
    fresh = drawn(stage, other)
    for name, values in fresh.items():
        assert (buffers[name] == values).all(), name


def test_samples_average_to_rays_at_the_same_places(tmp_path: Path) -> None:
    display = "projection: {kind: equirect, pixels: [64, 32]}"
    job = curved_job(
        tmp_path, display, bumpy_ball(splits=1), (0.2, 0.1, -0.3), more="render: {samples: 16}\n"
    )
    stage, viewer = staged(job)
    alpha = page(stage, drawn(stage, viewer)["A"])
    assert (alpha == 1).all()


def test_workers_and_threads_give_the_same_bytes(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: torus, radius: 1, tube: 0.35, pixels: [160, 128]}"
    stage, viewer = staged(curved_job(tmp_path, display, boxes(40, 0.4, 1.5), (1.2, 2.0, 2.4)))
    alone = drawn(stage, viewer)
    threads, processes = new_buffers(stage), shared_buffers(stage)
    draw_frame(stage, viewer, threads, 2)
    with Pool(stage, [processes], 2) as pool:
        draw_frame(stage, viewer, processes, crew=pool)
    for name, values in alone.items():
        assert (threads[name] == values).all(), name
        assert (processes[name] == values).all(), name


def test_a_cube_map_is_what_it_shows_between_its_pixels(tmp_path: Path) -> None:
    display = "projection: {kind: equirect, pixels: [128, 64]}"
    more = "output: {channels: [rgba, Z]}\n"
    pictures = []
    for how in ("homography", "cubemap, faces: 512"):
        job = curved_job(
            tmp_path,
            display,
            bumpy_ball(splits=3, bumps=0.02),
            (0.1, 0, 0),
            (1, 0, 0),
            f"render: {{method: {how}}}\n{more}",
        )
        stage, viewer = staged(job)
        buffers = drawn(stage, viewer)
        pictures.append([page(stage, buffers[name]).astype(np.float64) for name in ("R", "Z")])
    (red, z), (mapped_red, mapped_z) = pictures
    assert np.isfinite(mapped_z).all()
    assert np.abs(mapped_z / z - 1).max() < 2e-3
    assert np.abs(mapped_red - red).max() < 0.05
    assert (mapped_red != red).any()


@pytest.mark.parametrize("name", ["dome_master", "cross"])
def test_a_proxy_has_fewer_pixels_of_the_same_picture(name: str, tmp_path: Path) -> None:
    size = (128, 96) if name == "cross" else (128, 128)
    display = f"projection: {{{PROJECTIONS[name]}, pixels: [{size[0]}, {size[1]}]}}"
    job = curved_job(tmp_path, display, bumpy_ball(splits=2), (0.2, 0.1, -0.3), more="render: {scale: 0.5}\n")
    stage, viewer = staged(job)
    assert stage.facets.size.tolist() == [[size[0] // 2, size[1] // 2]]
    z = drawn(stage, viewer)["Z"]
    assert (np.isfinite(z) == (stage.owners > 0)).all()


def test_textures_are_looked_up_alike_by_both_exact_methods(tmp_path: Path) -> None:
    hall = Path(__file__).parents[2] / "scenes" / "hall.yaml"
    pictures = []
    for method in METHODS:
        display = "projection: {kind: equirect, pixels: [256, 128]}"
        more = f"render: {{method: {method}}}\noutput: {{channels: [rgba, Z, albedo]}}\n"
        job = curved_job(tmp_path, display, boxes(1, 0.1, 0.1), (0.2, 1.5, 0.3), (0, 1.5, -1), more)
        stage, viewer = staged(job.model_copy(update={"scene": hall}))
        buffers = drawn(stage, viewer)
        pictures.append([page(stage, part).astype(np.float64) for part in buffers.values()])
    for ours, rays in zip(*pictures, strict=True):
        both = np.isfinite(ours) & np.isfinite(rays)
        assert both.mean() > 0.5
        assert np.quantile(np.abs(ours - rays)[both], 0.98) < 0.02
