"""Facets from a mesh and a display file, or from the panels that the file lists."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from quiltcli.display.blending import blended
from quiltcli.display.check import called, check_polygons
from quiltcli.display.curved import joined, projection_facets, surface_facets
from quiltcli.display.facets import Facets, places_of
from quiltcli.display.notices import likely_unit
from quiltcli.display.panels import panel_facets
from quiltcli.display.points import point_facets
from quiltcli.display.projectors import projector_facets
from quiltcli.display.rasters import LEVEL, MOST_PIXELS, Rasters, axes, into_plane, rasters, turned, upward
from quiltcli.display.response import response_of
from quiltcli.errors import DisplayError, Problem, first_of, raise_all
from quiltcli.formats.mesh import PolygonMesh, read_mesh
from quiltcli.formats.mesh.polygons import area_vectors
from quiltcli.geometry import FloatArray, Int32Array, IntArray, applied, dot, normalized
from quiltcli.job.display import DisplayFile, FacetSpec, ResolutionSpec
from quiltcli.job.model import FARTHEST

_MOST_PROBLEMS = 50
_SMALLEST = 1e-9  # metres


def load_display(spec: DisplayFile) -> Facets:
    """Make the facets of a display file from its mesh, which is read, or from its panels.

    Raises:
        MeshError: the mesh cannot be read.
        DisplayError: the mesh or the display file makes no facets; every problem found is in it.
    """
    blend = None
    if spec.projectors is None:
        facets = _facets(spec)
    else:
        facets, projectors = projector_facets(spec, load_display)
        blend = blended(spec, projectors)
    response = response_of(spec, facets.charts, facets.count, blend)
    return facets if response is None else replace(facets, response=response)


def _facets(spec: DisplayFile) -> Facets:
    if spec.projection is not None:
        return projection_facets(spec)
    if spec.points is not None:
        return point_facets(spec)
    if spec.mesh is None and spec.panels is None:
        return surface_facets(spec)
    flat = panel_facets(spec) if spec.mesh is None else build_facets(read_mesh(spec.mesh), spec)
    return flat if spec.surfaces is None else joined(flat, surface_facets(spec))


def build_facets(mesh: PolygonMesh, spec: DisplayFile) -> Facets:
    """Make the facets of a display from its mesh, in mesh units, and its file.

    Corners stay where the mesh puts them; the raster lies in the plane through the first corner
    across Newell's normal, at most the planarity tolerance away from any of them.

    Raises:
        DisplayError: faces that cannot be facets, facets that do not exist, impossible rasters.
    """
    start = mesh.corner_start
    corners = _in_world(mesh, spec)
    chosen = [spec.facets.get(facet, FacetSpec()) for facet in range(1, mesh.count + 1)]
    names = tuple(choice.name or name for choice, name in zip(chosen, mesh.names, strict=True))
    _raise(list(_beyond_measure(corners, start, names, mesh)), spec)
    _raise(
        [*_unknown_facets(mesh.count, spec), *check_polygons(corners, start, names, mesh.lines, mesh.path)],
        spec,
    )
    front = normalized(area_vectors(corners, start))
    normal = -front if spec.viewing_side == "back" else front
    right, down = _axes(corners, start, front, normal, spec)
    mirrored = np.array([choice.mirror for choice in chosen])
    right = np.where(mirrored[:, None], -right, right)
    frame = _rasters(corners, start, right, down, mesh, spec)
    extent = float(np.ptp(corners, axis=0).max())
    _raise([*_useless_ups(normal, names, spec), *_impossible_sizes(frame.size, extent, names, spec)], spec)
    return Facets(
        names=names,
        corner_start=start,
        corners=corners,
        origin=frame.origin,
        du=frame.du,
        dv=frame.dv,
        size=frame.size,
        normal=normal,
        both_sides=spec.viewing_side == "both",
        enabled=np.array([choice.enabled for choice in chosen]),
        mirrored=mirrored,
        uv=mesh.uv,
        path=str(spec.source.path),
        places=places_of({k: choice.place for k, choice in sorted(spec.facets.items())}, spec.source),
    )


def _beyond_measure(
    corners: FloatArray, start: IntArray, names: Sequence[str], mesh: PolygonMesh
) -> Iterator[Problem]:
    """Facets so far away or so small that the squares of their lengths are no numbers any more."""
    farthest = np.maximum.reduceat(np.abs(corners).max(axis=1), start[:-1])
    for facet in np.flatnonzero(~(farthest <= FARTHEST)).tolist():
        words = f"{called(facet, names)} reaches {farthest[facet]:.3g} m from the world's origin"
        words += f" (expected at most {FARTHEST:.0f}; are the units and the transform right?)"
        yield Problem(words, mesh.path, int(mesh.lines[facet]))
    if not (farthest <= FARTHEST).all():
        return
    low, high = (
        np.minimum.reduceat(corners, start[:-1], axis=0),
        np.maximum.reduceat(corners, start[:-1], axis=0),
    )
    extent = (high - low).max(axis=1)
    for facet in np.flatnonzero(extent < _SMALLEST).tolist():
        words = f"{called(facet, names)} is {extent[facet]:.3g} m large (expected {_SMALLEST:g} or more)"
        yield Problem(words, mesh.path, int(mesh.lines[facet]))


def _in_world(mesh: PolygonMesh, spec: DisplayFile) -> FloatArray:
    """Corners (C, 3) in world metres, every sum in a fixed order."""
    with np.errstate(over="ignore", invalid="ignore"):  # `_beyond_measure` tells of it
        corners = mesh.vertices[mesh.corners] * spec.metres
        matrix = spec.world_from_local
        if matrix is None:
            return corners
        return applied(matrix[:3, :3], corners) + matrix[:3, 3]


def _axes(
    corners: FloatArray, start: IntArray, front: FloatArray, normal: FloatArray, spec: DisplayFile
) -> tuple[FloatArray, FloatArray]:
    """Right and down directions (F, 3) with the `up` and `rotate` of single facets."""
    up = upward(corners, start, front)
    turns = np.zeros(len(normal), np.int64)
    for facet, choice in spec.facets.items():
        turns[facet - 1] = int(choice.rotate) // 90
        if choice.up is not None:
            up[facet - 1] = into_plane(np.array([choice.up], np.float64), normal[facet - 1 : facet])[0]
    right, down = axes(corners, start, normal, normalized(up))
    return turned(right, down, turns)


def _rasters(
    corners: FloatArray,
    start: IntArray,
    right: FloatArray,
    down: FloatArray,
    mesh: PolygonMesh,
    spec: DisplayFile,
) -> Rasters:
    asked = np.zeros((len(right), 2), np.int32)
    resolution = spec.resolution
    if resolution is None:
        density = _texture_density(corners, mesh, spec)
    else:
        density = np.full(len(right), resolution.density or 1.0)
        asked[:] = resolution.facet_pixels or 0
    for facet, choice in spec.facets.items():
        if choice.facet_pixels is not None:
            asked[facet - 1] = choice.facet_pixels
    return rasters(corners, start, right, down, density, asked, a_pixel_at_least=resolution is None)


def _texture_density(corners: FloatArray, mesh: PolygonMesh, spec: DisplayFile) -> FloatArray:
    """Pixels a metre (F,) at which a facet has as many pixels as its place in the texture.

    The layout takes its rasters from the texture coordinates themselves; these are what `quilt info` tells
    of the display.
    """
    assert (
        spec.layout is not None
    )  # a file with a mesh has a resolution, or takes the layout from its texture
    if mesh.uv is None:
        message = "the mesh has no texture coordinates (expected them, or resolution beside another layout)"
        raise DisplayError(spec.source.problem(("layout",), message))
    start = mesh.corner_start
    flat = np.zeros((len(corners), 3))
    flat[:, :2] = mesh.uv * spec.layout.size
    placed = np.where(np.isfinite(flat), flat, 0.0)
    area, textured = (area_vectors(points, start) for points in (corners, placed))
    with np.errstate(
        over="ignore", invalid="ignore"
    ):  # of places far beyond any page, which the layout tells
        density = np.sqrt(np.sqrt(dot(textured, textured) / dot(area, area)))
    result: FloatArray = np.where(np.isfinite(density), density, 0.0)
    return result


def _unknown_facets(count: int, spec: DisplayFile) -> Iterator[Problem]:
    for facet in spec.facets:
        if facet > count:
            yield spec.source.problem(
                ("facets", facet), f"there is no facet {facet} (the mesh has facets 1 to {count})"
            )


def _useless_ups(normal: FloatArray, names: Sequence[str], spec: DisplayFile) -> Iterator[Problem]:
    """An `up` that stands straight on its facet points nowhere in the image."""
    for facet, choice in spec.facets.items():
        if choice.up is None:
            continue
        up = normalized(np.array([choice.up], np.float64))
        lying = into_plane(up, normal[facet - 1 : facet])[0]
        if float(np.sqrt(dot(lying, lying))) < LEVEL:
            text = ", ".join(f"{c:g}" for c in choice.up)
            yield spec.source.problem(
                ("facets", facet, "up"),
                f"[{text}] is perpendicular to {called(facet - 1, names)} "
                "(expected a direction that leans along it by 1 degree or more)",
            )


def _impossible_sizes(
    size: Int32Array, extent: float, names: Sequence[str], spec: DisplayFile
) -> Iterator[Problem]:
    for facet in np.flatnonzero(((size < 1) | (size > MOST_PIXELS)).any(axis=1)):
        width, height = ("less than 1" if n < 1 else f"over {MOST_PIXELS}" if n > MOST_PIXELS else str(n)
                         for n in size[facet])  # fmt: skip
        mistaken = (size[facet] > MOST_PIXELS).any() and spec.units == "m" and extent > 10
        hint = f"; is the mesh in another unit? units: {likely_unit(extent)}" if mistaken else ""
        own = spec.facets.get(int(facet) + 1)
        named = (name for name in ResolutionSpec.model_fields if getattr(spec.resolution, name, None))
        key = ("resolution", next(named)) if spec.resolution is not None else ("layout", "size")
        if spec.resolution is not None and spec.layout is not None:
            hint += "; leave resolution out, since the texture coordinates tell"
        yield spec.source.problem(
            ("facets", int(facet) + 1, "facet_pixels") if own and own.facet_pixels else key,
            f"makes {called(int(facet), names)} {width} × {height} pixels "
            f"(expected 1 to {MOST_PIXELS} a side{hint})",
        )


def _raise(problems: Sequence[Problem], spec: DisplayFile) -> None:
    """Raise the first problems found together, and the count of the rest."""
    raise_all(DisplayError, first_of(problems, _MOST_PROBLEMS, str(spec.source.path)))
