"""Curved facets: surfaces and projections as rows of `Facets`, each with its chart.

What asks for a plane, as packing and drawings do, is given a rectangle of the facet's pixels in the plane
that touches the surface in its middle; rays ask the chart.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from quiltcli.charts import Chart, projection_charts, surface_chart
from quiltcli.display.facets import Facets, Places, places_of
from quiltcli.display.rasters import MOST_PIXELS
from quiltcli.errors import DisplayError, Problem, QuiltError, raise_all
from quiltcli.geometry import FloatArray, normalized
from quiltcli.job.display import DisplayFile
from quiltcli.job.places import PlaceOnPage


def surface_facets(spec: DisplayFile) -> Facets:
    """The facets of a display's surfaces.

    Raises:
        DisplayError: every surface's first problem.
    """
    charts: list[tuple[str, Chart]] = []
    problems: list[Problem] = []
    for number, surface in enumerate(spec.surfaces or ()):
        try:
            raise_all(DisplayError, _too_many(spec, ("surfaces", number, "pixels"), surface.pixels))
            charts.append((surface.name, surface_chart(surface, number, spec)))
        except QuiltError as error:
            problems += error.problems
    raise_all(DisplayError, problems)
    given = {k: surface.place for k, surface in enumerate(spec.surfaces or (), 1)}
    mirrored = [surface.mirror for surface in spec.surfaces or ()]
    return chart_facets(charts, mirrored, given, spec, "surfaces")


def projection_facets(spec: DisplayFile) -> Facets:
    """The facets of a display that is a projection.

    Raises:
        DisplayError: it cannot be made.
    """
    projection: Any = spec.projection
    raise_all(DisplayError, _too_many(spec, ("projection", "pixels"), projection.pixels))
    charts = projection_charts(projection, spec)
    given: dict[int, PlaceOnPage | None] = {1: projection.place}
    found = chart_facets(charts, [False] * len(charts), given, spec, "projection")
    if found.places is None:
        return found
    return replace(found, places=replace(found.places, keys={1: ("projection",)}))


def chart_facets(
    charts: list[tuple[str, Chart]],
    mirrored: list[bool],
    given: dict[int, PlaceOnPage | None],
    spec: DisplayFile,
    listed: str,
) -> Facets:
    """Facets of charts alone.

    Args:
        charts: names and charts.
        mirrored: whether each shows a mirrored picture.
        given: places in the quilt by facet id.
        spec: the display file.
        listed: the key under which the file has them.
    """
    planes = [touching_plane(chart) for _, chart in charts]
    origin, du, dv, normal = (np.array([plane[k] for plane in planes]).reshape(-1, 3) for k in range(4))
    size = np.array([chart.size for _, chart in charts], dtype=np.int32).reshape(-1, 2)
    raster = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * size[:, None]
    corners = origin[:, None] + raster[..., :1] * du[:, None] + raster[..., 1:] * dv[:, None]
    return Facets(
        names=tuple(name for name, _ in charts),
        corner_start=4 * np.arange(len(charts) + 1, dtype=np.int64),
        corners=corners.reshape(-1, 3),
        origin=origin,
        du=du,
        dv=dv,
        size=size,
        normal=normal,
        both_sides=False,
        enabled=np.ones(len(charts), dtype=np.bool_),
        mirrored=np.array(mirrored, dtype=np.bool_),
        uv=None,
        path=str(spec.source.path),
        places=places_of(given, spec.source, listed=listed),
        charts=tuple(chart for _, chart in charts),
    )


def touching_plane(chart: Chart) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Origin, steps right and down and lit normal (3,) of a plane that touches a chart in its middle.

    Steps are as long as those between pixels there. Where a chart has no plane in its middle, another
    place near it is taken.
    """
    width, height = chart.size
    for share in (0.5, 0.51, 0.4, 0.6, 0.3, 0.7, 0.25, 0.75, 0.1, 0.9):
        x, y = np.array([width * share]), np.array([height * share])
        middle = chart.points(x, y)[:, 0]
        du = (chart.points(x + 0.25, y) - chart.points(x - 0.25, y))[:, 0] * 2
        dv = (chart.points(x, y + 0.25) - chart.points(x, y - 0.25))[:, 0] * 2
        if chart.mask is not None and not chart.mask[int(y[0]) % height, int(x[0]) % width]:
            continue
        normal = np.cross(dv, du)
        if np.isfinite(middle + normal).all() and np.sqrt(normal @ normal) > 1e-12 * (du @ du + dv @ dv) > 0:
            break
    else:
        middle, du, dv = np.zeros(3), np.array([1e-3, 0, 0]), np.array([0, -1e-3, 0])
        normal = np.array([0.0, 0.0, 1.0])
    unit = normalized(normal)
    # Perpendicular, so that the rectangle is one; its sides are as long as the steps are.
    down = np.cross(du, unit)
    down *= np.sqrt(dv @ dv) / np.sqrt(down @ down)
    return middle - width / 2 * du - height / 2 * down, du, down, unit * chart.side


def joined(first: Facets, second: Facets) -> Facets:
    """The facets of two displays as those of one, `second` after `first`."""
    both: dict[str, Any] = {
        name: np.concatenate((getattr(first, name), getattr(second, name)))
        for name in ("corners", "origin", "du", "dv", "size", "normal", "enabled", "mirrored")
    }
    uv = first.uv
    if uv is not None:
        uv = np.concatenate((uv, np.full((len(second.corners), 2), np.nan)))
    return replace(
        first,
        names=first.names + second.names,
        corner_start=np.concatenate((first.corner_start, first.corner_start[-1] + second.corner_start[1:])),
        uv=uv,
        places=_joined_places(first.places, second.places, first.count),
        charts=(first.charts or (None,) * first.count) + second.charts,
        **both,
    )


def _joined_places(first: Places | None, second: Places | None, count: int) -> Places | None:
    if second is None:
        return first
    keys = {facet + count: key for facet, key in second.keys.items()}
    moved = replace(second, facet=(second.facet + count).astype(np.int32), keys=keys)
    if first is None:
        return moved
    both: dict[str, Any] = {
        name: np.concatenate((getattr(first, name), getattr(moved, name)))
        for name in ("facet", "page", "turn", "mirror", "corner")
    }
    return replace(first, **both, keys={**first.keys, **keys})


def _too_many(spec: DisplayFile, key: tuple[str | int, ...], size: tuple[int, int] | None) -> list[Problem]:
    if size is None or max(size) <= MOST_PIXELS:
        return []
    return [spec.source.problem(key, f"expected at most {MOST_PIXELS} a side")]
