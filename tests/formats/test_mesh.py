"""Display meshes come back as they were written: polygons whole, faces in order, errors exact."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.mesh import PolygonMesh, read_mesh

# A pentagon between a triangle and a quad: readers that sort by size would move it.
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.5, 1.5, 0), (0, 1, 0), (0.5, -1, 0), (2, 0, 0), (2, 1, 0)]
FACES = [(0, 5, 1), (0, 1, 2, 3, 4), (1, 6, 7, 2)]
UV = [(x / 2, (y + 1) / 4) for x, y, _ in POINTS]


def faces_of(mesh: PolygonMesh) -> list[tuple[int, ...]]:
    return [
        tuple(mesh.corners[a:b].tolist())
        for a, b in zip(mesh.corner_start[:-1], mesh.corner_start[1:], strict=True)
    ]


def obj() -> bytes:
    lines = ["v {} {} {}".format(*p) for p in POINTS]
    return "\n".join(lines + ["f " + " ".join(str(c + 1) for c in f) for f in FACES]).encode()


def off() -> bytes:
    lines = ["OFF", "8 3 0", *("{} {} {}".format(*p) for p in POINTS)]
    return "\n".join([*lines, *(f"{len(f)} " + " ".join(map(str, f)) for f in FACES)]).encode()


def ply_header(kind: str) -> str:
    return (
        f"ply\nformat {kind} 1.0\ncomment mixed\nelement vertex 8\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 3\n"
        "property list uchar int vertex_indices\nproperty short facet_id\nelement edge 1\n"
        "property int vertex1\nend_header\n"
    )


def ply_text() -> bytes:
    rows = [f"{x} {y} {z} 255 {s} {t}" for (x, y, z), (s, t) in zip(POINTS, UV, strict=True)]
    rows += [f"{len(f)} " + " ".join(map(str, f)) + f" {9 - k}" for k, f in enumerate(FACES)]
    return (ply_header("ascii") + "\n".join([*rows, "0"])).encode()


def ply_binary(order: str) -> bytes:
    data = b"".join(struct.pack(order + "3fB2f", *p, 255, *uv) for p, uv in zip(POINTS, UV, strict=True))
    for face in FACES:
        data += struct.pack(f"{order}B{len(face)}ih", len(face), *face, 7)
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    return ply_header(kind).encode() + data + struct.pack(order + "i", 0)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("m.obj", obj()),
        ("m.off", off()),
        ("text.ply", ply_text()),
        ("little.ply", ply_binary("<")),
        ("big.ply", ply_binary(">")),
    ],
)
def test_polygons_stay_whole_and_in_order(tmp_path: Path, name: str, data: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    mesh = read_mesh(path)
    assert faces_of(mesh) == FACES
    np.testing.assert_array_equal(mesh.vertices, np.array(POINTS, np.float64))


@pytest.mark.parametrize("data", [ply_text(), ply_binary("<"), ply_binary(">")])
def test_ply_vertices_carry_texture_coordinates(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "m.ply"
    path.write_bytes(data)
    mesh = read_mesh(path)
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, np.array(UV)[mesh.corners], atol=1e-7)


def test_ply_faces_carry_texture_coordinates_as_meshlab_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "m.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 .1 .2 .3 .4 .5 .6\n"
    )
    np.testing.assert_array_equal(read_mesh(path).uv, [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])


def read_obj_text(tmp_path: Path, text: str) -> PolygonMesh:
    path = tmp_path / "m.obj"
    path.write_text(text)
    return read_mesh(path)


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    "face", ["1 2 3 4", "-4 -3 -2 -1", "1//1 2//1 3//1 4//1", "1 2 \\\n 3 4", "1 2 3 4 # a"]
)
def test_obj_face_forms(tmp_path: Path, face: str) -> None:
    assert faces_of(read_obj_text(tmp_path, SQUARE + f"f {face}\n")) == [(0, 1, 2, 3)]


def test_obj_texture_coordinates_belong_to_corners(tmp_path: Path) -> None:
    mesh = read_obj_text(tmp_path, SQUARE + "vt 0.5 0.25\nvt 1 0\nvt 1\nf 1/1 2/-2 3/3\nf 1 3 4\n")
    expected = [[0.5, 0.25], [1, 0], [1, 0], [np.nan] * 2, [np.nan] * 2, [np.nan] * 2]
    np.testing.assert_array_equal(mesh.uv, expected)


def test_obj_groups_of_one_face_name_it(tmp_path: Path) -> None:
    mesh = read_obj_text(tmp_path, SQUARE + "o top\nf 1 2 3\ng many\nf 1 2 4\nf 2 3 4\n")
    assert mesh.names == ("top", "", "")


def test_obj_lines_are_kept_for_messages(tmp_path: Path) -> None:
    assert read_obj_text(tmp_path, SQUARE + "\n# x\nf 1 2 \\\n3\nf 1 3 4\n").lines.tolist() == [7, 9]


@pytest.mark.parametrize("header", ["COFF", "NOFF", "OFF 3 1 0", "STOFF # here"])
def test_off_variants(tmp_path: Path, header: str) -> None:
    path = tmp_path / "m.off"
    more = " 9 8" if header != "OFF 3 1 0" else ""
    counts = "" if header == "OFF 3 1 0" else "3 1 0\n"
    path.write_text(f"{header}\n{counts}0 0 0{more}\n1 0 0{more}\n0 1 0{more}\n3 0 1 2 0.5 0.5 0.5\n")
    mesh = read_mesh(path)
    assert faces_of(mesh) == [(0, 1, 2)]
    assert (mesh.uv is not None) == header.startswith("ST")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_triangle_formats_keep_their_order(tmp_path: Path, suffix: str) -> None:
    import trimesh

    path = tmp_path / f"m.{suffix}"
    vertices = np.array(POINTS, np.float64)
    triangles = [(1, 6, 7), (0, 5, 1), (0, 1, 2)]
    trimesh.Trimesh(vertices, triangles, process=False).export(path)
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices[mesh.corners], vertices[np.ravel(triangles)])


def test_gltf_instances_come_in_an_order_of_the_file(tmp_path: Path) -> None:
    import trimesh

    path = tmp_path / "m.glb"
    piece = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], process=False)
    scene = trimesh.Scene({"g": piece})
    for shift in (5.0, 3.0):
        matrix = np.eye(4)
        matrix[0, 3] = shift
        scene.graph.update(frame_to=f"n{shift}", matrix=matrix, geometry="g")
    scene.export(path)
    assert read_mesh(path).vertices[::3, 0].tolist() == [0.0, 3.0, 5.0]


PLY_3 = (
    "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list char int vertex_indices\nend_header\n"
)
CORNERS_3 = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
BINARY = PLY_3.format("binary_little_endian").encode()

BAD = {
    "empty.obj": (b"", "{}: the mesh is empty (expected vertices and faces)"),
    "points.obj": (b"v 0 0 0\n", "{}: the mesh has 1 vertices but no faces (expected one or more)"),
    "nan.obj": (b"v 0 0 0\nv nan 0 inf\nv 0 1 0\nf 1 2 3\n", "{}:2: vertex 2 is (nan, 0, inf) (expected finite numbers)"),
    "word.obj": (b"v 0 zero 0\n", "{}:1: found '0 zero 0' (expected numbers)"),
    "short.obj": (b"v 0 0\n", "{}:1: vertex with 2 coordinates (expected x y z)"),
    "range.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "{}:4: face 1 names vertex 4 (expected 1 to 3)"),
    "zero.obj": (b"v 0 0 0\nf 0 1 1\n", "{}:2: face 1 names vertex 0 (numbers start at 1, or at -1 from the end)"),
    "before.obj": (b"v 0 0 0\nf 1 1 -2\n", "{}:2: face 1 names vertex -2, but only 1 come before it"),
    "two.obj": (b"v 0 0 0\nv 1 0 0\nf 1 2\n", "{}:3: face 1 has 2 corners (expected 3 or more)"),
    "corner.obj": (b"v 0 0 0\nf 1 1 x\n", "{}:2: face 1 has the corner 'x' (expected v, v/vt, v//vn or v/vt/vn)"),
    "vt.obj": (b"v 0 0 0\nf 1/1 1 1\n", "{}:2: face 1 names texture vertex 1 (expected 1 to 0)"),
    "head.off": (b"OOF\n", "{}:1: found 'OOF' (expected OFF, COFF, NOFF or STOFF)"),
    "none.off": (b"", "{}:1: found an empty file (expected OFF, COFF, NOFF or STOFF)"),
    "binary.off": (b"OFF BINARY\n", "{}:1: binary OFF is not supported (expected the text form)"),
    "ends.off": (b"OFF\n2 1 0\n0 0 0\n", "{}: the file ends after 1 of 2 vertices"),
    "face.off": (b"OFF\n1 1 0\n0 0 0\n3 0 0\n", "{}:4: face 1 is '3 0 0' (expected a count and that many vertex numbers)"),
    "notply.ply": (b"obj\n", "{}:1: found 'obj' (expected ply)"),
    "format.ply": (
        b"ply\nformat text 1.0\n",
        "{}:2: found 'format text 1.0' (expected one of ascii, binary_little_endian, binary_big_endian)",
    ),
    "vertices.ply": (
        BINARY + CORNERS_3[:10],
        "{}: truncated: the 3 rows of vertex need 36 bytes from byte 168, but 10 are there",
    ),
    "faces.ply": (
        BINARY + CORNERS_3 + b"\x03\x00\x00",
        "{}: truncated: row 1 of 1 of face runs past the end, byte 207",
    ),
    "negative.ply": (BINARY + CORNERS_3 + b"\xff", "{}: row 1 of face has a list of -1 numbers at byte 204"),
    "lines.ply": (PLY_3.format("ascii").encode() + b"0 0 0\n", "{}: the file ends after 1 of 3 rows of vertex"),
    "row.ply": (PLY_3.format("ascii").encode() + b"0 0\n", "{}:10: row 1 of vertex has 2 numbers (expected more)"),
    "text.ply": (PLY_3.format("ascii").encode() + b"0 0 z\n", "{}:10: row 1 of vertex is '0 0 z' (expected numbers)"),
    "mesh.fbx": (b"", "{}: is a .fbx file, which is not read (export as GLB)"),
    "mesh.xyz": (b"", "{}: unknown mesh format '.xyz' (expected .obj, .off, .ply, .stl, .glb, .gltf, .usd, .usda, .usdc, .usdz)"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes_say_what_is_wrong(tmp_path: Path, name: str) -> None:
    data, message = BAD[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    assert str(caught.value) == message.format(path)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(MeshError) as caught:
        read_mesh(tmp_path / "no.obj")
    assert str(caught.value) == f"{tmp_path / 'no.obj'}: no such file (expected a mesh)"
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(MeshError) as caught:
        read_mesh(tmp_path / "folder.obj")
    assert str(caught.value) == f"{tmp_path / 'folder.obj'}: is a directory (expected a mesh file)"


def test_all_problems_come_at_once_up_to_fifty(tmp_path: Path) -> None:
    path = tmp_path / "m.obj"
    path.write_text("v 0 0 0\n" + "f 1 1 9\n" * 60)
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    lines = str(caught.value).splitlines()
    assert lines[1] == f"{path}:3: face 2 names vertex 9 (expected 1 to 1)"
    assert lines[50:] == [f"{path}: and 10 problems more"]


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_broken_triangle_files_are_mesh_errors(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"m.{suffix}"
    path.write_bytes(b"not a mesh at all")
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    assert str(caught.value).startswith(f"{path}: ")
