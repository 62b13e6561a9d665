"""Sweet spots of curved displays: what holds for flat pieces of them holds for them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.sweetspot import Content, Question, sweet_spot
from quiltcli.analysis.sweetspot.distortion import distortion, show, solid_angles
from quiltcli.analysis.sweetspot.plan import Lines, draw_plan
from quiltcli.analysis.sweetspot.samples import sample_facets
from quiltcli.display import load_display
from quiltcli.exchange.flatten import flatten_display
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import SURFACES, display_of

FAR = Content("distance", math.inf)
PLACES = np.array([[0.3, 0.1, -0.2], [0.0, 0.0, 0.5], [-0.4, 0.2, 0.1]])


def test_from_inside_a_sphere_covers_all_directions(tmp_path: Path) -> None:
    samples = sample_facets(
        display_of("- {kind: sphere, radius: 1, lit: inside, pixels: [128, 64]}", tmp_path), 3000
    )
    angles = solid_angles(samples, PLACES * 0.5).sum(axis=1)
    assert np.abs(angles / (4 * np.pi) - 1).max() < 0.01


def test_from_outside_a_sphere_shows_the_cap_that_faces_the_eye(tmp_path: Path) -> None:
    samples = sample_facets(display_of("- {kind: sphere, radius: 1, pixels: [128, 64]}", tmp_path), 6000)
    (angle,) = solid_angles(samples, np.array([[0.0, 0.0, 3.0]])).sum(axis=1)
    # A cone of half angle asin(R / D).
    expected = 2 * np.pi * (1 - math.sqrt(1 - 1 / 9))
    assert abs(angle / expected - 1) < 0.02


@pytest.mark.parametrize("kind", ["cylinder", "dome"])
def test_a_surface_and_its_flat_pieces_have_one_sweet_spot(kind: str, tmp_path: Path) -> None:
    curved = display_of(f"- {{{SURFACES[kind]}, pixels: [128, 64]}}", tmp_path)
    flatten_display(tmp_path / "display.yaml", tmp_path / "flat.yaml", 0.1)
    flat = load_display(load_display_file(tmp_path / "flat.yaml"))
    eye = np.array([0.0, 0.3, 0.2])
    one, other = (
        distortion(show(sample_facets(facets, 4000), FAR, eye), PLACES) for facets in (curved, flat)
    )
    for measure in ("mean", "p95", "worst"):
        a, b = getattr(one, measure), getattr(other, measure)
        assert np.abs(a / b - 1).max() < 0.03, measure


def test_both_kinds_of_facets_have_points_by_their_areas(tmp_path: Path) -> None:
    (tmp_path / "wall.obj").write_text("v 0 0 -3\nv 2 0 -3\nv 2 1 -3\nv 0 1 -3\nf 1 2 3 4\n")
    more = "mesh: wall.obj\nresolution: {pixels_per_metre: 50}\nviewing_side: both\n"
    facets = display_of("- {kind: plane, width: 1, height: 1, pixels: [32, 32]}", tmp_path, more)
    samples = sample_facets(facets, 600)
    counts = np.bincount(samples.facet)
    assert 1.3 < counts[0] / counts[1] < 3.0
    assert np.bincount(samples.facet, samples.area) == pytest.approx([2.0, 1.0], rel=1e-6)
    # The mesh is lit on both sides, a surface on its own alone.
    assert samples.both_sides[samples.facet == 0].all()
    assert not samples.both_sides[samples.facet == 1].any()
    behind = solid_angles(samples, np.array([[0.3, 0.2, -8.0]]))[0]
    assert behind[samples.facet == 0].sum() > 0
    assert behind[samples.facet == 1].sum() == 0


def test_the_plan_has_a_wall_once_and_a_dome_with_its_rings(tmp_path: Path) -> None:
    eye = np.array([0.0, 0.2, 0.0])
    asked = Question(eye=eye, content=FAR, samples=200, area=(-0.5, -0.5, 0.5, 0.5), step=0.25)
    counts = []
    for kind in ("cylinder", "dome"):
        facets = display_of(f"- {{{SURFACES[kind]}, pixels: [64, 32]}}", tmp_path)
        plan = draw_plan(sweet_spot(facets, replace(asked)))
        counts.append(
            max(len(item.paths) for item in plan.items if isinstance(item, Lines) and item.width == 4)
        )
    # Upright columns of a wall are points from above.
    assert counts == [5, 9 + 5]
