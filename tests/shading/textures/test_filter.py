"""Looking up: between texels, between levels and along footprints, against what can be written down."""

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.scene.textures.levels import levels_of
from quiltcli.scene.textures.pool import Textures, _bordered
from quiltcli.shading.textures.filter import look_up

ALL = (0, 1, 2, 3)


def pool(pixels, wrap=("repeat", "repeat"), anisotropy=16):
    """One picture of float numbers as a pool."""
    levels = list(levels_of(np.asarray(pixels, np.float32), srgb=False))
    sizes = np.array([level.shape[1::-1] for level in levels])
    offset = np.cumsum([0, *(sizes + 2).prod(axis=1)])
    texels = np.empty(offset[-1], np.uint64)
    for level, start, end in zip(levels, offset[:-1], offset[1:], strict=True):
        high, wide = level.shape[:2]
        _bordered(texels[start:end].reshape(high + 2, wide + 2), level, wrap)
    wide, high = sizes.T
    code = [["repeat", "clamp", "mirror"].index(one) for one in wrap]
    return Textures(
        texels, offset[:-1] + wide + 3, wide + 2, wide.astype(np.float32), high.astype(np.float32),
        np.array([0, len(levels)], np.int32), np.array([code], np.int8), {}, (), anisotropy,
    )  # fmt: skip


def looked_up(textures, u, v, slopes=(0, 0, 0, 0), channels=ALL):
    u, v = (np.atleast_1d(np.asarray(values, np.float32)) for values in (u, v))
    steps = np.repeat(np.float32(slopes)[:, None], u.size, axis=1)
    return look_up(textures, np.zeros(1, np.int32), u, v, steps, channels)


def folded(index, size, wrap):
    """The texel that stands for any whole number."""
    if wrap == "repeat":
        return index % size
    if wrap == "clamp":
        return np.clip(index, 0, size - 1)
    place = index % (2 * size)
    return np.where(place < size, place, 2 * size - 1 - place)


def oracle(texels, u, v, wrap):
    """Bilinear texels in float64, folded index by index."""
    high, wide = texels.shape[:2]
    x, y = np.asarray(u, float) * wide - 0.5, np.asarray(v, float) * high - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    total = 0
    for di, dj in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = np.abs(1 - di - (x - i)) * np.abs(1 - dj - (y - j))
        total = total + weight[:, None] * texels[folded(j + dj, high, wrap[1]), folded(i + di, wide, wrap[0])]
    return total


@pytest.mark.parametrize(
    "wrap", [(a, b) for a in ("repeat", "clamp", "mirror") for b in ("repeat", "clamp", "mirror")]
)
def test_bilinear_is_that_of_float64_beyond_both_borders(wrap):
    dice = np.random.default_rng(4)
    texels = dice.uniform(0.1, 1, (5, 7, 4)).astype(np.float16).astype(np.float32)
    u = np.concatenate((dice.uniform(-3, 3, 500), [-0.25, 1.25, 0, 1, -1, 2]))
    v = np.concatenate((dice.uniform(-3, 3, 500), [1.25, -0.25, 1, 0, 2, -1]))
    u, v = u.astype(np.float32), v.astype(np.float32)
    found = looked_up(pool(texels, wrap), u, v)
    np.testing.assert_allclose(found.T, oracle(texels.astype(float), u, v, wrap), atol=4e-6)


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (1, 4096), (16, 16)])
def test_a_constant_is_constant_however_it_is_filtered(size):
    dice = np.random.default_rng(5)
    textures = pool(np.full((*size, 4), 0.3))
    for stretch in (0.0, 1e-3, 0.1, 1.0, 1e6, 1e30):
        slopes = dice.uniform(-1, 1, 4) * stretch
        found = looked_up(textures, dice.uniform(0, 1, 50), dice.uniform(0, 1, 50), slopes)
        np.testing.assert_allclose(found, float(np.float16(0.3)), rtol=1e-6)


def test_a_ramp_is_exact_between_texels_and_at_the_middle_when_it_is_minified():
    ramp = np.repeat((np.arange(64) / 64)[None, :, None], 64, axis=0) * np.ones(4)
    textures = pool(ramp, ("clamp", "clamp"))
    u = np.linspace(0.2, 0.8, 100).astype(np.float32)
    expected = u.astype(float) - 0.5 / 64
    np.testing.assert_allclose(looked_up(textures, u, u * 0 + 0.5, channels=(0,))[0], expected, atol=3e-4)
    for k in (2, 3, 4.5):
        slopes = (k / 64, 0, 0, k / 64)
        found = looked_up(textures, u, u * 0 + 0.5, slopes, (0,))[0]
        np.testing.assert_allclose(found, expected, atol=3e-4)


def blended(k):
    """The level of a picture reduced k times: whole for half of the way, and straight between."""
    whole, share = divmod(min(np.log2(k), 8), 1)
    return whole + np.clip(2 * share - 0.5, 0, 1)


def test_the_level_of_a_face_on_picture_is_the_logarithm_of_how_it_is_reduced():
    """A picture whose levels are all of one number each tells which one was looked at."""
    textures = pool(np.zeros((256, 256, 4)))
    start = 0
    for level in range(9):
        size = (256 >> level) + 2
        row = np.zeros((size * size, 4), np.float16)
        row[:] = level
        textures.texels[start : start + size * size] = row.view(np.uint64)[:, 0]
        start += size * size
    for k in (1.0001, 1.5, 2, 3, 5, 8, 33, 100, 1000):
        found = looked_up(textures, 0.5, 0.5, (k / 256, 0, 0, k / 256), (0,))[0, 0]
        assert found == pytest.approx(blended(k), abs=0.024)
        turned = looked_up(textures, 0.5, 0.5, np.array([0.6, -0.8, 0.8, 0.6]) * k / 256, (0,))[0, 0]
        assert turned == pytest.approx(blended(k), abs=0.024)


@pytest.mark.parametrize("most", [1, 4, 16])
def test_a_long_footprint_is_looked_at_along_its_length(most):
    """Stripes across the footprint are averaged, stripes along it are seen, as far as places reach."""
    stripes = np.repeat(np.where(np.arange(256) % 4 < 2, 1.0, 0.0)[:, None, None], 256, axis=1) * np.ones(4)
    along, across = (4 / 256, 0, 0, 1 / 256), (1 / 256, 0, 0, 16 / 256)
    textures = pool(stripes, anisotropy=most)
    v = np.linspace(0, 1, 40).astype(np.float32)
    sharp = looked_up(textures, v * 0 + 0.3, v, along, (0,))[0]
    assert (np.ptp(sharp) > 0.9) == (most >= 4)
    np.testing.assert_allclose(looked_up(textures, v * 0 + 0.3, v, across, (0,))[0], 0.5, atol=0.07)


def test_the_brightest_texel_stays_finite():
    texels = np.full((4, 4, 4), 65504.0)
    found = looked_up(pool(texels), [0.1, 0.9], [0.3, 0.7], (0.5, 0, 0, 0.4))
    np.testing.assert_allclose(found, 65504, rtol=1e-6)


def test_a_place_has_one_value_whatever_is_looked_up_with_it():
    dice = np.random.default_rng(6)
    textures = pool(dice.uniform(0, 1, (60, 33, 4)), ("mirror", "repeat"))
    n = 40_000
    u, v = dice.uniform(-1, 2, (2, n)).astype(np.float32)
    slopes = (dice.uniform(-1, 1, (4, n)) * 10 ** dice.uniform(-3, 1, n)).astype(np.float32)
    image = np.zeros(n, np.int32)
    together = look_up(textures, image, u, v, slopes, (0, 2))
    some = dice.permutation(n)[:999]
    alone = look_up(textures, image[:1], u[some], v[some], slopes[:, some], (2,))
    assert alone[0].tobytes() == together[1, some].tobytes()


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_squares_are_not_blended_where_they_are_enlarged(wrap):
    texels = np.random.default_rng(4).uniform(0, 1, (5, 7, 4)).astype(np.float16).astype(np.float32)
    squares = replace(pool(texels, (wrap, wrap)), nearest=np.array([True]))
    u, v = np.random.default_rng(5).uniform(-1.5, 2.5, (2, 400)).astype(np.float32)
    found = looked_up(squares, u, v)
    column, row = np.floor(u.astype(float) * 7).astype(int), np.floor(v.astype(float) * 5).astype(int)
    expected = texels[folded(row, 5, wrap), folded(column, 7, wrap)].T
    np.testing.assert_allclose(found, expected, atol=1e-5)
    # Reduced, they are averaged as others are.
    small = looked_up(squares, u, v, (3, 0, 0, 3))
    np.testing.assert_array_equal(small, looked_up(pool(texels, (wrap, wrap)), u, v, (3, 0, 0, 3)))
