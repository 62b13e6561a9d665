"""Facet frames: rasters that bound their polygon, stand upright, and are never mirrored unasked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quiltcli.display import (
    Facets,
    build_facets,
    convex_parts,
    corner_pixels,
    lit_facets,
    load_display,
    pitch_mm,
    shared_edges,
    triangulate,
)
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.mesh.polygons import area_vectors
from quiltcli.geometry import FloatArray, cross, dot, facet_from_world, normalized, rotation_deg
from quiltcli.job import DisplayFile, load_display_file


def mesh_of(*polygons: object) -> PolygonMesh:
    arrays = [np.asarray(p, np.float64) for p in polygons]
    start = np.concatenate(([0], np.cumsum([len(p) for p in arrays]))).astype(np.int64)
    count = len(arrays)
    corners = np.arange(start[-1])
    return PolygonMesh(
        np.concatenate(arrays), start, corners, None, ("",) * count, np.zeros(count, np.int64), "m.obj"
    )


def spec(**keys: object) -> DisplayFile:
    keys.setdefault("resolution", {"pixels_per_metre": 100})
    return DisplayFile.model_validate({"mesh": "m.obj", **keys})


def facet(polygon: object, **keys: object) -> Facets:
    return build_facets(mesh_of(polygon), spec(**keys))


def unit(v: FloatArray) -> list[list[float]]:
    return (np.round(normalized(v), 9) + 0.0).tolist()


def moved(polygon: FloatArray, x: float, y: float, z: float) -> FloatArray:
    return polygon + np.array([x, y, z])


def textured(*places: tuple[object, object]) -> PolygonMesh:
    """A mesh of polygons, each with its texture coordinates."""
    mesh = mesh_of(*(polygon for polygon, _ in places))
    return replace(mesh, uv=np.concatenate([np.asarray(uv, np.float64) for _, uv in places]))


def test_without_a_resolution_the_texture_tells_how_many_pixels_there_are():
    square = np.array([(0, 0, 0), (0.004, 0, 0), (0.004, 0.004, 0), (0, 0.004, 0)])
    unit_uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    strip = [(0, 0, 1), (0.01, 0, 1), (0.01, 10, 1), (0, 10, 1)]
    mesh = textured((square, unit_uv), (strip, np.full((4, 2), 0.5)), (strip, np.full((4, 2), np.nan)))
    own = DisplayFile.model_validate({"mesh": "m.obj", "layout": {"from_uv": True, "size": [64, 64]}})
    apart = mesh.vertices + np.repeat([(0, 0, 0), (0, 0, 0), (1, 0, 0)], 4, axis=0)
    facets = build_facets(replace(mesh, vertices=apart), own)
    assert facets.size.tolist() == [[64, 64], [1, 1000], [1, 1000]]
    assert np.allclose(facets.du[0], [0.004 / 64, 0, 0], rtol=1e-12, atol=0)


# A 1.92 × 1.08 m panel that faces +Z, from its lower left.
PANEL = np.array([(0, 0, 0), (1.92, 0, 0), (1.92, 1.08, 0), (0, 1.08, 0)])
FLOOR = [(0, 0, 0), (2, 0, 0), (2, 0, -1), (0, 0, -1)]
L_SHAPE = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], np.float64)


@pytest.mark.parametrize("first", range(4))
def test_hanging_panel_is_upright_whatever_its_first_corner(first: int) -> None:
    facets = facet(np.roll(PANEL, first, axis=0), resolution={"facet_pixels": [1920, 1080]})
    np.testing.assert_allclose(facets.origin, [[0, 1.08, 0]], atol=1e-15)
    np.testing.assert_allclose(facets.du, [[0.001, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(facets.dv, [[0, -0.001, 0]], atol=1e-15)
    assert facets.size.tolist() == [[1920, 1080]]
    assert facets.normal.tolist() == [[0, 0, 1]]


def test_back_side_is_seen_from_behind() -> None:
    facets = facet(PANEL, viewing_side="back", resolution={"facet_pixels": [1920, 1080]})
    assert facets.normal.tolist() == [[0, 0, -1]]
    np.testing.assert_allclose(facets.origin, [[1.92, 1.08, 0]], atol=1e-15)
    np.testing.assert_allclose(facets.du, [[-0.001, 0, 0]], atol=1e-15)


def test_both_sides_take_the_front() -> None:
    facets = facet(PANEL, viewing_side="both")
    assert facets.both_sides
    assert facets.normal.tolist() == [[0, 0, 1]]


@pytest.mark.parametrize(
    ("polygon", "up"),
    [
        (FLOOR, [0, 0, -1]),
        ([*FLOOR[1:], FLOOR[0]], [-1, 0, 0]),
        ([(x, y, -z) for x, y, z in FLOOR], [0, 0, 1]),
        ([(0, 3, 0), (0, 3, -1), (2, 3, -1), (2, 3, 0)], [1, 0, 0]),
    ],
)
def test_level_facets_stand_on_their_first_edge(polygon: object, up: list[float]) -> None:
    assert unit(-facet(polygon).dv) == [up]


def test_facet_tilted_by_two_degrees_follows_the_world_again() -> None:
    turned = np.array(FLOOR) @ rotation_deg((2, 0, 0)).T  # the far edge rises
    assert unit(-facet(np.roll(turned, 2, axis=0)).dv)[0][2] < -0.99
    flat = np.array(FLOOR) @ rotation_deg((0.5, 0, 0)).T
    assert unit(-facet(np.roll(flat, 2, axis=0)).dv)[0][2] > 0.99


def test_user_up_wins() -> None:
    assert unit(-facet(FLOOR, facets={1: {"up": [1, 5, 0.1]}}).dv) == [[1, 0, 0]]


@pytest.mark.parametrize(
    ("turn", "right", "down"),
    [
        (0, [1, 0, 0], [0, -1, 0]),
        (90, [0, -1, 0], [-1, 0, 0]),
        (180, [-1, 0, 0], [0, 1, 0]),
        (270, [0, 1, 0], [1, 0, 0]),
    ],
)
def test_rotate_turns_the_raster_clockwise(turn: int, right: list[int], down: list[int]) -> None:
    facets = facet(PANEL, facets={1: {"rotate": turn}})
    assert unit(facets.du) == [right]
    assert unit(facets.dv) == [down]
    assert facets.size.tolist() == ([[192, 108]] if turn % 180 == 0 else [[108, 192]])


def test_rotated_panel_keeps_its_pixel_count() -> None:
    portrait = PANEL[:, [1, 0, 2]] * (1, 1, -1)
    facets = facet(portrait, facets={1: {"rotate": 90, "facet_pixels": [1920, 1080]}})
    np.testing.assert_allclose(np.linalg.norm([facets.du[0], facets.dv[0]], axis=1), 0.001)


def test_mirror_runs_from_right_to_left() -> None:
    facets = facet(PANEL, facets={1: {"mirror": True}})
    np.testing.assert_allclose(facets.origin, [[1.92, 1.08, 0]], atol=1e-12)
    assert unit(facets.du) == [[-1, 0, 0]]
    assert unit(facets.dv) == [[0, -1, 0]]
    assert facets.mirrored.tolist() == [True]
    assert facets.normal.tolist() == [[0, 0, 1]]


def test_tilted_panel_keeps_its_edges() -> None:
    tilted = PANEL @ rotation_deg((0, 0, 20)).T
    facets = facet(tilted, resolution={"facet_pixels": [1920, 1080]})
    np.testing.assert_allclose(facets.du[0], (tilted[1] - tilted[0]) / 1920, atol=1e-15)


def test_smallest_rectangle_is_taken() -> None:
    # A right triangle's legs bound it by 3 × 4; its hypotenuse by 5 × 2.4, which is the same area, so
    # the upright one wins; a flatter top makes the slanted edge the better one.
    assert facet([(0, 0, 0), (4, 0, 0), (0, 3, 0)]).size.tolist() == [[400, 300]]
    band = np.array([(0, 0, 0), (4, 3, 0), (3.4, 3.8, 0), (-0.6, 0.8, 0)])
    assert facet(band).size.tolist() == [[500, 100]]


def test_diamond_tie_takes_the_first_edge() -> None:
    diamond = [(0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)]
    s = round(0.5**0.5, 9)
    assert unit(facet(diamond).du) == [[s, s, 0]]
    assert unit(facet(diamond[1:] + diamond[:1]).du) == [[s, s, 0]]


def test_square_pixels_have_the_exact_pitch_and_cover_the_polygon() -> None:
    facets = facet([(0, 0, 0), (1.005, 0, 0), (1.005, 0.5, 0), (0, 0.5, 0)])
    assert facets.size.tolist() == [[101, 50]]
    assert facets.du.tolist() == [[0.01, 0, 0]]
    assert facets.origin.tolist() == [[0, 0.5, 0]]
    assert pitch_mm(facets) == (10, 10)


def test_rounding_makes_no_pixel() -> None:
    assert facet(PANEL * (0.1 + 0.2) / 0.3, resolution={"pixels_per_metre": 1000}).size.tolist() == [
        [1920, 1080]
    ]


def test_units_and_transform() -> None:
    facets = facet(
        PANEL * 1000,
        units="mm",
        transform={"scale": 2, "rotate_deg": [0, 90, 0], "translate": [0, 1, 0]},
    )
    expected = [(0, 1, 0), (0, 1, -3.84), (0, 3.16, -3.84), (0, 3.16, 0)]
    np.testing.assert_allclose(facets.corners, expected, atol=1e-12)
    np.testing.assert_allclose(facets.normal, [[1, 0, 0]], atol=1e-15)


def test_single_facets_may_differ() -> None:
    facets = build_facets(
        mesh_of(PANEL, moved(PANEL, 2, 0, 0)),
        spec(facets={2: {"name": "right", "facet_pixels": [64, 32], "enabled": False}}),
    )
    assert facets.names == ("", "right")
    assert facets.enabled.tolist() == [True, False]
    assert facets.size.tolist() == [[192, 108], [64, 32]]
    assert lit_facets(facets, np.array([0, 0, 5.0])).tolist() == [True, False]
    assert pitch_mm(facets) == (10, 10)


def test_lit_facets() -> None:
    eyes = [(0, 0, 1), (0, 0, -1), (5, 5, 0), (9, 0, 1e-6)]
    lit = {
        side: [
            bool(lit_facets(facet(PANEL, viewing_side=side), np.array(eye, np.float64))[0]) for eye in eyes
        ]
        for side in ("front", "back", "both")
    }
    assert lit == {
        "front": [True, False, False, True],
        "back": [False, True, False, False],
        "both": [True, True, False, True],
    }


def test_facet_from_world_inverts_the_raster() -> None:
    facets = facet(PANEL @ rotation_deg((20, 30, 40)).T)
    point = facets.origin[0] + 12.5 * facets.du[0] + 7.25 * facets.dv[0] + 3 * facets.normal[0]
    np.testing.assert_allclose(
        facet_from_world(facets.origin, facets.du, facets.dv)[0] @ [*point, 1], [12.5, 7.25, 1], atol=1e-9
    )


@st.composite
def convex_polygons(draw: st.DrawFn) -> FloatArray:
    """Corners on an ellipse, turned and moved anywhere."""
    count = draw(st.integers(3, 9))
    turn = np.cumsum([draw(st.floats(0.2, 1)) for _ in range(count)])
    turn *= 2 * np.pi / (turn[-1] + draw(st.floats(0.2, 1)))
    flat = np.stack((np.cos(turn), draw(st.floats(0.3, 1)) * np.sin(turn), np.zeros(count)), axis=1)
    angles = [draw(st.floats(-180, 180)) for _ in range(3)]
    return flat @ rotation_deg(angles).T + [draw(st.floats(-5, 5)) for _ in range(3)]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(convex_polygons(), st.sampled_from(["front", "back"]), st.sampled_from([0, 90, 180, 270]))
def test_no_facet_is_ever_mirrored(polygon: FloatArray, side: str, turn: int) -> None:
    pixels = {"facet_pixels": [300, 200]}
    facets = facet(polygon, viewing_side=side, resolution=pixels, facets={1: {"rotate": turn}})
    front = normalized(area_vectors(polygon, np.array([0, len(polygon)])))
    np.testing.assert_allclose(facets.normal, front if side == "front" else -front, atol=1e-12)
    np.testing.assert_allclose(normalized(cross(facets.dv, facets.du)), facets.normal, atol=1e-9)
    assert abs(dot(facets.du, facets.dv)[0]) < 1e-15
    corners = corner_pixels(facets)
    np.testing.assert_allclose(corners.min(axis=0), [0, 0], atol=1e-7)
    np.testing.assert_allclose(corners.max(axis=0), [300, 200], atol=1e-7)
    back = facets.origin + corners[:, :1] * facets.du + corners[:, 1:] * facets.dv
    np.testing.assert_allclose(back, polygon, atol=1e-9)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(convex_polygons())
def test_up_is_never_below_level(polygon: FloatArray) -> None:
    # One of four quarter turns is within 45° of up, unless the facet is level and there is no up.
    facets = facet(polygon)
    raised = np.array([0, 1, 0]) - facets.normal[0, 1] * facets.normal[0]
    if np.linalg.norm(raised) >= np.sin(np.radians(1)):
        assert normalized(-facets.dv)[0] @ raised / np.linalg.norm(raised) > 0.7071 - 1e-5


# Triangles and convex parts


def comb(teeth: int) -> FloatArray:
    """Teeth of 2 × 3 on a back with a straight corner below each gap."""
    back = [(2.0 * k, 0, 0) for k in range(teeth + 1)]
    outline = [p for k in reversed(range(teeth)) for p in ((2 * k + 1.5, 3, 0), (2 * k + 0.5, 1, 0))]
    return np.array([*back, (2 * teeth, 3, 0), *outline])


@pytest.mark.parametrize("polygon", [PANEL, L_SHAPE, comb(1), comb(2), comb(7)])
@pytest.mark.parametrize("turn", [(0, 0, 0), (31, 47, 59)])
def test_triangles_cover_the_polygon(polygon: FloatArray, turn: tuple[float, ...]) -> None:
    facets = facet(polygon @ rotation_deg(turn).T)
    triangles, owner = triangulate(facets)
    assert len(triangles) == len(polygon) - 2
    assert owner.tolist() == [0] * len(triangles)
    a, b, c = facets.corners[triangles].transpose(1, 0, 2)
    area = dot(cross(b - a, c - a), facets.normal) / 2
    assert (area > 0).all()
    whole = np.linalg.norm(area_vectors(facets.corners, facets.corner_start)) / 2
    assert area.sum() == pytest.approx(whole, rel=1e-12)


def test_triangles_come_in_the_order_of_the_facets() -> None:
    facets = build_facets(mesh_of(L_SHAPE, moved(PANEL, 5, 0, 0), moved(L_SHAPE, 0, 5, 0)), spec())
    triangles, owner = triangulate(facets)
    assert owner.tolist() == [0] * 4 + [1] * 2 + [2] * 4
    assert (np.searchsorted(facets.corner_start, triangles, side="right") - 1 == owner[:, None]).all()


def test_convex_parts_keep_convex_facets_whole() -> None:
    facets = build_facets(mesh_of(moved(PANEL, 5, 0, 0), L_SHAPE, moved(PANEL, 0, 5, 0)), spec())
    owner, start, corners = convex_parts(facets)
    assert owner.tolist() == [0, 1, 1, 1, 1, 2]
    assert np.diff(start).tolist() == [4, 3, 3, 3, 3, 4]
    assert corners[:4].tolist() == [0, 1, 2, 3]
    assert corners[-4:].tolist() == [10, 11, 12, 13]
    area = np.linalg.norm(area_vectors(facets.corners[corners], start), axis=1) / 2
    assert area[1:5].sum() == pytest.approx(3)


def test_straight_corners_do_not_make_a_facet_concave() -> None:
    facets = facet(np.insert(PANEL, 1, (0.9, 0, 0), axis=0))
    assert convex_parts(facets)[0].tolist() == [0]
    assert len(triangulate(facets)[0]) == 3


# Shared edges


def test_shared_edge_of_separate_vertices_within_a_millionth() -> None:
    other = moved(PANEL, 1.92 + 1e-6, 0, 0)
    edges = shared_edges(build_facets(mesh_of(PANEL, other), spec()))
    assert (edges.facet_a.tolist(), edges.facet_b.tolist()) == ([0], [1])
    ends = sorted([edges.start[0].tolist(), edges.end[0].tolist()])
    np.testing.assert_allclose(ends, [(1.92, 0, 0), (1.92, 1.08, 0)], atol=1e-5)
    apart = moved(PANEL, 1.93, 0, 0)
    assert shared_edges(build_facets(mesh_of(PANEL, apart), spec())).count == 0


def test_t_junctions_share_pieces() -> None:
    high = moved(PANEL * (1, 0.5, 1), 1.92, 0.54, 0)
    low = moved(PANEL * (1, 0.5, 1), 1.92, 0, 0)
    edges = shared_edges(build_facets(mesh_of(PANEL, high, low), spec()))
    assert list(zip(edges.facet_a.tolist(), edges.facet_b.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 2)]
    lengths = np.linalg.norm(edges.end - edges.start, axis=1)
    np.testing.assert_allclose(lengths, [0.54, 0.54, 1.92], atol=1e-12)


def test_staggered_panels_share_the_overlap() -> None:
    edges = shared_edges(build_facets(mesh_of(PANEL, moved(PANEL, 1.92, 0.4, 0)), spec()))
    np.testing.assert_allclose(np.linalg.norm(edges.end - edges.start, axis=1), [0.68], atol=1e-12)


def test_three_facets_on_one_edge_share_it_in_pairs() -> None:
    wings = [
        np.array([(0, 0, 0), (0, 1, 0), (np.cos(t), 1, np.sin(t)), (np.cos(t), 0, np.sin(t))])
        for t in (0, 2, 4)
    ]
    edges = shared_edges(build_facets(mesh_of(*wings), spec()))
    assert list(zip(edges.facet_a.tolist(), edges.facet_b.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 2)]


# The hash


def test_hash_follows_geometry_and_nothing_else() -> None:
    facets = facet(PANEL)
    assert facets.sha256 == facet(PANEL + 1e-13).sha256
    assert facets.sha256 == replace(facets, names=("x",), path="y", enabled=~facets.enabled).sha256
    others = [
        facet(PANEL + 1e-6),
        facet(PANEL, viewing_side="back"),
        facet(PANEL, viewing_side="both"),
        facet(PANEL, facets={1: {"rotate": 180}}),
        facet(PANEL, facets={1: {"facet_pixels": [192, 109]}}),
    ]
    assert len({facets.sha256, *(other.sha256 for other in others)}) == 6


def test_file_to_facets(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng wall\nf 1 2 3 4\n")
    path = tmp_path / "d.yaml"
    path.write_text("quilt_display: 1\nmesh: m.obj\nresolution: {pixels_per_metre: 10}\n")
    facets = load_display(load_display_file(path))
    assert facets.names == ("wall",)
    assert facets.path == str(path)
    assert facets.size.tolist() == [[10, 10]]
