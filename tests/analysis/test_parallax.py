"""Parallax on facets, by closed form."""

import numpy as np
import pytest

from quiltcli.analysis.parallax import facet_parallax, stereo_notices
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from quiltcli.scene import load_scene
from tests.helpers.in_memory import panel
from tests.render.test_views import ball_job

LEFT, RIGHT = np.array([-0.03, 0.0, 2.0]), np.array([0.03, 0.0, 2.0])


@pytest.mark.parametrize("depth", [0.5, 1.0, 1.999, 2.001, 3.0, 50.0])
def test_parallax_is_the_separation_times_what_lies_behind_the_facet(depth):
    """A panel 2 m away, a point at `depth`: s (1 − 2/depth), to the left where it is in front."""
    facets = panel(width=4, height=4, density=100)
    world, pixels, inside = facet_parallax(facets, 0, LEFT, RIGHT, np.array([[0.1, 0.2, 2 - depth]]))
    assert inside.tolist() == [True]
    assert world[0] == pytest.approx([0.06 * (1 - 2 / depth), 0, 0], abs=1e-9)
    assert pixels[0] == pytest.approx([100 * 0.06 * (1 - 2 / depth), 0], abs=1e-7)
    assert (world[0, 0] < 0) == (depth < 2)


def test_a_point_on_the_facet_has_none():
    facets = panel(width=4, height=4, density=100)
    world, pixels, _ = facet_parallax(facets, 0, LEFT, RIGHT, np.array([[0.7, -0.4, 0.0]]))
    assert np.abs(world).max() < 1e-15
    assert np.abs(pixels).max() < 1e-12


def test_points_beside_the_facet_do_not_count():
    facets = panel(width=2, height=2, density=100)
    points = np.array([[5.0, 0, 0], [0, 0, 3], [0, 0, -1]])
    assert facet_parallax(facets, 0, LEFT, RIGHT, points)[2].tolist() == [False, False, True]


def test_points_as_far_away_as_the_eyes_are_nowhere_on_the_facet():
    facets = panel(width=2, height=2, density=100)
    points = np.array([[0.5, 0.0, 2.0], LEFT, RIGHT, [0.5, 0.0, 2.0 + 1e-15]])
    world, pixels, inside = facet_parallax(facets, 0, LEFT, RIGHT, points)
    assert not inside.any()
    assert np.isfinite(world).all()
    assert np.isfinite(pixels).all()


def notices(job):
    facets = load_display(load_display_file(job.display))
    return list(stereo_notices(job, facets, load_scene(job.scene)))


def test_a_job_is_asked_about_what_its_eyes_see(tmp_path):
    words = notices(ball_job(tmp_path))
    assert words[0] == "the eyes are 100 mm apart (people's are 40 to 80 mm)"
    assert any(word.startswith("the largest parallax behind the facets is") for word in words)
    assert notices(ball_job(tmp_path, stereo="")) == []


def test_eyes_on_both_sides_of_a_facets_plane_are_told(tmp_path):
    job = ball_job(tmp_path, eye=(1.0, 0.3, 4.0))
    assert any("lit for one eye only at some frame" in word for word in notices(job))
