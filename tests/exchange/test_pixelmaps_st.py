"""ST maps do in another program what unmapping does here."""

from __future__ import annotations

import numpy as np
import OpenImageIO
import pytest

from quiltcli.calibration.pattern import draw, piece
from quiltcli.calibration.pattern_files import page_pattern
from quiltcli.exchange.pixelmaps import write_map
from quiltcli.exchange.pixelmaps.stmap import facet_st_map, page_st_map
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.facets import page_of
from quiltcli.layout import pixel_owners
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.turned_layout import TURN_NAMES, turned_layout


def warped(image, red, green, pixel_filter):
    """The image (H, W, C) through an ST map, as OpenImageIO's st_warp applies one made for Nuke."""
    height, width = red.shape
    map_image = OpenImageIO.ImageBuf(np.ascontiguousarray(np.dstack((red, green))))
    source = OpenImageIO.ImageBuf(np.ascontiguousarray(image, dtype=np.float32))
    region = OpenImageIO.ROI(0, width, 0, height, 0, 1, 0, image.shape[2])
    result = OpenImageIO.ImageBufAlgo.st_warp(source, map_image, pixel_filter, flip_t=True, roi=region)
    assert not result.has_error, result.geterror()
    return np.asarray(result.get_pixels(OpenImageIO.FLOAT))


@pytest.mark.parametrize("pixel_filter", ["box", "triangle"])
@pytest.mark.parametrize("turn", range(8), ids=TURN_NAMES)
def test_a_facets_map_takes_its_upright_picture_out_of_the_quilt(turn, pixel_filter):
    layout = turned_layout()
    owners = pixel_owners(layout)
    page = page_pattern(layout, int(layout.page[turn]), "id", owners)
    quilt = np.dstack([page[c] for c in "RGB"])
    upright = draw("id", piece(layout, turn, owners))
    found = warped(quilt, *facet_st_map(layout, turn), pixel_filter)
    found[~piece(layout, turn, owners).inside] = 0
    # The middle of a pixel is met but for single precision, which a triangle filter sees.
    np.testing.assert_allclose(found, upright, rtol=0, atol=0 if pixel_filter == "box" else 2e-5)


@pytest.mark.parametrize("turn", range(8), ids=TURN_NAMES)
def test_a_pages_map_puts_facet_images_into_the_quilt(turn):
    layout = turned_layout()
    owners = pixel_owners(layout)
    page = int(layout.page[turn])
    expected = page_pattern(layout, page, "id", owners)
    red, green, facet = page_st_map(layout, page, owners)
    mine = facet == layout.facet[turn]
    np.testing.assert_array_equal(mine, page_of(owners, layout, page) == layout.facet[turn])
    found = warped(draw("id", piece(layout, turn, owners)), red, green, "box")
    np.testing.assert_array_equal(np.dstack([expected[c] for c in "RGB"])[mine], found[mine])


def test_an_untouched_picture_has_the_identity_map():
    layout = placed(flat_display([rectangle(5, 4)]), [moved(0, 0)], (5, 4))
    for red, green in (facet_st_map(layout, 0), page_st_map(layout, 0, pixel_owners(layout))[:2]):
        for y, x in np.ndindex(4, 5):
            assert red[y, x] == np.float32((x + 0.5) / 5)
            assert green[y, x] == np.float32(1 - (y + 0.5) / 4)


def test_a_picture_keeps_its_asymmetry_only_with_flip_t():
    layout = turned_layout([0])
    owners = pixel_owners(layout)
    page = page_pattern(layout, 0, "marker", owners)
    red, green = facet_st_map(layout, 0)
    upside_down = warped(np.dstack([page[c] for c in "RGB"]), red, 1 - green, "box")
    assert not np.array_equal(upside_down, draw("marker", piece(layout, 0, owners)))


def test_files_say_inside_by_alpha_and_go_on_outside(tmp_path):
    layout = turned_layout()
    owners = pixel_owners(layout)
    written = write_map(layout, None, tmp_path / "st.exr")
    assert [str(path.relative_to(tmp_path)) for path in written] == [
        *("st_page_01.exr", "st_page_02.exr"),
        *(f"st_facets/facet_000{n}.exr" for n in range(1, 9)),
    ]
    for row, path in enumerate(written[2:]):
        image = read_exr(path)
        assert {channel.dtype for channel in image.channels.values()} == {np.dtype(np.float32)}
        np.testing.assert_array_equal(piece(layout, row, owners).inside, image.channels["A"] == 1)
        assert (image.attributes["quilt:facet"], image.attributes["quilt:page"]) == (row + 1, row % 2 + 1)
        for channel in (image.channels["R"], image.channels["G"]):
            steps = np.diff(channel, axis=0), np.diff(channel, axis=1)
            assert all(np.ptp(step) < 1e-6 for step in steps)
            assert (channel != 0).all()
    for page, path in enumerate(written[:2]):
        image = read_exr(path)
        ids = np.maximum(page_of(owners, layout, page), 0)
        np.testing.assert_array_equal(ids, image.channels["B"])
        np.testing.assert_array_equal(ids > 0, image.channels["A"] == 1)
        assert image.attributes["quilt:page"] == page + 1


def test_a_large_page_keeps_pixel_centres():
    layout = placed(flat_display([rectangle(3, 2)]), [moved(8187, 8189)], (8192, 8192))
    red, green = (channel.astype(np.float64) for channel in facet_st_map(layout, 0))
    assert np.abs(red * 8192 - [8187.5, 8188.5, 8189.5]).max() < 1e-3
    assert np.abs((1 - green) * 8192 - [[8189.5], [8190.5]]).max() < 1e-3
