"""Displays, scenes and pictures made in memory, for tests of binning and rasterization."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets, build_facets, lit_facets
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot, normalized
from quiltcli.job import DisplayFile
from quiltcli.layout import Layout, align, pixel_owners
from quiltcli.projection.planar import QuiltRays, quilt_rays
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.pairs import Cores, Pairs, Parts, facet_parts, lit_cones, pairs_of
from quiltcli.visibility.draw import (
    Frame,
    Sight,
    batches,
    block_keys,
    cut_blocks,
    pairs_by_block,
    rasterize,
    triangles_in_range,
)
from tests.helpers.packed_layouts import pack


def display(vertices: object, polygons: list[list[int]], density: float = 100, **keys: object) -> Facets:
    """A display from vertices and polygons, in pixels per metre."""
    mesh = PolygonMesh(
        np.asarray(vertices, np.float64),
        np.cumsum([0, *map(len, polygons)]).astype(np.int64),
        np.concatenate([np.asarray(p) for p in polygons]),
        None,
        ("",) * len(polygons),
        np.zeros(len(polygons), np.int64),
        "m.obj",
    )
    spec = {"mesh": "m.obj", "resolution": {"pixels_per_metre": density}, **keys}
    return build_facets(mesh, DisplayFile.model_validate(spec))


def panel(width: float = 2, height: float = 2, density: float = 32) -> Facets:
    """One upright facet in the plane z = 0 that faces +z, centred on the origin."""
    w, h = width / 2, height / 2
    return display([(-w, -h, 0), (w, -h, 0), (w, h, 0), (-w, h, 0)], [[0, 1, 2, 3]], density)


CUBE = np.array([(x, y, z) for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
CUBE_FACES = [[1, 5, 7, 3], [0, 2, 6, 4], [4, 6, 7, 5], [0, 1, 3, 2], [2, 3, 7, 6], [0, 4, 5, 1]]


def cube(density: float = 40, **keys: object) -> Facets:
    """A cube of side 2 about the origin, faces outward."""
    return display(CUBE, CUBE_FACES, density, **keys)


def icosphere(splits: int) -> tuple[FloatArray, Int32Array]:
    """A unit sphere of 20·4ˢ triangles that share their vertices, wound outward."""
    golden = (1 + 5**0.5) / 2
    points = [(a * x, b * y, 0) for a in (1, -1) for b in (1, -1) for x, y in [(1, golden)]]
    vertices = [tuple(np.roll(p, k)) for k in range(3) for p in points]
    v = normalized(np.array(vertices, np.float64))
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if min(v[i] @ v[j], v[j] @ v[k], v[k] @ v[i]) > 0.4
    ]
    t = np.array(faces)
    for _ in range(splits):
        v, t = _split(v, t)
    outward = dot(cross(v[t[:, 1]] - v[t[:, 0]], v[t[:, 2]] - v[t[:, 0]]), v[t[:, 0]]) > 0
    t[~outward] = t[~outward][:, [0, 2, 1]]
    return v, t.astype(np.int32)


def _split(v: FloatArray, t: IntArray) -> tuple[FloatArray, IntArray]:
    """Every triangle into four, new vertices on the sphere."""
    edges = np.sort(np.concatenate((t[:, :2], t[:, 1:], t[:, ::2])), axis=1)
    ends, which = np.unique(edges, axis=0, return_inverse=True)
    a, b, c = (len(v) + which.reshape(3, -1)).astype(np.int64)
    p, q, r = t.T
    v = np.concatenate((v, normalized(v[ends].mean(axis=1))))
    return v, np.concatenate([np.stack(s, axis=1) for s in ((p, a, c), (a, q, b), (c, b, r), (a, b, c))])


def viewer(
    eye: object, at: object = (0, 0, 0), near: float = 0.05, far: float = 100, depth: str = "planar"
) -> Viewer:
    """A viewer who looks from `eye` at a point."""
    eye, at = np.asarray(eye, np.float64), np.asarray(at, np.float64)
    look = normalized(at - eye)
    aside = np.array([0.0, 1, 0]) if abs(look[1]) < 0.99 else np.array([0.0, 0, 1])
    right = normalized(cross(look, aside))
    return Viewer(1, eye, look, cross(right, look), near, far, depth)


def bin_triangles(
    vertices: FloatArray,
    triangles: Int32Array,
    wanted: BoolArray,
    parts: Parts,
    lit: BoolArray,
    eye: FloatArray,
) -> Pairs:
    """Both passes of binning over the `wanted` (T,) triangles; vertices are minus the eye."""
    cones = lit_cones(parts, lit, eye)
    return pairs_of(vertices, triangles, np.flatnonzero(wanted), Cores(cones).met_by(vertices), cones)


@dataclass(frozen=True)
class Picture:
    """What was rasterized: triangle (−1 none) and planar or radial depth of every quilt pixel."""

    facets: Facets
    layout: Layout
    owners: IntArray
    rays: QuiltRays
    frame: Frame
    pairs: Pairs
    triangle: IntArray
    depth: FloatArray

    @property
    def mine(self) -> BoolArray:
        """Pixels of lit facets, bleed included."""
        return np.append(False, self.rays.lit)[np.abs(self.owners)]

    def page(self, flat: IntArray) -> IntArray:
        """The first page of a flat array as (H, W)."""
        width, height = self.layout.pages[0]
        return flat[: width * height].reshape(height, width)


def picture(
    facets: Facets,
    vertices: FloatArray,
    triangles: object,
    eye: Viewer,
    bleed: int = 2,
    layout: Layout | None = None,
    sample: tuple[float, float] = (0.0, 0.0),
) -> Picture:
    """Bin and rasterize triangles."""
    vertices = np.asarray(vertices, np.float64)
    triangles = np.asarray(triangles, np.int32).reshape(-1, 3)
    layout = align(layout or pack(facets, "rows", padding=2), facets)
    owners = pixel_owners(layout, bleed)
    rays = quilt_rays(layout, lit_facets(facets, eye.eye), eye.eye)
    local = vertices - eye.eye
    wanted, cut = triangles_in_range(eye.depth_of(local.T), local, triangles, eye)
    pairs = bin_triangles(local, triangles, wanted, facet_parts(facets, layout, bleed), rays.lit, eye.eye)
    sight = Sight(local, triangles, cut)
    blocks = cut_blocks(layout, bleed, owners)
    block_pairs = pairs_by_block([block_keys(pairs, sight, rays, blocks)], blocks)
    frame = Frame(eye, sight, rays, blocks, block_pairs)
    triangle = np.full(owners.size, -1, np.int64)
    depth = np.full(owners.size, np.inf)
    for batch in batches(frame):
        for hits in rasterize(frame, batch, np.tile(sample, (facets.count, 1))):
            assert (triangle[hits.pixel] == -1).all(), "a pixel came twice"
            hits.put(triangle, hits.triangle[:, None])
            hits.put(depth, hits.depth)
    return Picture(facets, layout, owners.astype(np.int64), rays, frame, pairs, triangle, depth)


def pixel_rays(shown: Picture, pixels: IntArray) -> FloatArray:
    """Directions (n, 3) from the eye through the centres of quilt pixels of facets."""
    layout = shown.layout
    page = np.searchsorted(layout.page_offset, pixels, side="right") - 1
    y, x = np.divmod(pixels - layout.page_offset[page], layout.pages[page, 0])
    matrix = shown.rays.eye_from_quilt[np.abs(shown.owners[pixels]) - 1]
    return matrix[:, :, 0] * (x + 0.5)[:, None] + matrix[:, :, 1] * (y + 0.5)[:, None] + matrix[:, :, 2]
