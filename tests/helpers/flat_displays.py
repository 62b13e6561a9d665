"""Displays and layouts made from polygons in pixels, for tests: 1 pixel is 1 mm, in the plane z = 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.geometry import FloatArray
from quiltcli.layout import Layout

PITCH = 2.0**-10  # metres a pixel: a power of two keeps closed forms exact


def flat_display(
    polygons: Sequence[Sequence[Sequence[float]]],
    names: Sequence[str] = (),
    uv: FloatArray | None = None,
    enabled: Sequence[bool] | None = None,
) -> Facets:
    """Facets with these corners in facet pixels, all rasters starting at the world's origin, lit from +z."""
    count = len(polygons)
    pixels = np.concatenate([np.asarray(polygon, dtype=np.float64) for polygon in polygons])
    corners = np.column_stack((pixels * (PITCH, -PITCH), np.zeros(len(pixels))))
    highest = [np.ceil(np.max(np.asarray(polygon), axis=0) - 1e-9) for polygon in polygons]
    return Facets(
        names=tuple(names) or ("",) * count,
        corner_start=np.cumsum([0, *map(len, polygons)]),
        corners=corners,
        origin=np.zeros((count, 3)),
        du=np.tile((PITCH, 0.0, 0.0), (count, 1)),
        dv=np.tile((0.0, -PITCH, 0.0), (count, 1)),
        size=np.array(highest, dtype=np.int32),
        normal=np.tile((0.0, 0.0, 1.0), (count, 1)),
        both_sides=False,
        enabled=np.ones(count, dtype=np.bool_) if enabled is None else np.array(enabled),
        mirrored=np.zeros(count, dtype=np.bool_),
        uv=uv,
        path="flat.yaml",
    )


def placed(
    facets: Facets,
    maps: Sequence[Sequence[Sequence[float]]],
    page: tuple[int, int] = (16, 16),
    on: Sequence[int] | None = None,
    pages: int = 1,
) -> Layout:
    """A hand-made layout: `maps` are quilt_from_facet, `on` the 0-based pages."""
    count = facets.count
    return Layout(
        facet=np.arange(1, count + 1, dtype=np.int32),
        page=np.zeros(count, np.int32) if on is None else np.array(on, np.int32),
        size=facets.size,
        quilt_from_facet=np.array(maps, dtype=np.float64),
        origin=facets.origin,
        du=facets.du,
        dv=facets.dv,
        corner_start=facets.corner_start,
        polygon=corner_pixels(facets),
        pages=np.array([page] * pages, dtype=np.int32),
        padding=0,
        method="manual",
        display=facets.path,
        display_sha256=facets.sha256,
    )


def tiling(polygons: Sequence[Sequence[Sequence[float]]], page: tuple[int, int]) -> Layout:
    """A layout whose facets lie in the quilt exactly as these polygons in pixels."""
    facets = flat_display(polygons)
    facets = replace(facets, size=np.tile(np.array(page, dtype=np.int32), (facets.count, 1)))
    return placed(facets, [np.eye(2, 3)] * facets.count, page)


def moved(x: float, y: float) -> list[list[float]]:
    """The map of a facet that stands upright with its raster's corner at (x, y)."""
    return [[1, 0, x], [0, 1, y]]


def rectangle(width: float, height: float) -> list[list[float]]:
    """Corners of a rectangle at the raster's corner."""
    return [[0, 0], [width, 0], [width, height], [0, height]]


def shifted(polygon: Sequence[Sequence[float]], x: float, y: float) -> FloatArray:
    """Corners (n, 2) moved by this much."""
    return np.asarray(polygon, dtype=np.float64) + np.array((x, y))


def random_polygons(count: int, low: float, high: float, seed: int) -> list[FloatArray]:
    """Simple polygons of 3 to 7 corners on sixteenths of pixels, some concave, this many pixels across."""
    rng = np.random.default_rng(seed)
    result = []
    for _ in range(count):
        n = int(rng.integers(3, 8))
        angle = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2 * np.pi / n
        radius = rng.uniform(low, high) / 2 * (rng.uniform(0.4, 1, n) if n > 4 else np.ones(n))
        polygon = np.column_stack((np.cos(angle), np.sin(angle))) * radius[:, None]
        polygon = np.round(polygon * 16) / 16
        result.append(polygon - polygon.min(axis=0))
    return result
