"""STL: text and binary, every facet a face of its own vertices.

Colours in the two spare bytes of binary facets, sRGB of five bits a channel: Magics writes them when the
header holds `COLOR=` (red lowest, a set top bit for the colour of the header), VisCAM and SolidView
otherwise (blue lowest, a set top bit for colours that count). Normals are passed over: the winding
tells them, and files that lie about them are many.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.mesh.colors import linear_from_srgb
from quiltcli.formats.mesh.mesh import PolygonMesh, raise_problems
from quiltcli.formats.mesh.words import bad_rows, parsed_floats, plain_text, statements
from quiltcli.geometry import Float32Array, IntArray, offsets

_HEADER = 80
_FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("spare", "<u2")])
_SOLID = re.compile(rb"[ \t]*(end[ \t]*)?solid\b[^\n]*")
_LEADS = re.compile(rb"[ \t](?=(vertex|facet|outer|endloop|endfacet)\b)")
_WORDS = (b"vertex", b"outer", b"endloop", b"facet", b"endfacet")


def read_stl(data: bytes, path: Path) -> PolygonMesh:
    """Read an STL file's bytes.

    Raises:
        MeshError: what is wrong, with its line in a text file.
    """
    return _text(data, path) if _is_text(data) else _binary(data, path)


def _is_text(data: bytes) -> bool:
    """Whether the file is text; many binary ones begin with the word `solid` as well."""
    if _HEADER + 4 + _FACET.itemsize * _count(data) == len(data):
        return False
    text = plain_text(data[:4000]).lower()
    return b"\0" not in text and (b"facet" in text or text.lstrip().startswith(b"solid"))


def _count(data: bytes) -> int:
    """Number of facets that a binary file announces, -1 where it is too short to."""
    return int.from_bytes(data[_HEADER : _HEADER + 4], "little") if len(data) >= _HEADER + 4 else -1


def _binary(data: bytes, path: Path) -> PolygonMesh:
    count, begin = _count(data), _HEADER + 4
    if count < 0 or (data[:begin].isascii() and data[:begin].decode().replace("\n", " ").isprintable()):
        found = repr(data.partition(b"\n")[0][:20].decode("latin-1"))
        expected = f"text that begins with solid, or a binary header of {begin} bytes"
        raise MeshError(Problem(f"found {found} (expected {expected})", str(path)))
    need = begin + count * _FACET.itemsize
    if need > len(data):
        raise MeshError(
            Problem(f"truncated: {count} triangles need {need} bytes, {len(data)} are there", str(path))
        )
    facets = np.frombuffer(data, _FACET, count, begin)
    vertices = facets["vertices"].reshape(-1, 3).astype(np.float64)
    colors = _colors(facets["spare"].astype(np.int64), data[:_HEADER])
    return _mesh(vertices, np.full(count, 3), np.zeros(count, np.int64), path, colors)


def _colors(spare: IntArray, header: bytes) -> Float32Array | None:
    """Linear colours (F, 3) of the facets, or None."""
    low, middle, high = (spare >> shift & 31 for shift in (0, 5, 10))
    top = spare >> 15 == 1
    _, mark, rest = header.partition(b"COLOR=")
    if mark and len(rest) >= 3:
        own = np.stack((low, middle, high), axis=1) / 31
        return linear_from_srgb(np.where(top[:, None], np.array(list(rest[:3])) / 255, own))
    # Other programs keep other things there: only a file that marks whatever is not zero has colours.
    if not top.any() or (spare[~top] != 0).any():
        return None
    return linear_from_srgb(np.where(top[:, None], np.stack((high, middle, low), axis=1) / 31, 1.0))


def _text(data: bytes, path: Path) -> PolygonMesh:
    original = plain_text(data)
    body = _without_names(original.lower())
    text = statements(body, original)
    if len(text.led_by(b"vertex")) < body.count(b"vertex"):
        # Loops share lines with what stands about them.
        text = statements(_LEADS.sub(b"\n", body), original)
    led = {word: text.led_by(word) for word in _WORDS}
    rows = led[b"vertex"]
    sizes = text.sizes[rows] - 1
    flat = parsed_floats(text.spans(rows, 1), int(sizes.sum()))
    if flat is None or (sizes < 3).any():
        problems = [
            Problem(f"found {' '.join(words)!r} (expected numbers)", str(path), text.line(row))
            for row, words in bad_rows(text, rows.tolist(), 1, 3)
        ]
        problems += [
            Problem(
                f"vertex with {sizes[k]} coordinates (expected x y z)", str(path), text.line(int(rows[k]))
            )
            for k in np.flatnonzero(sizes < 3)
        ]
        raise_problems(problems or [Problem("the vertices are no numbers", str(path))], str(path))
    assert flat is not None
    start = offsets(sizes)
    vertices = flat[start[:-1, None] + np.arange(3)].reshape(-1, 3)
    vertex_lines = text.lines(rows)
    counts, lines = _loops(rows, led, vertex_lines)
    problems = [
        Problem(f"facet {k + 1} has {counts[k]} vertices (expected 3)", str(path), int(lines[k]))
        for k in np.flatnonzero(counts < 3)
    ]
    raise_problems(problems, str(path))
    return _mesh(vertices, counts, lines, path, None, vertex_lines)


def _without_names(text: bytes) -> bytes:
    """The text with the lines of `solid` and `endsolid` blank: names may be anything."""
    result = bytearray(text)
    place = text.find(b"solid")
    while place >= 0:
        begin = text.rfind(b"\n", 0, place) + 1
        end = text.find(b"\n", place)
        end = len(text) if end < 0 else end
        if _SOLID.fullmatch(text, begin, end):
            result[begin:end] = b" " * (end - begin)
        place = text.find(b"solid", end)
    return bytes(result)


def _loops(vertices: IntArray, led: dict[bytes, IntArray], lines: IntArray) -> tuple[IntArray, IntArray]:
    """How many vertices each facet has, and the line of its first: a loop, or what parts one."""
    marks = np.sort(np.concatenate((led[b"outer"], led[b"facet"], led[b"endloop"], led[b"endfacet"])))
    piece = np.searchsorted(marks, vertices)
    _, first, counts = np.unique(piece, return_index=True, return_counts=True)
    if not len(marks) and len(vertices) % 3 == 0:
        first, counts = np.arange(0, len(vertices), 3), np.full(len(vertices) // 3, 3)
    return counts.astype(np.int64), lines[first]


def _mesh(
    vertices: NDArray[np.float64],
    counts: IntArray,
    lines: IntArray,
    path: Path,
    colors: Float32Array | None,
    vertex_lines: IntArray | None = None,
) -> PolygonMesh:
    start = offsets(counts)
    return PolygonMesh(
        vertices=vertices,
        corner_start=start,
        corners=np.arange(len(vertices)),
        uv=None,
        names=("",) * len(counts),
        lines=lines,
        path=str(path),
        colors=None if colors is None else np.repeat(colors, counts, axis=0),
        vertex_lines=vertex_lines,
    )
