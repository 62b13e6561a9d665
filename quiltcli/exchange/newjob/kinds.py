"""The kinds of display that `quilt new` knows: what each needs to be told, and the panels it makes of that.

Rectangles stand as panels; the sphere's pieces are trapezoids, and it is a mesh.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from quiltcli.errors import JobError
from quiltcli.exchange.newjob.arenas import arena_panels, arranged_arena, settled
from quiltcli.exchange.newjob.figures import Sided, read_metres
from quiltcli.exchange.newjob.wishes import (
    Ball,
    Panel,
    Point,
    Wishes,
    base_of,
    count_of,
    grain_of,
    sides_of,
)


@dataclass(frozen=True)
class Kind:
    """A kind of display.

    Attributes:
        about: one line.
        needs: what it cannot do without, by option name, with the question to ask.
        build: its panels, or its ball.
        takes: what else it can be told, by option name.
        around: whether one walks around it, rather than stands before or inside it.
        from_above: whether the viewer has to see its upper sides.
        encloses: whether it is around the viewer; `Wishes.inside` makes it so, too.
        arrange: adds to wishes where the eye and the panels on the canvas are; None for nothing.
    """

    about: str
    needs: dict[str, str]
    build: Callable[[Wishes], tuple[Panel, ...] | Ball]
    takes: tuple[str, ...] = ("base",)
    around: bool = False
    from_above: bool = False
    encloses: bool = False
    arrange: Callable[[Wishes], Wishes] | None = None


def _wall(wishes: Wishes) -> tuple[Panel, ...]:
    wide, high = sides_of(wishes.size, 2, "--size")
    raster = grain_of(wishes).raster("wall", (wide, high))
    return (Panel("wall", raster, (0.0, base_of(wishes) + float(raster.size[1]) / 2, 0.0)),)


def _corner(wishes: Wishes) -> tuple[Panel, ...]:
    """Two walls that meet over the origin; what halves the angle between them points to +Z."""
    angle = 90.0 if wishes.angle is None else wishes.angle
    if not 10 <= angle <= 350:
        raise JobError(f"--angle: expected 10 to 350 degrees between the lit sides, got {angle:g}")
    grain, half = grain_of(wishes), math.radians(angle / 2)
    panels = []
    for name, text, side in (("left", wishes.left, -1), ("right", wishes.right, 1)):
        wide, high = sides_of(text, 2, f"--{name}")
        raster = grain.raster(name, (wide, high))
        away = float(raster.size[0]) / 2
        middle = (side * away * math.sin(half), base_of(wishes) + float(raster.size[1]) / 2)
        at = (*middle, away * math.cos(half))
        panels.append(Panel(name, raster, at, yaw_deg=-side * (90 - angle / 2)))
    return tuple(panels)


def _curve(wishes: Wishes) -> tuple[Panel, ...]:
    """Flat columns along an arc; the middle of the arc lies over the origin."""
    count = count_of(wishes.columns, 1, 1000, "--columns")
    wide, high = sides_of(wishes.size, 2, "--size")
    raster = grain_of(wishes).raster("column", (Sided(wide.amount / count, wide.in_pixels), high))
    bend = read_metres(wishes.radius or "", "--radius", negative=True)
    width, radius = float(raster.size[0]), abs(float(bend))
    if radius == 0 or math.asin(min(1.0, width / 2 / radius)) * 2 * count > 2 * math.pi * (1 + 1e-9):
        raise JobError(
            f"--radius: {count} columns of {width:g} m go more than around a circle of {radius:g} m"
        )
    step = 2 * math.asin(width / 2 / radius)
    reach, y = radius * math.cos(step / 2), base_of(wishes) + float(raster.size[1]) / 2
    panels = []
    for k in range(count):
        turn, sense = (k - (count - 1) / 2) * step, -1 if bend > 0 else 1
        # A hollow wall turns in on the viewer, a bulging one away from them.
        at = (reach * math.sin(turn), y, -sense * reach * (1 - math.cos(turn)))
        panels.append(Panel(f"column_{k + 1}", raster, at, yaw_deg=sense * math.degrees(turn)))
    return tuple(panels)


def _cave(wishes: Wishes) -> tuple[Panel, ...]:
    """Three walls and a floor around the origin, open behind the viewer; a ceiling where it is asked for."""
    grain, base = grain_of(wishes), base_of(wishes)
    wide, high, deep = sides_of(wishes.size, 3, "--size")
    front = grain.raster("front", (wide, high))
    side, ground = grain.raster("left", (deep, high)), grain.raster("floor", (wide, deep))
    w, h = map(float, front.size)
    d = float(side.size[0])
    y = base + h / 2
    panels = [
        Panel("front", front, (0.0, y, -d / 2)),
        Panel("left", side, (-w / 2, y, 0.0), yaw_deg=90.0),
        Panel("right", side, (w / 2, y, 0.0), yaw_deg=-90.0),
        Panel("floor", ground, (0.0, base, 0.0), pitch_deg=90.0),
    ]
    if wishes.ceiling:
        panels.append(Panel("ceiling", ground, (0.0, base + h, 0.0), pitch_deg=-90.0))
    return tuple(panels)


def _cube(wishes: Wishes) -> tuple[Panel, ...]:
    """Four sides and a top, to walk around."""
    grain, base = grain_of(wishes), base_of(wishes)
    wide, high, deep = sides_of(wishes.size, 3, "--size")
    front, side = grain.raster("front", (wide, high)), grain.raster("right", (deep, high))
    top = grain.raster("top", (wide, deep))
    w, h, d = float(front.size[0]), float(front.size[1]), float(side.size[0])
    y = base + h / 2
    return (
        Panel("front", front, (0.0, y, d / 2)),
        Panel("right", side, (w / 2, y, 0.0), yaw_deg=90.0),
        Panel("back", front, (0.0, y, -d / 2), yaw_deg=180.0),
        Panel("left", side, (-w / 2, y, 0.0), yaw_deg=-90.0),
        Panel("top", top, (0.0, base + h, 0.0), pitch_deg=90.0),
    )


def _cylinder(wishes: Wishes) -> tuple[Panel, ...]:
    """Flat columns all around the vertical, whose edges lie on a circle."""
    count = count_of(wishes.columns, 3, 1000, "--columns")
    across, high = sides_of(wishes.size, 2, "--size")
    if across.in_pixels:
        raise JobError(f"--size: the diameter is a length (expected such as 2x1.5m), got {wishes.size!r}")
    chord = Fraction(float(across.amount) * math.sin(math.pi / count)).limit_denominator(10**9)
    raster = grain_of(wishes).raster("column", (Sided(chord), high))
    reach = float(raster.size[0]) / 2 / math.tan(math.pi / count)
    y = base_of(wishes) + float(raster.size[1]) / 2
    panels = []
    for k in range(count):
        turn = 360.0 * k / count
        at = (reach * math.sin(math.radians(turn)), y, reach * math.cos(math.radians(turn)))
        panels.append(Panel(f"column_{k + 1}", raster, at, yaw_deg=turn + 180 * wishes.inside))
    return tuple(panels)


def _sphere(wishes: Wishes) -> Ball:
    """A ball of trapezoids between circles of latitude, with triangles at the poles."""
    columns, rows = count_of(wishes.columns, 3, 500, "--columns"), count_of(wishes.rows, 2, 500, "--rows")
    (across,) = sides_of(wishes.size, 1, "--size")
    if across.in_pixels or wishes.pitch is None or wishes.pixels or wishes.cabinet:
        raise JobError("a sphere needs a diameter and a pitch (expected such as --size 2m --pitch 3mm)")
    radius = float(across.amount) / 2
    middle = base_of(wishes) + radius
    vertices: list[Point] = [(0.0, middle - radius, 0.0)]
    for i in range(1, rows):
        low = math.pi * i / rows
        for k in range(columns):
            turn = 2 * math.pi * k / columns
            ring = radius * math.sin(low)
            vertices.append((ring * math.sin(turn), middle - radius * math.cos(low), ring * math.cos(turn)))
    vertices.append((0.0, middle + radius, 0.0))
    faces = [face for i in range(rows) for face in _belt(i, rows, columns)]
    return Ball(tuple(vertices), tuple(faces), read_metres(wishes.pitch, "--pitch"))


def _belt(row: int, rows: int, columns: int) -> list[tuple[int, ...]]:
    """Faces between two circles of latitude, from the lower pole up."""
    faces: list[tuple[int, ...]] = []
    for k in range(columns):
        low, high = (1 + (i - 1) * columns for i in (row, row + 1))
        a, b = k, (k + 1) % columns
        if row == 0:
            faces.append((0, high + b, high + a))
        elif row == rows - 1:
            faces.append((low + a, low + b, 1 + (rows - 1) * columns))
        else:
            faces.append((low + a, low + b, high + b, high + a))
    return faces


def _stairs(wishes: Wishes) -> tuple[Panel, ...]:
    """Risers and treads that climb away from the viewer; the first riser stands over the origin."""
    if wishes.pixels:
        raise JobError("stairs have panels of two sizes (expected --pitch or --cabinet, not --pixels)")
    grain, base = grain_of(wishes), base_of(wishes)
    count = count_of(wishes.steps, 1, 500, "--steps")
    wide, high, deep = sides_of(wishes.size, 3, "--size")
    riser, tread = grain.raster("riser", (wide, high)), grain.raster("tread", (wide, deep))
    rise, run = float(riser.size[1]), float(tread.size[1])
    panels = []
    for k in range(count):
        panels.append(Panel(f"riser_{k + 1}", riser, (0.0, base + (k + 0.5) * rise, -k * run)))
        if wishes.treads:
            at = (0.0, base + (k + 1) * rise, -(k + 0.5) * run)
            panels.append(Panel(f"tread_{k + 1}", tread, at, pitch_deg=90.0))
    return tuple(panels)


_COLUMNS = "how many flat columns, such as 16"
KINDS: dict[str, Kind] = {
    "corner": Kind(
        "two walls that meet; --angle is between their lit sides: 90 in a room, 270 around a building",
        {"left": "left wall, width x height, such as 8x4.5m", "right": "right wall, such as 6x4.5m"},
        _corner,
        takes=("base", "angle"),
    ),
    "wall": Kind("one flat wall", {"size": "width x height, such as 8x4.5m"}, _wall),
    "curve": Kind(
        "a wall of flat columns along an arc; a positive radius bends around the viewer, a negative one away",
        {
            "size": "width along the wall x height, such as 8x4m",
            "columns": _COLUMNS,
            "radius": "radius of the arc, such as 6m",
        },
        _curve,
    ),
    "cave": Kind(
        "three walls and a floor around the viewer, open behind; with --ceiling five sides",
        {"size": "width x height x depth, such as 3x3x3m"},
        _cave,
        takes=("base", "ceiling"),
        encloses=True,
    ),
    "cube": Kind(
        "four sides and a top, to walk around",
        {"size": "width x height x depth, such as 2x1x2m"},
        _cube,
        around=True,
    ),
    "cylinder": Kind(
        "flat columns all around, lit outside; with --inside around the viewer",
        {"size": "diameter x height, such as 2x1.5m", "columns": _COLUMNS},
        _cylinder,
        takes=("base", "inside"),
        around=True,
    ),
    "sphere": Kind(
        "a ball of flat pieces, lit outside; with --inside around the viewer",
        {"size": "diameter, such as 2m", "columns": "pieces around, such as 24", "rows": "rows, such as 12"},
        _sphere,
        takes=("base", "inside"),
        around=True,
    ),
    "stairs": Kind(
        "risers and treads that climb away from the viewer; with --no-treads risers alone",
        {
            "size": "width x height of a riser x depth of a tread, such as 4x0.16x0.3m",
            "steps": "how many steps",
        },
        _stairs,
        takes=("base", "treads"),
        from_above=True,
    ),
    "arena": Kind(
        "a cylinder of LED panels around an animal; --preset has those of the Reiser lab, such as G6_2x10",
        {"columns": "places for columns all around, such as 12", "rows": "rows of panels, such as 4"},
        arena_panels,
        takes=("base", "installed", "preset"),
        encloses=True,
        arrange=arranged_arena,
    ),
}
GRAIN = "pitch such as 6mm, pixels of a panel such as 1920x1080px, or cabinet such as 500x500mm/128x128px"


def missing(wishes: Wishes) -> dict[str, str]:
    """What a kind needs and was not told, by option name, with the question to ask.

    `grain` stands for the pixels, which may be told in three ways.

    Raises:
        JobError: there is no such kind.
    """
    kind_of(wishes)
    wishes = settled(wishes)
    asked = {name: text for name, text in kind_of(wishes).needs.items() if getattr(wishes, name) is None}
    if wishes.pitch is None and wishes.pixels is None and wishes.cabinet is None:
        asked["grain"] = "pixel pitch, such as 3mm" if wishes.kind == "sphere" else GRAIN
    return asked


_FIGURES = (
    *("size", "left", "right", "angle", "radius", "columns", "rows", "steps"),
    *("base", "inside", "ceiling", "treads", "preset", "installed"),
)


def check_wishes(wishes: Wishes) -> None:
    """Whether a kind makes use of all that was said.

    Raises:
        JobError: with what means nothing to it, and what it takes instead.
    """
    kind = kind_of(wishes)
    known = (*kind.needs, *kind.takes)
    idle = [name for name in _FIGURES if getattr(wishes, name) != getattr(Wishes, name) and name not in known]
    if idle:
        given = ", ".join(f"--{name}" if name != "treads" else "--no-treads" for name in idle)
        takes = ", ".join(f"--{name}" if name != "treads" else "--no-treads" for name in known)
        raise JobError(f"{given}: means nothing to a {wishes.kind} (which takes {takes})")
    if wishes.padding and wishes.canvas is None:
        raise JobError("--padding is between panels on a canvas (expected --canvas 2112x1024, too)")


def kind_of(wishes: Wishes) -> Kind:
    """The kind that was asked for.

    Raises:
        JobError: there is no such kind.
    """
    if wishes.kind not in KINDS:
        raise JobError(f"expected one of {', '.join(KINDS)}, got {wishes.kind!r}")
    return KINDS[wishes.kind]
