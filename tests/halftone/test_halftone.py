"""Tones to bits: means, grain, and what images have to do with one another."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.geometry import Float32Array
from quiltcli.halftone import MASKS, Sequel, halftone
from quiltcli.halftone.masks import void_cluster
from quiltcli.job.halftone import HALFTONES, HalftoneSpec

SMOOTH = ("ostromoukhov", "fixed", "void_cluster", "bayer")
WHOLE = np.ones((128, 128), np.bool_)


def flat(levels: list[int], size: int = 128) -> Float32Array:
    return np.stack([np.full((size, size), level / 255, np.float32) for level in levels])


def low_power(bits: np.ndarray, tone: float) -> float:
    """Power below half the principal frequency over that of white noise of the same tone."""
    size = len(bits)
    power = np.abs(np.fft.fft2(bits - bits.mean())) ** 2 / bits.size
    f = np.fft.fftfreq(size)
    away = np.hypot(f[:, None], f)
    low = (away > 0) & (away < np.sqrt(min(tone, 1 - tone)) / 2)
    return float(power[low].mean() / (tone * (1 - tone)))


@pytest.mark.parametrize("method", HALFTONES)
def test_black_stays_dark_and_white_is_lit_everywhere(method: str) -> None:
    tones = np.stack([np.zeros((16, 16)), np.ones((16, 16)), np.full((16, 16), 7.0)]).astype(np.float32)
    bits = halftone(tones, WHOLE[:16, :16], HalftoneSpec(method=method))
    assert not bits[0].any()
    assert bits[1:].all()


@pytest.mark.parametrize("method", SMOOTH)
def test_a_ramp_of_256_steps_keeps_its_tones_and_their_order(method: str) -> None:
    levels = list(range(256))
    bits = halftone(flat(levels, 64), WHOLE[:64, :64], HalftoneSpec(method=method))
    diffused = method in ("ostromoukhov", "fixed")
    means = bits[:, 8 if diffused else 0 :].mean(axis=(1, 2))
    np.testing.assert_allclose(means, np.array(levels) / 255, atol=2 / 255)
    assert (np.diff(means) >= (-1.5 / 255 if diffused else 0)).all()


@pytest.mark.parametrize("level", [16, 32, 64, 96, 127, 160, 191, 240])
def test_ostromoukhov_is_blue(level: int) -> None:
    bits = halftone(flat([level], 192), np.ones((192, 192), np.bool_), HalftoneSpec())[0]
    assert low_power(bits[64:, 32:160], level / 255) <= 0.15


@pytest.mark.parametrize("level", [16, 64, 127])
def test_void_and_cluster_is_blue_and_white_noise_is_not(level: int) -> None:
    tone = level / 255
    bits = halftone(flat([level]), WHOLE, HalftoneSpec(method="void_cluster"))[0]
    assert low_power(bits, tone) <= 0.15
    noise = np.random.default_rng(level).random((128, 128)) < tone
    assert low_power(noise, tone) > 0.8


@pytest.mark.parametrize("method", MASKS)
def test_a_mask_has_every_rank_once(method: str) -> None:
    ranks = MASKS[method]()
    np.testing.assert_array_equal(np.sort(ranks, axis=None), np.arange(ranks.size))


def test_the_mask_is_the_same_one_everywhere() -> None:
    assert void_cluster(8)[0].tolist() == [5, 36, 52, 18, 56, 32, 54, 24]


@pytest.mark.parametrize("method", HALFTONES)
def test_an_image_is_the_same_alone_and_among_others(method: str) -> None:
    rng = np.random.default_rng(3)
    tones = rng.random((6, 20, 20)).astype(np.float32)
    spec, inside = HalftoneSpec(method=method), WHOLE[:20, :20]
    together = halftone(tones, inside, spec)
    for k, image in enumerate(tones):
        alone = halftone(image[None], inside, spec, Sequel([k]))
        np.testing.assert_array_equal(alone[0], together[k])


def test_masks_stand_elsewhere_in_the_next_image() -> None:
    bits = halftone(flat([64, 64, 64], 64), WHOLE[:64, :64], HalftoneSpec(method="void_cluster"))
    assert (bits[0] != bits[1]).any()
    assert (bits[0] != bits[2]).any()


def test_two_neighbours_share_out_an_error_between_them() -> None:
    tones = flat([64] * 8, 48)
    inside = np.ones((48, 48), np.bool_)
    apart = halftone(tones, inside, HalftoneSpec())
    shared = halftone(tones, inside, HalftoneSpec(angle=0.25), Sequel(range(8), step_deg=1.25))
    assert (shared != apart).any()
    np.testing.assert_array_equal(apart[0], apart[1])
    assert (shared[0] != shared[1]).any()  # the second knows of the first
    # What the first one lacks the next ones make up for, and nothing is made up for twice.
    assert shared[4:, 8:].mean() == pytest.approx(64 / 255, abs=6e-3)


def test_error_is_handed_on_where_the_mirror_has_turned_it() -> None:
    tones = np.zeros((2, 33, 33), np.float32)
    tones[0, 16, 26] = 0.4  # to the right of the middle, too dark to be lit
    tones[1, 26, 16] = 0.4  # a quarter turn on, below it
    inside = np.ones((33, 33), np.bool_)
    spec = HalftoneSpec(angle=0.49)
    assert halftone(tones, inside, spec, Sequel(range(2), step_deg=90))[1, 26, 16]
    assert not halftone(tones, inside, spec, Sequel(range(2), step_deg=-90))[1].any()
