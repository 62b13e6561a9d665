"""Geomview OFF text files, with the prefixes ST, C and N for what vertices carry besides a position."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from quiltcli.formats.mesh.mesh import MeshBuilder

_HEADER = re.compile(r"^(ST)?C?N?OFF$")


def read_off(text: str, builder: MeshBuilder) -> None:
    """Read an OFF file's `text` into `builder`, noting every problem with its line."""
    rows = _rows(text)
    line, words = next(rows, (1, []))
    header = _HEADER.match(words[0]) if words else None
    if header is None:
        found = repr(words[0][:20]) if words else "an empty file"
        builder.problem(f"found {found} (expected OFF, COFF, NOFF or STOFF)", line)
        return
    words = words[1:]
    if words and words[0].upper() == "BINARY":
        builder.problem("binary OFF is not supported (expected the text form)", line)
        return
    if not words:
        line, words = next(rows, (line, []))
    counts = _whole(words[:2])
    if counts is None or len(counts) < 2 or min(counts) < 0:
        builder.problem(f"found {' '.join(words)!r} (expected the counts of vertices, faces and edges)", line)
        return
    has_uv = header.group(1) is not None
    texture = _vertices(rows, counts[0], has_uv, builder)
    if len(builder.vertices) == counts[0]:
        _faces(rows, counts[1], texture if has_uv else None, builder)


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield (line, words) of every line that holds something."""
    for line, raw in enumerate(text.splitlines(), 1):
        words = raw.split("#", 1)[0].split()
        if words:
            yield line, words


def _vertices(
    rows: Iterator[tuple[int, list[str]]], count: int, has_uv: bool, builder: MeshBuilder
) -> list[Sequence[float]]:
    """Read `count` vertices; their texture coordinates stand last on the line."""
    texture: list[Sequence[float]] = []
    for index in range(count):
        line, words = next(rows, (0, []))
        if not words:
            builder.problem(f"the file ends after {index} of {count} vertices")
            break
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            builder.problem(f"vertex {index + 1} is {' '.join(words)!r} (expected numbers)", line)
            numbers = [0.0] * 5
        if len(numbers) < (5 if has_uv else 3):
            expected = "x y z … s t" if has_uv else "x y z"
            builder.problem(f"vertex {index + 1} has {len(numbers)} numbers (expected {expected})", line)
            numbers = [0.0] * 5
        builder.add_vertex(numbers[:3], line)
        texture.append(numbers[-2:])
    return texture


def _faces(
    rows: Iterator[tuple[int, list[str]]],
    count: int,
    texture: Sequence[Sequence[float]] | None,
    builder: MeshBuilder,
) -> None:
    """Read `count` faces: the number of corners, the corners, then perhaps a colour."""
    for index in range(count):
        line, words = next(rows, (0, []))
        if not words:
            builder.problem(f"the file ends after {index} of {count} faces")
            return
        size = _whole(words[:1])
        corners = _whole(words[1 : 1 + size[0]]) if size and size[0] >= 0 else None
        if size is None or corners is None or len(corners) < size[0]:
            builder.problem(
                f"face {index + 1} is {' '.join(words)!r} (expected a count and that many vertex numbers)",
                line,
            )
            continue
        uv = None
        if texture is not None and all(0 <= corner < len(texture) for corner in corners):
            uv = [texture[corner] for corner in corners]
        builder.add_face(corners, line, uv)


def _whole(words: Sequence[str]) -> list[int] | None:
    try:
        return [int(word) for word in words]
    except ValueError:
        return None
