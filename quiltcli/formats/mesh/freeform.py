"""Free-form surfaces of OBJ files: one Bézier or B-spline patch, rational or not.

Statement forms follow the Wavefront "Object Files" appendix B1: `v x y z [w]`, `cstype`, `deg`, `surf`,
`parm`, `end`. Control points run along u first. Trimmed surfaces, holes and other bases are refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import FloatArray

_BASES = ("bezier", "bspline")
_TRIMMED = ("trim", "hole", "scrv", "sp")


@dataclass(frozen=True)
class FreeformPatch:
    """A B-spline patch.

    Attributes:
        points: (rows, columns, 3) control points, u along the rows, in the file's units.
        weights: (rows, columns).
        degree: along u and along v.
        knots: of u and of v.
        ranges: first and last u, and v, of the surface.
    """

    points: FloatArray
    weights: FloatArray
    degree: tuple[int, int]
    knots: tuple[FloatArray, FloatArray]
    ranges: tuple[tuple[float, float], tuple[float, float]]


@dataclass
class _Found:
    """What has been read so far; `lines` says where."""

    path: str
    vertices: list[list[float]] = field(default_factory=list)
    basis: str = ""
    rational: bool = False
    degree: tuple[int, int] | None = None
    surface: list[str] | None = None
    vertices_then: int = 0
    parameters: dict[str, list[float]] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)

    def wrong(self, message: str, line: int = 0) -> DisplayError:
        return DisplayError(Problem(message, self.path, line))


def read_freeform(path: Path) -> FreeformPatch:
    """Read the one free-form surface of an OBJ file.

    Raises:
        DisplayError: there is none or several, or something of it cannot be understood.
    """
    found = _Found(str(path))
    data = read_input(path, DisplayError, "a mesh").decode("utf-8", "replace")
    for line, words in _statements(data):
        _read(found, words, line)
    if found.surface is None:
        raise found.wrong("has no free-form surface (expected cstype, deg, surf, parm and end)")
    return _patch(found)


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and words of statements; a backslash at its end joins a line with the next."""
    words: list[str] = []
    first = 0
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0].rstrip()
        first = first or number
        words += bare.removesuffix("\\").split()
        if bare.endswith("\\"):
            continue
        if words:
            yield first, words
        words, first = [], 0


def _read(found: _Found, words: list[str], line: int) -> None:
    """One statement."""
    kind, rest = words[0], words[1:]
    if kind == "v":
        found.vertices.append(_numbers(found, rest, 3, line))
    elif kind == "cstype":
        found.rational = rest[:1] == ["rat"]
        found.basis = rest[-1] if rest else ""
        if found.basis not in _BASES:
            raise found.wrong(f"cstype is {' '.join(rest)!r} (expected {' or '.join(_BASES)})", line)
    elif kind == "deg":
        degrees = _numbers(found, rest, 2, line)
        if any(not (1 <= value <= 9 and value == int(value)) for value in degrees[:2]):
            raise found.wrong(f"deg is {' '.join(rest)} (expected two whole numbers from 1 to 9)", line)
        found.degree = int(degrees[0]), int(degrees[1])
    elif kind == "surf":
        if found.surface is not None:
            words_ = f"has a second surface, the first is in line {found.lines['surf']} (expected one)"
            raise found.wrong(words_, line)
        found.surface, found.vertices_then = rest, len(found.vertices)
    elif kind == "parm" and rest[:1] in (["u"], ["v"]):
        found.parameters[rest[0]] = _numbers(found, rest[1:], 2, line)
        kind = f"parm {rest[0]}"
    elif kind in _TRIMMED:
        raise found.wrong(f"has {kind}: the surface is cut (expected a whole one)", line)
    found.lines[kind] = line


def _numbers(found: _Found, words: list[str], least: int, line: int) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) < least or not all(map(math.isfinite, numbers)):
        raise found.wrong(f"expected {least} numbers or more, got {' '.join(words)[:40]!r}", line)
    return numbers


def _patch(found: _Found) -> FreeformPatch:
    """The surface of what has been read."""
    line = found.lines["surf"]
    if found.degree is None or not found.basis:
        raise found.wrong("the surface has no cstype or no deg before it", line)
    missing = [name for name in ("u", "v") if name not in found.parameters]
    if missing:
        raise found.wrong(f"the surface has no parm {missing[0]}", line)
    assert found.surface is not None
    ends = _numbers(found, found.surface[:4], 4, line)
    knots, counts = [], []
    for axis, name in enumerate("uv"):
        given, degree = found.parameters[name], found.degree[axis]
        where = found.lines[f"parm {name}"]
        if given != sorted(given):
            raise found.wrong(f"parm {name} descends (expected numbers that never do)", where)
        full = _bezier_knots(given, degree) if found.basis == "bezier" else given
        if len(full) < 2 * (degree + 1):
            least = 2 if found.basis == "bezier" else 2 * (degree + 1)
            raise found.wrong(f"parm {name} has {len(given)} numbers (expected {least} or more)", where)
        knots.append(np.array(full))
        counts.append(len(full) - degree - 1)
        first, last = full[degree], full[-degree - 1]
        if not first <= ends[2 * axis] < ends[2 * axis + 1] <= last:
            got = f"{ends[2 * axis]:g} to {ends[2 * axis + 1]:g}"
            raise found.wrong(
                f"the surface's {name} is {got} (expected a range in {first:g} to {last:g})", line
            )
    corners = _controls(found, counts, line)
    points = corners[:, :3].reshape(counts[1], counts[0], 3)
    weights = corners[:, 3].reshape(counts[1], counts[0])
    ranges = (ends[0], ends[1]), (ends[2], ends[3])
    return FreeformPatch(points, weights, found.degree, (knots[0], knots[1]), ranges)


def _bezier_knots(breaks: list[float], degree: int) -> list[float]:
    """The knots of Bézier pieces that end at these parameters."""
    return [breaks[0], *(value for value in breaks for _ in range(degree)), breaks[-1]]


def _controls(found: _Found, counts: list[int], line: int) -> FloatArray:
    """Control points (n, 4) with their weights."""
    assert found.surface is not None
    words = found.surface[4:]
    if len(words) != counts[0] * counts[1]:
        expected = f"{counts[0]} × {counts[1]} = {counts[0] * counts[1]} by its parm and deg"
        raise found.wrong(f"the surface has {len(words)} control points (expected {expected})", line)
    result = np.ones((len(words), 4))
    for k, word in enumerate(words):
        text = word.split("/")[0]
        number = int(text) if text.lstrip("+-").isdigit() else 0
        index = number - 1 if number > 0 else found.vertices_then + number
        if number == 0 or not 0 <= index < len(found.vertices):
            raise found.wrong(f"has no vertex {word!r} (there are {len(found.vertices)})", line)
        vertex = found.vertices[index]
        result[k, :3] = vertex[:3]
        if found.rational and len(vertex) > 3:
            result[k, 3] = vertex[3]
    if not (result[:, 3] > 0).all():
        raise found.wrong(f"has the weight {result[:, 3].min():g} (expected weights above 0)", line)
    return result
