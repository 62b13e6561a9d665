"""Meshes with texture coordinates: display and layout at once, whoever wrote them."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.display import build_facets
from quiltcli.errors import LayoutError
from quiltcli.exchange.pixelmaps import parse_label, read_map, write_map
from quiltcli.exchange.pixelmaps.naming import existing_pages
from quiltcli.formats.mesh import read_mesh
from quiltcli.job import load_display_file
from quiltcli.layout import layout_from_uv
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.map_displays import assert_same_places, cave, cube, turned, world_of_pixels
from tests.helpers.packed_layouts import pack


def test_a_mesh_holds_metres_and_texture_coordinates(tmp_path):
    facets = flat_display([rectangle(4, 2)], names=["wall"])
    layout = placed(facets, [moved(2, 4)], (16, 8))
    assert write_map(layout, facets, tmp_path / "m.obj") == [tmp_path / "m.obj"]
    assert (tmp_path / "m.obj").read_text().splitlines() == [
        "# quilt page 1 of 1, 16x8 pixels",
        "# metres, Y up; u * 16 = pixels from the left, v * 8 = pixels from the bottom",
        "o facet_0001_wall",
        "v 0 0 0",
        "v 0.00390625 0 0",
        "v 0.00390625 -0.001953125 0",
        "v 0 -0.001953125 0",
        *("vt 0.125 0.5", "vt 0.375 0.5", "vt 0.375 0.25", "vt 0.125 0.25"),
        "f 4/4 3/3 2/2 1/1",
    ]


def test_faces_show_their_front_where_they_are_lit(tmp_path):
    for facets, layout in (cave(), turned(), cube()):
        write_map(layout, facets, tmp_path / "m.obj")
        for path in existing_pages(tmp_path / "m.obj"):
            mesh = read_mesh(path)
            for face in range(mesh.count):
                corners = mesh.vertices[mesh.corners[mesh.corner_start[face] : mesh.corner_start[face + 1]]]
                local = corners - corners[0]
                front = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
                facet, _ = parse_label(mesh.names[face])
                assert front @ facets.normal[facet - 1] > 0
            path.unlink()


def test_every_page_is_a_mesh_and_any_of_them_names_all(tmp_path):
    facets, layout = turned()
    written = write_map(layout, facets, tmp_path / "m.obj")
    assert [path.name for path in written] == ["m_page_01.obj", "m_page_02.obj"]
    assert_same_places(layout, read_map(tmp_path / "m.obj", facets), 0)
    assert_same_places(layout, read_map(written[1], facets), 0)


def test_other_programs_may_rename_and_reorder_faces_and_cut_digits(tmp_path):
    facets, layout = cube()
    one = pack(facets, "rows", size=(100, 100))
    write_map(one, facets, tmp_path / "m.obj")
    blocks = (tmp_path / "m.obj").read_text().split("o facet")[1:]
    lines, count = [], 0
    for block in reversed(blocks):  # vertices all on top, 6 digits, other winding and first corner
        rows = [line.split() for line in block.splitlines()[1:]]
        corners = [row[1:] for row in rows]
        points, uvs = corners[:4], corners[4:8]
        lines += [f"g wall.{count}", *(f"v {' '.join(f'{float(n):.6f}' for n in p)}" for p in points)]
        lines += [f"vt {' '.join(f'{float(n):.6f}' for n in uv)}" for uv in uvs]
        lines.append("f " + " ".join(f"{count + k}/{count + k}" for k in (3, 2, 1, 4)))
        count += 4
    (tmp_path / "other.obj").write_text("\n".join(lines))
    back = read_map(tmp_path / "other.obj", facets, size=(100, 100))
    assert_same_places(one, back, 0)
    assert layout.pages.tolist() != one.pages.tolist()


def test_a_mesh_that_is_not_the_display(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.obj")
    page = tmp_path / "m_page_01.obj"
    page.write_text(page.read_text().replace("v 0 -0.001953125 0", "v 0 -0.001963125 0", 1))
    (tmp_path / "m_page_02.obj").unlink()
    page.rename(tmp_path / "one.obj")
    with pytest.raises(LayoutError) as caught:
        read_map(tmp_path / "one.obj", facets)
    line = (tmp_path / "one.obj").read_text().splitlines().index("f 5/5 4/4 3/3 2/2 1/1") + 1
    assert str(caught.value) == (
        f"{tmp_path}/one.obj:{line}: face 1 (facet_0001_a) lies on no facet of flat.yaml; the nearest is 1"
    )


def test_a_mesh_that_does_not_say_enough(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    with pytest.raises(LayoutError) as caught:
        read_map(path)
    assert (
        str(caught.value) == f"{path}: does not say how large its page is, expected a size such as 3840x2160"
    )
    layout = read_map(path, size=(10, 10))
    assert (layout.size.tolist(), layout.pages.tolist()) == ([[10, 10]], [[10, 10]])
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(LayoutError) as caught:
        read_map(path, size=(10, 10))
    assert str(caught.value) == f"{path}: the mesh has no texture coordinates, which a layout is read from"


@pytest.mark.parametrize("u", ["1e308", "-1e308", "1e400"])
def test_texture_coordinates_that_are_no_place_on_a_page(tmp_path, u):
    path = tmp_path / "m.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt {u} 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    with pytest.raises(LayoutError, match="no texture coordinate, or one that is not finite"):
        read_map(path, size=(100, 100))


def test_a_mesh_with_a_facet_twice(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.obj")
    page = tmp_path / "m_page_01.obj"
    page.write_text(page.read_text().replace("o facet_0003_left_wing", "o facet_0005_e"))
    (tmp_path / "m_page_02.obj").unlink()
    text = page.read_text().replace("o facet_0005_e", "o facet_0005_x", 1)
    page.write_text(text)
    with pytest.raises(LayoutError) as caught:
        read_map(page)
    assert str(caught.value) == f"{page}: facet 5 is in the mesh twice"


def test_an_exported_mesh_is_display_and_layout_at_once(tmp_path):
    """What media servers do with it: the mesh is the display, its texture coordinates the layout."""
    facets, _ = cube()
    layout = pack(facets, "rows")
    write_map(layout, facets, tmp_path / "m.obj")
    width, height = layout.pages[0]
    (tmp_path / "d.yaml").write_text(
        f"quilt_display: 1\nmesh: m.obj\nresolution: {{pixels_per_metre: 60}}\n"
        f"layout: {{from_uv: true, size: [{width}, {height}]}}\n"
    )
    spec = load_display_file(tmp_path / "d.yaml")
    again = layout_from_uv(build_facets(read_mesh(spec.mesh), spec), (int(width), int(height)))
    for expected, found in zip(world_of_pixels(layout), world_of_pixels(again), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
