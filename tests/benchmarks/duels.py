"""The duels: a frame of ours against Embree's rays, OpenGL's draws and the writing of the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from quiltcli.formats.exr.image import write_exr
from quiltcli.geometry import BoolArray
from quiltcli.images.facets import page_of
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility import draw as raster
from tests.benchmarks import meshes, opengl
from tests.benchmarks.embree import caster
from tests.benchmarks.meshes import Mesh
from tests.benchmarks.race import Contestants, race
from tests.benchmarks.stages import (
    Place,
    Work,
    all_hits,
    ball,
    binned,
    cube,
    culled,
    pixel_rays,
    stage_for,
    viewer_of,
    with_mesh,
)
from tests.benchmarks.watching import replaced

QUILT = (8192, 8192)
SCENES: Mapping[str, Callable[[], Mesh]] = {
    "dragon": lambda: meshes.detailed(3),
    "room": meshes.room,
    "mixed": meshes.mixed,
    "spheres": meshes.spheres,
}
DISPLAYS: Mapping[str, Callable[[], Place]] = {"cube": cube, "ball": lambda: ball(3)}
NAMES = ("dragon/ball", "dragon/cube", "room/cube", "room/ball", "mixed/cube", "mixed/ball", "spheres/cube")
_OTHER_PIXELS = 0.01  # as a share: OpenGL fills rectangles, some of which lap over other facets
_BRIEF = ("culled hits", "two-sided hits", "culled frame 1", "two-sided frame 1")
QUICK = ("dragon/ball", "room/cube")


@lru_cache(maxsize=2)
def _empty_stage(display: str) -> tuple[Place, Stage]:
    place = DISPLAYS[display]()
    return place, stage_for(place, meshes.room(1), QUILT)


def duel(name: str, rounds: int, scratch: Path, *, quick: bool = False) -> dict[str, Any]:
    """Measure one configuration, `scene/display`."""
    scene, display = name.split("/")
    place, stage = _empty_stage(display)
    stage = with_mesh(stage, place, SCENES[scene]())
    viewer = viewer_of(place)
    kinds = {"culled": culled(stage), "two-sided": stage}
    works = {kind: binned(made, viewer) for kind, made in kinds.items()}
    buffers = (shared_buffers if can_fork() else new_buffers)(stage)
    dirty = np.ones(stage.blocks.used.size, dtype=np.bool_)
    rays = list(pixel_rays(stage, works["two-sided"].frame))
    counts: dict[str, Any] = {"lit pixels": sum(map(len, rays))}
    with ExitStack() as ends:
        contestants: dict[str, Callable[[], object]] = {}
        for kind, work in works.items():
            counts[kind] = _counts(kinds[kind], viewer, work, buffers)
            contestants |= _ours(kind, kinds[kind], viewer, work, buffers, dirty, ends)
        contestants["embree"] = caster(works["two-sided"].frame.sight, rays)
        if not opengl.renderer().startswith("-"):
            visible = {kind: counts[kind]["visible pixels"] for kind in kinds}
            contestants |= _opengl(kinds, viewer, visible, ends)
        times = race(contestants, rounds, cold=("embree",), brief=_BRIEF)
        writes = _writes(stage, buffers, scratch)
        times |= race(writes, 1 if quick else rounds, once=1.0, cold=writes)
    if name == "dragon/ball" and not quick and "opengl two-sided draw" in times:
        times["opengl whole mesh"] = _whole_mesh(stage, viewer)
    return {"counts": counts, "times": times}


def _counts(stage: Stage, viewer: Viewer, work: Work, buffers: Buffers) -> dict[str, int]:
    record = draw_frame(stage, viewer, buffers)
    return {
        "triangles": record.triangles,
        "pairs": record.pairs,
        "block pairs": int(work.frame.pairs.count.sum()),
        "visible pixels": record.visible_pixels,
    }


def _ours(
    kind: str,
    stage: Stage,
    viewer: Viewer,
    work: Work,
    buffers: Buffers,
    dirty: BoolArray,
    ends: ExitStack,
) -> Contestants:
    """Our own ways: binning, depth keys, hits and whole frames, cleared as in a sequence."""
    frame = partial(draw_frame, stage, viewer, buffers, dirty=dirty)
    contestants: dict[str, Callable[[], object]] = {
        f"{kind} bin": lambda: binned(stage, viewer),
        f"{kind} keys": lambda: depth_keys(work),
        f"{kind} hits": lambda: all_hits(work),
        f"{kind} frame 1": partial(frame, 1),
    }
    if can_fork():
        pool = ends.enter_context(Pool(stage, [buffers], 2))
        contestants[f"{kind} frame 2"] = partial(frame, crew=pool)
        matte = _matte(stage)
        pool = ends.enter_context(Pool(matte, [buffers], 2))
        contestants[f"{kind} matte 2"] = partial(draw_frame, matte, viewer, buffers, dirty=dirty, crew=pool)
    return contestants


def _matte(stage: Stage) -> Stage:
    """The stage with surfaces of a Lambert base alone."""
    materials = replace(stage.scene.materials, specular=np.zeros(1, np.float32))
    return replace(stage, scene=replace(stage.scene, materials=materials))


def depth_keys(work: Work) -> None:
    """Visibility alone: rasterize every batch up to its depth keys, and read nothing from them."""
    with replaced(raster, "read_canvas", lambda *_: iter(())):
        all_hits(work)


def _opengl(
    kinds: Mapping[str, Stage], viewer: Viewer, visible: Mapping[str, int], ends: ExitStack
) -> Contestants:
    """OpenGL's ways, which have to show as many pixels as ours: or something else would be timed."""
    quilts = {
        kind: ends.enter_context(opengl.Quilt(stage, binned(stage, viewer).frame, culling=kind == "culled"))
        for kind, stage in kinds.items()
    }
    contestants: dict[str, Callable[[], object]] = {}
    for kind, quilt in quilts.items():
        quilt.draw("ggx")
        quilt.read()
        shown = int(np.count_nonzero(quilt.depth[kinds[kind].owners > 0] < 1))
        if abs(shown - visible[kind]) > _OTHER_PIXELS * visible[kind]:
            raise SystemExit(f"OpenGL shows {shown} pixels {kind}, expected about {visible[kind]}")
        contestants[f"opengl {kind} draw"] = partial(quilt.draw, "ggx")
        contestants[f"opengl {kind} lambert draw"] = partial(quilt.draw, "lambert")
    contestants["opengl read"] = quilts["two-sided"].read
    return contestants


def _writes(stage: Stage, buffers: Buffers, scratch: Path) -> Contestants:
    """Write the quilt that was drawn, with two of the library's threads."""
    OpenEXR.set_global_thread_count(2)
    pixels = {name: page_of(flat, stage.layout, 0) for name, flat in buffers.items()}
    return {
        f"write {kind}": partial(write_exr, scratch / f"quilt_{kind}.exr", pixels, {}, kind)
        for kind in ("zip", "zstd")
    }


def _whole_mesh(stage: Stage, viewer: Viewer) -> dict[str, list[float]]:
    """The usual way, every triangle to every lit facet; once, for it takes a quarter minute."""
    with ExitStack() as ends:
        quilt = ends.enter_context(opengl.Quilt(stage, binned(stage, viewer).frame, culling=False))
        way = {"whole": lambda: quilt.draw("ggx", whole_mesh=True)}
        return race(way, 1, once=1.0, cold=way)["whole"]
