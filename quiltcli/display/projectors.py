"""Projectors: each is a facet whose pixels are points of a screen, found by rays or read from a map."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.grids import grid_of
from quiltcli.charts.meet import CELLS, meet_near, net
from quiltcli.charts.projected import Projected, first_met
from quiltcli.charts.shapes import crossed
from quiltcli.display.curved import chart_facets
from quiltcli.display.facets import Facets, triangulate
from quiltcli.display.rasters import MOST_PIXELS
from quiltcli.errors import DisplayError, Problem, QuiltError, raise_all
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import BoolArray, FloatArray, cross, dot, normalized
from quiltcli.geometry.resection import Pinhole, Refined, lie_in_plane, resected
from quiltcli.job.digest import file_sha256
from quiltcli.job.display import DisplayFile
from quiltcli.job.dump import plain
from quiltcli.job.lengths import UNITS, exact_metres
from quiltcli.job.load import load_display_file
from quiltcli.job.projectors import LensSpec, ProjectorSpec

_ON_RAY = 1e-7  # of the distance, that a point may be off its ray
_MOST_OFF = 0.05  # of the picture's width: points that are off by more fit no projector
_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Screen:
    """What projectors light: T triangles and the facets that they stand for.

    Attributes:
        facets: the screen's facets.
        vertices: (V, 3) world metres.
        triangles: (T, 3).
        facet: (T,) 0-based.
        pixels: (V, 2) facet pixels of the corners of curved facets.
    """

    facets: Facets
    vertices: FloatArray
    triangles: Any
    facet: Any
    pixels: FloatArray


@dataclass(frozen=True, eq=False)
class Projector:
    """A projector as it was found.

    Attributes:
        chart: its pixels.
        matrix: (3, 4) pixels times depth from world metres; None where a map tells the points.
        fit: how well it fits the points by which it was found; None where it was given.
    """

    chart: Chart
    matrix: FloatArray | None
    fit: Refined | None = None


def projector_facets(
    spec: DisplayFile, load: Callable[[DisplayFile], Facets]
) -> tuple[Facets, list[Projector]]:
    """The facets of a display's projectors, and the projectors.

    Args:
        spec: the display file.
        load: makes the facets of the screen.

    Raises:
        DisplayError: every projector's first problem.
    """
    given = spec.projectors or ()
    screen = None if spec.screen is None else load_screen(spec, load)
    found: list[Projector] = []
    problems: list[Problem] = []
    for number, projector in enumerate(given):
        try:
            found.append(_projector(projector, number, spec, screen))
        except QuiltError as error:
            problems += error.problems
    raise_all(DisplayError, problems)
    charts = [(projector.name, one.chart) for projector, one in zip(given, found, strict=True)]
    places = {k: projector.place for k, projector in enumerate(given, 1)}
    return chart_facets(charts, [False] * len(given), places, spec, "projectors"), found


def load_screen(spec: DisplayFile, load: Callable[[DisplayFile], Facets]) -> Screen:
    """The screen of a display file: another display's facets, whatever their pixels are.

    Raises:
        DisplayError, MeshError, JobError: it cannot be read, or is no screen.
    """
    assert spec.screen is not None
    other = load_display_file(spec.screen)
    if other.projectors is not None or other.projection is not None:
        what = "projectors" if other.projectors is not None else "a projection"
        words = f"is a display of {what} (expected a mesh, panels or surfaces that stand in the world)"
        raise DisplayError(spec.source.problem(("screen",), words))
    facets = load(other)
    # A net has no more cells than a raster has pixels, and those of a screen say nothing.
    facets = replace(facets, charts=tuple(_finer(chart) for chart in facets.charts))
    triangles, facet = triangulate(facets)
    flat = ~facets.curved[facet] & facets.enabled[facet]
    vertices, pixels = [facets.corners], [np.zeros((len(facets.corners), 2))]
    faces, owner, count = [triangles[flat]], [facet[flat]], len(facets.corners)
    for row, chart in enumerate(facets.charts):
        if chart is not None and facets.enabled[row]:
            points, places, cells = net(chart)
            vertices.append(points)
            pixels.append(places)
            faces.append((cells + count).astype(np.int32))
            owner.append(np.full(len(cells), row, dtype=np.int32))
            count += len(points)
    return Screen(
        facets,
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(owner),
        np.concatenate(pixels),
    )


def _finer(chart: Chart | None) -> Chart | None:
    """The same chart with a raster that a whole net fits in."""
    if chart is None or min(chart.size) >= CELLS:
        return chart
    return chart.scaled((max(chart.size[0], CELLS), max(chart.size[1], CELLS)))


def _projector(given: ProjectorSpec, number: int, spec: DisplayFile, screen: Screen | None) -> Projector:
    """A projector of a display file, checked."""

    def problem(key: str, words: str) -> DisplayError:
        return DisplayError(spec.source.problem(("projectors", number, key), words))

    fit, matrix = None, None
    if given.map is not None:
        points = _mapped_points(given, problem)
        upright = _slopes_normal(points)
    else:
        assert screen is not None
        assert given.pixels is not None
        if max(given.pixels) > MOST_PIXELS:
            raise problem("pixels", f"expected at most {MOST_PIXELS} a side")
        matrix, fit = _matrix(given, spec, screen, problem)
        points, upright = _lit_points(matrix, given.pixels, screen)
    known = np.asarray(np.isfinite(points.sum(axis=0)))
    if not known.any():
        raise problem(_way(given), "no pixel of it meets the screen (does it look there?)")
    mask = _mask(given, known, problem)
    height, width = known.shape
    record = {**plain(given, file_sha256), "kind": "projector", "units": spec.metres}
    record.pop("place", None)
    if screen is not None:
        record["screen"] = screen.facets.sha256
    chart = Chart(
        shape=Projected(grid_of(points), upright),
        size=(width, height),
        side=-1 if given.lit == "back" else 1,
        mask=None if mask.all() else mask,
        adds=True,
        record=json.dumps(record, sort_keys=True, separators=(",", ":")),
    )
    return Projector(chart, matrix, fit)


def _way(given: ProjectorSpec) -> str:
    """The key that says where pixels are."""
    return next(name for name in ("lens", "matrix", "points", "map") if getattr(given, name) is not None)


def _mapped_points(given: ProjectorSpec, problem: Callable[[str, str], DisplayError]) -> FloatArray:
    """Points (3, H, W) of a map, NaN where there are none."""
    picture = read_numbers(Path(given.map or ""), 3, exact=True)
    if given.pixels is not None and given.pixels != picture.size:
        own, asked = (f"{wide} × {high}" for wide, high in (picture.size, given.pixels))
        raise problem("pixels", f"the map is {own}, got {asked}")
    values = picture.values[:3] * UNITS[given.units]
    if picture.alpha is not None:
        values[:, ~(picture.alpha > 0)] = np.nan
    values[:, ~np.isfinite(values.sum(axis=0))] = np.nan
    return np.asarray(values)


def _mask(given: ProjectorSpec, known: BoolArray, problem: Callable[[str, str], DisplayError]) -> BoolArray:
    """Pixels (H, W) that light something and are not masked."""
    if given.mask is None:
        return known
    picture = read_numbers(given.mask, 1)
    if picture.size != known.shape[::-1]:
        words = (
            f"is {picture.size[0]} × {picture.size[1]} pixels (expected {known.shape[1]} × {known.shape[0]})"
        )
        raise problem("mask", words)
    bright = known & (picture.values.max(axis=0) >= 0.5)
    if picture.alpha is not None:
        bright &= picture.alpha >= 0.5
    if not bright.any():
        raise problem("mask", "leaves no pixel (expected some that are bright and light the screen)")
    return np.asarray(bright)


def _matrix(
    given: ProjectorSpec, spec: DisplayFile, screen: Screen, problem: Callable[[str, str], DisplayError]
) -> tuple[FloatArray, Refined | None]:
    """The matrix (3, 4) of a projector, whose depths are above 0 on the screen's side."""
    fit = None
    if given.lens is not None:
        matrix = _lens_matrix(given, spec, problem)
    elif given.matrix is not None:
        matrix = np.array(given.matrix)
        matrix[:, :3] /= spec.metres
        size = np.abs(matrix[:, :3]).max(axis=1)
        if not size.all() or abs(np.linalg.det(matrix[:, :3] / size[:, None])) < _FLAT:
            raise problem("matrix", "is none of a projector: its first three columns are not independent")
    else:
        fit = _resected(given, spec, problem)
        matrix = fit.pinhole.matrix
    depth = screen.vertices[np.unique(screen.triangles)] @ matrix[2, :3] + matrix[2, 3]
    if given.matrix is not None and np.count_nonzero(depth > 0) < np.count_nonzero(depth < 0):
        matrix = -matrix
    return matrix, fit


def _lens_matrix(
    given: ProjectorSpec, spec: DisplayFile, problem: Callable[[str, str], DisplayError]
) -> FloatArray:
    """The matrix of a projector that was set up by hand."""
    lens: LensSpec | None = given.lens
    assert lens is not None
    assert given.pixels is not None
    at, target = (
        np.array([float(exact_metres(value, spec.metres)) for value in point])
        for point in (lens.at, lens.look_at)
    )
    if not np.sqrt(dot(target - at, target - at)) > _FLAT:
        raise problem("lens", "looks at where it stands (expected another point to look at)")
    ahead = normalized(target - at)
    right = cross(ahead, normalized(np.array(lens.up, dtype=np.float64)))
    if not np.sqrt(dot(right, right)) > 1e-6:
        raise problem("lens", "looks along up (expected a direction that is up in its picture)")
    right = normalized(right)
    width, height = given.pixels
    centre = np.array([width * (0.5 - lens.shift[0]), height * (0.5 + lens.shift[1])])
    rotation = np.stack((right, cross(ahead, right), ahead))
    return Pinhole(lens.throw * width, centre, rotation, at).matrix


def _resected(
    given: ProjectorSpec, spec: DisplayFile, problem: Callable[[str, str], DisplayError]
) -> Refined:
    """The projector that lights points through given pixels."""
    assert given.points is not None
    assert given.pixels is not None
    points = np.array([[float(exact_metres(v, spec.metres)) for v in p.world] for p in given.points])
    pixels = np.array([point.pixel for point in given.points], dtype=np.float64)
    if lie_in_plane(points):
        words = "all lie in one plane, which leaves the projector open (add some off that plane)"
        raise problem("points", words)
    fit = resected(points, pixels)
    if fit is None:
        raise problem("points", "leave the projector open: several fit (add points elsewhere)")
    off = np.sqrt((fit.errors**2).sum(axis=1))
    if not np.isfinite(off).all() or fit.pinhole.focal <= 0 or off.max() > _MOST_OFF * given.pixels[0]:
        worst = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        away = f"{off[worst]:.3g} pixels" if np.isfinite(off[worst]) else "behind it"
        words = f"fit no projector: point {worst + 1} is off by {away} (is it mistaken?)"
        raise problem("points", words)
    return fit


def _lit_points(matrix: FloatArray, size: tuple[int, int], screen: Screen) -> tuple[FloatArray, FloatArray]:
    """Points (3, H, W) of a screen under the centres of a projector's pixels, NaN where there are none.

    Returns:
        The points, world metres, and unit normals (3, H, W) of the screen there, on the projector's side.
    """
    width, height = size
    homogeneous = screen.vertices @ matrix[:, :3].T + matrix[:, 3]
    met, _ = first_met(homogeneous[screen.triangles], size)
    centre: FloatArray = np.asarray(-np.linalg.solve(matrix[:, :3], matrix[:, 3]), dtype=np.float64)
    back = np.linalg.inv(matrix[:, :3])
    points, upright = np.full((3, met.size), np.nan), np.zeros((3, met.size))
    pixel = np.flatnonzero(met >= 0)
    row, column = np.divmod(pixel, width)
    x, y = np.asarray(column + 0.5, dtype=np.float64), np.asarray(row + 0.5, dtype=np.float64)
    rays: FloatArray = np.asarray(back[:, :1] * x + back[:, 1:2] * y + back[:, 2:], dtype=np.float64)
    facet = screen.facet[met[pixel]]
    for one in np.unique(facet).tolist():
        mine = np.flatnonzero(facet == one)
        chart = screen.facets.charts[one] if screen.facets.charts else None
        if chart is None:
            found = _on_plane(screen.facets, one, centre, rays[:, mine])
        else:
            found = _on_chart(chart, screen, met[pixel[mine]], centre, rays[:, mine])
        points[:, pixel[mine]], upright[:, pixel[mine]] = found
    # Normals on the projector's side.
    towards = (upright * (centre[:, None] - points)).sum(axis=0)
    upright = np.where(towards < 0, -upright, upright)
    return points.reshape(3, height, width), upright.reshape(3, height, width)


def _on_plane(
    facets: Facets, row: int, centre: FloatArray, rays: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (3, P) of a flat facet's plane on rays, and its normal."""
    normal = facets.normal[row]
    slope = normal @ rays
    away = float(normal @ (facets.polygon(row)[0] - centre))
    share = np.divide(away, slope, out=np.full(slope.shape, np.nan), where=slope != 0)
    return centre[:, None] + share * rays, np.repeat(normal[:, None], rays.shape[1], axis=1)


def _on_chart(
    chart: Chart, screen: Screen, met: Any, centre: FloatArray, rays: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (3, P) of a curved facet on rays that meet these triangles of its net, and its normals."""
    corners = screen.triangles[met]
    a, b, c = (screen.vertices[corners[:, k]] - centre for k in range(3))
    weights = np.stack([dot(cross(p, q), rays.T) for p, q in ((b, c), (c, a), (a, b))])
    weights /= weights.sum(axis=0)
    guess = np.einsum("kp,pkc->cp", weights, screen.pixels[corners])
    x, y = meet_near(chart, centre, rays, guess)
    points = chart.points(x, y)
    # At the rim, where the net is smaller or larger than the surface, some rays meet nothing.
    off = points - centre[:, None]
    share = (off * rays).sum(axis=0) / (rays * rays).sum(axis=0)
    away = np.sqrt(((off - share * rays) ** 2).sum(axis=0))
    good = away <= _ON_RAY * np.sqrt((off * off).sum(axis=0))
    # A ray that leaves the raster has left the surface.
    good &= (x >= 0) & (x <= chart.size[0]) & (y >= 0) & (y <= chart.size[1])
    return np.where(good, points, np.nan), chart.normals(x, y)


def _slopes_normal(points: FloatArray) -> FloatArray:
    """Unit normals (3, H, W) of a map of points, on the side from which it is not mirrored."""
    known = np.where(np.isfinite(points), points, 0.0)
    along = np.gradient(known, axis=2) if points.shape[2] > 1 else np.zeros(points.shape)
    down = np.gradient(known, axis=1) if points.shape[1] > 1 else np.zeros(points.shape)
    normal = crossed(down, along)
    length = np.sqrt((normal * normal).sum(axis=0))
    return np.asarray(np.divide(normal, length, out=np.zeros(normal.shape), where=length > 0))


def screened(projector: Projector) -> str:
    """A projector in words: where it stands, how much of it lights the screen, how well it fits."""
    chart = projector.chart
    share = 1.0 if chart.mask is None else float(np.mean(chart.mask))
    words = f"{100 * share:.1f} % of its pixels light the screen"
    if projector.matrix is not None:
        x, y, z = np.round(-np.linalg.solve(projector.matrix[:, :3], projector.matrix[:, 3]), 3) + 0.0
        words = f"at ({x:.3f}, {y:.3f}, {z:.3f}) m, {words}"
    if projector.fit is not None:
        off = np.sqrt((projector.fit.errors**2).sum(axis=1))
        rms = float(np.sqrt(np.mean(off**2)))
        words += f", points off by {rms:.2g} px rms, {off.max():.2g} at most"
    return words
