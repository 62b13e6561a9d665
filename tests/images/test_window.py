from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.formats.exr.image import Image, read_exr, write_exr
from quiltcli.images.window import cropped, frame_size, tight_window, whole_frame


def picture(height=9, width=12):
    """A colour channel of zeros and a depth that is infinite, and a mask of numbers."""
    return {
        "R": np.zeros((height, width), np.float16),
        "Z": np.full((height, width), np.inf, np.float32),
        "facet": np.zeros((height, width), np.uint32),
    }


def image(channels, data, display):
    return Image(channels, {}, "zip", data, display)


@pytest.mark.parametrize("name", ["R", "Z", "facet"])
@pytest.mark.parametrize("size", [(9, 12), (200, 150), (1, 1)])
def test_one_pixel_in_any_channel_is_the_window(name, size):
    for y, x in {(0, 0), (size[0] - 1, size[1] - 1), (size[0] // 2, size[1] // 3)}:
        channels = picture(*size)
        channels[name][y, x] = 1
        assert tight_window(channels) == ((x, y), (x, y))


def test_the_window_bounds_all_that_shows():
    channels = picture()
    channels["R"][2, 7] = 0.5
    channels["Z"][6, 3] = 2
    assert tight_window(channels) == ((3, 2), (7, 6))


def test_nothing_is_one_pixel():
    assert tight_window(picture()) == ((0, 0), (0, 0))


@pytest.mark.parametrize("value", [np.nan, -0.0, np.inf])
def test_what_only_looks_empty_is_kept(value):
    channels = picture()
    channels["R"][4, 5] = value
    assert tight_window(channels) == ((5, 4), (5, 4))


def test_a_window_that_is_cropped_and_filled_up_is_the_frame():
    rng = np.random.default_rng(3)
    channels = picture(70, 140)
    channels["R"][20:40, 30:99] = rng.random((20, 69))
    channels["Z"][25:50, 40:60] = rng.random((25, 20))
    window = tight_window(channels)
    assert window == ((30, 20), (98, 49))
    whole = whole_frame(image(cropped(channels, window), window, ((0, 0), (139, 69))))
    for name, channel in channels.items():
        assert whole[name].dtype == channel.dtype
        np.testing.assert_array_equal(whole[name], channel)


def test_a_data_window_may_stand_out_of_the_frame():
    channels = {"R": np.arange(12, dtype=np.float32).reshape(3, 4)}
    whole = whole_frame(image(channels, ((-1, -2), (2, 0)), ((0, 0), (1, 1))))
    np.testing.assert_array_equal(whole["R"], [[9, 10], [0, 0]])


def test_a_data_window_beside_the_frame_shows_nothing():
    whole = whole_frame(image({"Z": np.ones((2, 2), np.float32)}, ((8, 8), (9, 9)), ((0, 0), (1, 0))))
    np.testing.assert_array_equal(whole["Z"], [[np.inf, np.inf]])


def test_a_full_window_is_handed_on_without_a_copy():
    channels = picture()
    whole = image(channels, ((0, 0), (11, 8)), ((0, 0), (11, 8)))
    assert whole_frame(whole) is channels
    assert frame_size(replace(whole, data_window=((2, 2), (3, 3)))) == (12, 9)


def test_a_tight_file_reads_back_to_the_frame(tmp_path):
    channels = picture()
    channels["Z"][3:5, 1:4] = 7
    window = tight_window(channels)
    write_exr(
        tmp_path / "a.exr",
        cropped(channels, window),
        {},
        data_window=window,
        display_window=((0, 0), (11, 8)),
    )
    found = read_exr(tmp_path / "a.exr")
    assert found.data_window == ((1, 3), (3, 4))
    for name, channel in whole_frame(found).items():
        np.testing.assert_array_equal(channel, channels[name])
