"""OBJ and MTL as programs write them: every form of a statement, every part of a material."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.mesh import PolygonMesh, read_mesh
from quiltcli.formats.mesh.mtl import MeshMaterial, read_mtl
from quiltcli.formats.mesh.read import read_polygons

SQUARE = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n"


def read(folder: Path, text: str | bytes) -> PolygonMesh:
    path = folder / "m.obj"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_polygons(path)


def faces(mesh: PolygonMesh) -> list[list[int]]:
    return [part.tolist() for part in np.split(mesh.corners, mesh.corner_start[1:-1])]


def materials(text: str, folder: Path = Path("there")) -> dict[str, MeshMaterial]:
    return read_mtl(text.encode(), folder)


@pytest.mark.parametrize(
    "text",
    [
        SQUARE.replace("\n", "\r\n") + "f 1 2 3 4\r\n",
        SQUARE.replace("\n", "\r") + "f 1 2 3 4\r",
        "\ufeff" + SQUARE + "f 1 2 3 4",
        SQUARE.replace("v ", "\tv\t") + "   f  1\t2 3   4  ",
        SQUARE + "f 1 2 \\\n\t3 \\\n4\n",
        SQUARE.replace("4 4 0", "4 \\\r\n4 0") + "f 1 2 3 4",
        SQUARE + "# f 9 9 9 \\\nf 1 2 3 4 # the wall",
        SQUARE + "# page\u2028v 9 9 9\nf 1 2 3 4",
        SQUARE + "fo 1 2 3 4",
        SQUARE + "f 1/ 2/ 3// 4",
        SQUARE.replace("v 4 4 0", "v 4.0E0 +4 0e+5 1.0") + "f 1 2 3 4",
        "f 1 2 3 4\n" + SQUARE,
        "s off\nl 1 2\np 1\ncurv 0 1 1 2\n" + SQUARE + "f 1 2 3 4\nend\n",
    ],
)
def test_a_square_is_read_however_it_is_written(tmp_path: Path, text: str) -> None:
    mesh = read(tmp_path, text)
    assert mesh.vertices.tolist() == [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    assert faces(mesh) == [[0, 1, 2, 3]]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_wide_encodings_are_read(tmp_path: Path, encoding: str) -> None:
    assert faces(read(tmp_path, (SQUARE + "f 1 2 3 4\n").encode(encoding))) == [[0, 1, 2, 3]]


def test_relative_numbers_count_back_from_where_they_stand(tmp_path: Path) -> None:
    one = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl {}\ng {}\nf -3/-1/-1 -2/-1/-1 -1/-1/-1\n"
    mesh = read(tmp_path, one.format("a", "a") + one.format("b", "b").replace("vt 0 0", "vt 1 1"))
    assert faces(mesh) == [[0, 1, 2], [3, 4, 5]]
    assert mesh.uv is not None
    assert mesh.uv.tolist() == [[0, 0]] * 3 + [[1, 1]] * 3
    assert mesh.names == ("a", "b")


def test_corners_bring_normals_and_texture_coordinates(tmp_path: Path) -> None:
    text = SQUARE + "vn 0 0 1\nvn 0 1 0\nvt 0.5\nvt 0 1 0\nf 1/1/1 2/2/2 3/1/1\nf 1//2 3//2 4//2\nf 1 3 4\n"
    mesh = read(tmp_path, text)
    nothing = [np.nan] * 2
    np.testing.assert_array_equal(mesh.uv, [[0.5, 0], [0, 1], [0.5, 0]] + [nothing] * 6)
    z, y = [0, 0, 1], [0, 1, 0]
    np.testing.assert_array_equal(mesh.normals, [z, y, z, y, y, y] + [[np.nan] * 3] * 3)
    assert mesh.variant is not None
    corner = dict(zip(mesh.corners.tolist(), mesh.variant.tolist(), strict=True))
    assert len(set(mesh.variant.tolist())) == 4
    assert corner[0] == corner[2]


def test_normals_that_are_not_there_are_none(tmp_path: Path) -> None:
    assert read(tmp_path, SQUARE + "f 1//7 2//7 3//-1\n").normals is None


def test_colors_may_stand_behind_some_of_the_positions(tmp_path: Path) -> None:
    mesh = read(tmp_path, "v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0 0 1 1\nf 1 2 3\n")
    assert mesh.colors is not None
    half = ((0.5 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(mesh.colors, [[1, half, 0], [1, 1, 1], [0, 0, 1]], rtol=1e-7)


def test_colors_above_one_are_bytes(tmp_path: Path) -> None:
    mesh = read(tmp_path, "v 0 0 0 255 0 0\nv 1 0 0 51 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n")
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[:, 0], [1, ((0.2 + 0.055) / 1.055) ** 2.4, 0], rtol=1e-6)


def test_what_is_no_number_behind_a_position_is_passed_over(tmp_path: Path) -> None:
    mesh = read(tmp_path, "v 0 0 0 red\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh.colors is None


@pytest.mark.parametrize(
    ("face", "message"),
    [
        ("1 2 99999999999999999999", "names vertex 99999999999999999999 (expected 1 to 4)"),
        ("1 2 -99999999999999999999", "names vertex -99999999999999999999, but only 4 come before it"),
        ("0 1 2", "names vertex 0 (numbers start at 1, or at -1 from the end)"),
        ("1 2 3.0", "has the corner '3.0' (expected v, v/vt, v//vn or v/vt/vn)"),
        ("1 2 /3", "has the corner '/3' (expected v, v/vt, v//vn or v/vt/vn)"),
        ("1 2 3/1/1/1", "has the corner '3/1/1/1' (expected v, v/vt, v//vn or v/vt/vn)"),
    ],
)
def test_corners_that_are_none_are_named(tmp_path: Path, face: str, message: str) -> None:
    with pytest.raises(MeshError) as caught:
        read(tmp_path, SQUARE + f"f 1 2 3\nf {face}\n")
    assert str(caught.value) == f"{tmp_path / 'm.obj'}:6: face 2 {message}"


def test_lines_count_joined_ones(tmp_path: Path) -> None:
    with pytest.raises(MeshError) as caught:
        read(tmp_path, "v 0 0 \\\n0\n# \\\nv 1 0 x\r\nv 1\nf 1 1 9\n")
    lines = [line.split(": ")[0].rpartition(":")[2] for line in str(caught.value).splitlines()]
    assert lines == ["4"]


@pytest.mark.parametrize(
    ("written", "shown"), [("1e400", "inf, 0, 0"), ("1e300", "1e+300, 0, 0"), ("-1e31", "-1e+31, 0, 0")]
)
def test_places_beyond_all_bounds_are_no_display(tmp_path: Path, written: str, shown: str) -> None:
    (tmp_path / "m.obj").write_text(f"v 0 0 0\nv {written} 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match=r"m.obj:2: vertex 2 is \(") as caught:
        read_mesh(tmp_path / "m.obj")
    assert f"vertex 2 is ({shown}) (expected " in str(caught.value)


def test_vertices_that_no_face_uses_may_be_nowhere(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(SQUARE + "v nan 0 0\nf 1 2 3 4\n")
    assert read_mesh(tmp_path / "m.obj").count == 1


def test_texture_vertices_that_are_not_there_matter_to_displays_alone(tmp_path: Path) -> None:
    assert read(tmp_path, SQUARE + "f 1/1 2/1 3/1\n").uv is None
    with pytest.raises(MeshError, match=r"names texture vertex 1 \(expected 1 to 0\)"):
        read_mesh(tmp_path / "m.obj")


class TestMaterials:
    def of_faces(self, mesh: PolygonMesh) -> list[str]:
        assert mesh.material is not None
        return [mesh.materials[row].name if row >= 0 else "" for row in mesh.material]

    @pytest.mark.parametrize(
        "statement",
        ["mtllib a.mtl b.mtl", "mtllib a.mtl\nmtllib b.mtl", "\tmtllib  a.mtl \\\n b.mtl # both",
         "mtllib a.mtl\nmtllib .\\b.mtl"],
    )  # fmt: skip
    def test_come_from_every_file_named(self, tmp_path: Path, statement: str) -> None:
        (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\n")
        (tmp_path / "b.mtl").write_text("\ufeffnewmtl green\n\tKd 0 1 0\n")
        use = "f 1 2 3\nusemtl red\nf 1 2 4\nusemtl green # grass\nf 2 3 4\nusemtl red\nf 1 3 4\n"
        mesh = read(tmp_path, f"{statement}\n{SQUARE}{use}")
        assert self.of_faces(mesh) == ["", "red", "green", "red"]
        assert [material.color for material in mesh.materials] == [(1, 0, 0), (0, 1, 0)]
        assert mesh.missing == ()

    def test_names_of_files_may_have_blanks(self, tmp_path: Path) -> None:
        (tmp_path / "my wall 2.mtl").write_text("newmtl red\nKd 1 0 0\n")
        mesh = read(tmp_path, f"mtllib my wall 2.mtl\n{SQUARE}usemtl red\nf 1 2 3\n")
        assert mesh.materials[0].color == (1, 0, 0)

    def test_missing_files_are_told_one_by_one(self, tmp_path: Path) -> None:
        mesh = read(tmp_path, f"mtllib a b.mtl c.mtl\nmtllib c.mtl\n{SQUARE}usemtl red\nf 1 2 3\n")
        assert mesh.missing == ("a b.mtl", "c.mtl")
        assert (mesh.materials[0].name, mesh.materials[0].defined) == ("red", False)

    @pytest.mark.parametrize(
        ("defined", "used"),
        [("a#1", "a#1"), ("a #1", "a #1"), ("a", "a # one"), ("a # one", "a"),
         ("Wall", "wall"), ("a b", "a b")],
    )  # fmt: skip
    def test_names_may_hold_what_comments_begin_with(self, tmp_path: Path, defined: str, used: str) -> None:
        (tmp_path / "m.mtl").write_text(f"newmtl other\nKd 1 1 1\nnewmtl {defined}\nKd 1 0 0\n")
        mesh = read(tmp_path, f"mtllib m.mtl\n{SQUARE}usemtl {used}\nf 1 2 3\n")
        assert mesh.materials[0].color == (1, 0, 0)

    def test_say_what_the_file_says(self) -> None:
        text = (
            "Kd 9 9 9\nnewmtl full\nKa 1 1 1\n"
            "Kd .1 .2 .3 # wood\nKs 0.5\nKe 1 2 3\nNs 98.5\nd 0.25\nillum 2\n"
            "Pr 0.4\nPm 1\nnewmtl bare\nTr 0.75\nKd one two three\nNs nan\n"
        )
        assert materials(text) == {
            "full": MeshMaterial(
                "full", (0.1, 0.2, 0.3), (1, 2, 3), (0.5,) * 3, 98.5, 0.25, 0.4, 1, illumination=2
            ),
            "bare": MeshMaterial("bare", opacity=0.25),
        }

    @pytest.mark.parametrize(
        ("statement", "role", "name"),
        [
            ("map_Kd wood.png", "color", "wood.png"),
            ("map_Kd my wood #2.png", "color", "my wood #2.png".partition(" #")[0]),
            ("map_Ke lamp.exr", "emission", "lamp.exr"),
            ("MAP_D leaf 1.tif", "opacity", "leaf 1.tif"),
            ("map_Pr -s 2 rough map.png", "roughness", "rough map.png"),
            ("map_Pm m.png", "metallic", "m.png"),
            ("norm n.png", "normal", "n.png"),
            ("map_Bump -bm 0.5 b.png", "bump", "b.png"),
            ("bump b.png", "bump", "b.png"),
            ("map_Kd -clamp on -o 0.1 -blendu off 7", "color", "7"),
            ("map_Kd -s 2 2 2 1.png", "color", "1.png"),
        ],
    )
    def test_name_images(self, statement: str, role: str, name: str) -> None:
        (texture,) = materials(f"newmtl a\n{statement}\n")["a"].textures
        assert (texture.role, texture.name, texture.path) == (role, name, Path("there") / name)

    def test_images_have_options(self) -> None:
        options = "-clamp on -s 2 3 -o .1 .2 .3 -mm 0.1 0.8 -imfchan r -bm 2 -texres 64 -boost 1.5"
        (texture,) = materials(f"newmtl a\nmap_Bump {options}  a b.png\n")["a"].textures
        assert (texture.scale, texture.offset) == ((2, 3, 1), (0.1, 0.2, 0.3))
        assert (texture.clamp, texture.strength, texture.gain) == (True, 2, (0.1, 0.8))
        assert (texture.channel, texture.name) == ("r", "a b.png")

    def test_images_are_looked_for_beside_the_file_too(self, tmp_path: Path) -> None:
        (tmp_path / "wood.png").touch()
        (tmp_path / "maps").mkdir()
        (tmp_path / "maps" / "stone.png").touch()
        text = "newmtl a\nmap_Kd C:\\Users\\me\\wood.png\nmap_Ke maps\\stone.png\nmap_d gone/leaf.png\n"
        places = [texture.path for texture in materials(text, tmp_path)["a"].textures]
        assert places == [tmp_path / "wood.png", tmp_path / "maps/stone.png", tmp_path / "gone/leaf.png"]
