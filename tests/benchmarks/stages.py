"""Displays at the sizes that are measured, and stages made of them in memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, lit_facets, load_display
from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.job import JobFile, ResolutionSpec, load_display_file
from quiltcli.layout import align
from quiltcli.projection.planar import quilt_rays
from quiltcli.render.crew import plan_of
from quiltcli.render.setup import Stage, stage_of
from quiltcli.scene import Scene
from quiltcli.shading.shade import shading_wants
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, Wanted, batches, rasterize
from quiltcli.visibility.shares import bin_frame
from tests.benchmarks.meshes import Mesh, scene_of
from tests.helpers.in_memory import CUBE, CUBE_FACES, display, icosphere, viewer
from tests.helpers.packed_layouts import pack

EYE = np.array([2.2, 1.8, 3.2])
"""Where the eye is, from the middle of a display that reaches 1 to all sides."""

DENSITY = 1360.0
"""Pixels a metre at which the large displays fill 8192 × 8192 pixels."""

MODELS = Path(__file__).parents[2] / "display_models"


@dataclass(frozen=True)
class Place:
    """A display where things happen: its middle, and how far it reaches (half its longest side)."""

    facets: Facets
    middle: FloatArray
    reach: float


def cube(density: float = DENSITY) -> Place:
    """Five sides of a cube of 2 m, by default so many pixels a metre."""
    return _place(display(CUBE, CUBE_FACES[:5], density))


def ball(splits: int) -> Place:
    """An icosphere of radius 1 m, 20·4ˢ facets."""
    vertices, triangles = icosphere(splits)
    return _place(display(vertices, triangles.tolist(), DENSITY))


def model(name: str, pixels: float) -> Place:
    """A display of display_models at the density that gives its facets' rectangles so many pixels."""
    spec = load_display_file(MODELS / f"{name}.yaml")

    def at(density: float) -> Facets:
        return load_display(spec.model_copy(update={"resolution": ResolutionSpec(pixels_per_metre=density)}))

    area = float(at(1000).size.astype(np.float64).prod(axis=1).sum())
    return _place(at(1000 * (pixels / area) ** 0.5))


def _place(facets: Facets) -> Place:
    low, high = facets.corners.min(axis=0), facets.corners.max(axis=0)
    return Place(facets, (low + high) / 2, float((high - low).max()) / 2)


def job_of(*, culling: bool) -> JobFile:
    """A job that asks for colour and depth; its files are never read."""
    path = {"keyframes": [{"frame": 1, "position": [0, 0, 2], "look_at": [0, 0, 0]}]}
    viewing = {"near": 0.05, "far": 100, "path": path}
    render = {"backface_culling": culling}
    spec = {"display": "d.yaml", "scene": "s.obj", "frames": "1", "viewer": viewing, "render": render}
    return JobFile.model_validate(spec)


def stage_for(place: Place, mesh: Mesh, size: tuple[int, int] | None = None) -> Stage:
    """A two-sided stage: the mesh about the display's middle, the facets packed in rows."""
    facets = place.facets
    layout = align(pack(facets, "rows", size), facets)
    scene = scene_of(replace(mesh, vertices=mesh.vertices * place.reach + place.middle))
    return stage_of(job_of(culling=False), facets, layout, scene, bleed=2)


def with_mesh(stage: Stage, place: Place, mesh: Mesh) -> Stage:
    """The stage with another scene."""
    return replace(stage, scene=scene_of(replace(mesh, vertices=mesh.vertices * place.reach + place.middle)))


def culled(stage: Stage) -> Stage:
    """The stage with backface culling."""
    return replace(stage, job=job_of(culling=True))


def viewer_of(place: Place) -> Viewer:
    """The viewer of a display."""
    return viewer(place.middle + EYE * place.reach, place.middle)


@dataclass(frozen=True)
class Work:
    """A frame that is binned and waits to be drawn."""

    scene: Scene
    frame: Frame
    batches: Sequence[tuple[int, int]]


def binned(stage: Stage, seen_by: Viewer) -> Work:
    """Bin a frame the way `draw_frame` does, and draw nothing."""
    rays = quilt_rays(stage.layout, lit_facets(stage.facets, seen_by.eye), seen_by.eye)
    found = bin_frame(plan_of(stage, seen_by, rays))
    frame = Frame(seen_by, found.sight, rays, stage.blocks, found.pairs)
    return Work(stage.scene, frame, batches(frame))


def all_hits(work: Work) -> int:
    """Rasterize every batch; the number of pixels that see the scene."""
    wanted = shading_wants(work.scene) | Wanted.POSITION | Wanted.WEIGHTS
    return sum(
        hits.pixel.size
        for batch in work.batches
        for hits in rasterize(work.frame, batch, wanted=wanted, scene=work.scene)
    )


def facet_pairs(frame: Frame) -> tuple[Int32Array, IntArray]:
    """Triangle (N,) and facet (N,) of every pair of a frame, by facet."""
    triangle, block = frame.pairs.of(np.arange(frame.blocks.facet.size))
    keys = np.unique(frame.blocks.facet.astype(np.int64).take(block) << 32 | triangle)
    return (keys & 0xFFFFFFFF).astype(np.int32), keys >> 32


def lit_pixels(stage: Stage, frame: Frame) -> IntArray:
    """Quilt addresses of the pixels in the polygons of lit facets."""
    lit = np.append(False, frame.rays.lit)
    return np.flatnonzero(lit[np.maximum(stage.owners, 0)])


def pixel_rays(stage: Stage, frame: Frame, step: int = 1 << 20) -> Iterator[Float32Array]:
    """Directions (n, 3) float32 from the eye through the centres of `lit_pixels`, `step` at a time."""
    layout, pixels = stage.layout, lit_pixels(stage, frame)
    matrices = frame.rays.eye_from_quilt.astype(np.float32)
    for at in range(0, pixels.size, step):
        part = pixels[at : at + step]
        page = np.searchsorted(layout.page_offset, part, side="right") - 1
        y, x = np.divmod(part - layout.page_offset[page], layout.pages[page, 0])
        x, y = x.astype(np.float32) + np.float32(0.5), y.astype(np.float32) + np.float32(0.5)
        m = matrices.reshape(-1, 9).take(stage.owners[part].astype(np.int64) - 1, axis=0)
        yield np.stack([m[:, 3 * i] * x + m[:, 3 * i + 1] * y + m[:, 3 * i + 2] for i in range(3)], axis=1)
