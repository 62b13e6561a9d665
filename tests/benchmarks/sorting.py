"""Sorting triangles to facets, an octree's leaves, and all triangles to all facets: the paper's figure 18."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from quiltcli.display import lit_facets
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.cones import lit_cones
from quiltcli.visibility.binning.octree import build_octree, facet_leaves, sent
from tests.benchmarks import meshes
from tests.benchmarks.curves import MODELS, QUILT_PIXELS
from tests.benchmarks.pictures import lines_chart
from tests.benchmarks.race import race, seconds
from tests.benchmarks.stages import model, stage_for, viewer_of
from tests.benchmarks.tables import ms, table

WAYS = {"sorted": "homography", "octree": "octree", "independent": "independent"}
_DETAIL = 1  # level of the mesh


def measure(rounds: int, names: Sequence[str] = MODELS) -> Iterator[dict[str, Any]]:
    """Displays of 20 to 1620 facets, one mesh, as many pixels on each; one process, one thread."""
    for name in names:
        place = model(name, QUILT_PIXELS)
        stage, viewer = stage_for(place, meshes.detailed(_DETAIL)), viewer_of(place)
        buffers = new_buffers(stage)
        stages = {way: _by(stage, method) for way, method in WAYS.items()}
        records = {way: draw_frame(made, viewer, buffers) for way, made in stages.items()}
        frames = {way: partial(draw_frame, made, viewer, buffers) for way, made in stages.items()}
        yield {
            "display": name,
            "facets": stage.facets.count,
            "lit": records["sorted"].lit_facets,
            "triangles": records["sorted"].triangles,
            "pairs": {way: record.pairs for way, record in records.items()} | _with_repeats(stage, viewer),
            "times": race(frames, rounds, once=2.0, brief=("independent",)),
        }


def _by(stage: Stage, method: str) -> Stage:
    render = stage.job.render.model_copy(update={"method": method})
    return replace(stage, job=stage.job.model_copy(update={"render": render}))


def _with_repeats(stage: Stage, viewer: Viewer) -> dict[str, int]:
    """What an octree sends where a triangle of several leaves is sent with each of them, as in the paper."""
    cones = lit_cones(stage.parts, lit_facets(stage.facets, viewer.eye), viewer.eye)
    scene = stage.scene
    tree = build_octree(scene.vertices - viewer.eye, scene.triangles, np.arange(len(scene.triangles)))
    leaves = facet_leaves(tree, cones, stage.facets.count)
    return {"octree with repeats": sum(number for _, _, number in sent(tree, leaves))}


def sorting_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Triangles drawn a lit facet, and processor time of a frame."""
    lines = []
    for row in rows:
        pairs, lit = row["pairs"], row["lit"]
        names = ("sorted", "octree", "octree with repeats", "independent")
        lines.append(
            (
                row["display"],
                row["facets"],
                lit,
                *(f"{pairs[name] / lit:,.0f}" for name in names),
                f"{pairs['octree'] / pairs['sorted']:.1f}",
                *(ms(seconds(row["times"], way, "cpu")) for way in WAYS),
            )
        )
    head = ("display", "facets", "lit", "sorted", "octree", "… with repeats", "independent")
    return table((*head, "octree / sorted", "ms sorted", "ms octree", "ms independent"), lines)


def sorting_picture(rows: Sequence[Mapping[str, Any]]) -> str:
    """The figure: a frame's time by number of facets."""
    labels = [f"{row['facets']}\n{row['display'].rstrip('0123456789')}" for row in rows]
    series = {way: [seconds(row["times"], way, "cpu") for row in rows] for way in WAYS}
    return lines_chart("A frame by how triangles come to facets", labels, series, caption="facets")
