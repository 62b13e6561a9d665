"""Curved displays against Embree at many eyes, and the published approximations against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import load_display
from quiltcli.exchange.pixelmaps import write_display_map
from quiltcli.job import load_display_file
from quiltcli.projection.patches import patch_grid
from quiltcli.render.crew import plan_of
from quiltcli.render.methods.raycast import target_of
from quiltcli.visibility.rays.embree import cast, plane_distance
from quiltcli.visibility.rays.exact import intersect
from quiltcli.visibility.rays.pixels import places
from quiltcli.visibility.shares import bin_frame
from tests.helpers.camera_texture import as_facets, as_projection
from tests.helpers.curved_jobs import SURFACES, boxes, bumpy_ball, curved_job
from tests.render.test_curved import drawn, page, staged
from tests.visibility.test_patches import KINDS

TRIANGLES = "output: {channels: [triangle, Z]}\n"
CITY = Path(__file__).parents[2] / "scenes" / "city.yaml"


def against_embree(kind: str, eyes: int, size: tuple[int, int], folder: Path) -> tuple[int, int]:
    """Lit pixels of all eyes, and those that show another triangle than one single-precision ray names."""
    display = f"surfaces:\n- {{{SURFACES[kind]}, pixels: {list(size)}}}"
    stage, viewer = staged(curved_job(folder, display, bumpy_ball(8.0, 4), more=TRIANGLES))
    random, lit, differ = np.random.default_rng(5), 0, 0
    for _ in range(eyes):
        viewer = replace(viewer, eye=random.uniform(-3, 3, 3))
        rays = stage.rays(np.ones(1, dtype=bool), viewer)
        target = target_of(stage, viewer)
        shown = drawn(stage, viewer)["triangle"].astype(np.int64) - 1
        width, height = size
        x, y = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
        there = np.flatnonzero(rays.views[0].lit(x, y))
        address = (there // width) * int(stage.layout.pages[0, 0]) + there % width
        pixels = places(address, stage.layout, stage.owners, rays)
        ways = pixels.directions()
        named = cast(target, ways)
        lit += address.size
        rows = np.flatnonzero(named != shown[address])
        differ += rows.size
        ours, theirs = shown[address[rows]], named[rows]
        # Where the two differ, the sample lies in ours in double precision, or next to one of its edges.
        inside = np.full(rows.size, -np.inf)
        mine = np.flatnonzero(ours >= 0)
        inside[mine] = intersect(target, pixels, rows[mine], ours[mine]).inside
        off = np.flatnonzero(ours < 0)
        other = intersect(target, pixels, rows[off], theirs[off]).inside
        assert (inside[mine] > -1e-4).all()
        assert (np.abs(other) < 1e-4).all()
        both = np.flatnonzero((ours >= 0) & (theirs >= 0))
        far, near = (plane_distance(target, which[both], ways[rows[both]]) for which in (ours, theirs))
        met = intersect(target, pixels, rows[both], theirs[both]).inside
        # What is shown is no farther than the other, or the other is missed by a hair.
        assert ((far <= near * (1 + 1e-5)) | (met < 1e-4)).all()
    return lit, differ


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_eyes_see_what_embree_sees(kind: str, tmp_path: Path) -> None:
    lit, differ = against_embree(kind, 2, (128, 64), tmp_path)
    assert lit > 500
    assert differ <= 1


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_many_eyes_see_what_embree_sees(kind: str, tmp_path: Path) -> None:
    lit, differ = against_embree(kind, 25, (512, 256), tmp_path)
    assert lit > 500_000
    assert differ <= 2e-5 * lit


def test_samples_lie_beside_their_pixels_as_far_as_curvature_says(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [2048, 1024]}"
    stage, viewer = staged(curved_job(tmp_path, display, bumpy_ball(splits=0), (0.0, 0.0, 2.5)))
    rays = stage.rays(np.ones(1, dtype=bool), viewer)
    seen, patches, view = rays.patched, stage.patches, rays.views[0]
    ratios = []
    for k in np.flatnonzero(seen.lit & seen.sure).tolist():
        x, y = patch_grid(patches, np.array([k]), int(patches.width[k]), int(patches.height[k]))
        middle = view.rays(x[:, :, x.size // 2], y[:, y.size // 2])[:, 0, 0] + viewer.eye
        latitude = np.arcsin(middle[1])
        normal, way = middle, viewer.eye - middle
        angle = np.arccos(normal @ way / np.linalg.norm(way))
        if not (np.radians(20) < angle < np.radians(60) and abs(latitude) < np.radians(50)):
            continue
        d = np.broadcast_to(view.rays(x, y), (3, 1, y.size, x.size))[:, 0]
        q = np.einsum("ij,jhw->ihw", seen.patch_from_eye[k], d)
        beside = np.abs(q[:2] / q[2] - np.stack(np.meshgrid(np.arange(x.size), np.arange(y.size))))
        # The curvature 1, the pitch π / H down and as much less across as the parallel is shorter.
        pitch = np.pi / 1024
        bent = [pitch * np.cos(latitude) * int(patches.width[k]) ** 2, pitch * int(patches.height[k]) ** 2]
        expected = sum(bent) * np.tan(angle) / 12
        ratios.append(float(np.hypot(*beside.max(axis=(1, 2)))) / expected)
    assert len(ratios) > 20
    assert min(ratios) > 0.5
    assert max(ratios) < 2


@pytest.mark.parametrize(
    ("nodes", "size"),
    [
        ((9, 7), (200, 150)),
        pytest.param((80, 60), (800, 600), marks=pytest.mark.long),
    ],
)
def test_a_camera_texture_is_the_same_as_a_map_and_as_facets(
    nodes: tuple[int, int], size: tuple[int, int], tmp_path: Path
) -> None:
    eye, found, stages = np.array([0.1, 0.2, 3.0]), [], []
    for text in (as_projection(tmp_path, *nodes, size), as_facets(tmp_path, *nodes, size, eye)):
        display = text.partition("quilt_display: 1\n")[2]
        more = "render: {bleed: 0}\n" + TRIANGLES
        job = curved_job(tmp_path, display, boxes(60, 0.6, 1.2), eye, (0.1, 0.2, 0), more)
        spec = load_display_file(tmp_path / "display.yaml")
        update = {"layout": spec.layout} if spec.layout is not None else {}
        stages.append(staged(job.model_copy(update=update)))
        found.append(drawn(*stages[-1])["triangle"].astype(np.int64) - 1)
    curved, flat = found
    assert (curved >= 0).mean() > 0.1
    # Samples lie within a ten-thousandth of a pixel of each other: hardly ever is an edge between them.
    differ = np.flatnonzero(curved != flat)
    assert differ.size <= 4e-6 * curved.size
    stage, viewer = stages[0]
    rays = stage.rays(np.ones(1, dtype=bool), viewer)
    pixels = places(differ, stage.layout, stage.owners, rays)
    for named in (curved[differ], flat[differ]):
        rows = np.flatnonzero(named >= 0)
        beside = intersect(target_of(stage, viewer), pixels, rows, named[rows]).inside
        assert (np.abs(beside) < 1e-4).all()


def test_strips_bend_a_level_edge_as_the_square_of_their_angle(tmp_path: Path) -> None:
    # The top of a round wall, as high as it is far away, through two strips of 9 degrees.
    a = np.radians(np.linspace(-20, 20, 401))
    low, high = (np.stack((5 * np.sin(a), np.full_like(a, y), -5 * np.cos(a)), axis=1) for y in (-9.0, 5.0))
    k = np.arange(400)
    faces = np.stack((k, k + 1, k + 402, k + 401), axis=1)
    columns, angle = 1600, np.radians(9)
    display = f"projection: {{kind: cylinder, hfov_deg: 18, center: 1.0, pieces: 2, pixels: [{columns}, 64]}}"
    more = "render: {samples: 16}\noutput: {channels: [rgba]}\n"
    scene = (np.concatenate((low, high)), faces)
    stage, viewer = staged(curved_job(tmp_path, display, scene, (0, 0, 0), (0, 0, -1), more))
    alpha = page(stage, drawn(stage, viewer)["A"]).astype(np.float64)
    edge = 64 - alpha.sum(axis=0)  # rows from the top
    height = columns / (2 * angle)  # of the edge over the horizon, pixels
    expected = height * angle**2 / 8
    assert np.ptp(edge) == pytest.approx(expected, rel=0.01)
    # Half above and half below where the round cylinder has it: the strips' mean distance is 1.
    assert edge.mean() == pytest.approx(32, abs=expected / 2)


@pytest.mark.long
def test_strips_come_near_the_cylinder_as_the_square_of_their_number(tmp_path: Path) -> None:
    numbers, pictures = (40, 80, 160, 320), {}
    for pieces in (0, *numbers):
        more = f", pieces: {pieces}" if pieces else ""
        display = f"projection: {{kind: cylinder{more}, pixels: [3200, 1600]}}"
        job = curved_job(tmp_path, display, bumpy_ball(splits=6), (0.1, 0.2, 0), (0, 0, -1), TRIANGLES)
        stage, viewer = staged(job)
        pictures[pieces] = page(stage, drawn(stage, viewer)["triangle"]).copy()
    wrong = [float((pictures[n] != pictures[0]).mean()) for n in numbers]
    slope = np.polyfit(np.log(numbers), np.log(wrong), 1)[0]
    assert -2.2 < slope < -1.8


def test_a_prism_of_160_facets_has_few_pairs_for_each_triangle(tmp_path: Path) -> None:
    from tests.benchmarks.surfaces import _prism

    display = _prism(160).partition("quilt_display: 1\n")[2]
    job = curved_job(tmp_path, display, bumpy_ball(splits=0), (0, 1.7, 0), (0, 1.7, -1))
    stage, viewer = staged(job.model_copy(update={"scene": CITY}))
    viewer = replace(viewer, far=1000.0)
    binned = bin_frame(plan_of(stage, viewer, stage.rays(np.ones(160, dtype=bool), viewer)))
    assert 1.9 < binned.facet_pairs / binned.reaching <= 2.7


@pytest.mark.parametrize("form", ["st", "xyz"])
def test_maps_of_a_fisheye_draw_what_it_draws(form: str, tmp_path: Path) -> None:
    size = (96, 96)
    first = f"projection: {{kind: fisheye, fov_deg: 150, pixels: {list(size)}}}"
    scene = bumpy_ball(splits=3)
    stage, viewer = staged(curved_job(tmp_path, first, scene, (0.1, 0.2, 0), (0, 0, -1), TRIANGLES))
    truth = page(stage, drawn(stage, viewer)["triangle"]).copy()
    write_display_map(stage.facets, tmp_path / "map.exr", form)
    kind = "st" if form == "st" else "map"
    again = f"projection: {{kind: {kind}, file: map.exr, pixels: {list(size)}}}"
    stage, viewer = staged(curved_job(tmp_path, again, scene, (0.1, 0.2, 0), (0, 0, -1), TRIANGLES))
    found = page(stage, drawn(stage, viewer)["triangle"])
    assert (truth > 0).mean() > 0.7
    # Single precision moves a ray by a millionth: next to no pixel crosses an edge.
    assert np.count_nonzero(found != truth) <= 2


def test_flat_facets_err_in_proportion_to_their_sag(tmp_path: Path) -> None:
    from quiltcli.exchange.flatten import flatten_display

    display = f"surfaces:\n- {{{SURFACES['paraboloid']}, pixels: [512, 512]}}"
    eye, more = (0.6, 1.6, 1.1), "render: {depth: radial, bleed: 0}\n" + TRIANGLES
    job = curved_job(tmp_path, display, bumpy_ball(4.0, 5), eye, (0.1, 0, 0), more)
    stage, viewer = staged(job)
    truth = page(stage, drawn(stage, viewer)["triangle"])[:512, :512].copy()
    wrong, sags = [], []
    for error in (2.0, 0.5):
        made = flatten_display(tmp_path / "display.yaml", tmp_path / "flat.yaml", error)
        spec = load_display_file(tmp_path / "flat.yaml")
        assert load_display(spec).count == made.facets
        stage, viewer = staged(
            job.model_copy(update={"display": tmp_path / "flat.yaml", "layout": spec.layout})
        )
        flat = page(stage, drawn(stage, viewer)["triangle"])[:512, :512]
        both = (truth > 0) & (flat > 0)
        wrong.append(float((truth != flat)[both].mean()))
        sags.append(made.error)
    # As many times fewer wrong pixels as the sag is smaller, within 40 %.
    assert wrong[0] / wrong[1] == pytest.approx(sags[0] / sags[1], rel=0.4)
    assert wrong[1] > 0
