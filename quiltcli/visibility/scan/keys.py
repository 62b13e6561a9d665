"""Depth keys: nearest first, then lowest triangle, in one comparison of whole numbers.

A key is the bit pattern of 1/t, whose doubles order like integers when positive, with its low bits
replaced by the pair's serial number counted from the top: the greater key is the nearer surface, and
of two at equal depth the pair with the lower serial, whatever the order in which they are drawn.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray

LEAST_BITS = 22


def serial_bits(pairs: int) -> int:
    """Bits that hold the serials of `pairs` block pairs; at least 30 bits of depth remain."""
    return max(LEAST_BITS, pairs.bit_length())


def serial_part(serial: Int32Array | IntArray, bits: int) -> IntArray:
    """The low bits of the keys of these serials."""
    result: IntArray = ((1 << bits) - 1) - serial.astype(np.int64)
    return result


def make_keys(serial: IntArray, bits: int, *, out: FloatArray) -> IntArray:
    """Keys of the 1/t in `out`, in its memory; a negative 1/t gives a key below every other."""
    keys = out.view(np.int64)
    keys &= ~np.int64((1 << bits) - 1)
    keys |= serial
    return keys


def serial_of(keys: IntArray, bits: int) -> IntArray:
    """Serials of keys that are not 0."""
    mask = np.int64((1 << bits) - 1)
    result: IntArray = mask - (keys & mask)
    return result


def distinct(serial: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """The distinct serials, ascending, among many below `count`, and the place of each among them."""
    there = np.zeros(count, dtype=np.bool_)
    there[serial] = True
    found = np.flatnonzero(there)
    place = np.empty(count, dtype=np.int64)
    place[found] = np.arange(found.size)
    return found, place.take(serial)


def depth_part(keys: IntArray, bits: int) -> FloatArray:
    """The least 1/t that keys may stand for; 0 for the key 0, and no key is negative."""
    result: FloatArray = (keys & ~np.int64((1 << bits) - 1)).view(np.float64)
    return result
