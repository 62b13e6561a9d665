"""Triangles cover their polygons: notches, straight corners, windows; areas tell when they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quiltcli.formats.mesh.coverage import coverage
from quiltcli.formats.mesh.polygons import Triangles, plane_coordinates, triangle_areas, triangulate
from quiltcli.geometry import FloatArray, rotation_deg

U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
DART = [(0, 0), (4, 0), (1, 1), (0, 4)]
# An outline, a bridge to a hole that winds the other way, and back over the bridge.
WINDOW = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
TWO_WINDOWS = [
    *[(0, 0), (7, 0), (7, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1)],
    *[(4, 1), (4, 3), (6, 3), (6, 1), (4, 1), (3, 1), (1, 1)],
]
STRAIGHT = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 3), (2, 3), (0, 3), (0, 2), (0, 1)]
SPIKE = [(0, 0), (4, 0), (4, 2), (6, 2), (4, 2), (4, 4), (0, 4)]
LSHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
SHAPES = {
    "u": (U, 7), "dart": (DART, 4), "window": (WINDOW, 12), "two windows": (TWO_WINDOWS, 20),
    "straight": (STRAIGHT, 9), "spike": (SPIKE, 16), "l": (LSHAPE, 3),
    "triangle with a corner on an edge": ([(0, 0), (1, 0), (2, 0), (0, 2)], 2),
}  # fmt: skip


def starts(*counts: int) -> np.ndarray:
    return np.cumsum([0, *counts])


def covered(points: FloatArray) -> tuple[Triangles, FloatArray]:
    cut = triangulate(points, starts(len(points)))
    return cut, triangle_areas(points, cut.corners)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("turn", [0, 37])
def test_triangles_cover_and_turn_one_way(name: str, first: int, turn: float) -> None:
    shape, area = SHAPES[name]
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    points = np.roll(np.array(shape, float), first, axis=0) @ np.array([[c, s], [-s, c]])
    _, areas = covered(points)
    assert areas.min() >= -1e-12
    assert areas.sum() == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize("name", ["u", "dart", "straight", "l", "window", "two windows"])
def test_every_corner_is_a_triangles_corner(name: str) -> None:
    # A corner that is left out opens a crack against the neighbour that has it.
    shape, _ = SHAPES[name]
    cut, _ = covered(np.array(shape, float))
    assert set(cut.corners.ravel().tolist()) == set(range(len(shape)))
    assert len(cut.corners) == len(shape) - 2


def inside(shape: list[tuple[float, float]], x: float, y: float) -> bool:
    """By the parity of crossings, which counts an edge and its twin for nothing."""
    crossings = 0
    for (ax, ay), (bx, by) in zip(shape, shape[1:] + shape[:1], strict=True):
        if (ay > y) != (by > y):
            crossings += x < ax + (y - ay) * (bx - ax) / (by - ay)
    return crossings % 2 == 1


@pytest.mark.parametrize("name", ["u", "dart", "window", "two windows", "l"])
def test_what_is_covered_is_what_is_inside(name: str) -> None:
    shape, _ = SHAPES[name]
    points = np.array(shape, float)
    cut, _ = covered(points)
    for x, y in np.random.default_rng(1).random((400, 2)) * 7.5 - 0.25:
        edges = points[np.roll(cut.corners, -1, axis=1)] - points[cut.corners]
        local = (x, y) - points[cut.corners]
        left = edges[..., 0] * local[..., 1] - edges[..., 1] * local[..., 0] > 0
        assert left.all(axis=1).any() == inside(shape, x, y)


@pytest.mark.parametrize("seed", range(40))
def test_stars_of_any_form_are_covered(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = int(random.integers(5, 60))
    angle = np.arange(count) * 2 * np.pi / count
    points = (random.random(count) * 0.9 + 0.1)[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    found = coverage(points, starts(count), covered(points)[0])
    assert (found.faces, found.wrong, found.crossing) == (1, 0, 0)
    assert found.worst < 1e-14


def test_convex_polygons_are_fans_and_come_in_their_order() -> None:
    angle = np.arange(5) * 2 * np.pi / 5
    pentagon = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    points = np.concatenate((square, pentagon, np.array(DART, float), square[:3]))
    cut = triangulate(points, starts(4, 5, 4, 3))
    assert cut.face.tolist() == [0, 0, 1, 1, 1, 2, 2, 3]
    assert cut.corners[:5].tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7], [4, 7, 8]]
    # A dart is cut at the corner that points inwards.
    assert all(11 in triangle for triangle in cut.corners[5:7].tolist())


def test_quadrilaterals_are_cut_as_ears_would() -> None:
    from quiltcli.formats.mesh.ears import ear_clip

    random = np.random.default_rng(0)
    quads = random.random((300, 4, 2))
    for quad in quads:
        cut, areas = covered(quad)
        if areas.min() > 0:
            assert sorted(sorted(t) for t in cut.corners.tolist()) in (
                sorted(sorted(t) for t in ear_clip(quad)),
                [[0, 1, 2], [0, 2, 3]],
            )


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e155, 1e200, 1e305])
def test_polygons_of_any_size_are_cut(size: float) -> None:
    points = np.array([*DART, *DART, *DART], float) * size
    with np.errstate(all="ignore"):
        assert len(triangulate(points, starts(len(points))).face) <= len(points) - 2


def test_planes_may_lie_anywhere() -> None:
    flat = np.array([(x, y, 0.0) for x, y in WINDOW])
    corners = flat @ rotation_deg((30, 50, 70)).T * 0.01 + (100, -20, 3)
    points = plane_coordinates(corners, starts(len(corners)))
    _, areas = covered(points)
    assert areas.sum() == pytest.approx(12e-4, rel=1e-9)


def test_a_fan_over_a_notch_is_told() -> None:
    points = np.array(U, float)
    fan = np.array([(0, k, k + 1) for k in range(1, 7)])
    found = coverage(points, starts(8), Triangles(fan, np.zeros(6, np.int64)))
    assert (found.faces, found.wrong, found.crossing, found.first) == (1, 1, 0, 0)
    assert (found.area, found.triangle_area) == (7, 11)


def test_a_missing_triangle_is_told() -> None:
    points = np.array(U, float)
    cut, _ = covered(points)
    assert coverage(points, starts(8), Triangles(cut.corners[1:], cut.face[1:])).wrong == 1


def test_outlines_that_cross_themselves_are_counted_apart() -> None:
    bow = np.array([(0, 0), (4, 4), (4, 0), (0, 3)], float)
    found = coverage(bow, starts(4), triangulate(bow, starts(4)))
    assert (found.wrong, found.crossing) == (0, 1)


@pytest.mark.parametrize("count", [5, 8, 40])
def test_tangles_end(count: int) -> None:
    points = np.random.default_rng(count).random((count, 2))
    assert len(triangulate(points, starts(count)).corners) <= count - 2


def test_polygons_without_area_or_place_become_fans() -> None:
    points = np.zeros((8, 2))
    points[4:] = np.nan
    assert triangulate(points, starts(4, 4)).face.tolist() == [0, 0, 1, 1]


def test_large_outlines_take_little_time() -> None:
    import time

    angle = np.arange(2000) * 2 * np.pi / 2000
    radius = np.where(np.arange(2000) % 2, 1, 0.5)
    points = radius[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    begin = time.process_time()
    assert covered(points)[1].min() > 0
    assert time.process_time() - begin < 5
