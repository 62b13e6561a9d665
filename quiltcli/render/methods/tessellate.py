"""Tessellation: triangles cut small and drawn straight on a curved display (Harish, Narayanan).

The method of *View Dependent Rendering to Simple Parametric Display Surfaces*, to compare with: each corner
is carried along its ray to the display's first lit point, edges whose ends lie farther apart there than
`render.threshold` of the display's size are cut in the middle, and what is left is drawn with straight edges
in the raster. Triangles with a corner whose ray misses the display are cut as well, and dropped when they are
small: what they would show is lost, as it is in the paper's.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from quiltcli.charts import Chart
from quiltcli.charts.meet import meet, net
from quiltcli.display import lit_facets
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot
from quiltcli.projection.camera import raster_display
from quiltcli.projection.gaze import Gaze
from quiltcli.projection.planar import viewer_rays
from quiltcli.render.buffers import Buffers, clear, lay_background, lay_sky, new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods.raycast import pixels_of
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage, stage_of
from quiltcli.scene.bare import bare_scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import fill
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.embree import aim, embree_scene, measure_along
from quiltcli.visibility.rays.pixels import lit_pixels, places
from quiltcli.visibility.rays.weights import barycentric, weight_slopes
from quiltcli.visibility.resolve.hits import point_hits

THRESHOLD = 0.01
"""Share of the display's size where a job does not say."""

_MOST_CUTS = 40
_SMALL = 4.0  # thresholds, below which a triangle that misses the display with a corner is dropped


@dataclass(frozen=True)
class Pieces:
    """N pieces of triangles on the raster of a display.

    Attributes:
        pixel: (N, 3, 2) facet pixels of the corners.
        depth: (N, 3) their depths.
        triangle: (N,) the triangle each is a piece of.
    """

    pixel: FloatArray
    depth: FloatArray
    triangle: IntArray


def draw_tessellated(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame of curved surfaces by cutting triangles; for the arguments see `frame.draw_frame`."""
    begin = time.perf_counter()
    lit = lit_facets(stage.facets, viewer.eye) & (stage.layout.page >= 0)
    if only is not None:
        lit &= only
    clear(stage, buffers, only)
    rays = viewer_rays(stage.layout, stage.facets, lit, viewer)
    blocks = np.flatnonzero(rays.lit[stage.blocks.facet])
    lay_background(stage, blocks, buffers, rays)
    target = aim(stage.scene.vertices, stage.scene.triangles, viewer, stage.job.render.backface_culling)
    sloped = stage.scene.textures is not None
    threshold, pieces, visible = stage.job.render.threshold or THRESHOLD, 0, 0
    for row in np.flatnonzero(lit).tolist():
        chart = stage.facets.charts[row]
        assert chart is not None
        corners = target.corners[target.triangles[target.drawn]]
        found = cut_to_display(chart, viewer, corners, np.flatnonzero(target.drawn), threshold)
        pieces += found.triangle.size
        shown, depth = _drawn(chart, viewer, found, threads, stage)
        mine = np.zeros(lit.size, dtype=np.bool_)
        mine[row] = True
        for address in pixels_of(stage, mine):
            address = address[lit_pixels(address, stage.layout, stage.owners, rays)]
            pixels = places(address, stage.layout, stage.owners, rays)
            view = rays.views[row]
            assert view is not None
            x, y = pixels.x.astype(np.float64) + 0.5, pixels.y.astype(np.float64) + 0.5
            i, j = (np.floor(value).astype(np.int64) for value in view.facet_pixels(x, y))
            inside = (i >= 0) & (j >= 0) & (i < chart.size[0]) & (j < chart.size[1])
            at = np.where(inside, j * chart.size[0] + i, 0)
            seen = np.flatnonzero(inside & (shown[at] >= 0))
            direction = pixels.directions()[seen]
            distance = depth[at[seen]] / measure_along(viewer, direction)
            position = direction * distance[:, None]
            triangle = found.triangle[shown[at[seen]]]
            points = np.ascontiguousarray(position.T)
            matrix = pixels.ray[seen]
            ray = matrix[:, :, 0] * x[seen, None] + matrix[:, :, 1] * y[seen, None] + matrix[:, :, 2]
            hits = point_hits(
                first=address[seen],
                facet=pixels.facet[seen].astype(np.int32),
                triangle=triangle.astype(np.int32),
                position=points,
                weights=np.stack(barycentric(target, triangle, position)),
                depth=depth[at[seen]],
                normals=stage.scene.corner_normals,
                inside=int(np.count_nonzero(~pixels.bleed[seen])),
                slopes=weight_slopes(target, triangle, matrix, ray, position) if sloped else None,
            )
            if seen.size:
                fill(
                    buffers,
                    stage.job.output.channels,
                    Gaze(viewer, None),
                    Shaded(stage.scene, viewer.eye, hits),
                )
            visible += hits.inside
    lay_sky(stage, blocks, buffers, rays)
    return FrameRecord(
        frame=viewer.frame,
        triangles=int(np.count_nonzero(target.drawn)),
        reaching=int(np.count_nonzero(target.drawn)),
        pairs=pieces,
        settled=0,
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds={"cut and draw": time.perf_counter() - begin},
        warnings=() if visible else ("no pixel shows the scene",),
    )


def cut_to_display(
    chart: Chart, viewer: Viewer, corners: FloatArray, triangle: IntArray, threshold: float
) -> Pieces:
    """Cut triangles until their edges are short on the display.

    Args:
        chart: the display's surface.
        viewer: who looks.
        corners: (T, 3, 3) corners of triangles, minus the eye.
        triangle: (T,) their numbers.
        threshold: the longest edge on the display, as a share of its size.
    """
    carry = _Carrier(chart, viewer)
    longest = threshold * carry.size
    pixel, on = carry.to_display(corners.reshape(-1, 3))
    pixel, on = pixel.reshape(-1, 3, 2), on.reshape(-1, 3)
    done = []
    for turn in range(_MOST_CUTS):
        length = _edge_lengths(chart, pixel, on, corners, carry, longest)
        worst = length.argmax(axis=1)
        rows = np.arange(len(worst))
        cut = (length[rows, worst] > longest) & on.any(axis=1)
        last = turn == _MOST_CUTS - 1
        whole = on.all(axis=1) & (~cut | last)
        done.append((pixel[whole], corners[whole], triangle[whole]))
        keep = np.flatnonzero(cut)
        if last or not keep.size:
            break
        edge, pixel, on, corners, triangle = worst[keep], pixel[keep], on[keep], corners[keep], triangle[keep]
        a, b, c = (edge + k for k in (1, 2, 0))
        rows = np.arange(keep.size)
        a, b, c = a % 3, b % 3, c % 3
        middle = (corners[rows, a] + corners[rows, b]) / 2
        spot, there = carry.to_display(middle)
        halves = []
        for gone in (a, b):
            p, o, v = pixel.copy(), on.copy(), corners.copy()
            p[rows, gone], o[rows, gone], v[rows, gone] = spot, there, middle
            halves.append((p, o, v))
        pixel, on, corners = (np.concatenate(both) for both in zip(*halves, strict=True))
        triangle = np.concatenate((triangle, triangle))
    pixel, corners, triangle = (np.concatenate(parts) for parts in zip(*done, strict=True))
    depth = viewer.depth_of(np.moveaxis(corners, 2, 0))
    ahead = (depth > 0).all(axis=1)
    return _across_the_seam(chart, Pieces(pixel[ahead], depth[ahead], triangle[ahead]))


def _edge_lengths(
    chart: Chart, pixel: FloatArray, on: BoolArray, corners: FloatArray, carry: _Carrier, longest: float
) -> FloatArray:
    """How long (N, 3) the edges opposite to each corner are on the display, metres.

    An edge with an end off the display is as long as its angle is wide, until it is small.
    """
    points = chart.points(pixel[..., 0], pixel[..., 1])
    points = np.where(on, points, 0.0)
    way = corners / np.sqrt(dot(corners, corners))[..., None]
    result = np.zeros(on.shape)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        both = on[:, i] & on[:, j]
        apart = np.sqrt(((points[:, :, i] - points[:, :, j]) ** 2).sum(axis=0))
        turn = np.sqrt(((way[:, i] - way[:, j]) ** 2).sum(axis=1)) * carry.away
        result[:, k] = np.where(both, apart, np.where(turn > _SMALL * longest, turn, 0.0))
    return result


class _Carrier:
    """Carries points along their rays to the first lit point of a display."""

    def __init__(self, chart: Chart, viewer: Viewer) -> None:
        points, self._pixels, triangles = net(chart)
        self._chart, self._eye = chart, viewer.eye
        self._points = points - viewer.eye
        lit = chart.lit(self._pixels[:, 0], self._pixels[:, 1], points.T, viewer.eye)
        self._triangles: Int32Array = triangles[lit[triangles].any(axis=1)]
        self._scene = embree_scene(self._points, self._triangles)
        self.size = float(np.ptp(points, axis=0).max()) / 2
        self.away = float(np.sqrt(dot(self._points, self._points)).mean())

    def to_display(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Facet pixels (N, 2) of points (N, 3) minus the eye, and which have one."""
        pixel, on = np.zeros((len(points), 2)), np.zeros(len(points), dtype=np.bool_)
        if not len(self._triangles) or not len(points):
            return pixel, on
        origin = np.zeros(points.shape, dtype=np.float32)
        met = self._scene.run(origin, points.astype(np.float32)).astype(np.int64)
        hit = np.flatnonzero(met >= 0)
        corners = self._points[self._triangles[met[hit]]]
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        weights = np.stack([dot(cross(p, q), points[hit]) for p, q in ((b, c), (c, a), (a, b))])
        weights /= weights.sum(axis=0)
        guess = np.einsum("kp,pkc->cp", weights, self._pixels[self._triangles[met[hit]]])
        found = meet(self._chart, self._eye, np.ascontiguousarray(points[hit].T), guess)
        pixel[hit] = found.T
        shown = self._chart.lit(found[0], found[1], self._chart.points(*found), self._eye)
        on[hit] = shown
        return pixel, on


def _across_the_seam(chart: Chart, pieces: Pieces) -> Pieces:
    """Pieces that lie across the seam of a display that closes, at both of its ends."""
    if not chart.wraps:
        return pieces
    width = chart.size[0]
    pixel = pieces.pixel.copy()
    first = pixel[:, :1, 0]
    pixel[..., 0] -= width * np.rint((pixel[..., 0] - first) / width)
    again = [np.flatnonzero(pixel[..., 0].min(axis=1) < 0), np.flatnonzero(pixel[..., 0].max(axis=1) > width)]
    parts = [pixel]
    for rows, way in zip(again, (width, -width), strict=True):
        moved = pixel[rows].copy()
        moved[..., 0] += way
        parts.append(moved)
    rows = np.concatenate((np.arange(len(pixel)), *again))
    return Pieces(np.concatenate(parts), pieces.depth[rows], pieces.triangle[rows])


def _drawn(
    chart: Chart, viewer: Viewer, pieces: Pieces, threads: int, stage: Stage
) -> tuple[IntArray, FloatArray]:
    """The piece (P,) that each pixel of the raster shows, −1 for none, and its depth.

    A point at depth Z over the pixel (x, y) is (xZ, −yZ, −Z) to an eye at the origin: the raster is a facet.
    """
    width, height = chart.size
    x, y, z = pieces.pixel[..., 0], pieces.pixel[..., 1], pieces.depth
    vertices = np.stack((x * z, -y * z, -z), axis=-1).reshape(-1, 3)
    scene = bare_scene(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))
    origin, du, dv = (np.array([v], dtype=np.float64) for v in ((0, 0, -1), (1, 0, 0), (0, -1, 0)))
    size = np.array([[width, height]], dtype=np.int32)
    raster = raster_display(origin, du, dv, size, np.array([[0.0, 0, 1]]))
    render = stage.job.render.model_copy(
        update={"method": "homography", "samples": 1, "depth": "planar", "backface_culling": False}
    )
    output = stage.job.output.model_copy(update={"channels": ("triangle", "Z")})
    job = stage.job.model_copy(update={"render": render, "output": output})
    camera = stage_of(job, *raster, scene, bleed=0)
    ahead = Viewer(
        viewer.frame,
        np.zeros(3),
        np.array([0.0, 0, -1]),
        np.array([0.0, 1, 0]),
        viewer.near,
        viewer.far,
        "planar",
    )
    buffers = new_buffers(camera)
    draw_frame(camera, ahead, buffers, threads)
    return buffers["triangle"].astype(np.int64) - 1, buffers["Z"].astype(np.float64)
