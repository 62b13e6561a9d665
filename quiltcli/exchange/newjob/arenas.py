"""Arenas: cylinders of square LED panels around an animal, as laboratories of neuroscience build them.

Sizes and arrangements of the presets are those of the Reiser lab's modular displays, whose generations
have panels of 8 × 8, 16 × 16 and 20 × 20 LEDs (github.com/reiserlab: Modular-LED-Display, webDisplayTools).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from quiltcli.errors import JobError
from quiltcli.exchange.newjob.figures import Raster, Sided
from quiltcli.exchange.newjob.wishes import Panel, Wishes, base_of, count_of, grain_of
from quiltcli.job.model import suggest


@dataclass(frozen=True)
class Arena:
    """An arrangement of panels.

    Attributes:
        cabinet: size and pixels of a panel.
        rows: panels one above the other.
        columns: places for columns all around.
        installed: columns that are there; the gap is behind the animal.
    """

    cabinet: str
    rows: int
    columns: int
    installed: int


_G3, _G4, _G41, _G6 = (
    "32x32mm/8x8px",
    "40.45x40.45mm/16x16px",
    "40x40mm/16x16px",
    "45.4x45.4mm/20x20px",
)
PRESETS: dict[str, Arena] = {
    "G3_3x24": Arena(_G3, 3, 24, 24),
    "G3_4x12": Arena(_G3, 4, 12, 12),
    "G4_3x12": Arena(_G4, 3, 12, 12),
    "G4_4x12": Arena(_G4, 4, 12, 12),
    "G4_3x12of18": Arena(_G4, 3, 18, 12),
    "G41_2x12": Arena(_G41, 2, 12, 12),
    "G6_2x10": Arena(_G6, 2, 10, 10),
    "G6_2x8of10": Arena(_G6, 2, 10, 8),
    "G6_3x16": Arena(_G6, 3, 16, 16),
    "G6_3x12of18": Arena(_G6, 3, 18, 12),
}


@dataclass(frozen=True)
class Spot:
    """Where a panel stands: its name, its middle in metres, how far it is turned, and its column and row."""

    name: str
    at: tuple[float, float, float]
    yaw_deg: float
    column: int
    row: int


def spots(columns: int, installed: int, rows: int, size: tuple[float, float], base: float) -> Iterator[Spot]:
    """Where panels stand, column by column from the left as the animal sees them, rows from the top.

    Panels touch at their upright edges, which lie on a circle about the vertical; they face its middle, and
    the middle of those that are there is ahead, towards −Z.

    Args:
        columns: places all around.
        installed: columns that are there.
        rows: panels one above the other.
        size: width and height of a panel, metres.
        base: height of the lowest edge, metres.
    """
    reach = size[0] / 2 / math.tan(math.pi / columns)
    for column in range(installed):
        turn_deg = 360 * (column - (installed - 1) / 2) / columns
        turn = math.radians(turn_deg)
        for row in range(rows):
            at = (reach * math.sin(turn), base + (rows - row - 0.5) * size[1], -reach * math.cos(turn))
            yield Spot(f"c{column + 1:02}r{row + 1}", at, -turn_deg, column, row)


def arena_panels(wishes: Wishes) -> tuple[Panel, ...]:
    """Square panels on a cylinder around the viewer, open behind where some columns are left out."""
    raster = _panel_of_arena(wishes)
    return tuple(Panel(spot.name, raster, spot.at, yaw_deg=spot.yaw_deg) for spot in _spots(wishes, raster))


def _panel_of_arena(wishes: Wishes) -> Raster:
    if wishes.cabinet is None:
        raise JobError("an arena is built of panels (expected --cabinet 40x40mm/16x16px, or a --preset)")
    grain = grain_of(wishes)
    assert grain.pitch is not None
    assert grain.cabinet is not None
    wide, high = (Sided(step * count) for step, count in zip(grain.pitch, grain.cabinet, strict=True))
    return grain.raster("panel", (wide, high))


def _spots(wishes: Wishes, raster: Raster) -> tuple[Spot, ...]:
    columns, rows = count_of(wishes.columns, 3, 1000, "--columns"), count_of(wishes.rows, 1, 100, "--rows")
    installed = columns if wishes.installed is None else wishes.installed
    size = float(raster.size[0]), float(raster.size[1])
    return tuple(spots(columns, count_of(installed, 1, columns, "--installed"), rows, size, base_of(wishes)))


def arranged_arena(wishes: Wishes) -> Wishes:
    """An arena with the eye in its middle and its picture unrolled on the canvas, unless other is said."""
    raster = _panel_of_arena(wishes)
    found = _spots(wishes, raster)
    if wishes.eye is None:
        middle = sum(spot.at[1] for spot in found) / len(found)
        wishes = replace(wishes, eye=(0.0, round(middle, 6), 0.0))
    if wishes.canvas is not None:
        return wishes
    wide, high = raster.pixels
    canvas = (found[-1].column + 1) * wide, (found[-1].row + 1) * high
    places = tuple(f"{spot.name}={spot.column * wide},{spot.row * high}" for spot in found)
    return replace(wishes, canvas=canvas, places=places)


def settled(wishes: Wishes) -> Wishes:
    """The wishes with what a preset says written out.

    Raises:
        JobError: there is no such preset, or something beside it that it says already.
    """
    if wishes.preset is None:
        return wishes
    if wishes.preset not in PRESETS:
        near = suggest(wishes.preset, PRESETS)
        hint = f" (did you mean {near}?)" if near else ""
        raise JobError(f"--preset: expected {', '.join(PRESETS)}, got {wishes.preset!r}{hint}")
    known = vars(PRESETS[wishes.preset])
    given = [name for name in known if getattr(wishes, name) is not None]
    if given:
        raise JobError(
            f"--{given[0]}: the preset {wishes.preset} says {known[given[0]]} (expected one of both)"
        )
    return replace(wishes, **known)
