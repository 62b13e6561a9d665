"""From a turn's colours to tones: one number a pixel, the share of the time that its light is on.

All of it is linear light. A projector that shows bits has one colour, white or that of a filter, and a tent
of two mirrors with a filter each has two, from which the nearest colour is mixed: Jones et al., *Rendering
for an Interactive 360° Light Field Display* (SIGGRAPH 2007), section 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, FloatArray

REC709 = (0.2126, 0.7152, 0.0722)
"""Luminance of the primaries of Rec. 709."""
ORANGE = (1.0, 0.254, 0.018)
"""About what the gel Rosco 020 lets through, linear Rec. 709; a filter should be measured."""
CYAN = (0.001, 0.768, 0.604)
"""The same of Rosco 131."""


def luminance(rgb: NDArray[np.floating]) -> Float32Array:
    """Luminance (…) of linear Rec. 709 (…, 3)."""
    red, green, blue = (
        np.float32(weight) * rgb[..., k].astype(np.float32) for k, weight in enumerate(REC709)
    )
    result: Float32Array = red + green + blue
    return result


def mixed(rgb: NDArray[np.floating], filters: FloatArray) -> FloatArray:
    """Shares of the filters' colours that come nearest to a colour; none is below 0.

    By non-negative least squares. To cut at 0 what plain least squares say is not the nearest: it leaves
    the other share as if there were less than nothing of the first.

    Args:
        rgb: (…, 3) linear Rec. 709.
        filters: (1 or 2, 3) linear Rec. 709 of white light through each filter.

    Returns:
        (…, 1 or 2) shares, which may be above 1.
    """
    colour = rgb.astype(np.float64)
    gram = filters @ filters.T
    alone = [_along(colour, filter) / gram[k, k] for k, filter in enumerate(filters)]
    if len(filters) == 1:
        return np.asarray(np.maximum(alone[0], 0)[..., None])
    shine = [_along(colour, filter) for filter in filters]
    det = gram[0, 0] * gram[1, 1] - gram[0, 1] * gram[1, 0]
    both = [
        (gram[1, 1] * shine[0] - gram[0, 1] * shine[1]) / det,
        (gram[0, 0] * shine[1] - gram[1, 0] * shine[0]) / det,
    ]
    inner = (both[0] >= 0) & (both[1] >= 0)
    # On the rim one share is 0: it is the one whose own colour explains less.
    light = [np.maximum(share, 0) ** 2 * gram[k, k] for k, share in enumerate(alone)]
    first = light[0] >= light[1]
    rim = [np.where(first, np.maximum(alone[0], 0), 0), np.where(first, 0, np.maximum(alone[1], 0))]
    return np.stack([np.where(inner, both[k], rim[k]) for k in range(2)], axis=-1)


def _along(colour: FloatArray, filter: FloatArray) -> FloatArray:
    """Product (…) of colours (…, 3) and a filter's (3,), summed in a fixed order."""
    result: FloatArray = colour[..., 0] * filter[0] + colour[..., 1] * filter[1] + colour[..., 2] * filter[2]
    return result


def white_gain(filters: FloatArray) -> float:
    """Factor on all shares that makes the larger one of white 1, so that white is not cut."""
    return float(1 / mixed(np.ones(3), filters).max())


def dwell(along: FloatArray, across: FloatArray) -> FloatArray:
    """How long pixels dwell on a distant viewer, relative to the pixel where the axis meets the mirror.

    A pixel's fan points to the azimuth θ − atan(across). While the mirror turns by dθ, its frame turns
    under the pixel, `across` grows by along·dθ, and so the fan sweeps by (1 − along/(1 + across²)) dθ.

    Args:
        along: (…) where a pixel's ray meets the plane at distance 1 below the projector, towards the viewers.
        across: (…) the same, to the side.

    Returns:
        (…) time relative to the middle's; for a mirror tilted 45° below a projector on the axis.
    """
    whole = 1 + across * across
    return whole / (whole - along)


@dataclass(frozen=True)
class Exposed:
    """Tones ready to be halftoned.

    Attributes:
        tones: (N, H, W) from 0 to 1, 0 where there is no mirror.
        clipped: (N) share of each image's pixels on the mirror that were brighter than white, and were cut.
    """

    tones: Float32Array
    clipped: FloatArray


def expose(
    tones: NDArray[np.floating], inside: BoolArray, exposure: float = 1.0, time: FloatArray | None = None
) -> Exposed:
    """Multiply tones by the exposure, even out how long pixels dwell, and cut them at white.

    Args:
        tones: (N, H, W) linear light.
        inside: (H, W) or (N, H, W) pixels on the mirror.
        exposure: factor on all tones.
        time: (H, W) or (N, H, W) from `dwell`: what is seen longer gets a darker tone. The pixels that are
            seen for the shortest time keep theirs.
    """
    inside = np.broadcast_to(inside, tones.shape)
    factor = np.float32(exposure)
    if time is not None:
        shortest = np.broadcast_to(time, tones.shape).min(where=inside, initial=np.inf)
        factor = (exposure * shortest / time).astype(np.float32)
    found = tones.astype(np.float32) * factor
    bright = np.count_nonzero((found > 1) & inside, axis=(1, 2))
    lit = np.maximum(np.count_nonzero(inside, axis=(1, 2)), 1)
    np.clip(found, 0, 1, out=found)
    return Exposed(found * inside, bright / lit)
