"""Sets of facets that boards carry along: how they have moved, from photos of the boards alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("cv2")

from quiltcli.calibration.panels.attached import parse_attached
from quiltcli.calibration.panels.rig import rig_files, rig_table, solve_rig
from quiltcli.display import load_display
from quiltcli.errors import JobError
from quiltcli.job import load_display_file
from tests.calibration.panels.made_up import MODELS, made_up
from tests.calibration.panels.test_attached import around, at_places, views

LEFT = parse_attached("3x3,50mm,15mm,4x4,0=1,4")
RIGHT = parse_attached("3x3,50mm,15mm,4x4,50=2,3")
# Both lie above the cube and face up, slanted against each other.
AT = (
    at_places(LEFT, np.array([-0.25, 0.45, -0.1]), np.array([0.995, 0.09987492, 0]), np.array([0, 0, 1.0])),
    at_places(RIGHT, np.array([0.05, 0.4, -0.1]), np.array([0.9, -0.435889894, 0]), np.array([0, 0, 1.0])),
)  # fmt: skip
TURN, SHIFT = np.radians([3.0, -5.0, 2.0]), np.array([0.03, 0.01, -0.02])
PHOTOS = tuple(f"photo_{k:02}.jpg" for k in range(10))


def moved_by(places: np.ndarray) -> np.ndarray:
    """Places turned about their middle, and shifted."""
    middle = places.reshape(-1, 3).mean(axis=0)
    turned = Rotation.from_rotvec(TURN).apply((places - middle).reshape(-1, 3))
    return turned.reshape(places.shape) + middle + SHIFT


@pytest.fixture(scope="module")
def case():
    return made_up(views=4)


def seen_boards(case, noise: float):
    poses = around(10)
    return [views(case, LEFT, AT[0], poses, noise), views(case, RIGHT, moved_by(AT[1]), poses, noise)]


def test_a_set_that_has_moved_is_found_with_its_facets(case, tmp_path) -> None:
    found = solve_rig([LEFT, RIGHT], AT, seen_boards(case, 0.0), PHOTOS, case.lens.size, anchor=1)
    np.testing.assert_allclose(found.adjusted.bundle.facets[1], [*TURN, *SHIFT], atol=1e-6)
    files = rig_files(load_display_file(MODELS / "cube5.yaml"), case.facets, found, "fixed.obj")
    (tmp_path / "fixed.yaml").write_text(files[""])
    (tmp_path / "fixed.obj").write_text(files["fixed.obj"])
    fixed = load_display(load_display_file(tmp_path / "fixed.yaml"))
    middle = AT[1].reshape(-1, 3).mean(axis=0)
    for facet in (1, 4, 5):
        np.testing.assert_allclose(fixed.polygon(facet - 1), case.facets.polygon(facet - 1), atol=1e-9)
    for facet in (2, 3):
        should = Rotation.from_rotvec(TURN).apply(case.facets.polygon(facet - 1) - middle) + middle + SHIFT
        np.testing.assert_allclose(fixed.polygon(facet - 1), should, atol=1e-6)


def test_with_noise_it_says_how_sure_it_is(case) -> None:
    found = solve_rig([LEFT, RIGHT], AT, seen_boards(case, 0.3), PHOTOS, case.lens.size)
    held = found.adjusted.bundle.anchor
    lines = list(rig_table(found))
    assert lines[1 + held].endswith("stays")
    assert "1,4" in lines[1]
    free = solve_rig([LEFT, RIGHT], AT, seen_boards(case, 0.3), PHOTOS, case.lens.size, anchor=4)
    off = free.adjusted.bundle.facets[1] - [*TURN, *SHIFT]
    sure = np.sqrt(np.diagonal(free.adjusted.covariance[1]))
    assert (np.abs(off) < 4 * sure).all()
    assert sure[3:].max() < 0.001


def test_rigs_that_do_not_tell_are_refused(case) -> None:
    seen = seen_boards(case, 0.3)
    size = case.lens.size
    bare = replace(RIGHT, facets=())
    with pytest.raises(JobError, match="board 2 of the rig carries no facets"):
        solve_rig([LEFT, bare], AT, seen, PHOTOS, size)
    with pytest.raises(JobError, match="one board alone cannot have moved"):
        solve_rig([LEFT], AT[:1], seen[:1], PHOTOS, size)
    with pytest.raises(JobError, match=r"--anchor 5: no board carries this facet \(known: 1, 4, 2, 3\)"):
        solve_rig([LEFT, RIGHT], AT, seen, PHOTOS, size, anchor=5)
    with pytest.raises(JobError, match="the camera's photos are 4000 × 3000 pixels, these are 800 × 600"):
        solve_rig([LEFT, RIGHT], AT, seen, PHOTOS, (800, 600), case.lens)
    apart = [
        replace(one, photo=one.photo[some], marker=one.marker[some], pixels=one.pixels[some])
        for one, some in ((seen[0], seen[0].photo < 5), (seen[1], seen[1].photo >= 5))
    ]
    with pytest.raises(JobError, match="not every board is tied to the others"):
        solve_rig([LEFT, RIGHT], AT, apart, PHOTOS, size)
