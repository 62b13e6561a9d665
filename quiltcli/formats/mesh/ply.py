"""Stanford PLY: text and both binary byte orders, faces of any mixture of sizes.

Texture coordinates are taken from a list on the faces (`texcoord`, two numbers a corner, the form
MeshLab writes) or from the vertices (`s t`, `u v`, `texture_u texture_v`), normals from the vertices
(`nx ny nz`), colours from vertices or else faces (`red green blue`): integers span 0 to their largest,
fractions 0 to 1, sRGB both. Triangle strips become triangles. Other elements and properties are
passed over.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.mesh.colors import linear_from_srgb
from quiltcli.formats.mesh.mesh import PolygonMesh, raise_problems, strange_corners
from quiltcli.formats.mesh.mtl import MeshMaterial, MeshTexture, place_of
from quiltcli.formats.mesh.ply_data import Element, List, read_elements
from quiltcli.formats.mesh.ply_header import StopReadingError, read_header
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, segments

_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_CORNERS = ("vertex_indices", "vertex_index")
_LARGEST = {"b": 255, "B": 255, "h": 65535, "H": 65535}
Faces: TypeAlias = tuple[IntArray, NDArray[Any], IntArray]


def read_ply(data: bytes, path: Path) -> PolygonMesh:
    """Read a PLY file's bytes.

    Raises:
        MeshError: what is wrong, with its line or byte.
    """
    try:
        header = read_header(data)
        elements = {element.name: element for element in read_elements(data, header)}
        return _mesh(elements, header.texture, bool(header.order), path)
    except StopReadingError as stop:
        raise MeshError(Problem(str(stop), str(path), stop.line)) from None


def _mesh(elements: dict[str, Element], texture: str, binary: bool, path: Path) -> PolygonMesh:
    vertex, face = elements.get("vertex"), elements.get("face")
    vertices = _positions(vertex)
    if face is not None and not any(name in face.lists for name in _CORNERS):
        raise StopReadingError(f"the faces have no list {_CORNERS[0]} or {_CORNERS[1]}")
    start, named, lines = _joined(_faces(face), _strips(elements.get("tristrips")))
    corners = _checked(named, start, lines, len(vertices), path)
    face_uv = _face_uv(face, start, corners)
    uv = _table(vertex, _UV_NAMES)[0] if face_uv is None else face_uv
    colors, own_colors = _colors(vertex, face, start, corners)
    count = len(start) - 1
    return PolygonMesh(
        vertices=vertices,
        corner_start=start,
        corners=corners,
        uv=uv if uv is None or face_uv is not None else uv[corners],
        names=("",) * count,
        lines=lines,
        path=str(path),
        normals=_corner_normals(vertex, corners),
        colors=colors,
        variant=_variant(face_uv, start if own_colors else None),
        material=np.zeros(count, np.int64) if texture else None,
        materials=(_textured(texture, path),) if texture else (),
        vertex_lines=None if vertex is None or vertex.lines is None else vertex.lines,
        single=not binary and vertex is not None and vertex.codes.get("x") == "f",
    )


def _textured(name: str, path: Path) -> MeshMaterial:
    """The material of a `comment TextureFile`."""
    texture = MeshTexture("color", name, place_of(path.parent, name), statement="TextureFile")
    return MeshMaterial("", textures=(texture,))


def _positions(vertex: Element | None) -> FloatArray:
    there = {} if vertex is None else vertex.scalars
    if missing := [name for name in "xyz" if name not in there]:
        raise StopReadingError(f"the vertices have no property {', '.join(missing)} (expected x, y and z)")
    if vertex is not None and (twice := [name for name in "xyz" if name in vertex.doubled]):
        raise StopReadingError(f"the vertices have the property {twice[0]} twice (expected x, y and z once)")
    return np.stack([there[name].astype(np.float64) for name in "xyz"], axis=1)


def _faces(face: Element | None) -> Faces:
    """Offsets, vertex numbers as written, and lines of the faces."""
    if face is None:
        return np.zeros(1, np.int64), np.zeros(0), np.zeros(0, np.int64)
    name = next(name for name in _CORNERS if name in face.lists)
    if name in face.doubled:
        raise StopReadingError(f"the faces have the property {name} twice (expected it once)")
    found = face.lists[name]
    return found.start, found.values, _lines(face)


def _lines(element: Element) -> IntArray:
    return np.zeros(element.count, np.int64) if element.lines is None else element.lines


def _strips(element: Element | None) -> Faces:
    """The triangles of strips, which -1 parts; every other one is turned so that all face one way."""
    found = (
        None if element is None else next((element.lists[n] for n in _CORNERS if n in element.lists), None)
    )
    if element is None or found is None:
        return np.zeros(1, np.int64), np.zeros(0), np.zeros(0, np.int64)
    row, rank = segments(found.start)
    values, place = found.values, np.arange(len(found.values))
    # Where each strip, or the piece of it behind a -1, begins.
    begins = np.maximum.accumulate(np.where((rank == 0) | (np.roll(values, 1) == -1), place, 0))
    third = np.flatnonzero((place - begins >= 2) & (values != -1))
    third = third[(values[third - 1] != -1) & (values[third - 2] != -1)]
    odd = (third - begins[third]) % 2 == 1
    first, second = np.where(odd, third - 1, third - 2), np.where(odd, third - 2, third - 1)
    corners = values[np.stack((first, second, third), axis=1)]
    # Strips repeat vertices to turn round corners: such triangles are no faces.
    real = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    start = 3 * np.arange(np.count_nonzero(real) + 1, dtype=np.int64)
    return start, corners[real].ravel(), _lines(element)[row[third[real]]]


def _joined(faces: Faces, strips: Faces) -> Faces:
    if len(strips[0]) == 1:
        return faces
    start = np.concatenate((faces[0], faces[0][-1] + strips[0][1:]))
    return start, np.concatenate((faces[1], strips[1])), np.concatenate((faces[2], strips[2]))


def _checked(named: NDArray[Any], start: IntArray, lines: IntArray, count: int, path: Path) -> IntArray:
    """Vertex numbers (C,) that are there.

    Raises:
        MeshError: some are not.
    """
    outside: BoolArray = ~((named >= 0) & (named < count))  # true for NaN
    if named.dtype.kind == "f":
        outside |= np.floor(named) != named

    def written(corner: int) -> str:
        value = named[corner]
        return f"{value:.17g}" if named.dtype.kind == "f" else str(value)

    found = strange_corners(outside, start, written, f"0 to {count - 1}", lines)
    raise_problems([Problem(message, str(path), line) for message, line in found], str(path))
    return named.astype(np.int64)


def _table(
    element: Element | None, choices: tuple[tuple[str, ...], ...]
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """The columns of the first choice that is there, side by side, and their names."""
    if element is None:
        return None, ()
    for names in choices:
        if all(name in element.scalars for name in names):
            columns = [element.scalars[name].astype(np.float64) for name in names]
            return np.stack(columns, axis=1), names
    return None, ()


def _corner_normals(vertex: Element | None, corners: IntArray) -> FloatArray | None:
    normals, _ = _table(vertex, (("nx", "ny", "nz"),))
    return None if normals is None else normals[corners]


def _colors(
    vertex: Element | None, face: Element | None, start: IntArray, corners: IntArray
) -> tuple[Float32Array | None, bool]:
    """Linear colours (C, 3) of the corners, and whether they are the faces' own."""
    given = _linear(vertex)
    if given is not None:
        return given[corners], False
    given = _linear(face)
    if given is None:
        return None, False
    row, _ = segments(start)
    white = np.ones((len(start) - 1 - len(given), 3), np.float32)  # triangles of strips
    return np.concatenate((given, white))[row], True


def _linear(element: Element | None) -> Float32Array | None:
    colors, names = _table(element, _COLORS)
    if colors is None or element is None:
        return None
    code = element.codes[names[0]]
    scale = _LARGEST.get(code, 255)
    if code in "fd" and np.nan_to_num(colors).max(initial=0.0) <= 1:
        scale = 1
    return linear_from_srgb(colors / scale)


def _face_uv(face: Element | None, start: IntArray, corners: IntArray) -> FloatArray | None:
    """Texture coordinates (C, 2) from the faces' own lists, NaN where a list does not fit its face."""
    listed: List | None = None if face is None else face.lists.get("texcoord")
    if listed is None:
        return None
    counts, given = np.diff(start), np.diff(listed.start)
    fits = np.zeros(len(counts), np.bool_)
    fits[: len(given)] = given == 2 * counts[: len(given)]
    row, rank = segments(start)
    fits &= counts > 0
    if not fits.any():
        return None
    uv = np.full((len(corners), 2), np.nan)
    chosen = np.flatnonzero(fits[row])
    place = listed.start[row[chosen]] + 2 * rank[chosen]
    uv[chosen] = listed.values[place[:, None] + np.arange(2)]
    return uv


def _variant(face_uv: FloatArray | None, start: IntArray | None) -> IntArray | None:
    """Corners differ by texture coordinates of their own, and by faces that have a colour."""
    if start is not None:
        return segments(start)[0]
    if face_uv is None:
        return None
    pairs = np.ascontiguousarray(face_uv + 0.0).view(np.complex128).ravel()
    _, number = np.unique(pairs, return_inverse=True)
    return number.reshape(-1)
