"""An octree and no sorting at all draw more triangles, and the same pixels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tests.helpers.in_memory as rig
from quiltcli.errors import JobError
from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_frame
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.visibility import unsorted
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.tiny_job import write_tiny_job


def by(stage, viewer, method: str, **more):
    """Buffers and record of a frame drawn by a method."""
    how = stage.job.render.model_copy(update={"method": method, **more})
    output = stage.job.output.model_copy(update={"channels": ("rgba", "Z", "triangle", "N")})
    stage = replace(stage, job=stage.job.model_copy(update={"render": how, "output": output}))
    buffers = new_buffers(stage)
    return buffers, draw_frame(stage, viewer, buffers)


@pytest.mark.parametrize("more", [{}, {"samples": 3}, {"backface_culling": True, "depth_bits": "16"}])
@pytest.mark.parametrize("inside", [False, True])
def test_the_pixels_are_those_of_sorting(inside: bool, more: dict) -> None:
    v, t = rig.icosphere(1)
    facets = rig.display(v, (t[:, ::-1] if inside else t).tolist(), 60)
    scene = ball_scene(2, 3.0 if inside else 0.8)
    if inside:
        scene = replace(scene, triangles=scene.triangles[:, ::-1].copy())
    stage = stage_of_facets(facets, scene, bleed=2)
    viewer = rig.viewer((0.1, 0.2, -0.3) if inside else (2.2, 1.8, 3.2), (0, 0, 1), near=0.1, far=9)
    exact, sorted_ = by(stage, viewer, "homography", **more)
    for method in ("octree", "independent"):
        found, record = by(stage, viewer, method, **more)
        assert all(np.array_equal(found[name], exact[name]) for name in exact)
        assert record.pairs > sorted_.pairs
        assert record.visible_pixels == sorted_.visible_pixels > 0
        assert (record.triangles, record.lit_facets) == (sorted_.triangles, sorted_.lit_facets)
    assert record.pairs == record.triangles * record.lit_facets


def test_one_facet_alone_is_drawn_by_an_octree_too() -> None:
    facets = rig.cube()
    stage = stage_of_facets(facets, ball_scene(1), bleed=2)
    stage = replace(
        stage,
        job=stage.job.model_copy(update={"render": stage.job.render.model_copy(update={"method": "octree"})}),
    )
    only = np.arange(facets.count) == 0
    buffers = new_buffers(stage)
    record = draw_frame(stage, rig.viewer((2.2, 1.8, 3.2)), buffers, 1, only)
    assert record.lit_facets == 1
    assert set(np.abs(stage.owners[np.isfinite(buffers["Z"])]).tolist()) == {1}


@pytest.mark.parametrize("method", ["octree", "independent"])
def test_a_job_may_ask_for_them(tmp_path: Path, method: str) -> None:
    job = load_job(write_tiny_job(tmp_path, "144, 72"), (f"render.method={method}", "frames=1"))
    records = render(job, RenderOptions(folder=tmp_path / "o"))
    assert records[0].visible_pixels > 0
    assert records[0].settled == 0


def test_they_draw_no_motion_blur(tmp_path: Path) -> None:
    said = ("render.method=octree", "render.shutter=0.5", "render.samples=4")
    with pytest.raises(JobError, match="shutter: expected 0 beside method: octree"):
        load_job(write_tiny_job(tmp_path), said)


def test_more_pairs_than_memory_holds_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unsorted, "MOST_PAIRS", 900)
    stage = stage_of_facets(rig.cube(), ball_scene(2), bleed=2)
    with pytest.raises(JobError, match=r"frame 1: without sorting, more than 900 pairs of triangles"):
        by(stage, rig.viewer((2.2, 1.8, 3.2)), "independent")
    _, record = by(stage, rig.viewer((2.2, 1.8, 3.2)), "homography")
    assert record.pairs < 900


def test_workers_draw_the_same(tmp_path: Path) -> None:
    job = load_job(write_tiny_job(tmp_path, "144, 72"), ("render.method=octree",))
    for threads in (1, 2):
        render(job, RenderOptions(folder=tmp_path / str(threads), threads=threads))
    names = [path.name for path in sorted((tmp_path / "1" / "quilt").iterdir())]
    assert len(names) == 4
    for name in names:
        one, two = ((tmp_path / str(threads) / "quilt" / name).read_bytes() for threads in (1, 2))
        assert one == two
