"""Test patterns: every facet's own upright picture, at exact pixels in the quilt."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from quiltcli.calibration.pattern import (
    KINDS,
    Piece,
    beside_corner,
    corner_letter,
    draw,
    facet_color,
    piece,
    roomiest,
)
from quiltcli.calibration.pattern_files import page_pattern, write_patterns
from quiltcli.errors import OutputError
from quiltcli.formats.drawing.font import HEIGHT, text_mask, text_width
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.diff import read_image
from quiltcli.images.facets import facet_image, page_of
from quiltcli.images.unmap import unmap
from quiltcli.layout import pixel_owners
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.turned_layout import POLYGON, TURN_NAMES, turned_layout

every_kind = pytest.mark.parametrize("kind", KINDS)


def whole(width, height, polygon=None, step=32, name=""):
    """A facet whose polygon is its raster, or what is given."""
    polygon = np.array(polygon if polygon is not None else rectangle(width, height), dtype=float)
    layout = placed(flat_display([polygon]), [moved(0, 0)], (width, height))
    return replace(piece(layout, 0, pixel_owners(layout), name, step), size=(width, height))


def colors(image):
    return {tuple(color) for color in image.reshape(-1, 3).tolist()}


# --- from the facet to the quilt ---


@every_kind
def test_unmapping_a_page_gives_every_facets_own_upright_picture(kind):
    layout = turned_layout()
    owners = pixel_owners(layout)
    for page in range(len(layout.pages)):
        quilt = page_pattern(layout, page, kind, owners, ["", "two"], step=5)
        buffers = {name: np.zeros(layout.page_offset[-1], np.float32) for name in quilt}
        for name, channel in quilt.items():
            page_of(buffers[name], layout, page)[:] = channel
        for row in np.flatnonzero(layout.page == page):
            name = "two" if layout.facet[row] == 2 else ""
            upright = draw(kind, piece(layout, int(row), owners, name, step=5))
            cut = facet_image(buffers, layout, int(row), owners)
            np.testing.assert_array_equal(upright, np.dstack([cut[c] for c in "RGB"]))


@pytest.mark.parametrize("turn", range(8), ids=TURN_NAMES)
def test_the_quilt_shows_the_facet_turned_as_the_layout_says(turn):
    layout = turned_layout([turn])
    owners = pixel_owners(layout)
    page = page_pattern(layout, 0, "id", owners)["R"]
    upright = draw("id", piece(layout, 0, owners))[:, :, 0]
    height, width = upright.shape
    for j, i in np.ndindex(height, width):
        x, y = np.floor(layout.quilt_from_facet[0] @ [i + 0.5, j + 0.5, 1]).astype(int)
        assert page[y, x] == upright[j, i]


def test_pixels_of_no_facet_are_transparent_black():
    layout = turned_layout()
    owners = pixel_owners(layout)
    for page in range(len(layout.pages)):
        quilt = page_pattern(layout, page, "white", owners)
        inside = page_of(owners, layout, page) > 0
        for channel in quilt.values():
            np.testing.assert_array_equal(np.where(inside, 1, 0), channel)


@pytest.mark.parametrize("form", ["png", "exr"])
def test_pixels_of_no_facet_are_black_where_that_is_asked_for(form, tmp_path):
    layout = turned_layout()
    for path in write_patterns(layout, tmp_path, ["marker"], image_format=form, opaque=True):
        (image,) = read_image(path)
        assert (image.channels["A"] == 1).all()


def test_the_flag_of_the_marker_shows_every_turn_and_mirror():
    image = draw("marker", whole(41, 41))
    pictures = {picture.tobytes() for quarter in range(4) for turned in [np.rot90(image, quarter)]
                for picture in (turned, turned[:, ::-1])}  # fmt: skip
    assert len(pictures) == 8


def test_the_arrow_points_up_and_the_pennant_right():
    image = draw("marker", whole(41, 41))
    white = np.argwhere((image == 1).all(axis=2)[1:-1, 1:-1]) + 1  # the border is white as well
    red = np.argwhere((image == (1, 0, 0)).all(axis=2))
    widest = np.bincount(white[:, 0]).argmax()
    assert widest < white[:, 0].mean()
    # It has a point, and grows from there row by row to the head's end.
    rows = np.bincount(white[:, 0])[white[:, 0].min() : widest + 1]
    assert rows[0] == 1
    assert (np.diff(rows) >= 0).all()
    assert red[:, 1].min() > white[:, 1][white[:, 0] == white[:, 0].max()].max()


# --- what is drawn ---


def test_the_border_of_a_rectangle_is_its_outermost_pixels():
    expected = np.ones((6, 9), dtype=bool)
    expected[1:-1, 1:-1] = False
    np.testing.assert_array_equal(expected, whole(9, 6).border)
    np.testing.assert_array_equal(expected[..., None] * np.ones(3), draw("border", whole(9, 6)))


def test_the_border_of_a_triangle_is_every_pixel_with_a_neighbour_outside():
    expected = [
        [1, 1, 1, 1, 1, 0],
        [1, 0, 0, 1, 0, 0],
        [1, 0, 1, 0, 0, 0],
        [1, 1, 0, 0, 0, 0],
        [1, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0],
    ]
    image = draw("border", whole(6, 6, [[0, 0], [6, 0], [0, 6]]))
    assert image[:, :, 1].tolist() == expected


def test_the_gradient_is_the_pixel_centre_to_the_last_bit():
    image = draw("gradient", whole(7, 3))
    for j, i in np.ndindex(3, 7):
        assert image[j, i].tolist() == [np.float32((i + 0.5) / 7), np.float32((j + 0.5) / 3), 0]


def test_the_checker_has_fields_of_exactly_the_step():
    image = draw("checker", whole(12, 9, step=3))[:, :, 0]
    expected = np.kron([[1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 1, 0]], np.ones((3, 3)))
    np.testing.assert_array_equal(expected, image)


def test_grid_lines_are_a_pixel_wide_and_start_at_the_rasters_corner():
    image = draw("grid", whole(64, 48, step=8))
    column, row = image[5, :, 1], image[:, 5, 1]
    assert np.flatnonzero(column[1:-1] == 1).tolist() == [7, 15, 23, 31, 39, 47, 55]
    assert np.flatnonzero(row[1:-1] == 1).tolist() == [7, 15, 23, 31, 39]
    assert image[0].tolist() == [[1, 0, 0]] * 64


def test_the_identification_holds_id_name_letters_and_flag():
    image = draw("id", whole(240, 240, name="top"))
    near = [facet_color(1), (1, 1, 1), (1, 1, 0), (0, 1, 0), (1, 0, 0)]
    assert colors(image) == {tuple(np.float32(color).tolist()) for color in near}
    yellow = np.argwhere((image == (1, 1, 0)).all(axis=2))
    (top, left), (bottom, right) = yellow.min(axis=0), yellow.max(axis=0) + 1
    scale = (bottom - top) // HEIGHT
    assert scale > 1
    np.testing.assert_array_equal(
        text_mask("TOP", scale), (image[top:bottom, left:right] == (1, 1, 0)).all(axis=2)
    )


def test_corner_letters_stand_at_their_corners():
    image = draw("id", whole(240, 160))
    green = (image == (0, 1, 0)).all(axis=2)
    quarters = [green[:80, :120], green[:80, 120:], green[80:, 120:], green[80:, :120]]
    for letter, quarter in zip("ABCD", quarters, strict=True):
        place = np.argwhere(quarter)
        low, high = place.min(axis=0), place.max(axis=0) + 1
        found = quarter[low[0] : high[0], low[1] : high[1]]
        np.testing.assert_array_equal(text_mask(letter, found.shape[0] // HEIGHT), found)


def test_a_facet_with_no_room_for_text_still_has_its_border():
    image = draw("id", whole(4, 4, name="long name"))
    assert (image[0] == 1).all()
    assert not (image[1:3, 1:3] == 1).all(axis=2).any()


def test_corner_letters_go_on_after_z():
    assert [corner_letter(n) for n in (0, 25, 26, 27, 51, 52, 701, 702)] == [
        *("A", "Z", "AA", "AB", "AZ", "BA", "ZZ", "AAA")
    ]


def test_neighbours_have_different_colors():
    near = [np.array(facet_color(n)) for n in range(1, 60)]
    assert min(np.abs(a - b).max() for a, b in itertools.pairwise(near)) > 0.08


def test_the_roomiest_place_of_an_l_is_inside_it():
    polygon = np.array([[0, 0], [30, 0], [30, 8], [10, 8], [10, 30], [0, 30]], dtype=float)
    centre, radius = roomiest(polygon)
    assert 4.5 < radius < 6
    assert (centre < 11).all()


# --- text ---


def test_a_glyph_is_what_is_drawn():
    assert ["".join(".#"[int(dot)] for dot in row) for row in text_mask("f7")] == [
        "#####.#####",
        "#.........#",
        "#........#.",
        "####....#..",
        "#......#...",
        "#......#...",
        "#......#...",
    ]


def test_every_character_is_a_glyph_of_its_own():
    known = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ-_.:+/()#,'=&? "
    assert len({text_mask(character).tobytes() for character in known}) == len(known)


def test_unknown_characters_are_boxes_and_scale_repeats_dots():
    assert text_mask("é").sum() == 2 * 5 + 2 * 5
    assert text_mask("ß").sum() == text_mask("é").sum()
    np.testing.assert_array_equal(np.kron(text_mask("A"), np.ones((3, 3))), text_mask("A", 3))
    assert (text_width(""), text_width("A"), text_width("AB")) == (0, 5, 11)


# --- files ---


def test_png_files_hold_code_values(tmp_path):
    layout = turned_layout()
    written = write_patterns(layout, tmp_path / "new", ["gradient", "white"])
    names = [f"{kind}_page_0{page}.png" for kind in ("gradient", "white") for page in (1, 2)]
    assert [path.name for path in written] == names
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(names)
    expected = page_pattern(layout, 1, "gradient", pixel_owners(layout))
    with Image.open(written[1]) as image:
        assert image.size == tuple(layout.pages[1])
        np.testing.assert_array_equal(
            np.rint(255 * np.dstack([expected[c] for c in "RGBA"])), np.asarray(image)
        )


@pytest.mark.parametrize("kind", ["gradient", "id"])
def test_exr_files_can_be_unmapped_again(tmp_path, kind):
    layout = turned_layout()
    quilts = write_patterns(layout, tmp_path, [kind], image_format="exr")
    owners = pixel_owners(layout)
    written = sorted(unmap(quilts, layout, tmp_path))
    assert len(written) == 8
    for row, path in enumerate(written):
        image = read_exr(path)
        exact = draw(kind, piece(layout, row, owners))
        stored = exact if kind == "gradient" else exact.astype(np.float16)
        np.testing.assert_array_equal(stored, np.dstack([image.channels[c] for c in "RGB"]))
        assert image.attributes["quilt:pattern"] == kind


def test_files_in_the_way_stay(tmp_path):
    (tmp_path / "id_page_02.png").write_text("mine")
    with pytest.raises(OutputError) as caught:
        write_patterns(turned_layout(), tmp_path, ["id"])
    wanted = f"{tmp_path}/id_page_02.png: exists already, expected to be told to overwrite it"
    assert str(caught.value) == wanted
    assert [path.name for path in tmp_path.iterdir()] == ["id_page_02.png"]
    assert len(write_patterns(turned_layout(), tmp_path, ["id"], overwrite=True)) == 2


def test_wrong_wishes_are_told_together(tmp_path):
    with pytest.raises(OutputError) as caught:
        write_patterns(turned_layout(), tmp_path / "new", ["id", "grit"], image_format="gif", step=0)
    assert str(caught.value).splitlines() == [
        "unknown pattern 'grit' (known: id, marker, border, grid, checker, gradient, white, markers)",
        "unknown image format 'gif' (known: png, exr)",
        "a step of 0 pixels; it must be 1 or more",
    ]
    assert not (tmp_path / "new").exists()


def test_a_page_without_facets_is_empty():
    layout = turned_layout()
    alone = replace(layout, page=np.zeros_like(layout.page), pages=np.array([[64, 64], [9, 7]], np.int32))
    empty = page_pattern(replace(alone, page=alone.page - 1), 1, "white", np.zeros(64 * 64 + 63, np.int16))
    assert empty["A"].shape == (7, 9)
    assert not empty["A"].any()


def test_the_border_leaves_the_piece_alone():
    facet = Piece(1, "", (3, 3), POLYGON, np.ones((3, 3), dtype=bool), 8)
    assert facet.border.sum() == 8
    assert facet.inside.all()


@pytest.mark.parametrize("turned", [False, True])
def test_letters_clear_both_sides_of_their_corner(turned):
    notched = np.array([[0.0, 0], [90, 0], [90, 30], [30, 30], [30, 90], [0, 90], [20, 45]])
    polygon = notched[::-1] if turned else notched
    for at in range(len(polygon)):
        spot = beside_corner(polygon, at, 4)
        away = float(np.hypot(*(spot - polygon[at])))
        distances = []
        for other in (at - 1, (at + 1) % len(polygon)):
            side = polygon[other] - polygon[at]
            normal = np.array((-side[1], side[0])) / np.hypot(*side)
            distances.append(abs(float((spot - polygon[at]) @ normal)))
        np.testing.assert_allclose(distances[0], distances[1], atol=1e-9)
        assert away <= 12 + 1e-9
        assert distances[0] > 3.59 or away > 12 - 1e-9
        x, y = spot
        following = np.roll(polygon, -1, axis=0)
        crossed = [
            (a[1] <= y) != (b[1] <= y) and x > a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            for a, b in zip(polygon, following, strict=True)
        ]
        assert sum(crossed) % 2 == 1
