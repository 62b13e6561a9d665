"""Planes over microtiles, and hits that go to their pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.shading.aovs import half_floats
from quiltcli.visibility.resolve.hits import RUN, Places, single_places
from quiltcli.visibility.resolve.vectors import (
    BlockVectors,
    PointVectors,
    TileVectors,
    along,
    products,
    vector_values,
)
from quiltcli.visibility.setup.grids import BASIS, exact_values, single_values
from tests.helpers.wall_scene import hits


def planes(count, seed=4):
    """Planes (3, count) of very different slopes and heights."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(3, count)) * 10.0 ** rng.integers(-9, 9, (3, count))


def test_values_over_a_microtile_are_those_of_the_plane():
    plane = planes(500)
    expected = plane.T @ BASIS
    reach = np.abs(plane.T) @ np.array([7, 7, 1])
    # Coefficients are rounded to 2⁻⁵⁰ of a number that is at most 8/7 of the reach; the product rounds, too.
    bound = (7 + 7 + 1) * 2.0**-51 * 8 / 7 + 3 * 2.0**-53
    assert (np.abs(exact_values(plane) - expected) <= bound * reach[:, None]).all()


def test_values_do_not_depend_on_the_order_of_sums_nor_on_the_company():
    plane = planes(97)
    whole = exact_values(plane)
    for part in (slice(0, 1), slice(5, 18), slice(40, 97)):
        np.testing.assert_array_equal(exact_values(plane[:, part].copy()), whole[part])
    for form in (plane, quadratics(97)):
        whole = single_values(form)
        for part in (slice(0, 1), slice(5, 18), slice(40, 97)):
            np.testing.assert_array_equal(single_values(form[:, part].copy()), whole[part])
    # Every partial sum of the rounded planes is exact: adding backwards changes nothing.
    whole = exact_values(plane)
    first = whole[:, :1]
    steps = whole[:, 1:2] - first, whole[:, 8:9] - first
    np.testing.assert_array_equal(steps[1] * BASIS[1] + (steps[0] * BASIS[0] + first), whole)


def test_vectors_keep_their_direction():
    rng = np.random.default_rng(8)
    planes = rng.normal(size=(3, 3, 300)) * 10.0 ** rng.integers(-12, 12, 300)
    planes[:, :2] *= 0.02
    exact = np.einsum("cin,ip->cnp", planes, BASIS)
    error = np.abs(vector_values(TileVectors(planes)) - exact)
    assert (error <= 2.0**-23 * np.abs(exact).max(axis=(0, 2))[:, None]).all()


def quadratics(count, seed=6):
    """Forms (6, count) as products of rays and normals have them: both vary little over a microtile."""
    a, b = (tile_vectors(count, seed + k).planes for k in (0, 1))
    return np.stack(
        (
            (a[:, 0] * b[:, 0]).sum(axis=0),
            (a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0]).sum(axis=0),
            (a[:, 1] * b[:, 1]).sum(axis=0),
            (a[:, 0] * b[:, 2] + a[:, 2] * b[:, 0]).sum(axis=0),
            (a[:, 1] * b[:, 2] + a[:, 2] * b[:, 1]).sum(axis=0),
            (a[:, 2] * b[:, 2]).sum(axis=0),
        )
    )


def tile_vectors(count, seed):
    rng = np.random.default_rng(seed)
    planes = rng.normal(size=(3, 3, count))
    planes[:, :2] *= 0.02
    return TileVectors(planes)


def block_vectors(count, seed):
    """Vectors of microtiles anywhere in seven blocks, and the same as planes over the microtiles."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(3, 3, 7))
    matrix[:, :2] *= 0.004
    block, x, y = rng.integers(0, 7, count), 8 * rng.integers(0, 64, count), 8 * rng.integers(0, 64, count)
    planes = matrix[:, :, block]
    planes[:, 2] += planes[:, 0] * x + planes[:, 1] * y
    return BlockVectors(matrix, block, x, y), planes


def test_vectors_over_a_microtile_and_their_products_are_those_of_the_planes():
    normals, (rays, planes) = tile_vectors(300, 8), block_vectors(300, 9)
    np.testing.assert_array_equal(rays.planes, planes)
    direction = np.float32([0.2, -0.7, 0.4])
    ones = PointVectors(np.random.default_rng(1).normal(size=(3, 300, 1)).astype(np.float32))
    one = PointVectors(ones.values[:, :1])
    n, r = (np.einsum("cin,ip->cnp", form, BASIS) for form in (normals.planes, planes))
    single = PointVectors(vector_values(normals))
    for got, expected in (
        (vector_values(normals), n),
        (vector_values(rays), r),
        (along(normals, direction), np.einsum("cnp,c->np", n, direction)),
        (along(rays, direction), np.einsum("cnp,c->np", r, direction)),
        (products(normals, rays), (n * r).sum(axis=0)),
        (products(normals, normals), (n * n).sum(axis=0)),
        (products(rays, rays), (r * r).sum(axis=0)),
        (products(ones, rays), (ones.values * r).sum(axis=0)),
        (products(one, rays), (one.values * r).sum(axis=0)),
    ):
        np.testing.assert_allclose(got, expected, rtol=2.0**-23, atol=2.0**-42)
    # Point by point, factors, products and sums are rounded in single precision, too.
    sizes = np.abs(n * r).sum(axis=0)
    assert (np.abs(products(single, rays) - (n * r).sum(axis=0)) <= 5 * 2.0**-24 * sizes).all()


def test_products_with_one_normal_do_not_depend_on_how_often_it_is_given():
    rays, _ = block_vectors(100, 3)
    normal = np.random.default_rng(2).normal(size=(3, 1, 1)).astype(np.float32)
    many = products(PointVectors(np.repeat(normal, 100, axis=1)), rays)
    np.testing.assert_array_equal(products(PointVectors(normal), rays), many)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.uint32])
@pytest.mark.parametrize("run", [RUN, 4 * RUN])
@pytest.mark.parametrize("first", [(0, 2, 3), (1, 7, 4), (1, 7.5, 4), (0.125, 3, 9.25)])
@pytest.mark.parametrize("single", [(), (90, 88)])
def test_runs_go_to_neighbours_wherever_they_begin(kind, run, first, single):
    first, size = (np.array(first) * run).astype(int), 12 * run + 3
    single = np.array(single, int) * run // RUN
    count = 3 * run + single.size
    values = np.arange(count)
    one = hits(np.zeros((3, 1)))
    seen = replace(one, places=Places(first, run, single), depth=np.zeros((1, count)))
    assert np.unique(seen.pixel).size == count
    buffer = np.full(size, 999, kind)
    seen.put(buffer, values[None])
    expected = np.full(size, 999, kind)
    expected[seen.pixel] = values
    np.testing.assert_array_equal(buffer, expected)
    seen.put(buffer, np.array([[5]]))
    np.testing.assert_array_equal(buffer, np.where(expected == 999, 999, 5))
    groups = replace(seen, depth=np.zeros((count, 1)))
    groups.put(buffer, values[:, None])
    np.testing.assert_array_equal(buffer, expected)


def test_of_groups_only_the_chosen_pixels_are_drawn():
    chosen = np.array([1, 15, 16, 30])
    seen = replace(
        hits(np.zeros((3, 2))), places=single_places(chosen * 2), chosen=chosen, depth=np.zeros((2, 16))
    )
    buffer = np.full(64, 99.0)
    seen.put(buffer, np.arange(32).reshape(2, 16))
    assert buffer[chosen * 2].tolist() == chosen.tolist()
    assert np.count_nonzero(buffer != 99) == 4
    seen.put(buffer, np.array([[5], [7]]))
    assert buffer[chosen * 2].tolist() == [5, 5, 7, 7]
    seen.put(buffer, np.array([[1]]))
    assert (buffer[chosen * 2] == 1).all()


def test_half_floats_are_the_nearest():
    rng = np.random.default_rng(2)
    values = np.concatenate((2.0 ** rng.uniform(-24, 15.9, 20000), [0, 1, 65504, 2.0**-24])).astype(
        np.float32
    )
    got, nearest = half_floats(values), values.astype(np.float16)
    error, least = (np.abs(values.astype(np.float64) - h.astype(np.float64)) for h in (got, nearest))
    np.testing.assert_array_equal(error, least)


def test_half_floats_of_what_lies_beside_their_range():
    much = half_floats(np.array([65519, 65521, 1e30, np.inf], np.float32))
    assert much.tolist() == [65504] * 4
    # Sums that are to be 0 may come out a little below it.
    assert half_floats(np.array([-0.0, -1e-35, -1e-8], np.float32)).tolist() == [0] * 3
    assert np.isnan(half_floats(np.array([np.nan, -np.nan], np.float32))).all()
