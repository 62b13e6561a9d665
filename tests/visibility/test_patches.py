"""Curved facets in patches: planes that are close enough, samples that are exact, edges without gaps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.projection.patches import patch_grid
from quiltcli.render.crew import plan_of
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame
from quiltcli.visibility.setup.blocks import new_canvas
from quiltcli.visibility.setup.planes import DISPLACED, LATTICE, PlaneTable
from quiltcli.visibility.setup.prewarp import warp
from quiltcli.visibility.setup.samples import samples_of
from quiltcli.visibility.shares import bin_frame
from tests.helpers.curved_jobs import SURFACES, bumpy_ball, curved_job
from tests.render.test_curved import drawn, page, staged

KINDS = ["sphere", "dome", "torus", "paraboloid", "bezier", "cylinder"]


def frame_of(stage: Stage, viewer: Viewer) -> Frame:
    rays = stage.rays(np.ones(stage.facets.count, dtype=bool), viewer)
    binned = bin_frame(plan_of(stage, viewer, rays))
    return Frame(viewer, binned.sight, rays, stage.blocks, binned.pairs, patches=stage.patches)


def counts(stage: Stage, viewer: Viewer) -> tuple[np.ndarray, np.ndarray]:
    """How many triangles hold each sample by their edge functions alone, and which samples are lit."""
    frame = frame_of(stage, viewer)
    block = np.flatnonzero(frame.pairs.per_block)
    canvas = new_canvas(block, frame.blocks)
    which = block - frame.blocks.flat
    none = np.zeros(which.size)
    samples = samples_of(frame.rays, frame.patches, canvas, which, (none, none))
    inverse = frame.rays.patched.patch_from_eye[which].copy()
    for k in (0, 1):
        inverse[:, k] -= LATTICE[k] * inverse[:, 2]
    pairs = warp(frame.sight, frame.pairs, frame.blocks, block, inverse, samples.reach)
    table = PlaneTable(pairs.triangle.size)
    planes = table.add(pairs, np.arange(pairs.triangle.size), DISPLACED)
    found = np.zeros(samples.lit.shape, dtype=np.int64)
    for k in range(pairs.triangle.size):
        place = int(planes.block[k])
        tiles = slice(int(canvas.tile_start[place]), int(canvas.tile_start[place + 1]))
        slopes, constant = planes.edge[:, :2, k], planes.edge[:, 2, k]
        values = np.einsum("ec,tcp->etp", slopes, samples.points[tiles]) + constant[:, None, None]
        assert (values != 0).all()
        found[tiles] += (values > 0).all(axis=0)
    return found, samples.lit


@pytest.mark.parametrize("name", KINDS)
def test_every_lit_pixel_has_one_triangle_of_a_closed_ball(name: str, tmp_path: Path) -> None:
    inside = "lit: inside" in SURFACES[name]
    eye = (0.3, 0.4, 0.2) if inside else (0.8, 1.9, 2.2)
    display = f"surfaces:\n- {{{SURFACES[name]}, pixels: [96, 64]}}"
    found, lit = counts(*staged(curved_job(tmp_path, display, bumpy_ball(splits=2, bumps=0.04), eye)))
    assert lit.any()
    assert (found[lit] == 1).all()


def test_a_vertex_on_every_sample_leaves_no_gap_and_no_double(tmp_path: Path) -> None:
    width, height = 48, 24
    a = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    b = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    rings = np.stack(
        [
            np.stack((np.cos(t) * np.sin(a), np.full(width, np.sin(t)), -np.cos(t) * np.cos(a)), axis=1)
            for t in b
        ]
    ).reshape(-1, 3)
    rings = np.concatenate((5 * rings, [[0, 5, 0], [0, -5, 0]]))
    faces = []
    for j in range(height - 1):
        for i in range(width):
            p, q = j * width + i, j * width + (i + 1) % width
            faces += [(p, p + width, q), (q, p + width, q + width)]
    faces += [(width * height, i, (i + 1) % width) for i in range(width)]
    last = width * (height - 1)
    faces += [(width * height + 1, last + (i + 1) % width, last + i) for i in range(width)]
    display = f"projection: {{kind: equirect, pixels: [{width}, {height}]}}"
    found, lit = counts(*staged(curved_job(tmp_path, display, (rings, faces), (0, 0, 0), (0, 0, -1))))
    assert lit.sum() == width * height
    assert (found[lit] == 1).all()


@pytest.mark.parametrize("name", [*KINDS, "cone", "superquadric", "nurbs", "formula"])
def test_rays_go_through_no_farther_than_is_promised(name: str, tmp_path: Path) -> None:
    display = f"surfaces:\n- {{{SURFACES[name]}, pixels: [512, 256]}}"
    stage, viewer = staged(curved_job(tmp_path, display, bumpy_ball(splits=0)))
    random, looked = np.random.default_rng(11), 0
    for _ in range(5):
        viewer = replace(viewer, eye=random.uniform(-3, 3, 3))
        rays = stage.rays(np.ones(1, dtype=bool), viewer)
        seen, patches, view = rays.patched, stage.patches, rays.views[0]
        if seen.near:
            continue
        for k in np.flatnonzero(seen.lit).tolist():
            x, y = patch_grid(patches, np.array([k]), int(patches.width[k]), int(patches.height[k]))
            d, lit = np.broadcast_to(view.rays(x, y), (3, 1, y.size, x.size))[:, 0], view.lit(x, y)[0]
            q = np.einsum("ij,jhw->ihw", seen.patch_from_eye[k], d)
            if not lit.any():
                continue
            assert (q[2][lit] > 0).all()
            beside = q[:2] / q[2] - np.stack(np.meshgrid(np.arange(x.size), np.arange(y.size)))
            assert (np.abs(beside[:, lit]).max(axis=1) <= seen.reach[k]).all()
            assert not (seen.sure[k] and not lit.all())
            looked += 1
    assert looked > 5


def test_a_planes_patches_are_the_facet_itself(tmp_path: Path) -> None:
    scene = bumpy_ball(2.0, 2)
    scene = (scene[0] - np.array([0, 0, 4.0]), scene[1])
    curved = "surfaces:\n- {kind: plane, width: 2, height: 1, pixels: [128, 64], rotate_deg: [10, 20, 5]}"
    flat = "panels:\n- {pixels: [128, 64], size: [2, 1], at: [0, 0, 0]}\ntransform: {rotate_deg: [10, 20, 5]}"
    pictures = []
    for display in (curved, flat):
        more = "output: {channels: [rgba, Z, triangle]}\n"
        stage, viewer = staged(curved_job(tmp_path, display, scene, (0.3, 0.2, 2), (0, 0, 0), more))
        buffers = drawn(stage, viewer)
        pictures.append([page(stage, buffers[name])[:64, :128] for name in ("Z", "triangle")])
        if stage.patches is not None:
            seen = stage.rays(np.ones(1, dtype=bool), viewer).patched
            # Planes are kept in single precision, which is all that is left of the distance.
            assert seen.reach.max() < 2e-4
    (z, triangle), (flat_z, flat_triangle) = pictures
    same = triangle == flat_triangle
    assert (~same).mean() < 2e-3
    hit = same & np.isfinite(z)
    assert hit.mean() > 0.3
    assert np.abs(z[hit] - flat_z[hit]).max() < 2e-6 * z[hit].max() + 1e-6


def test_the_distance_of_a_plane_is_continuous_across_the_seam_and_the_pole(tmp_path: Path) -> None:
    wall = ([(-60, -60, 5.0), (60, -60, 5.0), (60, 60, 5.0), (-60, 60, 5.0)], [(3, 2, 1, 0)])
    display = "projection: {kind: equirect, pixels: [512, 256]}"
    stage, viewer = staged(curved_job(tmp_path, display, wall, (0, 0, 0), (0, 0, 1)))
    z = page(stage, drawn(stage, viewer)["Z"]).astype(np.float64)
    # 1/Z over a row is a cosine about the seam: the same on both sides of it.
    rows = np.isfinite(z[:, 0])
    assert rows.sum() > 150
    assert np.abs(z[rows, 0] / z[rows, -1] - 1).max() < 1e-6


def test_the_city_has_few_pairs_for_each_triangle(tmp_path: Path) -> None:
    display = "projection: {kind: cylinder, pixels: [1600, 1200]}"
    job = curved_job(tmp_path, display, bumpy_ball(splits=0), (0.1, 1.7, 0), (0, 1.7, -1))
    city = Path(__file__).parents[2] / "scenes" / "city.yaml"
    job = job.model_copy(update={"scene": city})
    stage, viewer = staged(job)
    viewer = replace(viewer, far=1000.0)
    assert len(stage.scene.triangles) == 35_000
    rays = stage.rays(np.ones(1, dtype=bool), viewer)
    binned = bin_frame(plan_of(stage, viewer, rays))
    assert 1 <= binned.facet_pairs / binned.reaching <= 1.4


def test_pieces_come_near_the_cylinder_as_the_square_of_their_number(tmp_path: Path) -> None:
    pictures = {}
    for pieces in (0, 20, 40, 80):
        more = f", pieces: {pieces}" if pieces else ""
        display = f"projection: {{kind: cylinder{more}, pixels: [640, 320]}}"
        job = curved_job(
            tmp_path,
            display,
            bumpy_ball(splits=5),
            (0.1, 0.2, 0),
            (0, 0, -1),
            "output: {channels: [triangle]}\n",
        )
        stage, viewer = staged(job)
        pictures[pieces] = page(stage, drawn(stage, viewer)["triangle"]).copy()
    wrong = [float((pictures[n] != pictures[0]).mean()) for n in (20, 40, 80)]
    slope = np.polyfit(np.log([20, 40, 80]), np.log(wrong), 1)[0]
    assert -2.3 < slope < -1.7
