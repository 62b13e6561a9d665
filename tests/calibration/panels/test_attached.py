"""Boards that are rigidly attached to panels: found with them, tying them together, alone; and distances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cv2")

from quiltcli.calibration.markers import marker_places
from quiltcli.calibration.panels.attached import (
    Attached,
    SeenBoard,
    check_boards,
    parse_attached,
    read_rig,
    write_rig,
)
from quiltcli.calibration.panels.calibrate import calibrated_files
from quiltcli.calibration.panels.camera import project
from quiltcli.calibration.panels.distances import enlarged, parse_distance, scale_of
from quiltcli.calibration.panels.sightings import Sightings
from quiltcli.calibration.panels.solve import solve
from quiltcli.display import load_display
from quiltcli.errors import JobError
from quiltcli.job import load_display_file
from tests.calibration.panels.made_up import MODELS, made_up, shipped
from tests.calibration.panels.test_adjust import errors
from tests.helpers.photos import looking

BOARD = parse_attached("4x3,40mm,12mm,4x4,20=1,5")


def at_places(board: Attached, origin, right, down) -> np.ndarray:
    """Corners (m, 4, 3) of a board whose top left is there and whose sides run so."""
    axes = np.stack((right, down, np.cross(right, down)))
    return origin + board.corners @ axes


# Above the front panel of cube5, leaning back by some degrees.
ABOVE = at_places(
    BOARD, np.array([-0.1, 0.52, 0.2]), np.array([1.0, 0, 0]), np.array([0, -np.cos(0.2), np.sin(0.2)])
)


def views(case, board: Attached, places: np.ndarray, poses, noise: float, first: int = 0) -> SeenBoard:
    """What photos from some poses show of a board, from its front."""
    rng = np.random.default_rng(7)
    front = -np.cross(places[0, 1] - places[0, 0], places[0, 3] - places[0, 0])
    photo, marker, pixels = [], [], []
    for number, pose in enumerate(poses, first):
        towards = pose.eye - places[0, 0]
        if towards @ front < 0.3 * np.linalg.norm(front) * np.linalg.norm(towards):
            continue
        for row, corners in enumerate(places):
            local = corners @ pose.axes.T + pose.shift
            at = project(case.lens, local)
            if (local[:, 2] > 0.1).all() and (at > 5).all() and (at < np.array(case.lens.size) - 5).all():
                photo.append(number)
                marker.append(row)
                pixels.append(at + noise * rng.normal(size=(4, 2)))
    return SeenBoard(board, np.array(photo), np.array(marker), np.array(pixels))


def around(count: int, at=(0, 0.3, 0)):
    """Poses all the way around a cube, from above."""
    turns = 2 * np.pi * np.arange(count) / count
    return [looking((1.1 * np.sin(a), 0.9, 1.1 * np.cos(a)), at, 0.1 * np.sin(3 * a)) for a in turns]


def seen_from(case, poses, facets=None, noise: float = 0.3) -> Sightings:
    """Sightings of the display's markers from poses, only of some facets if wanted."""
    from tests.helpers.photos import moved

    rng = np.random.default_rng(3)
    real = moved(case.facets, case.turns, case.shifts)
    places = marker_places(real, case.markers.markers)
    photo, marker, pixels = [], [], []
    for number, pose in enumerate(poses):
        for row, one in enumerate(case.markers.markers):
            if facets is not None and one.facet not in facets[number]:
                continue
            towards = pose.eye - places[row].mean(axis=0)
            if towards @ real.normal[one.facet - 1] < 0.3 * np.linalg.norm(towards):
                continue
            at = project(case.lens, places[row] @ pose.axes.T + pose.shift)
            if (at > 5).all() and (at < np.array(case.lens.size) - 5).all():
                photo.append(number)
                marker.append(row)
                pixels.append(at + noise * rng.normal(size=(4, 2)))
    names = tuple(f"photo_{k + 1:02}.jpg" for k in range(len(poses)))
    return Sightings(names, case.lens.size, np.array(photo), np.array(marker), np.array(pixels))


@pytest.fixture(scope="module")
def case():
    return made_up(seed=2)


def test_a_board_is_found_where_it_is(case) -> None:
    poses = around(12)
    seen = seen_from(case, poses, noise=0.0)
    found = solve(case.facets, case.markers, seen, anchor=1, boards=[views(case, BOARD, ABOVE, poses, 0.0)])
    metres, degrees = errors(case, found)
    assert metres.max() < 1e-7
    assert degrees.max() < 1e-5
    (board,) = found.boards
    np.testing.assert_allclose(board.places, ABOVE, atol=1e-7)
    assert 3 <= board.photos <= 12
    assert found.body(len(found.facets)) == "board 1"


def test_its_uncertainty_is_told_and_holds(case) -> None:
    poses = around(16)
    seen = seen_from(case, poses)
    (board,) = solve(
        case.facets, case.markers, seen, anchor=1, boards=[views(case, BOARD, ABOVE, poses, 0.3)]
    ).boards
    off = board.places.mean(axis=(0, 1)) - ABOVE.mean(axis=(0, 1))
    assert 0 < np.linalg.norm(board.deviation) < 0.001
    assert (np.abs(off) < 4 * board.deviation).all()


def test_a_board_ties_facets_together_that_no_photo_shows_at_once(case) -> None:
    """Every photo shows one facet alone, and the board; without the board nothing ties them."""
    # A board that all see: it lies flat above the cube, facing up.
    flat = at_places(BOARD, np.array([-0.1, 0.5, -0.08]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]))
    poses = around(20)
    only = [{5} if k % 4 == 3 else {1 + (k // 5) % 4} for k in range(20)]
    seen = seen_from(case, poses, only, noise=0.0)
    assert {case.markers.markers[row].facet for row in np.unique(seen.marker)} == {1, 2, 3, 4, 5}
    with pytest.raises(JobError, match="no photo shows facets"):
        solve(case.facets, case.markers, seen, case.lens, anchor=1)
    board = views(case, BOARD, flat, poses, 0.0)
    found = solve(case.facets, case.markers, seen, case.lens, anchor=1, boards=[board])
    metres, degrees = errors(case, found)
    assert metres.max() < 1e-6
    assert degrees.max() < 1e-4


def test_photos_that_show_a_board_alone_are_of_use(case) -> None:
    poses = around(24)
    facets = [set() if k in (0, 1) else set(range(1, 6)) for k in range(24)]
    seen = seen_from(case, poses, facets, noise=0.0)
    board = views(case, BOARD, ABOVE, poses, 0.0)
    assert {0, 1} <= set(board.photo.tolist())
    found = solve(case.facets, case.markers, seen, anchor=1, boards=[board])
    np.testing.assert_allclose(found.boards[0].places, ABOVE, atol=1e-6)


def test_a_board_of_another_size_than_was_said_is_named(case) -> None:
    poses = around(12)
    seen = seen_from(case, poses)
    board = views(case, BOARD, ABOVE, poses, 0.3)
    wrong = replace(board, board=replace(BOARD, gap=0.03))
    with pytest.raises(JobError, match="the corners seen of board 1 contradict those of the facets"):
        solve(case.facets, case.markers, seen, case.lens, anchor=1, boards=[wrong])


def test_a_board_is_read_from_its_text() -> None:
    board = parse_attached("3x2, 40mm, 1 cm, 4x4, 20 = 1-3,5")
    assert (board.across, board.down, board.side, board.gap) == (3, 2, 0.04, 0.01)
    assert (board.dictionary, list(board.ids), board.facets) == (
        "4x4",
        [20, 21, 22, 23, 24, 25],
        (1, 2, 3, 5),
    )
    np.testing.assert_allclose(board.corners[4, 2], [0.09, 0.09, 0])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("3x2,40mm,10mm,4x4", "expected markers across and down, their side, the gap, dictionary, first id"),
        ("3x2,40mm,-1mm,4x4,0", "expected markers and gaps of a size"),
        ("3x2,40,10mm,4x4,0", "expected markers across and down"),
        ("3x2,40mm,10mm,7x7,0", "unknown dictionary '7x7'"),
        ("3x2,40mm,10mm,apriltag36h11,585", "has ids 0 to 586, and"),
        ("3x2,40mm,10mm,4x4,0=3-1", "expected facets such as 1-3,5 behind ="),
    ],
)  # fmt: skip
def test_texts_that_are_no_boards_are_told(text: str, complaint: str) -> None:
    with pytest.raises(JobError) as caught:
        parse_attached(text)
    assert complaint in str(caught.value)


@pytest.mark.parametrize(
    ("texts", "complaint"),
    [
        (("3x2,40mm,10mm,5x5,0",), "marker 0 of 5x5 is on board 1 and on the display"),
        (("3x2,40mm,10mm,4x4,0", "3x2,40mm,10mm,4x4,5"), "marker 5 of 4x4 is on board 2 and on board 1"),
        (("3x2,40mm,10mm,4x4,0=6",), "there is no facet 6 (the display has 1 to 5)"),
        (("3x2,40mm,10mm,4x4,0=1", "3x2,40mm,10mm,4x4,9=1"), "facet 1 is on boards 1 and 2"),
    ],
)
def test_boards_that_cannot_be_told_apart_are_refused(case, texts: tuple, complaint: str) -> None:
    with pytest.raises(JobError) as caught:
        check_boards([parse_attached(text) for text in texts], case.markers, 5)
    assert complaint in str(caught.value)


def test_a_rig_comes_back_and_another_file_is_refused(tmp_path) -> None:
    write_rig(tmp_path / "rig.json", [BOARD], [ABOVE])
    (board,), (places,) = read_rig(tmp_path / "rig.json")
    assert board == BOARD
    np.testing.assert_allclose(places, ABOVE, atol=1e-9)
    for text in ("[]", '{"quilt_rig": 1, "boards": []}', '{"quilt_rig": 1, "boards": [{"across": 2}]}', "{"):
        (tmp_path / "other.json").write_text(text)
        with pytest.raises(JobError, match="is no rig"):
            read_rig(tmp_path / "other.json")


# ---- distances ----


def test_distances_scale_by_least_squares() -> None:
    facets = shipped("cube5")
    texts = ["1A-1C=1.2m", "front A - 3C = 900 mm"]
    stated = [parse_distance(text, facets) for text in texts]
    found = [np.linalg.norm(facets.corners[a] - facets.corners[b]) for a, b in (one.ends for one in stated)]
    expected = (1.2 * found[0] + 0.9 * found[1]) / (found[0] ** 2 + found[1] ** 2)
    assert scale_of(stated, facets.corners) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1A-3C", "expected two corners and a length such as 1A-3C=1.532m"),
        ("1A-3C=-1m", "expected two corners and a length"),
        ("1A-9C=1m", "there is no facet '9' (expected a name, or an id from 1 to 5)"),
        ("1A-3E=1m", "facet 3 has no corner 'E' (expected A to D)"),
        ("1A-1A=1m", "expected two different corners"),
    ],
)
def test_texts_that_are_no_distances_are_told(text: str, complaint: str) -> None:
    with pytest.raises(JobError) as caught:
        parse_distance(text, shipped("cube5"))
    assert complaint in str(caught.value)


def test_a_display_larger_than_its_file_says_is_found_by_a_distance(tmp_path) -> None:
    """All is 1.5 % larger than the file has it; one distance on the facet that stays says so."""
    case = made_up(noise=0.0, views=8)
    spec = load_display_file(MODELS / "cube5.yaml")
    found = solve(case.facets, case.markers, case.seen, anchor=1)
    length = 1.015 * np.linalg.norm(case.facets.polygon(0)[2] - case.facets.polygon(0)[0])
    distance = parse_distance(f"1A-1C={length:.9f} m", case.facets)
    files, told = calibrated_files(spec, case.facets, found, "fixed.obj", [distance])
    (tmp_path / "fixed.yaml").write_text(files[""])
    (tmp_path / "fixed.obj").write_text(files["fixed.obj"])
    fixed = load_display(load_display_file(tmp_path / "fixed.yaml"))
    from tests.helpers.photos import moved

    real = moved(case.facets, case.turns, case.shifts)
    large = enlarged(real, 1.015, case.facets.polygon(0).mean(axis=0))
    np.testing.assert_allclose(fixed.corners, large.corners, atol=1e-7)
    assert (fixed.size == case.facets.size).all()
    assert told[0] == "scaled by 1.015000 to the distances that were measured"
    assert told[1].endswith("mm now, +0.00 mm from what was measured")
