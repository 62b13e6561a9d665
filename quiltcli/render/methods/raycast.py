"""Ray casting: one ray a pixel, cast with Embree and settled in double precision; exact and slow.

Embree's rays are single precision: near an edge they may name the neighbour, and of two surfaces a
millionth of their distance apart the farther one. So five rays are cast around every pixel's sample,
and one from just behind the hit back to the eye. Where all six name one triangle, that is it; for the
other pixels all triangles that were named, and those that touch them, are met in float64, and the
nearest is taken. Nothing of binning and rasterization takes part. Several samples a pixel are cast one after
another where the rasterizer has them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from quiltcli.display import eyes_apart, lit_facets
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, cross, dot
from quiltcli.projection.gaze import Gaze
from quiltcli.projection.planar import viewer_rays
from quiltcli.render.antialiasing import in_quilt, sample_places
from quiltcli.render.buffers import Buffers, clear, lay_background
from quiltcli.render.notices import frame_warnings
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.render.sums import Sums, new_sums, summed
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import fill
from quiltcli.shading.shadows import Sample
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Hits
from quiltcli.visibility.rays.embree import Target, aim, cast, plane_distance, reach_along
from quiltcli.visibility.rays.exact import Neighbours, intersect
from quiltcli.visibility.rays.pixels import OFFSETS, Places, lit_pixels, places
from quiltcli.visibility.resolve.hits import point_hits
from quiltcli.visibility.setup.planes import LATTICE

_CHUNK = 1 << 15
_BEHIND = 1e-5  # share of a distance within which a second surface is looked for
RESOLUTION = 2.0**-30
"""Share of a depth within which the rasterizer's keys hold two surfaces for as near as each other."""


def cast_frame(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame by casting rays; for the arguments see `frame.draw_frame`.

    Raises:
        MissingExtraError: there is no Embree on this machine.
    """
    begin = time.perf_counter()
    lit = lit_facets(stage.facets, viewer.eye)
    if only is not None:
        lit &= only
    rays = viewer_rays(stage.layout, stage.facets, lit, viewer)
    gaze = Gaze(viewer, rays)
    target = target_of(stage, viewer)
    neighbours = Neighbours(stage.scene.vertices, stage.scene.triangles)
    sloped = stage.scene.textures is not None
    channels, count = stage.job.output.channels, stage.job.render.samples
    light = summed(channels) if count > 1 else ()
    data = tuple(name for name in channels if name not in light)
    clear(stage, buffers, only)
    lay_background(stage, np.flatnonzero(rays.lit[stage.blocks.facet]), buffers, rays)

    def draw(address: IntArray) -> int:
        address = address[lit_pixels(address, stage.layout, stage.owners, rays)]
        pixels = places(address, stage.layout, stage.owners, rays)
        hits = cast_pixels(target, neighbours, pixels, stage.scene.corner_normals, sloped=sloped)
        if hits.triangle.size:
            fill(buffers, data, gaze, Shaded(stage.scene, viewer.eye, hits))
        if light and address.size:
            add_light(address)
        return hits.inside

    def add_light(address: IntArray) -> None:
        first, size = int(address[0]), int(address[-1]) - int(address[0]) + 1
        sums = Sums(new_sums(light, lambda dtype: np.zeros(size, dtype)), light, first)
        for k, place in enumerate(sample_places(count)):
            beside = in_quilt(stage.layout, place)
            pixels = places(address, stage.layout, stage.owners, rays, beside)
            hits = cast_pixels(target, neighbours, pixels, stage.scene.corner_normals, sloped=sloped)
            if hits.triangle.size:
                sums.add(Shaded(stage.scene, viewer.eye, hits, sample=Sample(k, count)))
        sums.store(buffers, count, stage.scene.background)

    with ThreadPoolExecutor(threads) as pool:
        visible = sum(pool.map(draw, pixels_of(stage, rays.lit)))
    return FrameRecord(
        frame=viewer.frame,
        triangles=int(np.count_nonzero(target.drawn)),
        reaching=0,
        pairs=0,
        settled=0,
        binned=False,
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds={"cast and shade": time.perf_counter() - begin},
        warnings=tuple(frame_warnings(stage, viewer, lit, pairs=1, visible=visible)),
    )


def target_of(stage: Stage, viewer: Viewer) -> Target:
    """The stage's scene as rays of a viewer meet it.

    Raises:
        MissingExtraError: there is no Embree on this machine.
    """
    scene, how = stage.scene, stage.job.render
    return aim(
        scene.vertices,
        scene.triangles,
        viewer,
        how.backface_culling,
        one_sided=scene.one_sided if how.double_sided == "file" else None,
        invisible=scene.invisible,
        beside=_beside(stage, viewer),
    )


def _beside(stage: Stage, viewer: Viewer) -> float:
    """How far from the eye rays may begin, metres: where each has an eye of its own."""
    if viewer.head is None or not eyes_apart(stage.facets):
        return 0.0
    return 2 * float(np.sqrt(dot(viewer.eye - viewer.head, viewer.eye - viewer.head)))


def pixels_of(stage: Stage, lit: BoolArray) -> Iterator[IntArray]:
    """Addresses of the pixels of some facets and their bleed, a chunk at a time."""
    wanted = np.concatenate(([False], lit))
    for start in range(0, stage.owners.size, _CHUNK):
        chunk = np.flatnonzero(wanted[np.abs(stage.owners[start : start + _CHUNK])])
        if chunk.size:
            yield chunk + start


def cast_pixels(
    target: Target, neighbours: Neighbours, pixels: Places, normals: Float32Array, *, sloped: bool = False
) -> Hits:
    """What P pixels see; `normals` are the scene's `corner_normals`; `sloped` if textures are looked up."""
    triangle = first_triangles(target, neighbours, pixels)
    rows = np.flatnonzero(triangle >= 0)
    triangle = triangle[rows]
    x, y = (pixels.x[rows] + 0.5)[:, None], (pixels.y[rows] + 0.5)[:, None]
    matrix = pixels.ray[rows]
    ray = matrix[:, :, 0] * x + matrix[:, :, 1] * y + matrix[:, :, 2]
    begin = pixels.from_eye(rows)
    seen = ray * plane_distance(target, triangle, ray, begin)[:, None]
    position = seen if begin is None else begin + seen
    points = np.ascontiguousarray(position.T)
    return point_hits(
        first=pixels.address[rows],
        facet=pixels.facet[rows].astype(np.int32),
        triangle=triangle.astype(np.int32),
        position=points,
        weights=np.stack(barycentric(target, triangle, position)),
        depth=target.viewer.depth_of(np.ascontiguousarray(seen.T)),
        normals=normals,
        inside=int(np.count_nonzero(~pixels.bleed[rows])),
        slopes=weight_slopes(target, triangle, matrix, ray, seen) if sloped else None,
        ray=None if begin is None else np.ascontiguousarray(ray.T),
    )


def barycentric(target: Target, triangle: IntArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Barycentric weights (P,) of the second and third corner at points (P, 3) of triangles (P,)."""
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    normal = target.plane[triangle, :3]
    area = dot(normal, normal)
    second = dot(normal, cross(position - a, c - a)) / area
    return second, dot(normal, cross(b - a, position - a)) / area


def weight_slopes(
    target: Target, triangle: IntArray, matrix: FloatArray, ray: FloatArray, position: FloatArray
) -> FloatArray:
    """How the weights of points change from pixel to pixel (2, 2, P) [weight, axis].

    A point is p = t·d with n·p constant, so along an axis p' = t·(d' − d·(n·d')/(n·d)).

    Args:
        target: the scene.
        triangle: (P,) which triangles.
        matrix: (P, 3, 3) page pixel (x, y, 1) → direction from the eye.
        ray: (P, 3) directions.
        position: (P, 3) points minus where their rays begin. That neighbours may begin beside one another
            is left out: it is little, and textures alone are filtered by it.
    """
    normal = target.plane[triangle, :3]
    along = dot(normal, ray)
    scale = dot(position, ray) / dot(ray, ray)
    a = target.corners[target.triangles[triangle, 0]]
    result = np.empty((2, 2, triangle.size))
    for axis in range(2):
        step = matrix[:, :, axis]
        moved = scale[:, None] * (step - ray * (dot(normal, step) / along)[:, None])
        result[:, axis] = barycentric(target, triangle, a + moved)
    return result


def first_triangles(target: Target, neighbours: Neighbours, pixels: Places) -> IntArray:
    """The first triangle (P,) along the ray of every pixel, −1 for none."""
    named = np.stack([cast(target, pixels.directions(*way), origin=pixels.origin) for way in OFFSETS])
    back = _looking_back(target, pixels, named[0])
    every = np.concatenate((named, back[None]))
    result: IntArray = np.maximum(named[0], -1)
    rows = np.flatnonzero((every != every[0]).any(axis=0))
    if rows.size:
        result[rows] = _nearest(target, neighbours, pixels, rows, every[:, rows])
    return result


def _looking_back(target: Target, pixels: Places, first: IntArray) -> IntArray:
    """What rays of P pixels from just behind their first hits (P,) towards the eye meet.

    Where that is nothing, or nothing was hit, it is `first` itself.
    """
    result: IntArray = first.copy()
    rows = np.flatnonzero(first >= 0)
    if rows.size:
        directions, begin = pixels.directions()[rows], pixels.from_eye(rows)
        distance = plane_distance(target, first[rows], directions, begin) * (1 + _BEHIND)
        distance = np.where(np.isfinite(distance), distance, 0.0)
        origin = distance[:, None] * directions
        origin = origin if begin is None else begin + origin
        met = target.embree.run(origin.astype(np.float32), (-directions).astype(np.float32)).astype(np.int64)
        result[rows[met >= 0]] = target.named[met[met >= 0]]
    return result


def _nearest(
    target: Target, neighbours: Neighbours, pixels: Places, rows: IntArray, named: IntArray
) -> IntArray:
    """The nearest triangle (N,) of those named (k, N), and those that touch them, that the sample lies in.

    Samples lie where the rasterizer's do, so that both decide centres on edges alike; depth is the
    centre's, and of triangles at one depth the lowest is taken, as there.
    """
    which, column = np.nonzero(named.T >= 0)
    result = np.full(rows.size, -1)
    around, triangle = neighbours.around(which, named.T[which, column])
    tests = intersect(target, pixels, rows[around], triangle, LATTICE)
    ray = pixels.directions()[rows[around]]
    distance = plane_distance(target, triangle, ray, pixels.from_eye(rows[around]))
    with np.errstate(invalid="ignore"):  # infinity times 0
        reach = distance * reach_along(target.viewer, ray)
    hit = np.flatnonzero((tests.inside >= 0) & (reach >= target.viewer.near) & (reach <= target.viewer.far))
    nearest = np.full(rows.size, np.inf)
    np.minimum.at(nearest, around[hit], distance[hit])
    first = hit[distance[hit] <= nearest[around[hit]] * (1 + RESOLUTION)]
    order = first[np.lexsort((tests.triangle[first], around[first]))][::-1]
    result[around[order]] = tests.triangle[order]  # the last write of a row is its lowest triangle
    return result
