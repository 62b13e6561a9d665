"""The header of a PLY file: which elements follow, with which properties, in which byte order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_ENDING = re.compile(rb"\r\n?|\n")
_MOST_DIGITS = 18  # what a count in int64 can have
_SHOWN = 60


class StopReadingError(Exception):
    """The file is broken beyond going on; the text says how."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Property:
    """A property: its name, its type as in `struct`, and that of the count if it is a list."""

    name: str
    code: str
    count_code: str = ""


@dataclass
class ElementHeader:
    """An element: `count` rows of these properties."""

    name: str
    count: int
    properties: list[Property]


@dataclass(frozen=True)
class Header:
    """What a header says.

    Attributes:
        order: byte order, `<` or `>`; empty for text.
        elements: in the order of their data.
        size: bytes up to the first datum.
        lines: lines up to there.
        texture: file name of a `comment TextureFile`, empty without.
    """

    order: str
    elements: list[ElementHeader]
    size: int
    lines: int
    texture: str


def read_header(data: bytes) -> Header:
    """Read a header, whose lines may end in a line feed, a carriage return or both.

    Raises:
        StopReadingError: with the line.
    """
    # The first line tells how lines end; binary data may begin with either character.
    found = _ENDING.search(data)
    ending = found[0] if found else b"\n"
    order: str | None = None
    elements: list[ElementHeader] = []
    texture = ""
    place = 0
    for line in range(1, 10_000):
        end = data.find(ending, place)
        text = data[place : end if end >= 0 else place + 200].decode("latin-1")
        words = text.split()
        if line == 1 and words != ["ply"]:
            raise StopReadingError(f"found {' '.join(words)[:20]!r} (expected ply)", 1)
        if end < 0:
            raise StopReadingError("the header never ends (expected a line end_header)", line)
        place = end + len(ending)
        if words[:1] == ["format"]:
            order = _byte_order(words, line)
        elif words[:1] == ["element"]:
            elements.append(_element(words, line))
        elif words[:1] == ["property"]:
            if not elements:
                raise StopReadingError("a property before the first element", line)
            elements[-1].properties.append(_property(words, line))
        elif words[:2] == ["comment", "TextureFile"]:
            texture = text.split("TextureFile", 1)[1].strip()
        elif words[:1] == ["end_header"]:
            if order is None:
                raise StopReadingError("the header names no format", line)
            return Header(order, elements, place, line, texture)
    raise StopReadingError("the header never ends (expected a line end_header)")


def _byte_order(words: Sequence[str], line: int) -> str:
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    if len(words) < 2 or words[1] not in orders:
        raise StopReadingError(f"found {_shown(words)!r} (expected one of {', '.join(orders)})", line)
    return orders[words[1]]


def _element(words: Sequence[str], line: int) -> ElementHeader:
    if len(words) != 3 or not (words[2].isascii() and words[2].isdecimal()):
        raise StopReadingError(f"found {_shown(words)!r} (expected element NAME COUNT)", line)
    digits = words[2].lstrip("0") or "0"
    if len(digits) > _MOST_DIGITS:
        raise StopReadingError(
            f"{words[1]} has a count of {len(digits)} digits (expected {_MOST_DIGITS} at most)", line
        )
    return ElementHeader(words[1], int(digits), [])


def _property(words: Sequence[str], line: int) -> Property:
    if len(words) == 3 and words[1] in _TYPES:
        return Property(words[2], _TYPES[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES:
        return Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    raise StopReadingError(
        f"found {_shown(words)!r} (expected property TYPE NAME or property list TYPE TYPE NAME)", line
    )


def _shown(words: Sequence[str]) -> str:
    text = " ".join(words)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"
