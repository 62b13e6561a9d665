"""Wavefront OBJ: polygons with texture coordinates, normals, colours, materials and names.

Statement forms follow the Wavefront "Object Files" appendix B1: `v`, `vt`, `vn`, `f` (and its old form
`fo`), `o`, `g`, `usemtl`, `mtllib`. Smoothing groups, lines, points and curves are passed over. Colours
behind a position (`v x y z r g b`) are sRGB from 0 to 1, or from 0 to 255 where any is above 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.inputs import read_input
from quiltcli.formats.mesh.colors import linear_from_srgb
from quiltcli.formats.mesh.mesh import PolygonMesh, one_face_groups, raise_problems
from quiltcli.formats.mesh.mtl import MeshMaterial, is_file, material_named, read_mtl, without_comment
from quiltcli.formats.mesh.words import (
    Statements,
    bad_rows,
    blanked,
    float_or_none,
    parsed_floats,
    parsed_integers,
    plain_text,
    statements,
)
from quiltcli.geometry import Float32Array, FloatArray, IntArray, offsets, segments

_CORNER = re.compile(r"[-+]?\d+(/([-+]?\d+)?){0,2}", re.ASCII)
_SLASH, _BLANK = 47, 32


@dataclass
class _File:
    """An OBJ file while it is read."""

    text: Statements
    named: bytes  # the text with its comments, which may be parts of names
    path: str
    problems: list[Problem] = field(default_factory=list)
    flaws: list[Problem] = field(default_factory=list)

    def problem(self, message: str, line: int) -> None:
        self.problems.append(Problem(message, self.path, line))


@dataclass(frozen=True)
class _Corners:
    """The corners of all faces: 0-based rows of the tables, -1 for none.

    Attributes:
        rows: (F,) statements of the faces.
        start: (F+1,) offsets.
        vertex: (C,) rows of the vertices.
        texture: (C,) rows of the texture vertices.
        normal: (C,) rows of the normals.
        lines: (F,) lines.
    """

    rows: IntArray
    start: IntArray
    vertex: IntArray
    texture: IntArray
    normal: IntArray
    lines: IntArray


def read_obj(data: bytes, path: Path) -> PolygonMesh:
    """Read an OBJ file's bytes, and the material files it names from beside `path`.

    Raises:
        MeshError: statements that make no sense, each with its line.
    """
    original = plain_text(data)
    joined = blanked(original, joins=True)
    file = _File(statements(joined, original), original, str(path))
    places = {key: file.text.led_by(key.encode()) for key in ("v", "vt", "vn")}
    vertices, colors = _vertices(file, places["v"])
    texture = _texture_vertices(file, places["vt"])
    normals = _normals(file, places["vn"])
    corners = _corners(file, places)
    raise_problems(sorted(file.problems, key=lambda problem: problem.line), file.path)

    materials, material, missing = _materials(file, corners.rows, path)
    return PolygonMesh(
        vertices=vertices,
        corner_start=corners.start,
        corners=corners.vertex,
        uv=_whole_faces(_picked(texture, corners.texture), corners.start),
        names=_names(file, corners.rows),
        lines=corners.lines,
        path=file.path,
        normals=_picked(normals, corners.normal),
        colors=None if colors is None else colors[corners.vertex],
        variant=_variant(corners, len(normals)),
        material=material,
        materials=materials,
        missing=missing,
        vertex_lines=file.text.lines(places["v"]),
        flaws=tuple(file.flaws),
    )


def _vertices(file: _File, rows: IntArray) -> tuple[FloatArray, Float32Array | None]:
    """`v x y z [w | r g b]`: positions (V, 3) and, where any has one, colours (V, 3)."""
    flat, start = _numbers(file, rows, 3)
    counts = np.diff(start)
    for place in np.flatnonzero(counts < 3):
        found = f"vertex with {counts[place]} coordinates (expected x y z)"
        file.problem(found, file.text.line(int(rows[place])))
    colored = counts >= 6
    colors = None
    if colored.any():
        given = _columns(flat, start, (3, 4, 5))
        scale = 255.0 if np.nan_to_num(given[colored]).max() > 1 else 1.0
        colors = np.ones((len(rows), 3), np.float32)
        colors[colored] = linear_from_srgb(given[colored] / scale)
    return _columns(flat, start, (0, 1, 2)), colors


def _texture_vertices(file: _File, rows: IntArray) -> FloatArray:
    """`vt u [v [w]]` as (N, 2)."""
    flat, start = _numbers(file, rows, 2)
    for place in np.flatnonzero(np.diff(start) == 0):
        line = file.text.line(int(rows[place]))
        file.problem("texture vertex without coordinates (expected u v)", line)
    return np.nan_to_num(_columns(flat, start, (0, 1)))


def _normals(file: _File, rows: IntArray) -> FloatArray:
    """`vn x y z` as (N, 3); a normal that is none is NaN."""
    flat, start = _numbers(file, rows, 0)
    return _columns(flat, start, (0, 1, 2))


def _columns(flat: FloatArray, start: IntArray, columns: tuple[int, ...]) -> FloatArray:
    """These columns of ragged rows, NaN where a row is shorter."""
    counts = np.diff(start)
    if not len(counts):
        return np.zeros((0, len(columns)))
    if (counts == counts[0]).all() and counts[0] > columns[-1]:
        return np.ascontiguousarray(flat.reshape(-1, counts[0])[:, list(columns)])
    place = start[:-1, None] + np.array(columns)
    inside = np.array(columns) < counts[:, None]
    found = np.append(flat, np.nan)
    result: FloatArray = found[np.where(inside, place, len(flat))]
    return result


def _numbers(file: _File, rows: IntArray, need: int) -> tuple[FloatArray, IntArray]:
    """All numbers of these statements, and the offsets of the rows.

    The first `need` words must be numbers; whatever else is not a number ends its row.
    """
    start = offsets(file.text.sizes[rows] - 1)
    flat = parsed_floats(file.text.spans(rows, 1), int(start[-1]))
    if flat is not None:
        return flat, start
    for row, words in bad_rows(file.text, rows.tolist(), 1, need):
        file.problem(f"found {' '.join(words)!r} (expected numbers)", file.text.line(row))
    kept = [list(_leading(file.text.words(row)[1:])) for row in rows.tolist()]
    if file.problems:  # not to call a row of words too short as well
        kept = [(row + [0.0] * 3)[: max(len(row), 3)] for row in kept]
    return np.array([n for row in kept for n in row], np.float64), offsets(np.array([len(r) for r in kept]))


def _leading(words: list[str]) -> Iterator[float]:
    for word in words:
        number = float_or_none(word)
        if number is None:
            return
        yield number


def _corners(file: _File, places: Mapping[str, IntArray]) -> _Corners:
    """`f a b c …`, a corner being `v`, `v/vt`, `v//vn` or `v/vt/vn`, negative counting back."""
    text = file.text
    rows = np.sort(np.concatenate((text.led_by(b"f"), text.led_by(b"fo"))))
    start = offsets(text.sizes[rows] - 1)
    row, rank = segments(start)
    word = text.first[rows][row] + 1 + rank
    fields = _fields(file, rows, word)
    lines = text.lines(rows)
    if fields is None:
        for corner in np.flatnonzero([_CORNER.fullmatch(text.word(w)) is None for w in word.tolist()]):
            found = f"face {row[corner] + 1} has the corner {text.word(word[corner])!r}"
            file.problem(f"{found} (expected v, v/vt, v//vn or v/vt/vn)", int(lines[row[corner]]))
        fields = np.ones((len(word), 3), np.int64)
    # How many of each table stand before each face: what negative numbers count back from.
    before = {key: np.searchsorted(places[key], rows)[row] for key in places}
    absolute = [
        np.where(fields[:, k] < 0, fields[:, k] + before[key], fields[:, k] - 1)
        for k, key in enumerate(places)
    ]
    counts = [len(places[key]) for key in places]
    if not file.problems:
        _check_vertices(file, fields[:, 0], absolute[0], before["v"], counts[0], (row, word, lines))
        _check_texture(file, fields[:, 1], absolute[1], counts[1], (row, lines))
    there = [
        np.where((fields[:, k] != 0) & (absolute[k] >= 0) & (absolute[k] < counts[k]), absolute[k], -1)
        for k in range(3)
    ]
    return _Corners(rows, start, there[0], there[1], there[2], lines)


def _fields(file: _File, rows: IntArray, word: IntArray) -> IntArray | None:
    """The numbers (C, 3) v, vt, vn of all corners, 0 where one is not given; None if a word is no corner.

    The slashes become blanks and all numbers are converted at once; where the slashes stood, and which
    of them had nothing behind them, tells what each number is.
    """
    text = file.text
    if not len(word):
        return np.zeros((0, 3), np.int64)
    slashes = np.flatnonzero(text.letters == _SLASH)
    owner = np.searchsorted(text.start[word], slashes, "right") - 1
    inside = (owner >= 0) & (slashes < text.end[word][owner])
    slashes, owner = slashes[inside], owner[inside]
    per_word = np.bincount(owner, minlength=len(word))
    if per_word.max() > 2 or (text.letters[text.start[word]] == _SLASH).any():
        return None
    field_of = np.arange(len(owner)) - offsets(per_word)[owner] + 1
    behind = text.letters[slashes + 1]
    filled = (behind != _SLASH) & (behind > _BLANK)
    count = int(np.count_nonzero(filled))
    numbers = parsed_integers(text.spans(rows, 1).replace(b"/", b" "), len(word) + count)
    if numbers is None:
        return None
    fields = np.zeros((len(word), 3), np.int64)
    # A word's first number comes after all numbers of the words before it.
    filled_before = offsets(np.bincount(owner[filled], minlength=len(word)))
    fields[:, 0] = numbers[np.arange(len(word)) + filled_before[:-1]]
    fields[owner[filled], field_of[filled]] = numbers[owner[filled] + 1 + np.arange(count)]
    return fields


def _check_vertices(
    file: _File,
    given: IntArray,
    found: IntArray,
    before: IntArray,
    count: int,
    where: tuple[IntArray, IntArray, IntArray],
) -> None:
    """Note corners whose vertex is not there."""
    row, word, lines = where
    for corner in np.flatnonzero((given == 0) | (found < 0) | (found >= count)):
        name = f"face {row[corner] + 1} names vertex"
        line = int(lines[row[corner]])
        # As written: a number beyond int64 is no longer what it was.
        written = file.text.word(word[corner]).partition("/")[0]
        if given[corner] == 0:
            file.problem(f"{name} 0 (numbers start at 1, or at -1 from the end)", line)
        elif written.startswith("-"):
            file.problem(f"{name} {written}, but only {before[corner]} come before it", line)
        else:
            file.problem(f"{name} {written} (expected 1 to {count})", line)


def _check_texture(
    file: _File, given: IntArray, found: IntArray, count: int, where: tuple[IntArray, IntArray]
) -> None:
    """Note corners whose texture vertex is not there: a display may be laid out by them."""
    row, lines = where
    for corner in np.flatnonzero((given != 0) & ((found < 0) | (found >= count))):
        written = given[corner] if given[corner] < 0 else found[corner] + 1
        message = f"face {row[corner] + 1} names texture vertex {written} (expected 1 to {count})"
        file.flaws.append(Problem(message, file.path, int(lines[row[corner]])))


def _picked(table: FloatArray, rows: IntArray) -> FloatArray | None:
    """Rows of a table, NaN for -1; None when all are."""
    if not len(table) or not (rows >= 0).any():
        return None
    result: FloatArray = table[rows]
    result[rows < 0] = np.nan
    return result


def _whole_faces(uv: FloatArray | None, start: IntArray) -> FloatArray | None:
    """Texture coordinates of faces all of whose corners have some."""
    if uv is None or not np.isnan(uv).any():
        return uv
    row, _ = segments(start)
    lacking = np.bincount(row[np.isnan(uv[:, 0])], minlength=len(start) - 1) > 0
    uv[lacking[row]] = np.nan
    return None if lacking[row].all() else uv


def _variant(corners: _Corners, normals: int) -> IntArray | None:
    if not ((corners.texture >= 0).any() or (corners.normal >= 0).any()):
        return None
    return (corners.texture + 1) * (normals + 1) + corners.normal + 1


def _names(file: _File, faces: IntArray) -> tuple[str, ...]:
    """Names of faces from the `o` or `g` they stand under."""
    rows = np.sort(np.concatenate((file.text.led_by(b"o"), file.text.led_by(b"g"))))
    names = ["", *(without_comment(_rest(file, row)) for row in rows.tolist())]
    return one_face_groups(np.searchsorted(rows, faces), names)


def _rest(file: _File, row: int) -> str:
    """What follows a statement's keyword, up to the end of its line, comments included."""
    begin = int(file.text.end[file.text.first[row]])
    # Lines are joined in the text, but only the other one has the comments.
    end = file.text.text.index(b"\n", begin)
    return file.named[begin:end].replace(b"\\\n", b" ").decode("utf-8", errors="replace").strip()


def _materials(
    file: _File, faces: IntArray, path: Path
) -> tuple[tuple[MeshMaterial, ...], IntArray, tuple[str, ...]]:
    """The materials that faces are made of, their row for every face, and the files that are missing."""
    used = file.text.led_by(b"usemtl")
    found: dict[str, MeshMaterial] = {}
    missing: list[str] = []
    for row in file.text.led_by(b"mtllib").tolist():
        for name in _libraries(_rest(file, row), path.parent):
            try:
                place = path.parent / name.replace("\\", "/")
                found.update(read_mtl(read_input(place, MeshError), place.parent))
            except (MeshError, ValueError):
                missing.append(name)
    number: dict[str, int] = {}
    rows = [number.setdefault(_rest(file, row), len(number)) for row in used.tolist()]
    materials = tuple(
        material_named(found, name) or MeshMaterial(without_comment(name), defined=False) for name in number
    )
    of_face = np.array([-1, *rows], np.int64)[np.searchsorted(used, faces)]
    return materials, of_face, tuple(dict.fromkeys(missing))


def _libraries(rest: str, folder: Path) -> list[str]:
    """The files an `mtllib` names: one with blanks in its name, if there is such a one, or several."""
    whole = without_comment(rest)
    if is_file(folder / whole.replace("\\", "/")):
        return [whole]
    pieces = re.findall(r".+?\.mtl(?=\s|$)", whole, re.IGNORECASE)
    return [piece.strip() for piece in pieces] if "".join(pieces) == whole else whole.split()
