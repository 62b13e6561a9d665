"""Make a mosaic better by small changes: another order, another orientation, kept when nothing gets worse."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from quiltcli.layout.packing.dice import Dice
from quiltcli.layout.packing.model import PackInput, PackResult, cost
from quiltcli.layout.packing.outlines.mosaic import Piece, pack_mosaic, pieces_of
from quiltcli.layout.packing.outlines.settle import settle
from quiltcli.layout.packing.outlines.shapes import Shapes


@dataclass(frozen=True)
class Mosaic:
    """A mosaic on cells of some size, and how many changes to try.

    Attributes:
        shapes: what to place.
        cell: side of a cell, pixels.
        steps: changes to try; 0 takes the mosaic as the order by area has it.
    """

    shapes: Shapes
    cell: int
    steps: int
    _pieces: list[list[Piece]] = field(default_factory=list)

    def run(self, wanted: PackInput) -> PackResult:
        """The best of all mosaics that were tried, settled."""
        if not self._pieces:
            self._pieces.extend(pieces_of(wanted, self.shapes, self.cell))
        order = np.lexsort((np.arange(self.shapes.area.size), -self.shapes.area)).tolist()
        locks = [-1] * len(order)
        best = pack_mosaic(wanted, self._pieces, self.cell, order, locks)
        least = cost(wanted, best)
        dice = Dice()
        for _ in range(self.steps):
            new_order, new_locks = self._changed(order, locks, dice)
            result = pack_mosaic(wanted, self._pieces, self.cell, new_order, new_locks)
            now = cost(wanted, result)
            if now <= least:
                best, least, order, locks = result, now, new_order, new_locks
        return settle(wanted, self.shapes, best)

    def _changed(self, order: list[int], locks: list[int], dice: Dice) -> tuple[list[int], list[int]]:
        """One or two changes: two shapes trade places in the order, or one is bound to an orientation."""
        order, locks = list(order), list(locks)
        orientations = self.shapes.size.shape[1]
        for _ in range(1 + dice.below(2)):
            i, j = dice.below(len(order)), dice.below(len(order))
            if dice.below(2):
                order[i], order[j] = order[j], order[i]
            else:
                locks[i] = dice.below(orientations + 1) - 1
        return order, locks
