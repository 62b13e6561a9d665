"""Figures of surfaces: crowded pixels, and edges that nearly meet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.charts.measure import pitch_ratio, seam_gap
from quiltcli.display.notices import surface_notices
from tests.helpers.curved_jobs import chart_of, display_of


def test_a_sphere_crowds_at_its_poles_and_a_plane_nowhere(tmp_path: Path) -> None:
    # The row beside a pole is sin(π/2H) of the equator's length.
    found = pitch_ratio(chart_of("kind: sphere, radius: 2", tmp_path, (256, 128)))
    assert found == pytest.approx(1 / np.sin(np.pi / 256), rel=0.01)
    assert pitch_ratio(chart_of("kind: plane, width: 2, height: 1", tmp_path)) == pytest.approx(1)


@pytest.mark.parametrize(
    ("arc", "words"),
    [("[-180, 180]", 0), ("[-180, 179.9]", 1), ("[-180, 170]", 0), ("[-60, 60]", 0)],
)
def test_a_ring_that_is_not_quite_closed_is_said(arc: str, words: int, tmp_path: Path) -> None:
    facets = display_of(
        f"- {{kind: cylinder, radius: 2, height: 1, arc_deg: {arc}, pixels: [360, 60]}}", tmp_path
    )
    found = list(surface_notices(facets))
    assert len(found) == words
    if words:
        # Of 360 pixels over 359.9 degrees, a tenth of one is missing.
        assert "the left and the right edge are 0.1 pixels apart but do not meet" in found[0]
        assert seam_gap(facets.charts[0]) == pytest.approx(0.1, rel=0.02)


def test_poles_are_said_once_a_surface(tmp_path: Path) -> None:
    facets = display_of("- {name: ball, kind: sphere, radius: 1, pixels: [256, 128]}", tmp_path)
    (found,) = surface_notices(facets)
    assert "facet 1 (ball): pixels are up to 81 times closer together" in found
