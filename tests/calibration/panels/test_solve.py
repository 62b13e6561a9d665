"""Photos that do not tell: each with what is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cv2")

from quiltcli.calibration.panels.solve import solve
from quiltcli.errors import JobError
from tests.calibration.panels.made_up import made_up


@pytest.fixture(scope="module")
def case():
    return made_up(views=12)


def facet_of(case):
    return np.array([marker.facet for marker in case.markers.markers])[case.seen.marker]


def kept(case, some):
    seen = case.seen
    return replace(seen, photo=seen.photo[some], marker=seen.marker[some], pixels=seen.pixels[some])


def test_a_facet_that_no_photo_shows_is_named(case):
    seen = kept(case, facet_of(case) != 3)
    with pytest.raises(JobError, match="no photo shows a marker of facets 3 "):
        solve(case.facets, case.markers, seen)


def test_a_facet_in_one_photo_is_named(case):
    own = facet_of(case) == 5
    first = case.seen.photo[own][0]
    with pytest.raises(JobError, match="only one photo shows facets 5 "):
        solve(case.facets, case.markers, kept(case, ~own | (case.seen.photo == first)))


def test_facets_that_no_photo_ties_to_the_others_are_named():
    case = made_up(views=24)
    # Half of the photos show the top, the others all but it.
    some = (facet_of(case) == 5) == (case.seen.photo % 2 == 0)
    with pytest.raises(JobError, match=r"no photo shows facets [\d, ]+ together with facet \d"):
        solve(case.facets, case.markers, kept(case, some))


def test_a_photo_without_markers_is_named(case):
    with pytest.raises(JobError, match=r"photo_02\.jpg: no marker of the display was found in it"):
        solve(case.facets, case.markers, kept(case, case.seen.photo != 1))


def test_nothing_at_all(case):
    with pytest.raises(JobError, match="no marker was found in 12 photos"):
        solve(case.facets, case.markers, kept(case, np.zeros(len(case.seen.photo), bool)))


def test_too_few_views_for_a_camera_that_is_not_known(case):
    facet = facet_of(case)
    three = np.unique(case.seen.photo[facet == 5])[:3]
    only = (facet == 5) & np.isin(case.seen.photo, three)
    facets = replace(case.facets, enabled=np.arange(5) == 4)
    markers = replace(case.markers, markers=tuple(case.markers.of(5)))
    seen = kept(case, only)
    seen = replace(
        seen,
        photos=seen.photos[:3],
        photo=np.searchsorted(three, seen.photo),
        marker=seen.marker - (len(case.markers.markers) - len(markers.markers)),
    )
    with pytest.raises(JobError, match="the photos show 3 views of facets, too few to tell"):
        solve(facets, markers, seen)


def test_a_facet_of_another_size_than_the_file_says_is_named(case):
    pixels = case.seen.pixels.copy()
    own = facet_of(case) == 2
    # Seen half as large again about its middle in each photo.
    for photo in np.unique(case.seen.photo):
        here = own & (case.seen.photo == photo)
        if here.any():
            middle = pixels[here].mean(axis=(0, 1))
            pixels[here] = middle + 1.5 * (pixels[here] - middle)
    with pytest.raises(JobError, match="the corners seen of facet 2 contradict"):
        solve(case.facets, case.markers, replace(case.seen, pixels=pixels), case.lens)


def test_an_anchor_that_is_no_facet(case):
    with pytest.raises(
        JobError, match=r"--anchor 9: there is no such facet with markers \(known: 1, 2, 3, 4, 5\)"
    ):
        solve(case.facets, case.markers, case.seen, anchor=9)


def test_flat_facets_seen_from_one_side_leave_the_camera_open():
    case = made_up("corner_billboard", views=5)
    # One facet alone, head on from five places in a row: any focal length fits.
    from quiltcli.calibration.markers import marker_places
    from quiltcli.calibration.panels.camera import project
    from tests.helpers.photos import looking

    markers = replace(case.markers, markers=tuple(case.markers.of(1)))
    places = marker_places(case.facets, markers.markers)
    middle, normal = places.mean(axis=(0, 1)), case.facets.normal[0]
    rng = np.random.default_rng(1)
    pixels = []
    for k in range(5):
        pose = looking(middle + (9 + k) * normal, middle)
        flat = project(case.lens, places.reshape(-1, 3) @ pose.axes.T + pose.shift)
        pixels.append(flat + 0.3 * rng.normal(size=flat.shape))
    seen = replace(
        case.seen,
        photo=np.repeat(np.arange(5), len(places)),
        marker=np.tile(np.arange(len(places)), 5),
        pixels=np.array(pixels).reshape(-1, 4, 2),
    )
    with pytest.raises(JobError, match="the photos do not tell the camera's focal length"):
        solve(case.facets, markers, seen)
