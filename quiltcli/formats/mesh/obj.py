"""Wavefront OBJ: the polygon statements `v`, `vt`, `f`, and names from `o` and `g`.

Everything else (normals, materials, smoothing groups, lines, curves) says nothing about a display
and is passed over. Statement forms follow the Wavefront "Object Files" appendix B1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from quiltcli.formats.mesh.mesh import MeshBuilder, one_face_groups


def read_obj(text: str, builder: MeshBuilder) -> None:
    """Read an OBJ file's `text` into `builder`, noting every problem with its line."""
    texture: list[tuple[float, float]] = []
    groups: list[str] = []
    group = ""
    for line, words in _statements(text):
        keyword, values = words[0], words[1:]
        if keyword == "v":
            _vertex(values, line, builder)
        elif keyword == "vt":
            texture.append(_texture(values, line, builder))
        elif keyword == "f":
            _face(values, line, texture, builder)
            groups.append(group)
        elif keyword in ("o", "g"):
            group = " ".join(values)
    builder.names = one_face_groups(groups)


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield (line, words) of every statement, joining lines that end in a backslash."""
    pending: list[str] = []
    first = 1
    for line, raw in enumerate(text.splitlines(), 1):
        if not pending:
            first = line
        body = raw.split("#", 1)[0].rstrip()
        if body.endswith("\\"):
            pending += body[:-1].split() or [""]
            continue
        words = [word for word in pending + body.split() if word]
        pending = []
        if words:
            yield first, words
    if any(pending):
        yield first, [word for word in pending if word]


def _vertex(values: Sequence[str], line: int, builder: MeshBuilder) -> None:
    """`v x y z [w | r g b]`; the weight is for curves and colours say nothing about a display."""
    position = _numbers(values[:3], line, builder)
    if position is not None and len(position) < 3:
        builder.problem(f"vertex with {len(values)} coordinates (expected x y z)", line)
        position = None
    # A bad vertex still takes its number, or every face after it would be called wrong as well.
    builder.add_vertex(position or (0.0, 0.0, 0.0), line)


def _texture(values: Sequence[str], line: int, builder: MeshBuilder) -> tuple[float, float]:
    """`vt u [v [w]]`."""
    pair = _numbers(values[:2], line, builder)
    if pair is not None and not pair:
        builder.problem("texture vertex without coordinates (expected u v)", line)
    u, v = (*(pair or ()), 0.0, 0.0)[:2]
    return u, v


def _face(
    values: Sequence[str], line: int, texture: Sequence[tuple[float, float]], builder: MeshBuilder
) -> None:
    """`f a b c …`, a corner being `v`, `v/vt`, `v//vn` or `v/vt/vn`, negative counting back."""
    corners: list[int] = []
    pairs: list[tuple[float, float]] = []
    for word in values:
        parts = word.split("/")
        vertex = _index(parts[0], len(builder.vertices), word, line, builder)
        corners.append(0 if vertex is None else vertex)
        if len(parts) > 1 and parts[1]:
            place = _index(parts[1], len(texture), word, line, builder)
            if place is not None and place >= len(texture):
                builder.problem(
                    f"face {len(builder.faces) + 1} names texture vertex {place + 1} "
                    f"(expected 1 to {len(texture)})",
                    line,
                )
            elif place is not None:
                pairs.append(texture[place])
    builder.add_face(corners, line, pairs if pairs and len(pairs) == len(corners) else None)


def _index(word: str, count: int, corner: str, line: int, builder: MeshBuilder) -> int | None:
    """0-based index of a 1-based or negative OBJ index; None, and a problem, where it is neither."""
    face = len(builder.faces) + 1
    try:
        number = int(word)
    except ValueError:
        builder.problem(f"face {face} has the corner {corner!r} (expected v, v/vt, v//vn or v/vt/vn)", line)
        return None
    if number == 0:
        builder.problem(f"face {face} names vertex 0 (numbers start at 1, or at -1 from the end)", line)
        return None
    if -number > count:
        builder.problem(f"face {face} names vertex {number}, but only {count} come before it", line)
        return None
    return number - 1 if number > 0 else count + number


def _numbers(words: Sequence[str], line: int, builder: MeshBuilder) -> tuple[float, ...] | None:
    try:
        return tuple(map(float, words))
    except ValueError:
        builder.problem(f"found {' '.join(words)!r} (expected numbers)", line)
        return None
