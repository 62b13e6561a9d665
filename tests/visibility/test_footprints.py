"""Attributes and their slopes, through the product's own edge planes, against points in long double."""

import numpy as np
import pytest

from quiltcli.visibility.resolve.footprints import Cells, EdgePlanes, PixelEdges, TileEdges, edge_planes_of
from quiltcli.visibility.setup.planes import LATTICE, PlaneTable, Warped

LONG = np.longdouble


def tables(count, seed):
    """Triangles in homogeneous pixels of a block, all seen at the block's pixel (20, 12), at any slant."""
    dice = np.random.default_rng(seed)
    where = np.array([20.0, 12.0])
    angle = dice.uniform(0, 2 * np.pi, (count, 1)) + np.array([0, 2.1, 4.2])
    radius = 10 ** dice.uniform(0.7, 3, (count, 3))
    w = 10 ** dice.uniform(-1, 1, (count, 1)) * dice.uniform(1, 6, (count, 3))
    x, y = where[0] + radius * np.cos(angle), where[1] + radius * np.sin(angle)
    corners = np.stack((x * w, y * w, w)).transpose(2, 0, 1)  # [corner, X/Y/W, triangle]
    box = np.tile(np.array([[0], [40], [0], [24]], np.int32), count)
    pairs = Warped(
        np.arange(count, dtype=np.int32), np.zeros(count, np.int32), np.ascontiguousarray(corners), box,
        np.zeros(count, bool),
    )  # fmt: skip
    table = PlaneTable(count)
    table.add(pairs, np.arange(count))
    return table.planes, corners


def truth(corners, values, x, y):
    """Attributes (2, n) at pixels, by solving for what each corner counts, in long double."""
    a, b, c = (corners[k].astype(LONG) for k in range(3))
    # The block's pixels are where the shifted lattice's whole numbers are not.
    p = np.stack((x + LONG(0) - LONG(LATTICE[0]), y + LONG(0) - LONG(LATTICE[1]), np.ones_like(x, LONG)))
    p = np.broadcast_to(p, a.shape)

    def volume(f, g, h):
        return (
            f[0] * (g[1] * h[2] - g[2] * h[1])
            - f[1] * (g[0] * h[2] - g[2] * h[0])
            + f[2] * (g[0] * h[1] - g[1] * h[0])
        )

    weights = np.stack((volume(p, b, c), volume(a, p, c), volume(a, b, p)))
    return (values.astype(LONG) * weights).sum(axis=1) / weights.sum(axis=0)


@pytest.mark.parametrize("kind", ["tiles", "pixels"])
def test_slopes_are_those_of_differences_in_long_double(kind):
    count = 20_000
    planes, corners = tables(count, 11)
    rows, here = np.arange(count), np.zeros(count, np.int32)
    values = np.random.default_rng(12).uniform(0, 5, (2, 3, count))
    x, y = np.full(count, 17), np.full(count, 9)
    edges = edge_planes_of(planes, rows, x, y, None, here)
    if kind == "tiles":
        found, place = TileEdges(edges, 1).footprint(values), 3 * 8 + 3  # the fourth pixel of the fourth row
        u, v, slopes = found.u[:, place], found.v[:, place], found.slopes[:, :, place]
    else:
        at = PixelEdges(edges, rows, x + 3.0, y + 3.0, x.astype(np.int32), y.astype(np.int32))
        found = at.footprint(values)
        u, v, slopes = found.u[:, 0], found.v[:, 0], found.slopes[:, :, 0]
    px, py, step = x + LONG(3), y + LONG(3), LONG(2.0**-12)
    expected = truth(corners, values, px, py)
    reach = np.abs(values).max(axis=1)
    error = np.abs(np.stack((u, v)) - expected) / reach
    assert np.quantile(error.astype(float), 0.999) < 1e-9
    right, left = truth(corners, values, px + step, py), truth(corners, values, px - step, py)
    below, above = truth(corners, values, px, py + step), truth(corners, values, px, py - step)
    differences = np.stack([(right - left)[0], (below - above)[0], (right - left)[1], (below - above)[1]])
    differences = (differences / (2 * step)).astype(float)
    size = np.sqrt((differences**2).sum(axis=0))
    error = np.abs(slopes - differences).max(axis=0) / size
    assert np.median(error) < 2e-7
    assert np.quantile(error, 0.999) < 2e-5


def test_a_cell_is_looked_at_in_its_middle_and_as_large_as_it_is():
    planes, corners = tables(500, 13)
    values = np.random.default_rng(14).uniform(0, 5, (2, 3, 500))
    rows, x, y, facet = np.arange(500), np.full(500, 20), np.full(500, 12), np.zeros(500, np.int32)
    cells = Cells(np.array([[0.25, -0.125]]), np.array([[0.5, 0.25]]))
    whole = TileEdges(edge_planes_of(planes, rows, x, y, None, facet), 1).footprint(values)
    part = TileEdges(edge_planes_of(planes, rows, x, y, cells, facet), 1).footprint(values)
    expected = truth(corners, values, LONG(20.25) + 0 * x, LONG(11.875) + 0 * y)
    np.testing.assert_allclose(part.u[:, 0], expected[0].astype(float), rtol=1e-6)
    ratio = part.slopes[:, :, 0] / whole.slopes[:, :, 0]
    np.testing.assert_allclose(np.median(ratio, axis=1), [0.5, 0.25, 0.5, 0.25], rtol=0.02)


def test_beyond_the_horizon_it_is_the_sample_itself_that_is_looked_at():
    """The sum of the edge functions is 0 half a pixel to the right, where the cell's middle is."""
    planes = np.zeros((3, 3, 1))
    planes[0, :, 0] = (-1.0, 0, 0.4)  # 0.4 at the sample, −0.1 in the middle of its cell
    planes[1, :, 0] = (0.2, 0.1, 0.1)
    edges = EdgePlanes(np.zeros(1, np.int32), planes, np.array([[0.5], [0]]), np.array([[0.5], [1.0]]))
    here = TileEdges(EdgePlanes(edges.triangle, planes), 1)
    values = np.array([[0.0, 1, 0], [0, 0, 1]])[..., None]
    found, own = TileEdges(edges, 1).footprint(values), here.footprint(values)
    assert found.u[0, 0] == own.u[0, 0] == pytest.approx(0.25)
