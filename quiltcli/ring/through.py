"""Surfaces that light may pass, as pixels with viewpoints of their own see them.

All fragments of such triangles that lie before the nearest opaque one are kept, not the nearest alone; that
one leaves the picture and becomes the last of them. They are blended as a quilt's are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.visibility.scan.soft import Fragments


@dataclass(frozen=True)
class Through:
    """The pixels that are seen through something.

    Attributes:
        fragments: theirs; pixels are counted through the window, keys are the picture's.
        bits: bits of the triangle's number in a key.
        count: how many triangles there are.
        parent: what of the scene each is a piece of; None for itself.
    """

    fragments: Fragments
    bits: int
    count: int
    parent: IntArray | None = None

    def some(self, kept: BoolArray) -> Through:
        """Only some of the pixels (n,)."""
        number = np.cumsum(kept) - 1
        mine = kept.take(self.fragments.which)
        which = number.take(self.fragments.which[mine])
        return replace(
            self, fragments=Fragments(self.fragments.pixel[kept], which, self.fragments.keys[mine])
        )

    def layers(self, light: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
        """Rows of the pixels (m,) and triangles (m,) a layer, the nearest first; see `Fragments.layers`."""
        for row, keys in self.fragments.layers(light):
            triangle = self.count - 1 - (keys & ((1 << self.bits) - 1))
            yield row, triangle if self.parent is None else self.parent[triangle]


def gathered(keys: IntArray, found: list[tuple[IntArray, IntArray]], bits: int, count: int) -> Through | None:
    """What is seen through something, of a picture's keys (P,), from which these pixels are taken.

    Args:
        keys: of everything opaque; 0 where nothing is.
        found: pixels and keys of the fragments that light may pass.
        bits: bits of the triangle's number in a key.
        count: how many triangles there are.
    """
    pixel, key = (np.concatenate([part[k] for part in found]) for k in (0, 1))
    front = key > keys.take(pixel)
    if not front.any():
        return None
    seen, which = np.unique(pixel[front], return_inverse=True)
    behind = keys.take(seen)
    last = np.flatnonzero(behind)
    keys[seen] = 0
    every = np.concatenate((which.reshape(-1), last))
    return Through(Fragments(seen, every, np.concatenate((key[front], behind[last]))), bits, count)
