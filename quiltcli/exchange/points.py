"""The colours of single lights out of a render's pages: tables, bytes, and universes of DMX.

A display of points has a pixel of the page for each, row by row in the order of the list, so that a page
is what a driver of lights is sent. sACN (ANSI E1.31) and Art-Net send universes of 512 channels.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem, QuiltError
from quiltcli.exchange.film.reels import Reel, reels_of
from quiltcli.exchange.pixelmaps import known_display
from quiltcli.formats.whole import make_folder, write_bytes
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.images.names import frame_digits, layout_path
from quiltcli.images.preview import Look, display_values
from quiltcli.layout import Layout, read_layout

CHANNELS = 512
"""Of a universe."""

LAST_UNIVERSE = 63999  # of E1.31
_FIELD = re.compile("#+")
ORDERS = ("rgb", "rbg", "grb", "gbr", "brg", "bgr")


@dataclass(frozen=True)
class Wiring:
    """How lights are told their colours.

    Attributes:
        look: how light becomes values.
        order: of a light's channels, a name of `ORDERS`.
        universe: that of the first light.
        per_universe: lights in a universe; None for as many as it holds.
    """

    look: Look = field(default_factory=lambda: Look("srgb"))
    order: str = "rgb"
    universe: int = 1
    per_universe: int | None = None

    @property
    def channels(self) -> int:
        """Channels of a light."""
        return 3 * self.look.depth // 8

    @property
    def lights(self) -> int:
        """Lights in a universe."""
        return self.per_universe or CHANNELS // self.channels


@dataclass(frozen=True)
class Lights:
    """N lights of a page.

    Attributes:
        number: (N,) numbers in the list, from 0, ascending.
        pixel: (N,) their pixels in the page, row by row.
        place: (N, 3) where they are, world metres.
        count: length of the list up to the last that is there.
    """

    number: IntArray
    pixel: IntArray
    place: FloatArray
    count: int


def write_colors(
    out: Path, path: Path, wiring: Wiring | None = None, frames: Sequence[int] | None = None, eye: str = ""
) -> tuple[list[Path], Lights]:
    """Write the colours of a render of a display of points.

    Args:
        out: the folder that was rendered to.
        path: the file, `.csv`, `.rgb` or `.dmx`; with #### a file for each frame, else all in one.
        wiring: how lights are told their colours; the defaults when None.
        frames: their numbers; all when None.
        eye: `left` or `right` where there are two.

    Returns:
        The files, and the lights.

    Raises:
        OutputError: the folder has no such render, the display is none of points, or the file cannot be
            written so.
    """
    wiring = wiring or Wiring()
    form = FORMS.get(path.suffix.lower())
    if form is None:
        raise OutputError(Problem(f"expected a name that ends in {', '.join(FORMS)}", file=str(path)))
    _check_wiring(wiring)
    lights = lights_of(out)
    last = wiring.universe + (lights.count - 1) // wiring.lights
    if last > LAST_UNIVERSE:
        words = f"{lights.count:,} points end in universe {last:,} (there are {LAST_UNIVERSE:,})"
        raise OutputError(Problem(words, file=str(path)))
    reel = _reel(out, frames, eye)
    make_folder(path.parent)
    shown = ((frame, _values(reel.light(frame), lights, wiring)) for frame in reel.frames)
    if "#" not in path.name:
        write_bytes(path, b"".join(form(shown, lights, wiring)))
        return [path], lights
    written = []
    for frame, values in shown:
        file = path.with_name(_FIELD.sub(frame_digits(frame), path.name))
        write_bytes(file, b"".join(form(iter([(frame, values)]), lights, wiring)))
        written.append(file)
    return written, lights


def lights_of(out: Path) -> Lights:
    """The lights of a render.

    Raises:
        OutputError: there is no layout, or its facets are no single pixels of one page.
    """
    path = layout_path(out)
    if not path.is_file():
        words = f"has no {path.name} (expected the folder that quilt render has written to)"
        raise OutputError(Problem(words, file=str(out)))
    layout = read_layout(path)
    corner = _corners(layout)
    odd = np.flatnonzero((layout.size != 1).any(axis=1) | (layout.page != 0))
    if odd.size:
        facet, size = int(layout.facet[odd[0]]), layout.size[odd[0]].tolist()
        words = f"facet {facet} is {size[0]} × {size[1]} pixels on page {int(layout.page[odd[0]]) + 1}"
        raise OutputError(Problem(f"is no render of points: {words} (expected one of one page)", str(out)))
    pixel = corner[:, 1] * int(layout.pages[0, 0]) + corner[:, 0]
    number = _numbers(layout, pixel)
    order = np.argsort(number)
    place = layout.origin + (layout.du + layout.dv) / 2
    return Lights(number[order], pixel[order], place[order], int(number.max()) + 1)


def _numbers(layout: Layout, pixel: IntArray) -> IntArray:
    """Numbers in the list (F,) of a layout's facets: by the display if it is there, else by the page."""
    try:
        facets = known_display(layout)
    except QuiltError:
        facets = None
    if facets is None or facets.sha256 != layout.display_sha256 or facets.places is None:
        return pixel
    size = facets.places.page_size
    if size is None:
        return pixel
    own = facets.places.corner[np.searchsorted(facets.places.facet, layout.facet)].astype(np.int64)
    return np.asarray(own[:, 1] * size[0] + own[:, 0])


def _corners(layout: Layout) -> IntArray:
    """The page pixel (F, 2) whose centre is that of each facet's first pixel."""
    middle = layout.quilt_from_facet @ np.array([0.5, 0.5, 1.0])
    return np.asarray(np.floor(middle), dtype=np.int64)


def _check_wiring(wiring: Wiring) -> None:
    most = CHANNELS // wiring.channels
    if not 1 <= wiring.lights <= most:
        words = f"expected 1 to {most} lights of {wiring.channels} channels, got {wiring.lights}"
        raise OutputError(f"--per-universe: {words}")
    if wiring.order not in ORDERS:
        raise OutputError(f"--order: expected {', '.join(ORDERS)}, got {wiring.order!r}")


def _reel(out: Path, frames: Sequence[int] | None, eye: str) -> Reel:
    """The page's frames, of the eye that was asked for."""
    reels = reels_of(out, "page", frames)
    if not eye and len(reels) > 1:
        eyes = ", ".join(reel.eye for reel in reels)
        raise OutputError(Problem(f"has two eyes (choose one with --eye: {eyes})", file=str(out)))
    for reel in reels:
        if reel.eye == eye or not eye:
            return reel
    found = ", ".join(reel.eye or "one eye" for reel in reels)
    raise OutputError(Problem(f"has no pages of the {eye} eye (it has {found})", file=str(out)))


def _values(light: NDArray[Any], lights: Lights, wiring: Wiring) -> NDArray[Any]:
    """Values (count, 3) of all numbers up to the last, 0 for those that are not there."""
    flat = display_values(light, wiring.look).reshape(-1, 3)
    result = np.zeros((lights.count, 3), dtype=np.uint8 if wiring.look.depth == 8 else np.dtype(">u2"))
    result[lights.number] = flat[lights.pixel][:, ["rgb".index(name) for name in wiring.order]]
    return result


Frames = Iterator[tuple[int, NDArray[Any]]]


def _table(frames: Frames, lights: Lights, wiring: Wiring) -> Iterator[bytes]:
    """A row a light and frame."""
    yield f"frame,point,x,y,z,universe,channel,{','.join(wiring.order)}\n".encode()
    universe = wiring.universe + lights.number // wiring.lights
    channel = 1 + wiring.channels * (lights.number % wiring.lights)
    begin = [
        f"{k + 1},{x:.6g},{y:.6g},{z:.6g},{u},{c}"
        for k, (x, y, z), u, c in zip(
            lights.number.tolist(), lights.place.tolist(), universe.tolist(), channel.tolist(), strict=True
        )
    ]
    for frame, values in frames:
        rows = zip(begin, values[lights.number].tolist(), strict=True)
        yield "".join(f"{frame},{start},{a},{b},{c}\n" for start, (a, b, c) in rows).encode()


def _raw(frames: Frames, lights: Lights, wiring: Wiring) -> Iterator[bytes]:
    """The channels of all lights one after another."""
    for _, values in frames:
        yield values.tobytes()


def _universes(frames: Frames, lights: Lights, wiring: Wiring) -> Iterator[bytes]:
    """Universes of 512 channels, one after another; what no light has is 0."""
    count = -(-lights.count // wiring.lights)
    for _, values in frames:
        padded = np.zeros((count * wiring.lights, 3), dtype=values.dtype)
        padded[: len(values)] = values
        block = np.zeros((count, CHANNELS), dtype=np.uint8)
        block[:, : wiring.lights * wiring.channels] = padded.view(np.uint8).reshape(count, -1)
        yield block.tobytes()


FORMS: dict[str, Callable[[Frames, Lights, Wiring], Iterator[bytes]]] = {
    ".csv": _table,
    ".rgb": _raw,
    ".dmx": _universes,
}
"""What is written, by the end of the name."""
