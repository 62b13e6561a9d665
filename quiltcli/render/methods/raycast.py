"""Ray casting: one ray a pixel, cast with Embree and settled in double precision; exact and slow.

Embree's rays are single precision: near an edge they may name the neighbour, and of two surfaces a
millionth of their distance apart the farther one. So five rays are cast around every pixel's sample,
and one from just behind the hit back to the eye. Where all six name one triangle, that is it; for the
other pixels all triangles that were named, and those that touch them, are met in float64, and the
nearest is taken. Nothing of binning and rasterization takes part. Several samples a pixel are cast one after
another where the rasterizer has them.

Where a ray meets something that light may pass, it goes on behind it up to what is opaque, and all that
it has met is met again in float64 and blended in the order of distance.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from quiltcli.display import eyes_apart, lit_facets
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, dot
from quiltcli.projection.gaze import Gaze
from quiltcli.projection.planar import viewer_rays
from quiltcli.render.antialiasing import in_quilt, sample_places
from quiltcli.render.batch import put_layers
from quiltcli.render.buffers import Buffers, background_of, clear, lay_background, lay_sky
from quiltcli.render.notices import frame_warnings
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import fill
from quiltcli.shading.layers import Layer, blended
from quiltcli.shading.shadows import CENTRE, Sample
from quiltcli.shading.sums import Sums, new_sums, summed
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Hits
from quiltcli.visibility.rays.embree import Target, aim, cast, plane_distance, reach_along
from quiltcli.visibility.rays.exact import Neighbours, intersect
from quiltcli.visibility.rays.pixels import OFFSETS, Places, lit_pixels, places
from quiltcli.visibility.rays.weights import barycentric, weight_slopes
from quiltcli.visibility.resolve.hits import point_hits
from quiltcli.visibility.resolve.layers import LayerHits
from quiltcli.visibility.setup.planes import LATTICE

_CHUNK = 1 << 15
_PAST = 1e-6  # share of a distance by which a ray that goes on begins behind it
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
    scene, channels, count = stage.scene, stage.job.output.channels, stage.job.render.samples
    light = summed(channels) if count > 1 else ()
    data = tuple(name for name in channels if name not in light)
    clear(stage, buffers, only)
    blocks = np.flatnonzero(rays.lit[stage.blocks.facet])
    lay_background(stage, blocks, buffers, rays)

    def seen(pixels: Places, sample: Sample = CENTRE) -> tuple[Hits, Iterable[Layer]]:
        """What pixels see at once, and what others of them see through something."""
        triangle, through = first_triangles(target, neighbours, pixels, scene.soft)
        rows = np.flatnonzero((triangle >= 0) & ~through)
        sloped = scene.textures is not None
        hits = ray_hits(target, pixels.take(rows), triangle[rows], scene.corner_normals, sloped=sloped)
        if not through.any():
            return hits, ()
        others = pixels.take(np.flatnonzero(through))
        return hits, layers_of(scene, target, neighbours, others, viewer.eye, sample)

    def draw(address: IntArray) -> int:
        address = address[lit_pixels(address, stage.layout, stage.owners, rays)]
        hits, found = seen(places(address, stage.layout, stage.owners, rays))
        if hits.triangle.size:
            fill(buffers, data, gaze, Shaded(scene, viewer.eye, hits))
        inside = hits.inside + put_layers(
            found, sums_of(address, summed(data)), buffers, data, gaze, background_of(stage, rays)
        )
        if light and address.size:
            add_light(address)
        return inside

    def add_light(address: IntArray) -> None:
        sums = sums_of(address, light)
        for k, place in enumerate(sample_places(count)):
            sample, beside = Sample(k, count), in_quilt(stage.layout, place)
            hits, found = seen(places(address, stage.layout, stage.owners, rays, beside), sample)
            if hits.triangle.size:
                sums.add(Shaded(scene, viewer.eye, hits, sample=sample))
            for layer in found:
                sums.add(layer.shaded, layer.weight)
        sums.store(buffers, count, background_of(stage, rays))

    with ThreadPoolExecutor(threads) as pool:
        visible = sum(pool.map(draw, pixels_of(stage, rays.lit)))
    lay_sky(stage, blocks, buffers, rays)
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


def sums_of(address: IntArray, channels: tuple[str, ...]) -> Sums:
    """Empty sums of pixels (P,) of ascending addresses."""
    first, size = (int(address[0]), int(address[-1]) - int(address[0]) + 1) if address.size else (0, 0)
    return Sums(new_sums(channels, lambda dtype: np.zeros(size, dtype)), channels, first)


def layers_of(
    scene: Scene, target: Target, neighbours: Neighbours, pixels: Places, eye: FloatArray, sample: Sample
) -> Iterator[Layer]:
    """What pixels see through something, from the front to the back."""
    assert scene.soft is not None
    light = np.ones(pixels.address.size, dtype=np.bool_)
    found = (
        LayerHits(
            row,
            ray_hits(target, pixels.take(row), triangle, scene.corner_normals, scene.textures is not None),
            ~pixels.bleed[row],
        )
        for row, triangle in met_through(target, neighbours, pixels, scene.soft).layers(light)
    )
    yield from blended(found, light, scene, eye, sample)


def ray_hits(
    target: Target, pixels: Places, triangle: IntArray, normals: Float32Array, sloped: bool = False
) -> Hits:
    """What P pixels see of triangles (P,).

    Args:
        target: the scene.
        pixels: the pixels.
        triangle: (P,) what each sees.
        normals: the scene's `corner_normals`.
        sloped: whether textures are looked up.
    """
    ray = pixels.rays()
    seen = ray * plane_distance(target, triangle, ray, pixels.origin)[:, None]
    position = seen if pixels.origin is None else pixels.origin + seen
    points = np.ascontiguousarray(position.T)
    return point_hits(
        first=pixels.address,
        facet=pixels.facet.astype(np.int32),
        triangle=triangle.astype(np.int32),
        position=points,
        weights=np.stack(barycentric(target, triangle, position)),
        depth=target.viewer.depth_of(np.ascontiguousarray(seen.T)),
        normals=normals,
        inside=int(np.count_nonzero(~pixels.bleed)),
        slopes=weight_slopes(target, triangle, pixels.ray, ray, seen) if sloped else None,
        ray=None if pixels.origin is None else np.ascontiguousarray(ray.T),
    )


def first_triangles(
    target: Target, neighbours: Neighbours, pixels: Places, soft: BoolArray | None = None
) -> tuple[IntArray, BoolArray]:
    """The first triangle (P,) along the ray of every pixel, −1 for none; `soft` (T,) are what light may pass.

    Returns:
        the triangles, and the pixels (P,) near which the first may be passed.
    """
    named = np.stack([cast(target, pixels.directions(*way), origin=pixels.origin) for way in OFFSETS])
    back = _looking_back(target, pixels, pixels.directions(), named[0])
    every = np.concatenate((named, back[None]))
    result: IntArray = np.maximum(named[0], -1)
    rows = np.flatnonzero((every != every[0]).any(axis=0))
    if rows.size:
        result[rows] = _nearest(target, neighbours, pixels, rows, every[:, rows])
    if soft is None:
        return result, np.zeros(result.size, dtype=np.bool_)
    every = np.concatenate((every, result[None]))
    return result, np.asarray((soft[every] & (every >= 0)).any(axis=0))


@dataclass(frozen=True)
class Met:
    """All that rays of P pixels meet before the first opaque surface, that and perhaps more.

    Attributes:
        count: P.
        row: (M,) whose ray.
        triangle: (M,).
        distance: (M,) how far from the eye.
    """

    count: int
    row: IntArray
    triangle: IntArray
    distance: FloatArray

    def layers(self, light: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
        """The nearest triangles, then those behind them, and so on.

        Args:
            light: (P,) pixels that light still passes; whoever takes a layer notes where it ends.

        Yields:
            pixels (n,), ascending, and triangles (n,) of a layer, each pixel once.
        """
        left = np.lexsort((self.triangle, self.row))
        while left.size:
            row = self.row[left]
            nearest = np.full(self.count, np.inf)
            np.minimum.at(nearest, row, self.distance[left])
            front = np.flatnonzero(self.distance[left] <= nearest[row] * (1 + RESOLUTION))
            # Of triangles at one depth the lowest, as where pixels are opaque.
            front = front[np.flatnonzero(np.diff(row[front], prepend=-1))]
            yield row[front], self.triangle[left[front]]
            rest = light[row]
            rest[front] = False
            left = left[rest]


def met_through(target: Target, neighbours: Neighbours, pixels: Places, soft: BoolArray) -> Met:
    """All that the rays of pixels meet up to the first triangle that is not `soft` (T,)."""
    rows, named = [], []
    for offset in OFFSETS:
        directions = pixels.directions(*offset)
        live, start = np.arange(len(directions)), np.zeros(len(directions))
        while live.size:
            ray, some = directions[live], pixels.take(live)
            met = cast(target, ray, start, some.origin)
            back = _looking_back(target, some, ray, met)
            hit = np.flatnonzero(met >= 0)
            rows += [live[hit], live[back >= 0]]
            named += [met[hit], back[back >= 0]]
            distance = plane_distance(target, met[hit], ray[hit], some.from_eye(hit))
            going = soft[met[hit]] & np.isfinite(distance)
            start = np.maximum(distance, start[hit])[going] * (1 + _PAST) + _PAST * 1e-3
            live = live[hit[going]]
    tests = _drawn_here(target, neighbours, pixels, np.concatenate(rows), np.concatenate(named))
    return Met(pixels.address.size, *tests)


def _looking_back(target: Target, pixels: Places, directions: FloatArray, first: IntArray) -> IntArray:
    """What rays (P, 3) of P pixels from just behind their first hits (P,) towards the eye meet.

    Where that is nothing, or nothing was hit, it is `first` itself.
    """
    result: IntArray = first.copy()
    rows = np.flatnonzero(first >= 0)
    if rows.size:
        ray, begin = directions[rows], pixels.from_eye(rows)
        distance = plane_distance(target, first[rows], ray, begin) * (1 + _BEHIND)
        distance = np.where(np.isfinite(distance), distance, 0.0)
        origin = distance[:, None] * ray if begin is None else begin + distance[:, None] * ray
        met = target.embree.run(origin.astype(np.float32), (-ray).astype(np.float32)).astype(np.int64)
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
    around, triangle, distance = _drawn_here(
        target, neighbours, pixels.take(rows), which, named.T[which, column]
    )
    nearest = np.full(rows.size, np.inf)
    np.minimum.at(nearest, around, distance)
    first = np.flatnonzero(distance <= nearest[around] * (1 + RESOLUTION))
    order = first[np.lexsort((triangle[first], around[first]))][::-1]
    result[around[order]] = triangle[order]  # the last write of a row is its lowest triangle
    return result


def _drawn_here(
    target: Target, neighbours: Neighbours, pixels: Places, row: IntArray, named: IntArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Of triangles (N,) and those that touch them what the rays of pixels (N,) meet, each once a pixel.

    Returns:
        pixels, triangles, and how far from the eye these are.
    """
    around, triangle = neighbours.around(row, named)
    tests = intersect(target, pixels, around, triangle, LATTICE)
    ray = pixels.directions()[around]
    distance = plane_distance(target, triangle, ray, pixels.from_eye(around))
    with np.errstate(invalid="ignore"):  # infinity times 0
        reach = distance * reach_along(target.viewer, ray)
    hit = np.flatnonzero((tests.inside >= 0) & (reach >= target.viewer.near) & (reach <= target.viewer.far))
    return around[hit], triangle[hit], distance[hit]
