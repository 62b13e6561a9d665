"""Levels of textures: decoding, and means over areas at any size."""

import numpy as np
import pytest

from quiltcli.scene.textures.levels import half_bits, halved, level_sizes, levels_of

SIZES = [(1, 1), (3, 5), (1, 4096), (7, 7), (64, 32), (600, 3)]


def values(level):
    return level.view(np.float16).astype(np.float64)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("level", [0, 77, 255])
def test_a_constant_picture_is_constant_at_every_level(size, level):
    pixels = np.full((*size, 3), level, np.uint8)
    levels = [values(one) for one in levels_of(pixels, srgb=True)]
    assert all((one[..., :3] == levels[0][0, 0, 0]).all() for one in levels)
    assert all((one[..., 3] == 1).all() for one in levels)
    assert [one.shape[1::-1] for one in levels] == level_sizes(*size[::-1], most=65536)
    assert levels[-1].shape == (1, 1, 4)


def weights_of_areas(size):
    """How much of each of `size` texels a texel of the next level covers, (size // 2, size)."""
    count = max(size // 2, 1)
    edges = np.arange(count + 1) * size / count
    low = np.maximum(edges[:-1, None], np.arange(size))
    high = np.minimum(edges[1:, None], np.arange(size) + 1)
    return np.maximum(high - low, 0) * count / size


@pytest.mark.parametrize("size", [(1, 2), (3, 5), (4, 7), (9, 6), (2, 1), (31, 1)])
def test_a_level_is_the_mean_over_areas(size):
    texels = np.random.default_rng(1).uniform(0, 2, (*size, 4)).astype(np.float32)
    rows, columns = weights_of_areas(size[0]), weights_of_areas(size[1])
    expected = np.einsum("ai,bj,ijc->abc", rows, columns, texels.astype(np.float64))
    np.testing.assert_allclose(halved(texels), expected, rtol=3e-7)


def test_tall_pictures_are_reduced_in_strips_as_in_one():
    pixels = np.random.default_rng(2).integers(0, 256, (1400, 6, 3)).astype(np.uint8)
    first, second, *_ = levels_of(pixels, srgb=False)
    whole = halved(first.view(np.float16).astype(np.float32))
    np.testing.assert_array_equal(second, half_bits(whole))


def test_srgb_is_decoded_before_anything_is_averaged():
    pixels = np.array([[[0, 128, 10], [255, 128, 10]]], np.uint8)
    own, mean = (values(one) for one in levels_of(pixels, srgb=True))
    np.testing.assert_allclose(own[0, 1], [1, 0.2158605, 10 / 255 / 12.92, 1], rtol=5e-4)
    np.testing.assert_allclose(mean[0, 0, :2], [0.5, 0.2158605], rtol=5e-4)
    raw, mean = (values(one) for one in levels_of(pixels, srgb=False))
    np.testing.assert_allclose(raw[0, 1, :3], [1, 128 / 255, 10 / 255], rtol=5e-4)


@pytest.mark.parametrize(
    ("channels", "expected"),
    [(1, (1, 1, 1, 1)), (2, (1, 1, 1, 0.2)), (3, (1, 0.2, 0.4, 1)), (4, (1, 0.2, 0.4, 0.6))],
)
def test_grey_and_alpha_are_told_by_the_number_of_channels(channels, expected):
    pixels = np.array([[[255, 51, 102, 153]]], np.uint8)[..., :channels]
    (found,) = levels_of(pixels, srgb=False)
    np.testing.assert_allclose(values(found)[0, 0], expected, atol=3e-4)


def test_sixteen_bits_are_finer_than_eight():
    pixels = np.array([[[1000, 1001, 65535]]], np.uint16)
    (found,) = levels_of(pixels, srgb=False)
    np.testing.assert_allclose(values(found)[0, 0, :3], np.array([1000, 1001, 65535]) / 65535, rtol=5e-4)


def test_light_of_float_files_is_finite_and_no_less_than_nothing():
    pixels = np.array([[[np.inf, -1, np.nan], [1e9, 1e-7, 2.5]]], np.float32)
    (own, mean) = (values(one) for one in levels_of(pixels, srgb=False))
    np.testing.assert_array_equal(own[0, :, :3], [[65504, 0, 0], [65504, 0, 2.5]])
    assert np.isfinite(mean).all()
