"""PLY as programs write it: any order of properties, any byte order, broken counts and corners."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.mesh import PolygonMesh, read_mesh
from quiltcli.formats.mesh.read import read_polygons

POINTS = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]
XYZ = "property float x\nproperty float y\nproperty float z\n"


def read(folder: Path, data: str | bytes) -> PolygonMesh:
    path = folder / "m.ply"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_polygons(path)


def head(*elements: str, kind: str = "ascii") -> str:
    return f"ply\nformat {kind} 1.0\n" + "".join(elements) + "end_header\n"


def vertex(more: str = "", count: int = 4) -> str:
    return f"element vertex {count}\n{XYZ}{more}"


def face(more: str = "", count: int = 1, kinds: str = "uchar int") -> str:
    return f"element face {count}\nproperty list {kinds} vertex_indices\n{more}"


def rows(*more: str) -> str:
    each = more or ("",) * 4
    return "".join(f"{x} {y} {z} {m}\n" for (x, y, z), m in zip(POINTS, each, strict=True))


def corners(mesh: PolygonMesh) -> list[list[int]]:
    return [part.tolist() for part in np.split(mesh.corners, mesh.corner_start[1:-1])]


def said(folder: Path, data: str | bytes) -> str:
    with pytest.raises(MeshError) as caught:
        read(folder, data)
    return str(caught.value).replace(f"{folder}/", "")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("sizes", [(3, 3), (3, 4), (4, 3)])
def test_properties_come_in_any_order(tmp_path: Path, order: str, sizes: tuple[int, int]) -> None:
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    text = head(
        "element camera 1\nproperty list uchar double view\nproperty char on\n",
        "element vertex 4\nproperty uchar red\nproperty double z\nproperty uchar green\nproperty short y\n"
        "property uchar blue\nproperty float x\n",
        "element face 2\nproperty float quality\nproperty list ushort float texcoord\n"
        "property list int ushort vertex_index\nproperty uchar flags\n",
        kind=kind,
    )  # fmt: skip
    data = text.encode() + struct.pack(order + "B2dB", 2, 1, 2, 3)
    data += b"".join(struct.pack(order + "BdBhBf", 255, z, 0, y, 0, x) for x, y, z in POINTS)
    for size in sizes:
        uv = [k / 8 for k in range(2 * size)]
        data += struct.pack(order + f"fH{2 * size}fi{size}HB", 0.5, 2 * size, *uv, size, *range(size), 7)
    mesh = read(tmp_path, data)
    assert mesh.vertices.tolist() == [list(point) for point in POINTS]
    assert corners(mesh) == [list(range(size)) for size in sizes]
    assert mesh.uv is not None
    assert mesh.uv.ravel().tolist() == [k / 8 for size in sizes for k in range(2 * size)]
    assert mesh.colors is not None
    assert (mesh.colors == [1, 0, 0]).all()


@pytest.mark.parametrize("ending", ["\r", "\r\n", "\n"])
def test_header_lines_end_in_any_way(tmp_path: Path, ending: str) -> None:
    text = head(vertex(), face(), kind="binary_little_endian").replace("\n", ending).encode()
    # A first float of 0x0a bytes looks like the other half of a line's end.
    data = text + struct.pack("<12f", *(c for p in POINTS for c in p)) + struct.pack("<B3i", 3, 0, 1, 2)
    assert read(tmp_path, data).vertices.tolist() == [list(point) for point in POINTS]
    odd = (
        text
        + b"\n"
        + struct.pack("<12f", *(c for p in POINTS for c in p))[1:]
        + struct.pack("<B3i", 3, 0, 1, 2)
    )
    assert 0 < read(tmp_path, odd).vertices[0, 0] < 1e-40


def test_text_may_have_blank_lines_and_words_to_spare(tmp_path: Path) -> None:
    text = head(vertex(), face()) + "\n" + rows("9", "", "8 7", "") + "\r\n4 0 1 2 3 5\n"
    assert corners(read(tmp_path, text)) == [[0, 1, 2, 3]]


def test_numbers_need_not_be_of_their_type(tmp_path: Path) -> None:
    color = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    mesh = read(tmp_path, head(vertex(color), face()) + rows(*["255.0 0.0 0"] * 4) + "3.0 0 1.0 2\n")
    assert corners(mesh) == [[0, 1, 2]]
    assert mesh.colors is not None
    assert (mesh.colors == [1, 0, 0]).all()


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("uchar", "51", 0.2),
        ("ushort", "13107", 0.2),
        ("float", "0.2", 0.2),
        ("int", "51", 0.2),
        ("double", "51", 0.2),
    ],
)
def test_colors_span_what_their_type_does(tmp_path: Path, kind: str, value: str, expected: float) -> None:
    color = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    mesh = read(tmp_path, head(vertex(color), face()) + rows(*[f"{value} 0 0"] * 4) + "3 0 1 2\n")
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[0], [((expected + 0.055) / 1.055) ** 2.4, 0, 0], rtol=1e-6)


def test_faces_have_colors_of_their_own(tmp_path: Path) -> None:
    color = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    mesh = read(tmp_path, head(vertex(), face(color, 2)) + rows() + "4 0 1 2 3 255 0 0\n3 0 2 1 0 255 0\n")
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1, 0, 0]] * 4 + [[0, 1, 0]] * 3
    assert mesh.variant is not None
    assert mesh.variant.tolist() == [0] * 4 + [1] * 3


def test_vertices_have_normals(tmp_path: Path) -> None:
    normal = "property float nx\nproperty float ny\nproperty float nz\n"
    mesh = read(tmp_path, head(vertex(normal), face()) + rows(*["0 0 1"] * 4) + "3 0 1 2\n")
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3


def test_properties_that_nobody_needs_may_be_there_twice(tmp_path: Path) -> None:
    text = head(vertex("property float nx\nproperty float nx\n"), face()) + rows(*["1 2"] * 4) + "3 0 1 2\n"
    assert corners(read(tmp_path, text)) == [[0, 1, 2]]


def test_elements_without_properties_take_no_rows(tmp_path: Path) -> None:
    for kind in ("ascii", "binary_little_endian"):
        text = head("element nothing 7\n", vertex(), "element none 2\n", face(), kind=kind)
        data = struct.pack("<12f", *(c for p in POINTS for c in p)) + struct.pack("<B3i", 3, 0, 1, 2)
        data = (rows() + "3 0 1 2\n").encode() if kind == "ascii" else data
        assert corners(read(tmp_path, text.encode() + data)) == [[0, 1, 2]]


def test_strips_become_triangles_that_face_one_way(tmp_path: Path) -> None:
    strips = "element tristrips 2\nproperty list int int vertex_indices\n"
    text = head(vertex(), face(), strips) + rows() + "3 0 1 2\n9 0 1 3 2 -1 0 1 1 2\n3 1 2 3\n"
    # 0 1 3 2 are two triangles, and 0 1 1 2 turn a corner without one.
    assert corners(read(tmp_path, text)) == [[0, 1, 2], [0, 1, 3], [3, 1, 2], [1, 2, 3]]
    assert read(tmp_path, text).lines.tolist() == [16, 17, 17, 18]


def test_a_texture_may_be_named_in_a_comment(tmp_path: Path) -> None:
    text = head("comment TextureFile my wood.png\n", vertex("property float s\nproperty float t\n"), face())
    mesh = read(tmp_path, text + rows(*["0 1"] * 4) + "3 0 1 2\n")
    (texture,) = mesh.materials[0].textures
    assert (texture.role, texture.path) == ("color", tmp_path / "my wood.png")
    assert mesh.material is not None
    assert mesh.material.tolist() == [0]


BINARY = head(vertex(), face(kinds="float float"), kind="binary_little_endian").encode()
DATA = struct.pack("<12f", *(c for p in POINTS for c in p))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30, -1.0, 1.5, 4.0])
def test_corners_that_name_no_vertex_are_told(tmp_path: Path, value: float) -> None:
    data = BINARY + DATA + struct.pack("<4f", 3, 0, 1, value)
    written = {1e30: f"{struct.unpack('<f', struct.pack('<f', 1e30))[0]:.17g}"}.get(value, f"{value:g}")
    assert said(tmp_path, data) == f"m.ply: face 1 names vertex {written} (expected 0 to 3)"


def test_corners_in_text_are_told_with_their_line(tmp_path: Path) -> None:
    text = head(vertex(), face(count=2)) + rows() + "3 0 1 2\n3 0 1 nan\n"
    assert said(tmp_path, text) == "m.ply:15: face 2 names vertex nan (expected 0 to 3)"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 2.5])
def test_counts_that_are_none_are_told(tmp_path: Path, value: float) -> None:
    data = BINARY + DATA + struct.pack("<4f", value, 0, 1, 2)
    assert (
        said(tmp_path, data)
        == f"m.ply: row 1 of face has a list of {value:g} numbers at byte {len(BINARY + DATA)}"
    )
    text = head(vertex(), face()) + rows() + f"{value} 0 1 2\n"
    assert (
        said(tmp_path, text)
        == f"m.ply:14: row 1 of face has a list of {value:g} numbers (expected a whole count)"
    )


BROKEN = {
    "digits": (head(vertex(), face()).replace("vertex 4", "vertex " + "9" * 5000), "m.ply:3: vertex has a count of 5000 digits (expected 18 at most)"),
    "many": (head(vertex(), face()).replace("vertex 4", "vertex 10000000000") + rows(), "m.ply: the file ends after 4 of 10000000000 rows of vertex"),
    "many bytes": (
        head(vertex(), face(), kind="binary_big_endian").replace("vertex 4", "vertex 100000000000000000"),
        "m.ply: truncated: the 100000000000000000 rows of vertex need 1200000000000000000 bytes from byte 183, but 0 are there",
    ),
    "twice": (head(vertex("property float x\n"), face()) + rows(*"1111") + "3 0 1 2\n", "m.ply: the vertices have the property x twice (expected x, y and z once)"),
    "no corners": (head(vertex(), "element face 1\nproperty int a\n") + rows() + "1\n", "m.ply: the faces have no list vertex_indices or vertex_index"),
    "never ends": ("ply\rformat ascii 1.0\r", "m.ply:3: the header never ends (expected a line end_header)"),
    "odd type": ("ply\nformat ascii 1.0\nelement vertex 4\nproperty half x\n", "m.ply:4: found 'property half x' (expected property TYPE NAME or property list TYPE TYPE NAME)"),
    "list runs on": (head(vertex(), face()) + rows() + "9 0 1 2\n", "m.ply:14: row 1 of face has 4 numbers (expected more)"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_say_what_is_wrong(tmp_path: Path, name: str) -> None:
    data, message = BROKEN[name]
    assert said(tmp_path, data) == message


def test_long_lists_that_run_past_the_end_are_told(tmp_path: Path) -> None:
    data = head(vertex(), face(kinds="uint int"), kind="binary_little_endian").encode() + DATA
    assert said(tmp_path, data + struct.pack("<I", 2**32 - 1)) == (
        f"m.ply: truncated: row 1 of 1 of face runs past the end, byte {len(data) + 4}"
    )


def test_vertices_that_no_face_uses_may_be_nowhere(tmp_path: Path) -> None:
    read(tmp_path, head(vertex(count=5), face()) + rows() + "nan nan nan\n3 0 1 2\n")
    assert read_mesh(tmp_path / "m.ply").count == 1
