"""Cryptomatte: names as floats, and the attributes that tell them (Friedman & Jones 2015, specification 1.2).

A matte's identity is the MurmurHash3 of its name taken for the bits of a float. A layer holds ranks of pairs,
identity and coverage, two pairs to an image of four channels; its attributes say which names there are.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np

from quiltcli.geometry import Float32Array

_MASK = 0xFFFFFFFF


def name_hash(name: str) -> int:
    """MurmurHash3, the variant of 32 bits for x86 with seed 0, of a name in UTF-8 (Appleby 2011)."""
    data = name.encode()
    state, whole = 0, len(data) // 4 * 4
    for at in range(0, whole, 4):
        state ^= _scrambled(int.from_bytes(data[at : at + 4], "little"))
        state = (_turned(state, 13) * 5 + 0xE6546B64) & _MASK
    state ^= _scrambled(int.from_bytes(data[whole:], "little")) ^ len(data)
    state = ((state ^ state >> 16) * 0x85EBCA6B) & _MASK
    state = ((state ^ state >> 13) * 0xC2B2AE35) & _MASK
    return state ^ state >> 16


def _scrambled(word: int) -> int:
    return _turned(word * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK


def _turned(word: int, bits: int) -> int:
    """A word of 32 bits rotated to the left."""
    return (word << bits | word >> 32 - bits) & _MASK


def identity_bits(name: str) -> int:
    """The bits of the float that stands for a name: none that is not finite, or too small to be normal."""
    bits = name_hash(name)
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


def identities(names: Iterable[str]) -> Float32Array:
    """The floats (n,) that stand for names."""
    return np.array([identity_bits(name) for name in names], dtype=np.uint32).view(np.float32)


def attributes(name: str, names: Iterable[str]) -> dict[str, object]:
    """What tells readers of a layer, and of the names in it."""
    key = f"cryptomatte/{name_hash(name):08x}"[:-1]
    manifest = {one: f"{identity_bits(one):08x}" for one in sorted(set(names))}
    return {
        f"{key}/name": name,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }
