from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quiltcli.errors import LayoutError
from quiltcli.layout import Layout, facet_spans, fill, pixel_owners, quilt_polygons
from tests.helpers.flat_displays import flat_display, moved, placed, random_polygons, rectangle, tiling
from tests.helpers.packed_layouts import pack


def picture(layout, bleed=0.0, page=0):
    """Owners of a page as text: digits inside, letters in the bleed (a = facet 1), dots elsewhere."""
    start, stop = layout.page_offset[page : page + 2]
    rows = pixel_owners(layout, bleed)[start:stop].reshape(-1, layout.pages[page, 0])
    return ["".join("." if o == 0 else str(o) if o > 0 else chr(96 - o) for o in row) for row in rows]


def one(polygon, page=(6, 4), at=(0, 0)):
    return placed(flat_display([polygon]), [moved(*at)], page)


def test_rectangle_owns_its_pixels():
    assert picture(one(rectangle(3, 2), at=(1, 1))) == ["......", ".111..", ".111..", "......"]


def test_centre_on_left_and_top_edge_is_inside_on_right_and_bottom_outside():
    layout = one([[0.5, 0.5], [3.5, 0.5], [3.5, 2.5], [0.5, 2.5]])
    assert picture(layout) == ["111...", "111...", "......", "......"]


def test_diagonal_through_centres_goes_to_the_polygon_on_its_right():
    low, high = [[0, 0], [4, 4], [0, 4]], [[0, 0], [4, 0], [4, 4]]
    assert picture(tiling([low, high], (6, 4))) == ["2222..", "1222..", "1122..", "1112.."]


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("step", [1, -1])
def test_winding_and_first_corner_do_not_matter(start, step):
    corners = [[0.5, 0.5], [3.5, 1.5], [2.5, 3.5], [0.5, 2.5]]
    expected = picture(one(corners))
    assert expected == picture(one(np.roll(corners[::step], start, axis=0)))


def test_concave_polygon_leaves_its_notch_free():
    layout = one([[0, 0], [6, 0], [6, 4], [4, 4], [4, 2], [2, 2], [2, 4], [0, 4]])
    assert picture(layout) == ["111111", "111111", "11..11", "11..11"]


def test_thin_facet_between_centres_owns_nothing():
    assert fill(one([[0.6, 0], [1.4, 0], [1.4, 4], [0.6, 4]])) == 0


def test_corner_between_two_neighbours_edge_ends_is_claimed_once():
    # Facets 2 and 3 meet in the middle of facet 1's slanted edge, on a pixel centre.
    first = [[0, 0], [1, 0], [6, 5], [6, 6], [0, 6]]
    second, third = [[1, 0], [6, 0], [3.5, 2.5]], [[6, 0], [6, 5], [3.5, 2.5]]
    assert fill(tiling([first, second, third], (6, 6))) == 1.0


def test_neighbours_agree_though_their_corners_differ_in_the_last_bits():
    nudge = 1e-12
    left, right = [[0, 0], [2.5 + nudge, 0], [2.5 + nudge, 4], [0, 4]], [[2.5, 0], [6, 0], [6, 4], [2.5, 4]]
    assert picture(tiling([left, right], (6, 4))) == ["112222"] * 4


def test_pages_follow_each_other_and_absent_facets_own_nothing():
    facets = flat_display([rectangle(2, 1)] * 3)
    layout = placed(facets, [moved(0, 0)] * 3, (3, 2), on=[1, 0, -1], pages=2)
    assert pixel_owners(layout).tolist() == [2, 2, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0]


def test_polygon_past_the_page_is_cut_off():
    layout = one([[-2, -2], [9, -2], [9, 9], [-2, 9]])
    assert picture(layout) == ["111111"] * 4


def test_runs_are_sorted_and_not_empty():
    spans = facet_spans(pack(flat_display(random_polygons(30, 3, 20, seed=1)), "rows", (64, 64)))
    assert (spans.start < spans.stop).all()
    assert (spans.stop[:-1] <= spans.start[1:]).all()


def test_overlap_is_refused():
    layout = placed(flat_display([rectangle(3, 3)] * 2), [moved(0, 0), moved(2, 2)])
    with pytest.raises(LayoutError, match=r"^flat\.yaml: facets overlap in the quilt$"):
        pixel_owners(layout)


def test_owners_are_int16_while_ids_fit():
    layout = one(rectangle(2, 2))
    assert np.int16 == pixel_owners(layout, 1).dtype
    large = replace(layout, facet=np.array([32767], np.int32))
    assert np.int32 == pixel_owners(large, 1).dtype
    assert {-32767, 0, 32767} == set(pixel_owners(large, 1).tolist())


def test_bleed_reaches_as_far_as_asked_and_is_round():
    assert picture(one(rectangle(2, 2), at=(2, 1)), 1.5)[:4] == [".aaaa.", "aa11aa", "aa11aa", ".aaaa."]
    assert picture(one(rectangle(2, 2), at=(2, 1)), 0.5) == ["..aa..", ".a11a.", ".a11a.", "..aa.."]


def test_bleed_less_than_half_a_pixel_reaches_no_centre():
    assert picture(one(rectangle(2, 2), at=(1, 0)), 0.49) == [".11...", ".11...", "......", "......"]


def test_contested_bleed_goes_to_the_nearest_then_to_the_lowest_id():
    two = flat_display([rectangle(1, 1)] * 2)
    assert picture(placed(two, [moved(0, 0), moved(6, 0)], (7, 1)), 2) == ["1aa.bb2"]
    assert picture(placed(two, [moved(0, 0), moved(6, 0)], (7, 1)), 3) == ["1aaabb2"]


def test_equal_distance_goes_to_the_lowest_id_wherever_it_lies():
    two = flat_display([rectangle(1, 1)] * 2)
    assert picture(placed(two, [moved(6, 0), moved(0, 0)], (7, 1)), 3) == ["2bbaaa1"]


def test_bleed_never_takes_a_pixel_from_inside():
    two = flat_display([rectangle(2, 2)] * 2)
    assert picture(placed(two, [moved(0, 0), moved(2, 0)], (4, 2)), 5) == ["1122", "1122"]


def test_bleed_stays_on_its_page():
    layout = placed(flat_display([rectangle(1, 1)]), [moved(2, 1)], (3, 2), pages=2)
    assert pixel_owners(layout, 9).tolist() == [-1] * 5 + [1] + [0] * 6


def brute_force(layout: Layout, bleed: float) -> list[int]:
    """Owners by the definition, a pixel and a facet at a time (no ties in general position)."""
    width, height = layout.pages[0]
    quilt = quilt_polygons(layout)
    polygons = [quilt[a:b] for a, b in zip(layout.corner_start, layout.corner_start[1:], strict=False)]
    return [
        owner_of(np.array((x + 0.5, y + 0.5)), polygons, bleed) for y in range(height) for x in range(width)
    ]


def owner_of(point, polygons, bleed):
    reach = []
    for facet, polygon in enumerate(polygons, 1):
        turns = 0.0
        nearest = np.inf
        for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            u, v = a - point, b - point
            turns += np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v)
            t = np.clip(-(u @ (v - u)) / ((v - u) @ (v - u)), 0, 1)
            nearest = min(nearest, float(np.linalg.norm(u + t * (v - u))))
        if abs(turns) > 3:
            return facet
        reach.append((nearest, facet))
    distance, facet = min(reach)
    return -facet if distance <= bleed else 0


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), bleed=st.sampled_from([0.0, 0.7, 2.0, 3.3]))
def test_owners_agree_with_winding_numbers_and_distances(seed, bleed):
    # Two factors, so that no slanted edge runs through pixel centres: there the two may differ.
    polygons = [polygon * (0.9713, 0.9379) for polygon in random_polygons(4, 4, 12, seed)]
    layout = pack(flat_display(polygons), "rows", (26, 26), padding=1, max_pages=1)
    assert brute_force(layout, bleed) == pixel_owners(layout, bleed).tolist()


def fan(cuts, centre, width, height):
    """Triangles from an inner point to the page's border, cut at its corners and at these places along it."""
    corners = {0, width, width + height, 2 * width + height}
    ends = [on_border(at, width, height) for at in sorted(corners | set(cuts))]
    return [[ends[i - 1], ends[i], centre] for i in range(len(ends))]


def on_border(at, width, height):
    """The point at this distance along the border, clockwise from the top-left corner."""
    if at <= width:
        return [at, 0]
    if at <= width + height:
        return [width, at - width]
    if at <= 2 * width + height:
        return [2 * width + height - at, height]
    return [0, 2 * (width + height) - at]


halves = st.integers(1, 51).map(lambda n: n / 2)


@settings(max_examples=60, deadline=None)
@given(cuts=st.lists(halves, max_size=9), x=st.integers(1, 29), y=st.integers(1, 21))
def test_edge_sharing_pieces_of_a_page_claim_every_pixel_exactly_once(cuts, x, y):
    # Every corner lies on a pixel's centre, edge or corner: ties everywhere.
    spans = facet_spans(tiling(fan(cuts, [x / 2, y / 2], 15, 11), (15, 11)))
    claimed = [pixel for a, b in zip(spans.start, spans.stop, strict=True) for pixel in range(a, b)]
    assert list(range(165)) == sorted(claimed)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), slope=st.floats(-3, 3), offset=st.floats(-0.5, 0.5))
def test_random_cuts_of_a_page_leave_no_pixel_out(seed, slope, offset):
    # Triangles of a jittered grid, sheared: corners of general floats, shared by six.
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0)), axis=-1) * 3
    grid[1:-1, 1:-1] += rng.uniform(-0.9, 0.9, (4, 4, 2))
    triangles = []
    for i in range(5):
        for j in range(5):
            a, b, c, d = grid[i, j], grid[i, j + 1], grid[i + 1, j + 1], grid[i + 1, j]
            triangles += [[a, b, c], [a, c, d]]
    layout = tiling(triangles, (15, 15))
    shear = np.array([[1, 0, 0], [0, 1, 0]], dtype=float)
    assert fill(layout) == 1.0
    shear[0, 1], shear[0, 2] = slope, offset
    sheared = replace(layout, quilt_from_facet=np.tile(shear, (50, 1, 1)))
    outline = replace(tiling([rectangle(15, 15)], (15, 15)), quilt_from_facet=shear[None])
    assert (pixel_owners(outline) > 0).tolist() == (pixel_owners(sheared) > 0).tolist()
