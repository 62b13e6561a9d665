"""Rendering scenes that move, from the command line's end."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import SceneError
from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.gltf_files import one_square
from tests.helpers.tiny_job import replaced, write_tiny_job


def depths(folder, frames=(1, 2, 3, 4)):
    found = [read_exr(folder / f"out/quilt/page_01.{frame:04d}.exr").channels["Z"] for frame in frames]
    return [np.isfinite(z).sum() for z in found]


def test_an_object_may_shrink_to_nothing_and_come_back(tmp_path):
    job = write_tiny_job(tmp_path)
    file = one_square()
    file.animation(0, "scale", [0, 1], [(1, 1, 1), (0, 0, 0)])
    file.write(tmp_path / "m.glb")
    replaced(
        tmp_path,
        "scene.yaml",
        "mesh: ball.obj",
        "mesh: m.glb, animation: {start_frame: 1, after: bounce}, transform: {translate: [-0.5, -0.5, -0.5]}",
    )
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-4\nfps: 2")
    render(load_job(job), RenderOptions(threads=1))
    first, second, third, fourth = depths(tmp_path)
    assert first > second > third == 0 < fourth


def test_each_eye_sees_its_own_time(tmp_path):
    job = write_tiny_job(tmp_path)
    keys = "[{frame: 1}, {frame: 2, scale: 2}, {frame: 3}]"
    replaced(tmp_path, "scene.yaml", "mesh: ball.obj", f"mesh: ball.obj, transform: {{keyframes: {keys}}}")
    replaced(
        tmp_path, "job.yaml", "  near: 0.05", "  stereo: {separation: 1.0e-9, eye_time: own}\n  near: 0.05"
    )
    render(load_job(job), RenderOptions(frames=[1, 2], threads=1))
    sizes = [
        np.isfinite(read_exr(tmp_path / f"out/quilt/page_01.{eye}.{frame:04d}.exr").channels["Z"]).sum()
        for frame, eye in ((1, "left"), (1, "right"), (2, "left"))
    ]
    assert sizes[0] < sizes[1] < sizes[2]


def test_a_frame_without_a_file_is_told_before_anything_is_written(tmp_path):
    job = write_tiny_job(tmp_path)
    (tmp_path / "ball.0001.obj").write_text((tmp_path / "ball.obj").read_text())
    replaced(tmp_path, "scene.yaml", "mesh: ball.obj", 'mesh: "ball.####.obj", frames: 1')
    with pytest.raises(SceneError, match="frames 2-4 have no file"):
        render(load_job(job))
    assert not (tmp_path / "out").exists()
