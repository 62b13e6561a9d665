"""The data of a PLY file: every element as columns, lists as ragged ones."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.mesh.ply_header import ElementHeader, Header, Property, StopReadingError
from quiltcli.formats.mesh.words import Statements, bad_rows, parsed_floats, plain_text, statements
from quiltcli.geometry import FloatArray, IntArray, offsets, segments

Column = NDArray[Any]


@dataclass(frozen=True)
class List:
    """A list property: the values of row k are values[start[k] : start[k + 1]]."""

    start: IntArray
    values: Column


@dataclass(frozen=True)
class Element:
    """The data of an element; of properties that share a name, the first.

    Attributes:
        name: of the element.
        count: rows.
        scalars: (count,) each, by name.
        lists: by name.
        codes: types of the scalars, as in `struct`.
        doubled: names that occur more than once.
        lines: (count,) lines of the rows; None in binary files.
    """

    name: str
    count: int
    scalars: dict[str, Column] = field(default_factory=dict)
    lists: dict[str, List] = field(default_factory=dict)
    codes: dict[str, str] = field(default_factory=dict)
    doubled: set[str] = field(default_factory=set)
    lines: IntArray | None = None

    def add(self, prop: Property, column: Column | List) -> None:
        """Take a property's data, unless one of its name is there."""
        if prop.name in self.scalars or prop.name in self.lists:
            self.doubled.add(prop.name)
        elif isinstance(column, List):
            self.lists[prop.name] = column
        else:
            self.scalars[prop.name] = column
            self.codes[prop.name] = prop.code


def read_elements(data: bytes, header: Header) -> list[Element]:
    """Read all elements.

    Raises:
        StopReadingError: the data is shorter than the header promises, or broken.
    """
    # Rows of an element without properties take no room.
    wanted = [element for element in header.elements if element.properties and element.count]
    read = _text_elements(data, header, wanted) if not header.order else _binary(data, header, wanted)
    found = {element.name: element for element in reversed(read)}
    return [found.get(element.name, _nothing(element)) for element in header.elements]


def _nothing(header: ElementHeader) -> Element:
    """An element of no rows."""
    element = Element(header.name, 0)
    for prop in header.properties:
        nothing = np.zeros(0, prop.code)
        element.add(prop, List(np.zeros(1, np.int64), nothing) if prop.count_code else nothing)
    return element


def _text_elements(data: bytes, header: Header, wanted: Sequence[ElementHeader]) -> list[Element]:
    text = statements(plain_text(data[header.size :]))
    found, row = [], 0
    for element in wanted:
        rows = np.arange(row, min(row + element.count, text.count))
        if len(rows) < element.count:
            _missing_rows(text, rows, element, header.lines)
        found.append(_text_element(text, rows, element, header.lines))
        row += element.count
    return found


def _missing_rows(text: Statements, rows: IntArray, element: ElementHeader, skipped: int) -> NoReturn:
    """Say what is wrong with the rows that are there, or else that some are not."""
    if len(rows):
        _text_element(text, rows, element, skipped)
    raise StopReadingError(f"the file ends after {len(rows)} of {element.count} rows of {element.name}")


def _text_element(text: Statements, rows: IntArray, header: ElementHeader, skipped: int) -> Element:
    """One element: all its numbers at once, then every property of all rows at once."""
    sizes = text.sizes[rows]
    flat = parsed_floats(text.spans(rows, 0), int(sizes.sum()))
    if flat is None:
        for row, words in bad_rows(text, rows.tolist(), 0, int(sizes.max())):
            raise StopReadingError(
                f"row {row - rows[0] + 1} of {header.name} is {' '.join(words)!r} (expected numbers)",
                text.line(row) + skipped,
            )
        raise StopReadingError(f"the rows of {header.name} are no numbers")
    element = Element(header.name, header.count, lines=text.lines(rows) + skipped)
    start = offsets(sizes)
    at, end = start[:-1].copy(), start[1:]
    for prop in header.properties:
        _long_enough(at + 1, end, start, element)
        if not prop.count_code:
            element.add(prop, flat[at])
            at += 1
            continue
        counts = _counts(flat[at], element)
        _long_enough(at + 1 + counts, end, start, element)
        own = offsets(counts)
        element.add(prop, List(own, flat[_places(at + 1, own)]))
        at += 1 + counts
    return element


def _long_enough(need: IntArray, end: IntArray, start: IntArray, element: Element) -> None:
    short = np.flatnonzero(need > end)
    if len(short) and element.lines is not None:
        row = int(short[0])
        raise StopReadingError(
            f"row {row + 1} of {element.name} has {end[row] - start[row]} numbers (expected more)",
            int(element.lines[row]),
        )


def _counts(written: FloatArray, element: Element) -> IntArray:
    """Lengths of lists, of which none is negative, broken, infinite or not a number."""
    good = (written >= 0) & (written < 2**53) & (np.floor(written) == written)
    if not good.all():
        row = int(np.argmin(good))
        line = 0 if element.lines is None else int(element.lines[row])
        raise StopReadingError(
            f"row {row + 1} of {element.name} has a list of {written[row]:g} numbers "
            "(expected a whole count)",
            line,
        )
    return written.astype(np.int64)


def _places(begin: IntArray, own: IntArray, size: int = 1) -> IntArray:
    """Places of all values of lists that begin at `begin` (n,), in steps of `size`.

    `own` (n+1,) are the offsets of the lists when joined.
    """
    row, rank = segments(own)
    result: IntArray = begin[row] + size * rank
    return result


def _binary(data: bytes, header: Header, wanted: Sequence[ElementHeader]) -> list[Element]:
    found, place = [], header.size
    for element in wanted:
        if any(prop.count_code for prop in element.properties):
            read, place = _even_lists(data, place, element, header.order)
            if read is None:
                read, place = _uneven_lists(data, place, element, header.order)
        else:
            read, place = _plain_rows(data, place, element, header.order)
        found.append(read)
    return found


def _plain_rows(data: bytes, place: int, header: ElementHeader, order: str) -> tuple[Element, int]:
    """Rows without lists."""
    kind = np.dtype([(f"{k}", order + prop.code) for k, prop in enumerate(header.properties)])
    need = header.count * kind.itemsize
    if len(data) - place < need:
        raise StopReadingError(
            f"truncated: the {header.count} rows of {header.name} need {need} bytes from byte {place}, "
            f"but {len(data) - place} are there"
        )
    table = np.frombuffer(data, kind, header.count, place)
    element = Element(header.name, header.count)
    for k, prop in enumerate(header.properties):
        element.add(prop, _native(table[f"{k}"]))
    return element, place + need


def _native(column: Column) -> Column:
    return column.astype(column.dtype.newbyteorder("="))


def _even_lists(data: bytes, place: int, header: ElementHeader, order: str) -> tuple[Element | None, int]:
    """Rows whose lists are all as long as the first row's; None if they are not."""
    counts = _first_counts(data, place, header, order)
    if counts is None:
        return None, place
    fields: list[Any] = []
    for k, prop in enumerate(header.properties):
        if prop.count_code:
            fields += [(f"n{k}", order + prop.count_code), (f"{k}", order + prop.code, (counts[k],))]
        else:
            fields.append((f"{k}", order + prop.code))
    kind = np.dtype(fields)
    if (len(data) - place) // kind.itemsize < header.count:
        return None, place
    table = np.frombuffer(data, kind, header.count, place)
    if any(
        (table[f"n{k}"] != counts[k]).any() for k, prop in enumerate(header.properties) if prop.count_code
    ):
        return None, place
    element = Element(header.name, header.count)
    for k, prop in enumerate(header.properties):
        column = _native(table[f"{k}"])
        own = np.arange(header.count + 1, dtype=np.int64) * counts[k]
        element.add(prop, List(own, column.reshape(-1)) if prop.count_code else column)
    return element, place + header.count * kind.itemsize


def _first_counts(data: bytes, place: int, header: ElementHeader, order: str) -> list[int] | None:
    """Length of each property in the first row, 0 for those that are no lists."""
    counts = []
    for prop in header.properties:
        count = 1
        if prop.count_code:
            width = struct.calcsize(order + prop.count_code)
            if place + width > len(data):
                return None
            (written,) = struct.unpack_from(order + prop.count_code, data, place)
            if not 0 <= written <= len(data) or written % 1:
                return None
            count = int(written)
            place += width
        counts.append(count if prop.count_code else 0)
        place += count * struct.calcsize(order + prop.code)
    return counts if place <= len(data) else None


def _uneven_lists(data: bytes, place: int, header: ElementHeader, order: str) -> tuple[Element, int]:
    """Rows with lists of any length: walk over them to find where each begins, then take all at once."""
    begins, place = _walk(data, place, header, order)
    element = Element(header.name, header.count)
    octets = np.frombuffer(data, np.uint8)
    for prop, (begin, counts) in zip(header.properties, begins, strict=True):
        kind = np.dtype(order + prop.code)
        own = offsets(counts)
        at = _places(begin, own, kind.itemsize)
        values = octets[at[:, None] + np.arange(kind.itemsize)].view(kind).reshape(-1)
        element.add(prop, List(own, _native(values)) if prop.count_code else _native(values))
    return element, place


def _walk(
    data: bytes, place: int, header: ElementHeader, order: str
) -> tuple[list[tuple[IntArray, IntArray]], int]:
    """Byte at which every property of every row begins and how many values it has; the byte after all."""
    steps = [
        (struct.Struct(order + prop.count_code).unpack_from if prop.count_code else None,
         struct.calcsize(order + prop.count_code) if prop.count_code else 0,
         struct.calcsize(order + prop.code))
        for prop in header.properties
    ]  # fmt: skip
    found: list[tuple[list[int], list[int]]] = [([], []) for _ in steps]
    for row in range(header.count):
        for (unpack, width, size), (begins, counts) in zip(steps, found, strict=True):
            count = 1
            if unpack is not None:
                count = _count(unpack, data, place, row, header)
                place += width
            begins.append(place)
            counts.append(count)
            place += count * size
        if place > len(data):
            _runs_out(data, row, header)
    return [(np.array(b, np.int64), np.array(c, np.int64)) for b, c in found], place


def _count(unpack: Any, data: bytes, place: int, row: int, header: ElementHeader) -> int:
    try:
        (written,) = unpack(data, place)
    except struct.error:
        _runs_out(data, row, header)
    if not 0 <= written < 2**53 or written % 1:
        raise StopReadingError(
            f"row {row + 1} of {header.name} has a list of {written:g} numbers at byte {place}"
        )
    return int(written)


def _runs_out(data: bytes, row: int, header: ElementHeader) -> NoReturn:
    raise StopReadingError(
        f"truncated: row {row + 1} of {header.count} of {header.name} runs past the end, byte {len(data)}"
    )
