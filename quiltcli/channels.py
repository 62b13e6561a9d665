"""Channels: their names, EXR layers, pixel types and empty values. No code that computes is here.

To add a channel, add a row to `CHANNELS`, and the function that computes it to `shading.aovs`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Pixels: TypeAlias = NDArray[Any]

MOST_HALF = np.float32(65504)
"""The largest finite half float; brighter values are written as this."""

_HALF, _FLOAT, _UINT = np.dtype(np.float16), np.dtype(np.float32), np.dtype(np.uint32)


@dataclass(frozen=True)
class Channel:
    """One job channel.

    Attributes:
        layers: names of its EXR channels.
        dtype: their pixel type.
        empty: value of a pixel that sees nothing.
        averaged: whether it is light, the mean of a pixel's samples; others are the pixel's centre's.
        matte: whether it is a Cryptomatte: what the samples see, and how many of them see it.
    """

    layers: tuple[str, ...]
    dtype: np.dtype[Any]
    empty: float = 0.0
    averaged: bool = False
    matte: bool = False


RANKS = 6
"""Pairs of identity and coverage that a Cryptomatte holds for a pixel, two to an image of four channels."""


def _matte(name: str) -> Channel:
    layers = tuple(f"{name}{image:02d}.{channel}" for image in range(RANKS // 2) for channel in "RGBA")
    return Channel(layers, _FLOAT, matte=True)


# A pixel that sees nothing is infinitely far in `zv` as well as in `Z`, so that it cannot be taken for
# one on the far plane, where zv is 1.
CHANNELS: Mapping[str, Channel] = MappingProxyType(
    {
        "rgba": Channel(("R", "G", "B", "A"), _HALF, averaged=True),
        "Z": Channel(("Z",), _FLOAT, np.inf),
        "zv": Channel(("zv",), _FLOAT, np.inf),
        "facet": Channel(("facet",), _UINT),
        "object": Channel(("object",), _UINT),
        "triangle": Channel(("triangle",), _UINT),
        "N": Channel(("N.X", "N.Y", "N.Z"), _HALF),
        "P": Channel(("P.X", "P.Y", "P.Z"), _FLOAT),
        "uv": Channel(("uv.U", "uv.V"), _FLOAT),
        "albedo": Channel(("albedo.R", "albedo.G", "albedo.B"), _HALF, averaged=True),
        "diffuse": Channel(("diffuse.R", "diffuse.G", "diffuse.B"), _HALF, averaged=True),
        "specular": Channel(("specular.R", "specular.G", "specular.B"), _HALF, averaged=True),
        "emission": Channel(("emission.R", "emission.G", "emission.B"), _HALF, averaged=True),
        "motion": Channel(("motion.X", "motion.Y"), _FLOAT),
        "cryptoobject": _matte("CryptoObject"),
        "cryptomaterial": _matte("CryptoMaterial"),
    }
)


def exr_channels(names: Iterable[str]) -> dict[str, tuple[np.dtype[Any], float]]:
    """Pixel type and empty value of every EXR channel that the job channels `names` bring, in order."""
    rows = [CHANNELS[name] for name in names]
    return {layer: (row.dtype, row.empty) for row in rows for layer in row.layers}


def empty_buffers(names: Iterable[str], pixels: int) -> dict[str, Pixels]:
    """A flat buffer (pixels,) for every EXR channel, in which nothing is seen yet."""
    return {layer: np.full(pixels, empty, dtype) for layer, (dtype, empty) in exr_channels(names).items()}


BACKGROUND: Mapping[str, float] = MappingProxyType(
    {layer: empty for layer, (_, empty) in exr_channels(CHANNELS).items()}
)
"""What pixels of no facet hold, by EXR channel; 0 in channels that are not named."""
