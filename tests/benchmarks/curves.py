"""How a frame's time grows: with facets, quilt pixels and triangles, and by stage.

These are the curves of the method's paper (Harish & Narayanan, figures 18 to 21), on displays of the
same shapes and numbers of facets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import lru_cache, partial
from typing import Any

import numpy as np

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from quiltcli.viewer.viewer import Viewer
from tests.benchmarks import meshes, opengl
from tests.benchmarks.race import Times, race
from tests.benchmarks.stages import Place, all_hits, binned, model, stage_for, viewer_of, with_mesh
from tests.benchmarks.watching import stage_seconds

MODELS = (
    *("icosahedron", "cylinder216", "desk816", "sphere840"),
    *("spring902", "teapot1024", "knot1200", "sphere1620"),
)
QUILT_PIXELS = 48e6
"""Pixels of the facets' rectangles; packed in rows they take 48 to 80 million of quilt."""
_KNOT_FILL = 0.63  # of a quilt in rows that the rectangles of the knot's facets take
_DETAIL = 1  # level of the mesh where triangles do not vary

Row = dict[str, Any]


@lru_cache(maxsize=1)
def _stage(name: str, pixels: float) -> tuple[Place, Stage]:
    place = model(name, pixels)
    return place, stage_for(place, meshes.detailed(_DETAIL))


def by_facets(rounds: int, names: tuple[str, ...] = MODELS) -> Iterator[Row]:
    """Figures 18 and 19: displays of 20 to 1620 facets, one mesh, the same number of pixels."""
    for name in names:
        place, stage = _stage(name, QUILT_PIXELS)
        viewer = viewer_of(place)
        yield _described(stage, viewer, name) | {
            "times": _times(stage, viewer, rounds, rivals=True),
            "stages": _stages(stage, viewer),
        }


def by_pixels(rounds: int, megapixels: tuple[int, ...] = (1, 2, 4, 8, 16, 32, 64)) -> Iterator[Row]:
    """Figure 20: the knot of 1200 facets in quilts of 1 to 64 million pixels."""
    for size in megapixels:
        place, stage = _stage("knot1200", size * _KNOT_FILL * 1e6)
        viewer = viewer_of(place)
        yield _described(stage, viewer, "knot1200") | {"times": _times(stage, viewer, rounds, rivals=False)}


def by_triangles(
    rounds: int, names: tuple[str, ...] = ("icosahedron", "sphere840", "sphere1620")
) -> Iterator[Row]:
    """Figure 21: the detailed body at its four resolutions on three displays."""
    for name in names:
        place, stage = _stage(name, QUILT_PIXELS)
        viewer = viewer_of(place)
        for level in range(4):
            made = with_mesh(stage, place, meshes.detailed(level))
            yield _described(made, viewer, name) | {"times": _times(made, viewer, rounds, rivals=False)}


def _described(stage: Stage, viewer: Viewer, name: str) -> Row:
    """What a row of a table begins with."""
    work = binned(stage, viewer)
    return {
        "display": name,
        "facets": stage.facets.count,
        "lit": int(np.count_nonzero(work.frame.rays.lit)),
        "quilt pixels": int(stage.owners.size),
        "visible pixels": all_hits(work),
        "triangles": len(stage.scene.triangles),
        "block pairs": int(work.frame.pairs.count.sum()),
    }


def _times(stage: Stage, viewer: Viewer, rounds: int, *, rivals: bool) -> Times:
    """Whole frames of ours with two workers; with `rivals` OpenGL's, triangles sorted or not."""
    buffers = (shared_buffers if can_fork() else new_buffers)(stage)
    frame = binned(stage, viewer).frame
    dirty = np.ones(stage.blocks.used.size, dtype=np.bool_)
    contestants: dict[str, Callable[[], object]] = {}
    with ExitStack() as ends:
        pool = ends.enter_context(Pool(stage, [buffers], 2)) if can_fork() else None
        contestants["frame 2"] = partial(draw_frame, stage, viewer, buffers, dirty=dirty, crew=pool)
        if rivals and not opengl.renderer().startswith("-"):
            quilt = ends.enter_context(opengl.Quilt(stage, frame, culling=False))
            contestants["opengl sorted"] = partial(quilt.draw, "ggx")
            contestants["opengl whole"] = partial(quilt.draw, "ggx", whole_mesh=True)
        return race(contestants, rounds, once=0.6)


def _stages(stage: Stage, viewer: Viewer) -> dict[str, float]:
    """Seconds by stage in one process, the second frame's: the first finds cold memory."""
    buffers = new_buffers(stage)
    dirty = np.ones(stage.blocks.used.size, dtype=np.bool_)
    draw_frame(stage, viewer, buffers, dirty=dirty)
    return stage_seconds(lambda: draw_frame(stage, viewer, buffers, dirty=dirty))
