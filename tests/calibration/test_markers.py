"""Markers on facets: where they are put, and what a camera finds of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.calibration.dictionaries import DICTIONARIES
from quiltcli.calibration.markers import (
    Marker,
    MarkerSet,
    draw_markers,
    marker_places,
    place_markers,
    read_markers,
    unknown_markers,
    write_markers,
)
from quiltcli.calibration.panels.camera import project
from quiltcli.calibration.pattern import MARKERS
from quiltcli.calibration.pattern_files import write_patterns
from quiltcli.display import corner_pixels, load_display
from quiltcli.errors import DisplayError, JobError
from quiltcli.job import load_display_file
from quiltcli.layout import pixel_owners
from tests.helpers import photos
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle

MODELS = Path(__file__).parents[2] / "display_models"


def shipped(name):
    return load_display(load_display_file(MODELS / f"{name}.yaml"))


def one_facet(polygon, mirrored=False):
    facets = flat_display([polygon])
    size = np.ceil(np.ptp(np.array(polygon, float), axis=0)).astype(np.int32)
    facets = replace(facets, size=size[None], origin=np.zeros((1, 3)))
    if mirrored:
        facets = replace(facets, du=-facets.du, origin=facets.origin + size[0] * facets.du)
    return facets


@pytest.mark.parametrize(
    ("name", "kind"),
    [("cube5", "apriltag36h11"), ("cave5", "4x4"), ("corner_billboard", "6x6"), ("sphere840", "5x5")],
)
def test_markers_lie_on_their_facets_apart_with_a_quiet_zone_around_each(name, kind):
    facets = shipped(name)
    found = place_markers(facets, kind, photo=(16000, 12000))
    modules = DICTIONARIES[kind].modules
    assert [marker.id for marker in found.markers] == list(range(len(found.markers)))
    assert len(found.markers) <= DICTIONARIES[kind].count
    pixels, start = corner_pixels(facets), facets.corner_start
    for facet in {marker.facet for marker in found.markers}:
        polygon = pixels[start[facet - 1] : start[facet]]
        taken = np.zeros(facets.size[facet - 1][::-1], int)
        for marker in found.of(facet):
            (x, y), (width, height) = marker.at, marker.size
            assert width % modules == 0 == height % modules
            left, top = x - width // modules, y - height // modules
            right, bottom = x + width + width // modules, y + height + height // modules
            taken[top:bottom, left:right] += 1
            # The box is in the polygon: its corners on the inner side of every edge of these convex ones.
            box = np.array([(left, top), (right, top), (right, bottom), (left, bottom)], float)
            a, b = polygon, np.roll(polygon, -1, axis=0)
            side = (b - a)[:, None, 0] * (box - a[:, None])[..., 1] - (b - a)[:, None, 1] * (
                box - a[:, None]
            )[..., 0]
            assert (side <= 1e-5 * np.abs(polygon).max()).all() or (
                side >= -1e-5 * np.abs(polygon).max()
            ).all()
        assert taken.max() == 1


def test_a_marker_is_as_large_as_the_photo_asks_for():
    facets = shipped("corner_billboard")
    extent = np.ptp(facets.corners, axis=0).max()
    for photo in ((400, 300), (1000, 800)):
        for marker in place_markers(facets, photo=photo).markers:
            metres = marker.size[0] * np.linalg.norm(facets.du[marker.facet - 1])
            assert metres / 7 * min(photo) / extent >= 4 - 1e-6


def test_a_concave_facet_has_markers_on_itself_alone():
    polygon = [(0, 0), (400, 0), (400, 400), (300, 400), (300, 100), (0, 100)]
    found = place_markers(one_facet(polygon), per_facet=12, photo=(4000, 3000))
    inside = np.zeros((400, 400), bool)
    inside[:100] = inside[:, 300:] = True
    assert len(found.markers) > 4
    for marker in found.markers:
        (x, y), (width, height) = marker.at, marker.size
        assert inside[y : y + height, x : x + width].all()


def test_facets_without_room_are_told_and_a_display_without_any_is_refused():
    found = place_markers(shipped("sphere840"))
    assert 0 < len(found.without(shipped("sphere840"))) < 200
    with pytest.raises(DisplayError, match=r"no facet has room for a marker of 7 modules"):
        place_markers(one_facet(rectangle(20, 6)))


def test_too_many_facets_for_a_dictionary():
    with pytest.raises(JobError, match="apriltag36h11 has 587 markers, fewer than the 840 facets"):
        place_markers(shipped("sphere840"), "apriltag36h11")
    with pytest.raises(JobError, match="unknown dictionary 'aruco'"):
        place_markers(shipped("cube5"), "aruco")


def test_corners_are_named_as_seen_from_the_lit_side_mirrored_or_not():
    plain, rear = one_facet(rectangle(100, 80)), one_facet(rectangle(100, 80), mirrored=True)
    straight = marker_places(plain, [Marker(0, 1, (10, 20), (14, 21))])[0]
    other = marker_places(rear, [Marker(0, 1, (100 - 24, 20), (14, 21), mirrored=True)])[0]
    np.testing.assert_allclose(straight, other, atol=1e-12)


def test_a_list_of_markers_comes_back_and_another_file_is_refused(tmp_path):
    facets = shipped("cube5")
    found = place_markers(facets)
    write_markers(tmp_path / "markers.json", found)
    assert read_markers(tmp_path / "markers.json") == found
    assert not list(unknown_markers(found, facets, tmp_path))
    for text in (
        "",
        "[]",
        "{}",
        '{"quilt_markers": 1, "dictionary": "5x5", "markers": [{"id": -1}]}',
        "[" * 10**5,
    ):
        (tmp_path / "other.json").write_text(text)
        with pytest.raises(JobError, match=r"other.json: is no list of markers"):
            read_markers(tmp_path / "other.json")
    far = MarkerSet("5x5", (Marker(0, 9, (0, 0), (7, 7)), Marker(1, 1, (1915, 3), (7, 7))))
    told = [str(problem) for problem in unknown_markers(far, facets, tmp_path / "m.json")]
    assert "marker 0 is on facet 9 (the display has 5 facets" in told[0]
    assert "marker 1 lies outside facet 1, which has 1920 × 1080 pixels" in told[1]


@pytest.mark.parametrize("slant", [10, 35, 60])
@pytest.mark.parametrize("kind", ["5x5", "apriltag36h11"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_real_detector_finds_them_slanted(tmp_path, kind, slant, mirrored):
    pytest.importorskip("cv2")
    from quiltcli.calibration.panels.sightings import find_markers

    facets = one_facet(rectangle(240, 200), mirrored=mirrored)
    found = place_markers(facets, kind, per_facet=4, photo=(640, 480))
    middle = facets.corners.mean(axis=0)
    towards = facets.normal[0]
    side = np.cross(towards, (0.0, 1.0, 0.0))
    side = side / np.linalg.norm(side)
    angle = np.radians(slant)
    eye = middle + 0.42 * (np.cos(angle) * towards + np.sin(angle) * side)
    pose, lens = photos.looking(eye, middle, 0.3), photos.camera(640, 480, 1.0)
    paths = photos.save(tmp_path, [photos.photo(facets, found, lens, pose)])
    seen = find_markers(paths, found)
    assert sorted(seen.marker.tolist()) == list(range(len(found.markers)))
    should = project(
        lens, marker_places(facets, found.markers)[seen.marker].reshape(-1, 3) @ pose.axes.T + pose.shift
    )
    assert np.abs(seen.pixels.reshape(-1, 2) - should).max() < 0.5


def test_pages_show_the_markers_and_a_list_lies_beside_them(tmp_path):
    pytest.importorskip("cv2")
    from PIL import Image

    facets = one_facet(rectangle(120, 90))
    layout = placed(facets, [moved(3, 5)], (128, 100))
    found = place_markers(facets, per_facet=2, photo=(4000, 3000))
    paths = write_patterns(layout, tmp_path, (MARKERS,), markers=found)
    assert [path.name for path in paths] == ["markers_page_01.png", "markers.json"]
    page = np.asarray(Image.open(paths[0]))
    image = np.zeros((90, 120, 3), np.float32)
    draw_markers(found, 1, image)
    np.testing.assert_array_equal(page[5:95, 3:123, :3], np.rint(255 * image))
    assert pixel_owners(layout).size == page.shape[0] * page.shape[1]
