"""OFF and STL as programs write them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.mesh.read import read_polygons

POINTS = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
ROWS = "0 0 0\n4 0 0\n4 4 0\n0 4 0\n"


def read(folder: Path, name: str, data: str | bytes) -> PolygonMesh:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_polygons(path)


def said(folder: Path, name: str, data: str | bytes) -> str:
    with pytest.raises(MeshError) as caught:
        read(folder, name, data)
    return str(caught.value).replace(f"{folder}/", "")


class TestOff:
    @pytest.mark.parametrize(
        "text",
        [
            f"OFF\n4 1 0\n{ROWS}4 0 1 2 3\n",
            f"OFF 4 1 0\n{ROWS}4 0 1 2 3\n",
            f"OFF4 1 0\n{ROWS}4 0 1 2 3",
            f"4 1 0\n{ROWS}4 0 1 2 3",
            f"# made by hand\r\n\r\nOFF # four\r\n4 1\r\n{ROWS}\r\n4  0 1 2\t3 # wall\r\n",
            "OFF 4 1 0 0 0 0 4 0 0 4 4 0 0 4 0 4 0 1 2 3",
            "OFF\n4 1 0\n0 0\n0 4 0 0 4 4\n0 0 4 0 4 0\n1 2 3\n",
            f"\ufeffOFF\n4 1 0\n{ROWS}4 0 1 2 3\n",
        ],
    )
    def test_a_square_is_read_however_it_is_written(self, tmp_path: Path, text: str) -> None:
        mesh = read(tmp_path, "m.off", text)
        assert mesh.vertices.tolist() == POINTS
        assert mesh.corners.tolist() == [0, 1, 2, 3]
        assert mesh.colors is None

    def test_vertices_bring_normals_colors_and_texture_coordinates(self, tmp_path: Path) -> None:
        rows = "".join(f"{x} {y} {z} 0 0 1 1 0 0 1 0.5 {k}\n" for k, (x, y, z) in enumerate(POINTS))
        for text in (rows, rows.replace("\n", " ")):
            mesh = read(tmp_path, "m.off", f"STCNOFF\n4 1 0\n{text}3 2 1 0\n")
            assert mesh.vertices.tolist() == POINTS
            assert mesh.uv is not None
            assert mesh.uv.tolist() == [[0.5, 2], [0.5, 1], [0.5, 0]]
            assert mesh.normals is not None
            assert mesh.normals.tolist() == [[0, 0, 1]] * 3
            assert mesh.colors is not None
            assert mesh.colors.tolist() == [[1, 0, 0]] * 3

    @pytest.mark.parametrize(
        ("color", "expected"),
        [("0.2 0 0 1", 0.2), ("51 0 0 255", 0.2), ("1 0 0 1", 1), ("1. 0 0", 1), ("255 0 0", 1)],
    )
    def test_vertex_colors_are_bytes_or_fractions(self, tmp_path: Path, color: str, expected: float) -> None:
        rows = ROWS.replace("\n", f" {color}\n")
        mesh = read(tmp_path, "m.off", f"COFF\n4 1 0\n{rows}3 0 1 2\n")
        assert mesh.colors is not None
        np.testing.assert_allclose(mesh.colors[0], [((expected + 0.055) / 1.055) ** 2.4, 0, 0], rtol=1e-6)

    def test_faces_have_colors_as_each_writes_them(self, tmp_path: Path) -> None:
        faces = "3 0 1 2 1.0 0.0 0.0\n3 0 2 3 255 0 0 255\n3 0 1 3\n3 1 2 3 7\n"
        mesh = read(tmp_path, "m.off", f"OFF\n4 4 0\n{ROWS}{faces}")
        assert mesh.colors is not None
        assert mesh.colors[::3].tolist() == [[1, 0, 0], [1, 0, 0], [1, 1, 1], [1, 1, 1]]
        assert mesh.variant is not None
        assert mesh.variant.tolist() == np.repeat(range(4), 3).tolist()

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            (f"OFF\n4 1 0\n{ROWS}3 0 1 {10**30}\n",
             f"m.off:7: face 1 names vertex {10**30} (expected 0 to 3)"),
            (f"OFF\n4 1 0\n{ROWS}3 0 1 nan\n", "m.off:7: face 1 names vertex nan (expected 0 to 3)"),
            (f"OFF\n4 1 0\n{ROWS}3 0 1 1.5\n", "m.off:7: face 1 names vertex 1.5 (expected 0 to 3)"),
            (f"OFF\n4 1 0\n{ROWS}inf 0 1 2\n",
             "m.off:7: face 1 is 'inf 0 1 2' (expected a count and that many vertex numbers)"),
            ("OFF\n4 nan 0\n", "m.off:2: found '4 nan 0' (expected the counts of vertices, faces and edges)"),
            (f"OFF\n{'9' * 30} 1 0\n",
             f"m.off:2: found '{'9' * 30} 1 0' (expected the counts of vertices, faces and edges)"),
            ("OFF\n1000000000000 1 0\n0 0 0\n", "m.off: the file ends after 1 of 1000000000000 vertices"),
            ("OFF\n2 1 0\n0 0 0\n0 z 0\n", "m.off:4: vertex 2 is '0 z 0' (expected numbers)"),
        ],
    )  # fmt: skip
    def test_broken_files_say_what_is_wrong(self, tmp_path: Path, text: str, message: str) -> None:
        assert said(tmp_path, "m.off", text) == message


def facets(keyword: str = "vertex") -> str:
    return "".join(
        "facet normal -1.#IND 0 0\n outer loop\n"
        + "".join(f"  {keyword} {x} {y} {z}\n" for x, y, z in (POINTS[a], POINTS[b], POINTS[c]))
        + " endloop\nendfacet\n"
        for a, b, c in ((0, 1, 2), (0, 2, 3))
    )


def binary(count: int = 2, spare: tuple[int, int] = (0, 0), header: bytes = b"") -> bytes:
    data = header.ljust(80, b"\0") + struct.pack("<I", count)
    for (a, b, c), bits in zip(((0, 1, 2), (0, 2, 3)), spare, strict=True):
        data += struct.pack("<12fH", 0, 0, 0, *POINTS[a], *POINTS[b], *POINTS[c], bits)
    return data


class TestStl:
    @pytest.mark.parametrize(
        "data",
        [
            f"solid vertex 9 9 9\n{facets()}endsolid\n",
            f"solid a\n{facets()}end solid a\n",
            f"solid a\n{facets()}",
            f"solid a\nendsolid a\nsolid b\n{facets()}",
            f"SOLID A\r\n{facets('VERTEX')}ENDSOLID A\r\n".replace("\n", "\r\n"),
            f"solid a\n{facets()}".replace("\n ", " "),
            f"solid m\xfcller\n{facets()}".encode("cp1252"),
            f"\ufeffsolid a\n{facets()}",
            binary(),
            binary(header=b"solid but binary"),
            binary() + b"trailing words",
        ],
    )
    def test_two_triangles_are_read_however_they_are_written(self, tmp_path: Path, data: str | bytes) -> None:
        mesh = read(tmp_path, "m.stl", data)
        assert mesh.count == 2
        assert mesh.vertices[mesh.corners].tolist() == [POINTS[k] for k in (0, 1, 2, 0, 2, 3)]
        assert mesh.colors is None

    def test_solids_follow_each_other(self, tmp_path: Path) -> None:
        assert read(tmp_path, "m.stl", f"solid a\n{facets()}endsolid a\nsolid b\n{facets()}").count == 4

    def test_colors_of_magics(self, tmp_path: Path) -> None:
        mesh = read(tmp_path, "m.stl", binary(spare=(31, 0x8000), header=b"COLOR=\x00\xff\x00\xff"))
        assert mesh.colors is not None
        assert mesh.colors[::3].tolist() == [[1, 0, 0], [0, 1, 0]]

    def test_colors_of_viscam(self, tmp_path: Path) -> None:
        mesh = read(tmp_path, "m.stl", binary(spare=(0x8000 | 31 << 10, 0)))
        assert mesh.colors is not None
        assert mesh.colors[::3].tolist() == [[1, 0, 0], [1, 1, 1]]

    def test_other_spare_bytes_are_no_colors(self, tmp_path: Path) -> None:
        assert read(tmp_path, "m.stl", binary(spare=(0x8001, 77))).colors is None

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            (binary(4), "m.stl: truncated: 4 triangles need 284 bytes, 184 are there"),
            (f"solid a\n{facets()}facet\nouter loop\nvertex 0 0 0\n",
             "m.stl:18: facet 3 has 1 vertices (expected 3)"),
            (f"solid a\n{facets()}".replace("4 4 0", "4 four 0", 1),
             "m.stl:6: found '4 four 0' (expected numbers)"),
            (f"solid a\n{facets()}".replace("4 4 0", "4 4", 1),
             "m.stl:6: vertex with 2 coordinates (expected x y z)"),
            ("not a mesh at all", "m.stl: found 'not a mesh at all' "
             "(expected text that begins with solid, or a binary header of 84 bytes)"),
        ],
    )  # fmt: skip
    def test_broken_files_say_what_is_wrong(self, tmp_path: Path, data: str | bytes, message: str) -> None:
        assert said(tmp_path, "m.stl", data) == message
