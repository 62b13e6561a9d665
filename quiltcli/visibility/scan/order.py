"""The order of a batch's fragments by another method's depth buffer; `orders` says what it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.depth_buffers import DepthOrder, ranks


@dataclass(frozen=True)
class BatchOrder:
    """A depth buffer's order, with the rays of a batch's blocks.

    Attributes:
        order: what the buffer holds.
        limits: the rays.
        facet: (K,) facet of every block of the batch.
    """

    order: DepthOrder
    limits: DepthRange
    facet: Int32Array

    def values(
        self, block: Int32Array, x: FloatArray | IntArray, y: FloatArray | IntArray, inverse: FloatArray
    ) -> FloatArray:
        """Numbers in place of 1/t: greater is nearer, negative is clipped or was negative before.

        Args:
            block: (..., N) place of the fragment's block in the batch; the rest broadcast with it.
            x: pixel columns in the block.
            y: pixel rows.
            inverse: 1/t of the fragments, negative where they are not to be drawn.
        """
        gain = self.order.gain(*self.limits.directions(block, x, y))
        with np.errstate(divide="ignore", invalid="ignore"):  # rays square to the look direction
            canonical = self.order.canonical(self.facet[block], gain, inverse)
            keep = (inverse > 0) & self.order.keeps(gain, canonical)
        if self.order.bits is None:
            return np.where(keep, inverse, -1.0)
        return np.where(keep, ranks(np.where(keep, canonical, 1.0), self.order.bits), -1.0)
