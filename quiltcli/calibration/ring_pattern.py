"""Test patterns of a 360° light field display: pictures of one bit, packed as they are sent.

They are drawn on the mirror itself, upright for the viewers it serves at each position: what a technician
reads upside down, mirrored or in another order is so because of the wiring or of `packing`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.bitplanes import PLANES, pack, packed_name, write_packed
from quiltcli.formats.drawing.font import text_mask
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.job.load import load_mirror_file
from quiltcli.ring.build import rig_of
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.plane import on_mirror
from quiltcli.ring.rig import Pose, Rig

_LINE = 0.0005  # half the width of a line, metres
_GRID = 0.01


@dataclass(frozen=True)
class Plane:
    """One side of the mirror at one position, as a pattern is drawn on it.

    Attributes:
        number: of the position, from 1.
        lit: (H, W) pixels that light it.
        across: (H, W) metres to the right, as the viewers see it, from the axis.
        up: (H, W) metres up the slope.
        radius: how far the mirror reaches, metres.
    """

    number: int
    lit: BoolArray
    across: FloatArray
    up: FloatArray
    radius: float


def _number(plane: Plane) -> BoolArray:
    """The position's number in the middle, and the outline."""
    mask = text_mask(str(plane.number))
    dot = 1.2 * plane.radius / max(mask.shape[1], 3 * 6)
    column = np.floor(plane.across / dot + mask.shape[1] / 2).astype(np.int64)
    row = np.floor(mask.shape[0] / 2 - plane.up / dot).astype(np.int64)
    there = (column >= 0) & (column < mask.shape[1]) & (row >= 0) & (row < mask.shape[0])
    dots: BoolArray = there & mask[np.where(there, row, 0), np.where(there, column, 0)]
    return dots | _border(plane)


def _border(plane: Plane) -> BoolArray:
    """The outermost pixels of the mirror."""
    around = np.pad(plane.lit, 1)
    kept = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    return plane.lit & ~kept


def _grid(plane: Plane) -> BoolArray:
    """Lines a centimetre apart, and the axis."""
    near = np.minimum(*(np.abs(q - _GRID * np.round(q / _GRID)) for q in (plane.across, plane.up)))
    return _border(plane) | (near < _LINE) | (np.hypot(plane.across, plane.up) < 6 * _LINE)


def _white(plane: Plane) -> BoolArray:
    """All of the mirror."""
    return plane.lit


KINDS: dict[str, Callable[[Plane], BoolArray]] = {
    "id": _number,
    "border": _border,
    "grid": _grid,
    "white": _white,
}


def write_ring_patterns(
    path: Path, out: Path, kinds: Sequence[str] = ("id",), *, overwrite: bool = False
) -> list[Path]:
    """Write a turn of each pattern, `out`/KIND/dvi.00000001.png and so on; return the files.

    Args:
        path: display file of the kind lightfield360.
        out: folder, made if need be.
        kinds: keys of `KINDS`.
        overwrite: replace files that exist.

    Raises:
        JobError, DisplayError: the display is wrong.
        OutputError: an unknown pattern, or a file that is in the way or cannot be written.
    """
    raise_all(OutputError, _wrong(kinds))
    display = load_mirror_file(path)
    rig, packing = rig_of(display), display.packing
    images = range(-(-rig.positions // PLANES))
    places = {(kind, image): out / kind / packed_name(image + 1) for kind in kinds for image in images}
    if not overwrite:
        taken = (place for place in places.values() if place.exists())
        wanted = "exists already, expected to be told to overwrite it"
        raise_all(OutputError, [Problem(wanted, file=str(place)) for place in taken])
    for kind in kinds:
        make_folder(out / kind)
    for image in images:
        positions = range(PLANES * image, min(PLANES * (image + 1), rig.positions))
        shape = (len(positions), rig.size[1], rig.size[0])
        bits = {kind: np.zeros(shape, dtype=np.bool_) for kind in kinds}
        for row, position in enumerate(positions):
            for plane in planes(rig, position):
                for kind in kinds:
                    bits[kind][row] |= KINDS[kind](plane) & plane.lit
        for kind in kinds:
            write_packed(places[kind, image], pack(bits[kind], packing.order, packing.bits)[0])
    return list(places.values())


def planes(rig: Rig, position: int) -> Iterator[Plane]:
    """The sides of the mirror at a position, from 0."""
    for side in range(len(rig.sides)):
        pose = rig.at(rig.angle(position), side)
        yield Plane(position + 1, lit_pixels(rig, pose), *_places(rig, pose), rig.radius)


def _places(rig: Rig, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """Metres to the right and up the slope (H, W) of the places that pixels light."""
    width, height = rig.size
    y, x = np.mgrid[:height, :width] + 0.5
    along, across, rise = on_mirror(pose, x, y) + pose.origin[:, None, None]
    return across, pose.slope[0] * (rise - pose.ridge) - pose.slope[2] * along


def _wrong(kinds: Sequence[str]) -> Iterator[Problem]:
    known = ", ".join(KINDS)
    yield from (
        Problem(f"unknown pattern {kind!r} for a spinning mirror (known: {known})")
        for kind in kinds
        if kind not in KINDS
    )
