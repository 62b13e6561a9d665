"""Error diffusion over many images at once, against the definition for one pixel at a time."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.geometry import BoolArray, Float32Array
from quiltcli.halftone.diffuse import diffuse, wavefront
from quiltcli.halftone.keys import fixed, ostromoukhov

ONE = np.float32(1)


def defined(
    tones: Float32Array, inside: BoolArray, shares: Float32Array, *, serpentine: bool = True
) -> tuple[BoolArray, float]:
    """Bits (H, W) of one image pixel by pixel, and the sum of the error that left the pixels inside."""
    height, width = tones.shape
    bits, lost = np.zeros((height, width), np.bool_), 0.0
    down, behind = np.zeros((2, height + 1, width), np.float32)
    forth = True
    for y in range(height):
        if not inside[y].any() and not bits.any():
            continue
        step = 1 if forth else -1
        carry = np.float32(0)
        for x in range(width)[::step]:
            tone = tones[y, x] if inside[y, x] else np.float32(0)
            value = (tone + (down[y, x] + behind[y, x])) + carry
            carry = np.float32(0)
            if not inside[y, x]:
                continue
            bits[y, x] = value >= np.float32(0.5)
            error = value - (ONE if bits[y, x] else np.float32(0))
            near, back, under = shares[round(float(tone * np.float32(255)))]
            sent = [(x + step, y, near), (x - step, y + 1, back), (x, y + 1, under)]
            for k, (i, j, share) in enumerate(sent):
                if not (0 <= i < width and j < height and inside[j, i]):
                    lost += float(error) * float(share)
                elif k == 0:
                    carry = error * share
                elif k == 1:
                    behind[j, i] = error * share
                else:
                    down[j, i] = error * share
        forth = not forth or not serpentine
    return bits, lost


def pictures(shape: tuple[int, int, int]) -> Float32Array:
    rng = np.random.default_rng(19)
    tones = rng.random(shape) * rng.random((shape[0], 1, 1)) * 1.2
    tones[0] = np.linspace(0, 1, shape[2])
    return np.clip(tones, 0, 1).astype(np.float32)


def disk(height: int, width: int) -> BoolArray:
    y, x = np.mgrid[:height, :width] + 0.5
    return np.hypot((x / width - 0.5), (y / height - 0.5)) < 0.42


@pytest.mark.parametrize("shares", [ostromoukhov(), fixed()], ids=["ostromoukhov", "fixed"])
@pytest.mark.parametrize("whole", [True, False])
def test_many_images_at_once_are_what_the_definition_makes_of_each(shares: Float32Array, whole: bool) -> None:
    tones = pictures((5, 21, 26))
    inside = np.ones((21, 26), np.bool_) if whole else disk(21, 26)
    found = diffuse(tones, inside, shares)
    for image, bits in zip(tones, found, strict=True):
        expected, lost = defined(image, inside, shares)
        np.testing.assert_array_equal(bits, expected)
        held = image[inside].sum(dtype=np.float64)
        assert bits.sum() + lost == pytest.approx(held, abs=1e-5 * image.size)
        assert abs(lost) < 0.2 * np.sqrt(image.size)  # only what crossed the rim


def test_every_image_may_have_an_outline_of_its_own() -> None:
    tones = pictures((4, 16, 16))
    masks = np.stack([np.roll(disk(16, 16), shift, axis=1) for shift in range(4)])
    found = diffuse(tones, masks, ostromoukhov())
    assert not found[~masks].any()
    # The box of them all is wider than each one's: rows begin elsewhere, and that is all that may differ.
    box = np.flatnonzero(masks.any(axis=(0, 2)))
    assert masks.any(axis=2)[:, box].all()
    for image, mask, bits in zip(tones, masks, found, strict=True):
        np.testing.assert_array_equal(bits, diffuse(image[None], mask, ostromoukhov())[0])


def test_a_ring_shaped_outline_gets_no_error_across_its_hole() -> None:
    inside = disk(24, 24)
    inside[8:16, 8:16] = False
    tones = pictures((2, 24, 24))
    for image, bits in zip(tones, diffuse(tones, inside, ostromoukhov()), strict=True):
        np.testing.assert_array_equal(bits, defined(image, inside, ostromoukhov())[0])


def test_nothing_is_lit_where_there_is_no_mirror() -> None:
    assert not diffuse(np.ones((2, 4, 5), np.float32), np.zeros((4, 5), np.bool_), ostromoukhov()).any()


def test_half_precision_tones_are_taken_as_they_are() -> None:
    tones = pictures((3, 12, 12)).astype(np.float16)
    inside = np.ones((12, 12), np.bool_)
    expected = diffuse(tones.astype(np.float32), inside, ostromoukhov())
    np.testing.assert_array_equal(diffuse(tones, inside, ostromoukhov()), expected)


def test_a_wavefront_is_the_definition_with_all_rows_from_left_to_right() -> None:
    inside = disk(19, 23)
    for image in pictures((3, 19, 23)):
        bits, error = wavefront(image * inside, inside, ostromoukhov())
        expected, lost = defined(image, inside, ostromoukhov(), serpentine=False)
        np.testing.assert_array_equal(bits, expected)
        assert error[~inside].max() == error[~inside].min() == 0
        assert bits.sum() + lost == pytest.approx(float(image[inside].sum()), abs=1e-3)


def test_bits_do_not_depend_on_where_other_images_are_lit() -> None:
    rng = np.random.default_rng(8)
    tones = rng.random((3, 12, 14), dtype=np.float32)
    inside = np.zeros(tones.shape, dtype=np.bool_)
    for number, top in enumerate((3, 2, 5)):
        inside[number, top : top + 6, 2 + number : 12] = True
    together = diffuse(tones, inside, ostromoukhov())
    for image, where, bits in zip(tones, inside, together, strict=True):
        assert np.array_equal(diffuse(image[None], where[None], ostromoukhov())[0], bits)
