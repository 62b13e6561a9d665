"""Stanford PLY: text and both binary byte orders, faces of any mixture of sizes.

Texture coordinates are taken from the vertices (`s t`, `u v`, `texture_u texture_v`) or from a list
on the faces (`texcoord`, two numbers a corner, the form MeshLab writes). Other elements and
properties are passed over, which for lists means reading them row by row.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from quiltcli.formats.mesh.mesh import MeshBuilder

_TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "float32": "f", "float64": "d",
}  # fmt: skip
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_CORNERS = ("vertex_indices", "vertex_index")

Row: TypeAlias = Mapping[str, float | Sequence[float]]


class _StopReadingError(Exception):
    """The file is broken beyond going on; the text says how."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class _Property:
    name: str
    code: str
    count_code: str = ""  # set for lists


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]


@dataclass(frozen=True)
class _Header:
    order: str  # "" for text, "<" or ">"
    elements: list[_Element]
    size: int  # bytes up to the first datum
    lines: int


def read_ply(data: bytes, builder: MeshBuilder) -> None:
    """Read a PLY file's bytes into `builder`, noting what is wrong with its line or byte."""
    try:
        header = _header(data)
        rows = _binary_rows(data, header) if header.order else _text_rows(data, header)
        _gather(rows, header, builder)
    except _StopReadingError as stop:
        builder.problem(str(stop), stop.line)


def _header(data: bytes) -> _Header:
    order: str | None = None
    elements: list[_Element] = []
    place = 0
    for line in range(1, 10_000):
        end = data.find(b"\n", place)
        if end < 0:
            raise _StopReadingError("the header never ends (expected a line end_header)", line)
        words = data[place:end].decode("latin-1").split()
        place = end + 1
        if line == 1 and words != ["ply"]:
            raise _StopReadingError(f"found {' '.join(words)[:20]!r} (expected ply)", 1)
        if words[:1] == ["format"]:
            order = _byte_order(words, line)
        elif words[:1] == ["element"]:
            elements.append(_element(words, line))
        elif words[:1] == ["property"]:
            if not elements:
                raise _StopReadingError("a property before the first element", line)
            elements[-1].properties.append(_property(words, line))
        elif words[:1] == ["end_header"]:
            if order is None:
                raise _StopReadingError("the header names no format", line)
            return _Header(order, elements, place, line)
    raise _StopReadingError("the header never ends (expected a line end_header)")


def _byte_order(words: Sequence[str], line: int) -> str:
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    if len(words) < 2 or words[1] not in orders:
        raise _StopReadingError(f"found {' '.join(words)!r} (expected one of {', '.join(orders)})", line)
    return orders[words[1]]


def _element(words: Sequence[str], line: int) -> _Element:
    if len(words) != 3 or not words[2].isdecimal():
        raise _StopReadingError(f"found {' '.join(words)!r} (expected element NAME COUNT)", line)
    return _Element(words[1], int(words[2]), [])


def _property(words: Sequence[str], line: int) -> _Property:
    if len(words) == 3 and words[1] in _TYPES:
        return _Property(words[2], _TYPES[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES:
        return _Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    raise _StopReadingError(
        f"found {' '.join(words)!r} (expected property TYPE NAME or property list TYPE TYPE NAME)", line
    )


def _text_rows(data: bytes, header: _Header) -> Iterator[tuple[_Element, int, Row]]:
    """Yield (element, line, row) of every datum of a text file."""
    lines = data[header.size :].decode("latin-1").splitlines()
    numbered = ((header.lines + i, text.split()) for i, text in enumerate(lines, 1) if text.strip())
    for element in header.elements:
        for index in range(element.count):
            line, words = next(numbered, (0, []))
            if not line:
                raise _StopReadingError(
                    f"the file ends after {index} of {element.count} rows of {element.name}"
                )
            yield element, line, _text_row(element, index, words, line)


def _text_row(element: _Element, index: int, words: Sequence[str], line: int) -> Row:
    row: dict[str, float | Sequence[float]] = {}
    rest = iter(words)
    try:
        for prop in element.properties:
            read = float if prop.code in "fd" else int
            if prop.count_code:
                row[prop.name] = [read(next(rest)) for _ in range(int(next(rest)))]
            else:
                row[prop.name] = read(next(rest))
    except ValueError:
        raise _StopReadingError(
            f"row {index + 1} of {element.name} is {' '.join(words)!r} (expected numbers)", line
        ) from None
    except (StopIteration, RuntimeError):  # next() inside the list turns into the latter
        raise _StopReadingError(
            f"row {index + 1} of {element.name} has {len(words)} numbers (expected more)", line
        ) from None
    return row


def _binary_rows(data: bytes, header: _Header) -> Iterator[tuple[_Element, int, Row]]:
    """Yield (element, 0, row) of every datum of a binary file."""
    place = header.size
    for element in header.elements:
        if any(prop.count_code for prop in element.properties):
            for index in range(element.count):
                row, place = _list_row(data, place, element, index, header.order)
                yield element, 0, row
            continue
        kind = np.dtype([(prop.name, header.order + prop.code) for prop in element.properties])
        need = element.count * kind.itemsize
        if len(data) - place < need:
            raise _StopReadingError(
                f"truncated: the {element.count} rows of {element.name} need {need} bytes from byte {place}, "
                f"but {len(data) - place} are there"
            )
        table = np.frombuffer(data, kind, element.count, place)
        place += need
        names = [prop.name for prop in element.properties]
        for values in table.tolist():
            yield element, 0, dict(zip(names, values, strict=True))


def _list_row(data: bytes, place: int, element: _Element, index: int, order: str) -> tuple[Row, int]:
    """One row of an element with lists, and the byte after it."""
    row: dict[str, float | Sequence[float]] = {}
    try:
        for prop in element.properties:
            count = 1
            if prop.count_code:
                (number,) = struct.unpack_from(order + prop.count_code, data, place)
                count = int(number)
                if count < 0:
                    raise _StopReadingError(
                        f"row {index + 1} of {element.name} has a list of {count} numbers at byte {place}"
                    )
                place += struct.calcsize(prop.count_code)
            values = struct.unpack_from(f"{order}{count}{prop.code}", data, place)
            place += count * struct.calcsize(prop.code)
            row[prop.name] = values if prop.count_code else values[0]
    except struct.error:
        raise _StopReadingError(
            f"truncated: row {index + 1} of {element.count} of {element.name} runs past the end, "
            f"byte {len(data)}"
        ) from None
    return row, place


def _gather(rows: Iterator[tuple[_Element, int, Row]], header: _Header, builder: MeshBuilder) -> None:
    """Keep the vertices and faces among the rows."""
    uv_names = _check_properties(header)
    texture: list[tuple[float, float]] = []
    for element, line, row in rows:
        if element.name == "vertex":
            builder.add_vertex((_number(row["x"]), _number(row["y"]), _number(row["z"])), line)
            if uv_names:
                texture.append((_number(row[uv_names[0]]), _number(row[uv_names[1]])))
        elif element.name == "face":
            found = row.get(_CORNERS[0], row.get(_CORNERS[1]))
            corners = [int(c) for c in found] if isinstance(found, Sequence) else []
            builder.add_face(corners, line, _face_uv(row, corners, texture))


def _check_properties(header: _Header) -> tuple[str, str] | None:
    """Raise when positions or corners are missing; return the vertices' texture properties."""
    by_name = {element.name: {p.name for p in element.properties} for element in header.elements}
    if missing := [name for name in "xyz" if name not in by_name.get("vertex", set())]:
        raise _StopReadingError(f"the vertices have no property {', '.join(missing)} (expected x, y and z)")
    faces = by_name.get("face")
    if faces is not None and not faces.intersection(_CORNERS):
        raise _StopReadingError(f"the faces have no list {_CORNERS[0]} or {_CORNERS[1]}")
    return next((pair for pair in _UV_NAMES if set(pair) <= by_name["vertex"]), None)


def _face_uv(
    row: Row, corners: Sequence[int], texture: Sequence[tuple[float, float]]
) -> Sequence[Sequence[float]] | None:
    listed = row.get("texcoord")
    if isinstance(listed, Sequence) and corners and len(listed) == 2 * len(corners):
        return list(zip(listed[0::2], listed[1::2], strict=True))
    if texture and all(0 <= corner < len(texture) for corner in corners):
        return [texture[corner] for corner in corners]
    return None


def _number(value: float | Sequence[float]) -> float:
    return float(value) if isinstance(value, (int, float)) else float("nan")
