"""Worker processes: the same pixels as one process, and a clean end whatever happens."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import CheckFailedError
from quiltcli.render import arena, workplace
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import cube, display, icosphere, viewer
from tests.helpers.wall_scene import lights

pytestmark = pytest.mark.skipif(not can_fork(), reason="processes cannot fork here")

EYES = [(2.2, 1.8, 3.2), (-2.5, 1.2, 2), (0.2, 4, 0.3)]


@pytest.fixture(scope="module")
def stage():
    lamps = lights(sun=[(-1, -1, -1)], color=[(2, 2, 2)], ambient=(0.1, 0.1, 0.1))
    return stage_of_facets(cube(), ball_scene(3, 0.9, lamps, (0.1, 0, 0.2)), bleed=2)


def test_workers_draw_the_same_pixels_as_one_process(stage):
    alone, together = new_buffers(stage), shared_buffers(stage)
    dirty = np.zeros(stage.blocks.used.size, bool)
    with Pool(stage, [together], 3) as pool:
        for eye in EYES:
            one = draw_frame(stage, viewer(eye), alone)
            other = draw_frame(stage, viewer(eye), together, dirty=dirty, crew=pool)
            assert one.visible_pixels == other.visible_pixels > 1000
            for name in alone:
                np.testing.assert_array_equal(alone[name], together[name], err_msg=name)


@pytest.mark.parametrize("background", [(0, 0, 0), (0.1, 0, 0.2)])
def test_a_frame_does_not_show_the_frames_before_it(background):
    lamps = lights(sun=[(-1, -1, -1)], color=[(2, 2, 2)], ambient=(0.1, 0.1, 0.1))
    vertices, triangles = icosphere(1)
    facets = display(vertices, triangles.tolist(), 60)
    stage = stage_of_facets(facets, ball_scene(2, 0.7, lamps, background), bleed=2)
    fresh, used = new_buffers(stage), shared_buffers(stage)
    dirty = np.zeros(stage.blocks.used.size, bool)
    with Pool(stage, [used], 2) as pool:
        for eye in (*EYES, (2.0, 1.8, 3.2), (2.2, 1.7, 3.1)):
            for crew in (pool, None):
                record = draw_frame(stage, viewer(eye), used, dirty=dirty, crew=crew)
                assert 1000 < record.visible_pixels < 0.9 * np.count_nonzero(stage.owners > 0)
                draw_frame(stage, viewer(eye), fresh)
                for name in fresh:
                    np.testing.assert_array_equal(fresh[name], used[name], err_msg=name)


def test_more_pairs_than_there_is_room_for_are_drawn_all_the_same(stage, monkeypatch):
    monkeypatch.setattr(arena, "ROOM", 0)
    monkeypatch.setattr(arena, "LEAST_ROOM", 100)
    alone, together = new_buffers(stage), shared_buffers(stage)
    with Pool(stage, [together], 2) as pool:
        draw_frame(stage, viewer(EYES[0]), alone)
        draw_frame(stage, viewer(EYES[0]), together, crew=pool)
    np.testing.assert_array_equal(alone["Z"], together["Z"])


def scenes_of_a_ball(moved: int, split: int):
    """A ball that moves, and two frames later has more triangles, and other lights."""
    lamps = lights(sun=[(-1, -1, -1)], color=[(2, 2, 2)], ambient=(0.1, 0.1, 0.1))
    still = ball_scene(3, 0.9, lamps, (0.1, 0, 0.2))
    for step in range(moved):
        yield replace(still, vertices=still.vertices + [0.1 * step, 0, 0])
    yield ball_scene(split, 0.8, lights(sun=[(1, -1, 0)], color=[(1, 2, 1)]), (0.1, 0, 0.2))
    yield still


@pytest.mark.parametrize("culling", [False, True])
def test_workers_see_a_scene_that_moves_grows_and_shrinks(stage, culling):
    how = stage.job.render.model_copy(update={"backface_culling": culling})
    stage = replace(stage, job=stage.job.model_copy(update={"render": how}))
    alone, together = new_buffers(stage), shared_buffers(stage)
    dirty = np.zeros(stage.blocks.used.size, bool)
    pictures = []
    with Pool(stage, [together], 2) as pool:
        for scene in scenes_of_a_ball(3, 5):
            now = replace(stage, scene=scene)
            draw_frame(now, viewer(EYES[0]), alone)
            draw_frame(now, viewer(EYES[0]), together, dirty=dirty, crew=pool)
            for name in alone:
                np.testing.assert_array_equal(alone[name], together[name], err_msg=name)
            pictures.append(alone["Z"].tobytes())
    assert len(set(pictures)) == 4


def test_memory_is_not_made_anew_for_frames_of_one_size(stage):
    together = shared_buffers(stage)
    made = []
    with Pool(stage, [together], 2) as pool:
        for step in range(4):
            vertices = stage.scene.vertices + [0.01 * step, 0, 0]
            moved = replace(stage, scene=replace(stage.scene, vertices=vertices))
            draw_frame(moved, viewer(EYES[0]), together, crew=pool)
            made.append(pool._arrays._made)
    assert len(set(made)) == 1


def children() -> set[int]:
    return {int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()}


def test_a_dead_worker_is_an_error_that_names_the_frame_and_leaves_nobody(stage):
    buffers = shared_buffers(stage)
    before = children()
    with Pool(stage, [buffers], 2) as pool:
        victim = max(children() - before)
        os.kill(victim, signal.SIGKILL)
        words = "frame 1: a worker process was killed by signal 9 .out of memory"
        with pytest.raises(CheckFailedError, match=words):
            draw_frame(stage, viewer(EYES[0]), buffers, crew=pool)
    assert children() == before


def test_a_fault_in_a_worker_is_told_with_its_traceback(stage, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("no such thing")

    monkeypatch.setattr(workplace, "draw_batch", fail)
    buffers = shared_buffers(stage)
    with (
        Pool(stage, [buffers], 2) as pool,
        pytest.raises(RuntimeError, match=r"frame 1: a worker failed:[\s\S]*no such thing"),
    ):
        draw_frame(stage, viewer(EYES[0]), buffers, crew=pool)


def test_workers_do_not_outlive_a_parent_that_is_killed(stage):
    reader, writer = os.pipe()
    parent = os.fork()
    if parent == 0:  # a process of its own, that dies without a word
        pool = Pool(stage, [shared_buffers(stage)], 2)
        pids = [worker.process.pid for worker in pool._workers]
        os.write(writer, ",".join(map(str, pids)).encode())
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(parent, 0)
    pids = [int(pid) for pid in os.read(reader, 100).decode().split(",")]
    for _ in range(100):
        alive = [pid for pid in pids if Path(f"/proc/{pid}").exists() and "Z" not in state(pid)]
        if not alive:
            return
        signal.sigtimedwait([], 0.1)
    pytest.fail(f"still there: {alive}")


def state(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"
