"""Geomview OFF text files, with the prefixes ST, C and N for what vertices carry besides a position.

Rows stand on lines of their own; where they do not, numbers are taken one after the other as the
prefixes say. Colours, of vertices and behind faces, are sRGB: fractions where any is written with a
point, otherwise 0 to 255, or 0 to 1 where none is above 1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.mesh.colors import linear_from_srgb
from quiltcli.formats.mesh.mesh import PolygonMesh, raise_problems, strange_corners
from quiltcli.formats.mesh.words import (
    Statements,
    bad_rows,
    blanked,
    parsed_floats,
    plain_text,
    statements,
)
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, offsets, segments

_HEADER = re.compile(r"(ST)?(C)?(N)?OFF(\d+)?")
_MOST_DIGITS = 18


@dataclass(frozen=True)
class _Header:
    """What a file begins with.

    Attributes:
        texture: vertices end in texture coordinates.
        colored: vertices have colours.
        normals: vertices have normals.
        vertices: how many follow.
        faces: likewise.
        row: statement with the first vertex.
        word: word with which the first vertex begins.
    """

    texture: bool
    colored: bool
    normals: bool
    vertices: int
    faces: int
    row: int
    word: int


@dataclass(frozen=True)
class _Rows:
    """Rows of numbers, flat[start[k] : start[k + 1]], their lines, and the first word of each."""

    flat: FloatArray
    start: IntArray
    lines: IntArray
    first_word: IntArray

    @property
    def counts(self) -> IntArray:
        return np.diff(self.start)

    def columns(self, columns: IntArray) -> FloatArray:
        """Numbers (n, k) at these columns (k,) or (n, k) of every row."""
        result: FloatArray = self.flat[self.start[:-1, None] + columns]
        return result


def read_off(data: bytes, path: Path) -> PolygonMesh:
    """Read an OFF file's bytes.

    Raises:
        MeshError: what is wrong, with its line.
    """
    text = statements(blanked(plain_text(data)))
    header = _header(text, str(path))
    vertices, faces = _rows(text, header, str(path))
    start, corners = _corners(text, faces, header, str(path))
    uv = None
    if header.texture:
        uv = vertices.columns(vertices.counts[:, None] + np.array([-2, -1]))[corners]
    normals = None
    if header.normals and len(corners) and (vertices.counts >= 6).all():
        normals = vertices.columns(np.array([3, 4, 5]))[corners]
    colors = _vertex_colors(text, vertices, header)
    own = _face_colors(text, faces) if colors is None else None
    row, _ = segments(start)
    return PolygonMesh(
        vertices=vertices.columns(np.arange(3)).reshape(-1, 3),
        corner_start=start,
        corners=corners,
        uv=uv,
        names=("",) * header.faces,
        lines=faces.lines,
        path=str(path),
        normals=normals,
        colors=colors[corners] if colors is not None else None if own is None else own[row],
        variant=None if own is None else row,
        vertex_lines=vertices.lines,
    )


def _header(text: Statements, path: str) -> _Header:
    words = text.words(0) if text.count else []
    found = _HEADER.fullmatch(words[0]) if words else None
    if found is None and not (words and words[0].isdecimal()):  # the keyword may be left out
        shown = repr(words[0][:20]) if words else "an empty file"
        raise _error(path, f"found {shown} (expected OFF, COFF, NOFF or STOFF)", text.line(0) if words else 1)
    taken = 1 if found else 0
    if found and len(words) > 1 and words[1].upper() == "BINARY":
        raise _error(path, "binary OFF is not supported (expected the text form)", text.line(0))
    # The first count may be glued to the keyword: `OFF6 2 0`.
    glued = [found[4]] if found and found[4] else []
    row = 0 if glued or len(words) > taken or text.count == 1 else 1
    word = int(text.first[row]) + (taken if row == 0 else 0)
    here = [text.word(k) for k in range(word, int(text.first[row + 1]))]
    counts = [*glued, *here][:3]
    if len(counts) < 2 or not all(
        n.isascii() and n.isdecimal() and len(n) <= _MOST_DIGITS for n in counts[:2]
    ):
        shown = " ".join([*glued, *here])[:60]
        message = f"found {shown!r} (expected the counts of vertices, faces and edges)"
        raise _error(path, message, text.line(row))
    used = len(counts) - len(glued)
    texture, colored, normals = (found is not None and found[k] is not None for k in (1, 2, 3))
    return _Header(texture, colored, normals, int(counts[0]), int(counts[1]), row + 1, word + used)


def _error(path: str, message: str, line: int = 0) -> MeshError:
    return MeshError(Problem(message, path, line))


def _rows(text: Statements, header: _Header, path: str) -> tuple[_Rows, _Rows]:
    """Vertices and faces, from their lines or, where those do not tell, from the stream of numbers."""
    if header.word == text.first[header.row]:
        try:
            return _by_lines(text, header, path)
        except MeshError as error:
            loose = _loose(text, header)
            if loose is None:
                raise error from None
            return loose
    loose = _loose(text, header)
    if loose is None:
        raise _error(path, f"the file ends within its {header.vertices} vertices and {header.faces} faces")
    return loose


def _by_lines(text: Statements, header: _Header, path: str) -> tuple[_Rows, _Rows]:
    vertices = _lines_of(text, header.row, header.vertices, "vertices", path)
    need = 5 if header.texture else 3
    for row in np.flatnonzero(vertices.counts < need):
        expected = "x y z … s t" if header.texture else "x y z"
        message = f"vertex {row + 1} has {vertices.counts[row]} numbers (expected {expected})"
        raise _error(path, message, int(vertices.lines[row]))
    faces = _lines_of(text, header.row + header.vertices, header.faces, "faces", path)
    size = faces.flat[faces.start[:-1]]
    for row in np.flatnonzero(~((size >= 0) & (np.floor(size) == size) & (size < faces.counts))):
        shown = " ".join(text.words(header.row + header.vertices + int(row)))[:60]
        message = f"face {row + 1} is {shown!r} (expected a count and that many vertex numbers)"
        raise _error(path, message, int(faces.lines[row]))
    return vertices, faces


def _lines_of(text: Statements, row: int, count: int, what: str, path: str) -> _Rows:
    rows = np.arange(row, min(row + count, text.count))
    start = offsets(text.sizes[rows])
    flat = parsed_floats(text.spans(rows, 0), int(start[-1]))
    if flat is None:
        name = {"vertices": "vertex", "faces": "face"}[what]
        for bad, words in bad_rows(text, rows.tolist(), 0, int(text.sizes[rows].max())):
            found = f"{name} {bad - row + 1} is {' '.join(words)[:60]!r} (expected numbers)"
            raise _error(path, found, text.line(bad))
        raise _error(path, f"the {what} are no numbers")
    if len(rows) < count:
        raise _error(path, f"the file ends after {len(rows)} of {count} {what}")
    return _Rows(flat, start, text.lines(rows), text.first[rows])


def _loose(text: Statements, header: _Header) -> tuple[_Rows, _Rows] | None:
    """The numbers one after the other; faces have no colours then. None where they do not come out."""
    count = len(text.start) - header.word
    width = 3 + 3 * header.normals + 4 * header.colored + 2 * header.texture
    if count < header.vertices * width:
        return None
    flat = parsed_floats(text.text[text.start[header.word] :] if count else b"", count)
    if flat is None:
        return None
    starts = [header.vertices * width]
    for _ in range(min(header.faces, count)):
        if starts[-1] >= count or not 0 <= np.floor(flat[starts[-1]]) == flat[starts[-1]]:
            return None
        starts.append(starts[-1] + 1 + int(min(flat[starts[-1]], count)))
    if len(starts) != header.faces + 1 or starts[-1] != count:
        return None
    vertex_start = width * np.arange(header.vertices + 1, dtype=np.int64)
    face_start = np.array(starts, np.int64)
    rows = []
    for start in (vertex_start, face_start):
        words = header.word + start[:-1]
        lines = 1 + np.searchsorted(text.line_ends, text.start[words])
        rows.append(_Rows(flat, start, lines, words))
    return rows[0], rows[1]


def _corners(text: Statements, faces: _Rows, header: _Header, path: str) -> tuple[IntArray, IntArray]:
    """Offsets (F+1,) and vertex numbers (C,) of the faces."""
    size = faces.flat[faces.start[:-1]].astype(np.int64)
    start = offsets(size)
    row, rank = segments(start)
    place = faces.start[row] + 1 + rank
    named = faces.flat[place]
    outside: BoolArray = ~((named >= 0) & (named < header.vertices))
    outside |= np.floor(named) != named

    def written(corner: int) -> str:
        return text.word(int(faces.first_word[row[corner]] + 1 + rank[corner]))

    found = strange_corners(outside, start, written, f"0 to {header.vertices - 1}", faces.lines)
    raise_problems([Problem(message, path, line) for message, line in found], path)
    return start, named.astype(np.int64)


def _vertex_colors(text: Statements, vertices: _Rows, header: _Header) -> Float32Array | None:
    """Linear colours (V, 3), the three or four numbers between normals and texture coordinates."""
    first = 3 + 3 * header.normals
    spare = vertices.counts - first - 2 * header.texture
    if not header.colored or not len(spare) or spare.min() < 3:
        return None
    columns = first + np.arange(3)
    points = bool(_with_point(text, vertices.first_word[:, None] + columns).any())
    return linear_from_srgb(_scaled(vertices.columns(columns), np.full(len(spare), points)))


def _face_colors(text: Statements, faces: _Rows) -> Float32Array | None:
    """Linear colours (F, 3) from three or four numbers behind the corners, white without them.

    A single number there is a row of a colour map that no file holds.
    """
    size = faces.flat[faces.start[:-1]].astype(np.int64)
    colored = np.flatnonzero(faces.counts - 1 - size >= 3)
    if not len(colored):
        return None
    columns = 1 + size[colored, None] + np.arange(3)
    given = faces.flat[faces.start[colored, None] + columns]
    points: BoolArray = np.logical_or.reduce(_with_point(text, faces.first_word[colored, None] + columns), 1)
    result = np.ones((len(size), 3), np.float32)
    result[colored] = linear_from_srgb(_scaled(given, points))
    return result


def _scaled(given: FloatArray, fractions: BoolArray) -> FloatArray:
    """Colours (n, 3) from 0 to 1; rows that are no `fractions` (n,) are 0 to 255 if any of them says so."""
    whole = ~fractions
    if given[whole].max(initial=0.0) <= 1:
        return given
    return np.where(whole[:, None], given / 255, given)


def _with_point(text: Statements, words: IntArray) -> BoolArray:
    """Which words are written with a decimal point."""
    points = np.flatnonzero(text.letters == ord("."))
    before = np.searchsorted(points, text.start[words])
    result: BoolArray = np.searchsorted(points, text.end[words]) > before
    return result
