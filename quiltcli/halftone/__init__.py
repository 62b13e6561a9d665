"""Tones to bits: images in which light is on or off, and whose mean over small areas is the tone.

A mirror chip's mean over time is linear, so tones are linear light. See `halftone`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, IntArray
from quiltcli.halftone import keys, masks
from quiltcli.halftone.diffuse import diffuse, wavefront
from quiltcli.job.halftone import HalftoneSpec

SHARES: dict[str, Callable[[], Float32Array]] = {"ostromoukhov": keys.ostromoukhov, "fixed": keys.fixed}
MASKS: dict[str, Callable[[], IntArray]] = {"void_cluster": masks.void_cluster, "bayer": masks.bayer}


@dataclass(frozen=True)
class Sequel:
    """What halftoning must know of images beyond their tones.

    Attributes:
        positions: (N) numbers of the images in the turn; masks are shifted by them.
        step_deg: angle by which what is seen turns from one image to the next, from x towards y.
    """

    positions: Sequence[int]
    step_deg: float = 0.0


def halftone(
    tones: NDArray[np.floating], inside: BoolArray, spec: HalftoneSpec, sequel: Sequel | None = None
) -> BoolArray:
    """Turn tones into light that is on or off; an image's bits do not depend on which others come along.

    Except where `spec.angle` is not 0: then each image hands a share of its error on to the next.

    Args:
        tones: (N, H, W) linear light, exposed; cut to 0…1.
        inside: (H, W) or (N, H, W) pixels that may be lit, those on the mirror.
        spec: the method, and the share of errors that goes to the next image.
        sequel: numbers and angles of the images; 0, 1, … and no turning when absent.

    Returns:
        (N, H, W) whether a pixel is lit.
    """
    sequel = sequel or Sequel(range(len(tones)))
    if spec.method == "none":
        return (tones >= np.float32(0.5)) & inside
    if spec.method in MASKS:
        return masks.by_mask(tones, inside, MASKS[spec.method](), sequel.positions)
    shares = SHARES[spec.method]()
    if spec.angle:
        return _one_after_another(tones, inside, shares, spec.angle, sequel.step_deg)
    return diffuse(tones, inside, shares)


def _one_after_another(
    tones: NDArray[np.floating], inside: BoolArray, shares: Float32Array, angle: float, step_deg: float
) -> BoolArray:
    """Bits of images of which each hands a share of its error on to the next, to the same place.

    The rest stays in the image: an error that was handed on and kept would be made up for twice.
    """
    bits = np.empty(tones.shape, dtype=np.bool_)
    shares = shares * np.float32(1 - angle)
    before = _before(tones.shape[1:], step_deg)
    error = np.zeros(tones.shape[1:], dtype=np.float32)
    for image, where, out in zip(tones, np.broadcast_to(inside, tones.shape), bits, strict=True):
        tone = np.clip(image, 0, 1).astype(np.float32) + np.float32(angle) * error.take(before)
        out[:], error = wavefront(tone, where, shares)
    return bits


def _before(shape: Sequence[int], step_deg: float) -> IntArray:
    """Index (H, W) of the pixel where each pixel's place was seen one image before, at most at the rim."""
    height, width = shape
    y, x = np.mgrid[:height, :width]
    across, down = x + 0.5 - width / 2, y + 0.5 - height / 2
    # To 2⁻³⁰, so that a library's last bit of a sine decides nothing.
    c, s = (round(f(math.radians(step_deg)) * 2**30) / 2**30 for f in (math.cos, math.sin))
    column = np.floor(c * across + s * down + width / 2).astype(np.int64)
    row = np.floor(c * down - s * across + height / 2).astype(np.int64)
    found: IntArray = np.clip(row, 0, height - 1) * width + np.clip(column, 0, width - 1)
    return found
