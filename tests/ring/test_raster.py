"""The rasterizer in ray space against rays in the world, pixel by pixel."""

from __future__ import annotations

import math
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quiltcli.ring import raster
from quiltcli.ring.cast import see_by_rays
from quiltcli.ring.curve import Curve
from quiltcli.ring.forms import distances, edge_values, forms_of
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.plane import on_mirror
from quiltcli.ring.propose import bending, propose
from quiltcli.ring.raster import Limits, depth, in_frame, see
from quiltcli.ring.rays import rays_at
from quiltcli.ring.rig import Pose, Rig, Side
from quiltcli.ring.vertexwise import see_by_vertices
from quiltcli.visibility.setup.planes import LATTICE
from tests.helpers.ring_scenes import (
    RING,
    TRACKED,
    ball,
    brute_force,
    cube,
    mesh_of,
    pose,
    rig,
    tilted,
    whole,
    world_rays,
)

SIZE = (64, 64)


def centres(size: tuple[int, int], part: int) -> tuple[np.ndarray, np.ndarray]:
    """Samples of every `part`th pixel."""
    y, x = np.mgrid[: size[1], : size[0]]
    chosen = (x + 3 * y) % part == 0
    return x[chosen], y[chosen]


@pytest.mark.parametrize("culled", [False, True])
@pytest.mark.parametrize("shape", [ball, cube])
@pytest.mark.parametrize(
    ("angle", "aside", "cone", "curve"),
    [
        (0.0, False, False, RING),
        (0.3, True, False, RING),
        (0.3, True, True, TRACKED),
        (math.pi / 2, False, True, RING),
        (4.0, False, False, TRACKED),
        (5.5, True, False, Curve(0.05, 0.3)),
    ],
)
def test_every_pixel_sees_what_its_ray_meets(
    angle: float, aside: bool, cone: bool, curve: Curve, shape, culled: bool
) -> None:
    where, mesh = pose(SIZE, angle, aside=aside, cone=cone), mesh_of(*shape())
    seen = see(where, curve, mesh, SIZE, culled)
    x, y = centres(SIZE, 5)
    eye, along = world_rays(where, curve, x + 0.5 + LATTICE[0], y + 0.5 + LATTICE[1])
    found, far = brute_force(mesh, eye, along, culled)
    assert np.array_equal(whole(seen, SIZE)[y, x], found)
    assert (found >= 0).mean() > 0.1
    picture = np.zeros(SIZE[::-1])
    picture[whole(seen, SIZE) >= 0] = depth(seen.rays, seen.pixel, _s(mesh, seen))
    hit = found >= 0
    assert np.abs(picture[y, x][hit] - far[hit]).max() < 1e-12


def _s(mesh, seen) -> np.ndarray:
    corners = [seen.corners[:, corner[seen.triangle]] for corner in mesh.triangles]
    rays = seen.rays
    eta = None if rays.eta is None else rays.eta[seen.pixel]
    plane = forms_of(*corners).plane
    return distances(plane, rays.b[seen.pixel], rays.m[seen.pixel], rays.kappa[seen.pixel], eta)


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_a_closed_mesh_is_met_twice_everywhere(angle: float) -> None:
    mesh = mesh_of(*ball())
    seen = see(pose(SIZE, angle), RING, mesh, SIZE)
    assert seen.fragments == 2 * seen.pixel.size
    assert see(pose(SIZE, angle), RING, mesh, SIZE, True).fragments == seen.pixel.size


@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 2])
@pytest.mark.parametrize("cone", [False, True])
def test_a_sheet_with_its_corners_on_pixels_has_no_hole_and_no_double(angle: float, cone: bool) -> None:
    where = pose(SIZE, angle, cone=cone)
    columns = np.arange(14, 50, 3)
    y, x = np.meshgrid(columns + 0.5, columns + 0.5, indexing="ij")
    rays = rays_at(where, RING, x.reshape(-1), y.reshape(-1))
    depths = 0.6 + 0.002 * np.sin(np.arange(x.size))
    corners = where.to_world(rays.points(slice(None), depths).T)
    count = columns.size
    at = np.arange(x.size).reshape(count, count)
    first, right, below, last = (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:])
    triangles = np.concatenate(
        [np.stack(some, axis=-1).reshape(-1, 3) for some in ((first, right, below), (right, last, below))]
    ).astype(np.int32)
    seen = see(where, RING, mesh_of(corners, triangles), SIZE)
    assert seen.fragments == seen.pixel.size
    inside = whole(seen, SIZE)[17:47, 17:47]
    assert (inside >= 0).all()


@pytest.mark.parametrize("cone", [False, True])
def test_edges_are_those_of_space_and_neighbours_have_the_negative(cone: bool) -> None:
    where, mesh = pose(SIZE, 0.8, aside=True, cone=cone), mesh_of(*ball(times=1))
    corners = in_frame(where, mesh.vertices)
    a, b, c = (corners[:, corner] for corner in mesh.triangles)
    rng = np.random.default_rng(2)
    rays = rays_at(where, RING, *rng.uniform(10, 54, (2, mesh.count)))
    numbers = (rays.b, rays.m, rays.kappa, rays.omega, rays.eta)
    forms, other = forms_of(a, b, c), forms_of(b, a, c)
    value = edge_values(forms.edges[2], *numbers)
    assert np.array_equal(value, -edge_values(other.edges[2], *numbers))
    start = rays.points(slice(None), np.zeros(mesh.count))
    along = rays.points(slice(None), np.ones(mesh.count)) - start
    volume = np.linalg.det(np.stack((along, a - start, b - start)).transpose(2, 0, 1))
    size = np.abs(along).max() * np.abs(a - start).max() * np.abs(b - start).max()
    assert np.abs(value - volume).max() < 1e-12 * size


def _covered_and_boxed(where: Pose, curve: Curve, corners: np.ndarray) -> int:
    """Hold the boxes of triangles (T, 3, 3) against the pixels that they cover; how many these are."""
    mesh = mesh_of(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))
    points = in_frame(where, mesh.vertices)
    bend = bending(where, curve, points.min(axis=1), points.max(axis=1))
    x, y = raster._pixels(where, curve, points)
    boxes = propose(x, y, mesh.triangles, mesh.square, bend, SIZE, LATTICE, False)
    row, column = (part.reshape(-1) for part in np.mgrid[: SIZE[1], : SIZE[0]])
    rays = rays_at(where, curve, column + 0.5 + LATTICE[0], row + 0.5 + LATTICE[1])
    covered = 0
    for number in range(mesh.count):
        forms = forms_of(*(points[:, corner[number], None] for corner in mesh.triangles))
        values = [edge_values(edge, rays.b, rays.m, rays.kappa, rays.omega, rays.eta) for edge in forms.edges]
        inside = (np.min(values, axis=0) > 0) | (np.max(values, axis=0) < 0)
        box = np.flatnonzero(boxes.triangle == number)
        if not inside.any():
            continue
        covered += int(inside.sum())
        assert box.size == 1
        left, top = boxes.x[box[0]], boxes.y[box[0]]
        assert column[inside].min() >= left
        assert column[inside].max() < left + boxes.width[box[0]]
        assert row[inside].min() >= top
        assert row[inside].max() < top + boxes.height[box[0]]
    return covered


@pytest.mark.parametrize(("angle", "curve"), [(0.0, RING), (0.3, TRACKED), (2.5, Curve(0.0, 0.56))])
@pytest.mark.parametrize("cone", [False, True])
def test_boxes_hold_every_pixel_that_a_triangle_covers(angle: float, curve: Curve, cone: bool) -> None:
    rng = np.random.default_rng(7)
    corners = rng.uniform(-0.03, 0.03, (40, 3, 3))
    corners[20:] = corners[20:, :1] + 0.1 * (corners[20:] - corners[20:, :1])
    assert _covered_and_boxed(pose(SIZE, angle, aside=True, cone=cone), curve, corners) > 500


@given(
    seed=st.integers(0, 2**32 - 1),
    long=st.floats(0.001, 0.08),
    angle=st.floats(0, 6.3),
    height=st.floats(-0.1, 1.5),
    distance=st.floats(0.2, 4),
    cone=st.booleans(),
    aside=st.booleans(),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_boxes_hold_all_pixels_of_any_triangles_for_any_viewers(
    seed: int, long: float, angle: float, height: float, distance: float, cone: bool, aside: bool
) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.04, 0.04, (6, 1, 3)) + rng.uniform(-long, long, (6, 3, 3)) / 2
    _covered_and_boxed(pose(SIZE, angle, aside=aside, cone=cone), Curve(height, distance), corners)


@pytest.mark.parametrize("chunk", [64, 700])
def test_the_size_of_chunks_and_tiles_changes_nothing(chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = mesh_of(*ball(times=1))
    usual = see(pose(SIZE), TRACKED, mesh, SIZE)
    monkeypatch.setattr(raster, "_CHUNK", chunk)
    monkeypatch.setattr(raster, "_TILE", 4)
    monkeypatch.setattr(raster, "_SIDES", (1, 2, 4))
    monkeypatch.setattr("quiltcli.ring.rays._ROWS", chunk)
    other = see(pose(SIZE), TRACKED, mesh, SIZE)
    assert np.array_equal(whole(usual, SIZE), whole(other, SIZE))
    assert np.array_equal(usual.rays.kappa, other.rays.kappa)


def test_near_and_far_cut_by_the_distance_from_each_viewpoint() -> None:
    mesh = mesh_of(*ball())
    all_of_it = see(pose(SIZE), RING, mesh, SIZE)
    distance = depth(all_of_it.rays, all_of_it.pixel, _s(mesh, all_of_it))
    middle = float(np.median(distance))
    front = see(pose(SIZE), RING, mesh, SIZE, limits=Limits(0.01, middle))
    assert np.array_equal(front.pixel + 0, all_of_it.pixel[distance <= middle])
    back = see(pose(SIZE), RING, mesh, SIZE, limits=Limits(middle, 3.0))
    assert (depth(back.rays, back.pixel, _s(mesh, back)) >= middle).all()
    assert back.pixel.size == all_of_it.pixel.size


@pytest.mark.parametrize("aside", [False, True])
@pytest.mark.parametrize("kind", ["disk", "rectangle", "tent", "tent of rectangles"])
def test_lit_pixels_are_those_that_meet_the_outline(kind: str, aside: bool) -> None:
    size = (90, 80)
    projector = tilted(size) if aside else rig(size).sides[0].projector
    ridge = 0.02 if "tent" in kind else 0.0
    sides = tuple(Side(turn, ridge, projector) for turn in ((0.0, math.pi) if ridge else (0.0,)))
    disk = 0.0 if "rectangle" in kind else 0.1
    whole_rig = Rig(size, sides, math.pi / 4, disk, (0.08, 0.06), 288, 0.0, 0.02, 0.02)
    for angle, side in product((0.0, 0.7, 3.0), range(len(sides))):
        where = whole_rig.at(angle, side)
        y, x = np.mgrid[: size[1], : size[0]] + 0.5
        e, f, up = on_mirror(where, x, y) + where.origin[:, None, None]
        if disk:
            inside = np.hypot(e, f) <= disk / 2
        else:
            slope = (up - ridge) * math.sin(math.pi / 4) - e * math.cos(math.pi / 4)
            inside = (np.abs(f) <= 0.04) & (slope >= (-0.06 if ridge else -0.03))
            inside &= (slope <= 0.03) | bool(ridge)
        if ridge:
            inside &= e >= 0
        assert np.array_equal(lit_pixels(whole_rig, where), inside)


@pytest.mark.parametrize("culled", [False, True])
@pytest.mark.parametrize(("angle", "cone", "curve"), [(0.3, False, RING), (2.0, True, TRACKED)])
def test_rays_and_edge_functions_see_the_same(angle: float, cone: bool, curve: Curve, culled: bool) -> None:
    mesh, where = mesh_of(*ball()), pose(SIZE, angle, aside=True, cone=cone)
    limits = Limits(0.01, curve.distance)
    by_rays = see_by_rays(where, curve, mesh, SIZE, culled, limits)
    exact = see(where, curve, mesh, SIZE, culled, limits)
    assert np.array_equal(whole(by_rays, SIZE), whole(exact, SIZE))


def test_straight_edges_are_wrong_and_less_so_the_finer_they_are() -> None:
    """An edge bends with the square of its length: of half of it, a quarter of the pixels are wrong."""
    size = (512, 512)
    mesh, where = mesh_of(*cube(0.04)), pose(size)
    corners = in_frame(where, mesh.vertices)
    bend = bending(where, RING, corners.min(axis=1), corners.max(axis=1)).most / 2
    whole_edges = 1.0001 * float(mesh.square.max()) * bend / 8
    exact = whole(see(where, RING, mesh, size), size)
    wrong = [
        int((whole(see_by_vertices(where, RING, mesh, size, tessellate=most), size) != exact).sum())
        for most in (whole_edges / 4**halved for halved in range(5))
    ]
    assert wrong[0] > 2000
    assert all(more >= 3 * less for more, less in pairwise(wrong))
