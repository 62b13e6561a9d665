"""Mattes: which of the scene's names points show, as Cryptomatte has it."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS
from quiltcli.formats.exr.cryptomatte import attributes, identity_bits
from quiltcli.geometry import Int32Array
from quiltcli.scene import Scene


def names_in(scene: Scene, channel: str) -> tuple[str, ...]:
    """The names that a matte channel tells apart; two that are equal have one matte."""
    return scene.objects if channel == "cryptoobject" else scene.material_names


def identities_of(scene: Scene, channel: str, triangle: Int32Array) -> NDArray[np.uint32]:
    """The bits of the identities of what triangles (n,) belong to, by a matte channel; none is 0."""
    table = _bits(names_in(scene, channel))
    if channel == "cryptoobject":
        return table.take(scene.object.take(triangle))
    return table.take(scene.named.take(triangle))


@lru_cache(maxsize=8)
def _bits(names: tuple[str, ...]) -> NDArray[np.uint32]:
    return np.array([identity_bits(name) for name in names], dtype=np.uint32)


def matte_attributes(scene: Scene, channels: Iterable[str]) -> dict[str, object]:
    """What files with these channels say of those that are mattes."""
    found: dict[str, object] = {}
    for channel in channels:
        if CHANNELS[channel].matte:
            found |= attributes(CHANNELS[channel].layers[0].removesuffix("00.R"), names_in(scene, channel))
    return found
