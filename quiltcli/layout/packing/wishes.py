"""What a layout is to be like, and the checks of that by itself."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from quiltcli.errors import LayoutError, Problem
from quiltcli.layout.layout import Layout
from quiltcli.layout.packing.methods import DEFAULT_METHOD, METHODS

CANVASES = {"uhd": (3840, 2160), "dci4k": (4096, 2160), "uhd8k": (7680, 4320)}
"""Page sizes that have a name: what LED processors and projectors take."""

DEFAULT_SECONDS = 10.0


@dataclass(frozen=True)
class Target:
    """How to pack; see `pack` for the meaning."""

    method: str = DEFAULT_METHOD
    size: tuple[int, int] | None = None
    padding: int = 2
    max_pages: int | None = None
    aspect: Fraction | None = None
    align: int = 1
    mirror: bool = False
    page_facets: int | None = None
    page_pixels: int | None = None
    pins: Layout | None = None
    seconds: float = DEFAULT_SECONDS


def read_aspect(text: str) -> Fraction:
    """The aspect written as 16:9, 16x9, 16/9 or 1.85.

    Raises:
        LayoutError: it is none of these, or not between 1:100 and 100:1.
    """
    parts = text.lower().replace("x", ":").replace("/", ":").split(":")
    try:
        aspect = Fraction(parts[0]) / Fraction(parts[1] if len(parts) > 1 else "1")
    except (ValueError, ZeroDivisionError):
        aspect = Fraction(0)
    if len(parts) > 2 or not Fraction(1, 100) <= aspect <= 100:
        raise LayoutError(f"expected an aspect such as 16:9 or 1.85, got {text!r}")
    return aspect


def bad_target(target: Target) -> Iterator[Problem]:
    """What makes no sense about a target, whatever the display."""
    if target.method not in METHODS:
        near = difflib.get_close_matches(target.method, METHODS, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        yield Problem(f"unknown packing method {target.method!r} (known: {', '.join(METHODS)}{hint})")
    if target.size is not None and min(target.size) < 1:
        yield Problem(f"page size {target.size[0]}×{target.size[1]}; both must be at least 1 pixel")
    if target.padding < 0:
        yield Problem(f"padding {target.padding}; it must be 0 pixels or more")
    if target.align < 1:
        yield Problem(f"alignment to {target.align}; it must be at least 1 pixel")
    if target.seconds <= 0:
        yield Problem(f"{target.seconds:g} seconds; they must be more than 0")
    for name, most in (
        ("pages", target.max_pages),
        ("facets a page", target.page_facets),
        ("pixels a page", target.page_pixels),
    ):
        if most is not None and most < 1:
            yield Problem(f"at most {most} {name}; it must be at least 1")
    yield from _at_odds(target)


def _at_odds(target: Target) -> Iterator[Problem]:
    """Wishes that exclude each other."""
    limited = target.page_facets is not None or target.page_pixels is not None
    if target.size is not None and target.aspect is not None:
        yield Problem("a page size and an aspect: give one, since the size has an aspect")
    if limited and target.size is None:
        yield Problem("limits of a page need a page size")
    if limited and target.pins is not None:
        yield Problem("limits of a page and pins cannot be combined")
    if target.method == "net" and (target.align > 1 or target.mirror):
        yield Problem("the method net lays facets at any angle, so it can neither align nor mirror them")
