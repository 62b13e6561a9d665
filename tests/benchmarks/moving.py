"""What movement and samples cost: a frame of a scene that moves beside one that rests, and memory.

Memory is measured in processes of their own, `python -m tests.benchmarks.moving WHAT NUMBER FOLDER`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.setup import Stage, set_stage
from quiltcli.render.workers import Pool, shared_buffers
from tests.benchmarks import meshes
from tests.benchmarks.race import race
from tests.benchmarks.stages import DENSITY, cube, stage_for, viewer_of
from tests.helpers.in_memory import CUBE, CUBE_FACES
from tests.helpers.verified_jobs import obj

_FRAMES, _OBJECTS = 240, 4
EARLY = 30
"""The frame of a sequence after which memory is not to grow."""

_JOB = """quilt_job: 1
display: display.yaml
layout: {{method: rows, size: [{side}, {side}]}}
scene: {scene}.yaml
frames: 1-{frames}
viewer:
  near: 0.05
  far: 100
  path:
    orbit: {{center: [0, 0, 0], radius: 3.6, height: 1.8, start_deg: 30, end_deg: 50, end_frame: {frames}}}
"""
_TURNS = "transform: {{keyframes: [{{frame: 1{at}}}, {{frame: 240, rotate_deg: [20, 170, 10]{at}}}]}}"


def measure(rounds: int, scratch: Path, *, quick: bool) -> dict[str, Any]:
    """Processor time of frames that move and that rest, by two workers; and memory by frames and samples."""
    _write_scenes(scratch)
    with ExitStack() as ends:
        contestants = {name: _frames_of(scratch, name, ends) for name in ("still", "moving")}
        times = race(contestants, max(rounds, 3))
    last = 60 if quick else 300
    grown = _memory("sequence", last, scratch)
    samples = {str(n): _memory("samples", n, scratch)["most"] for n in (4, 64)}
    return {"times": times, "sequence": {"frames": last, **grown}, "samples": samples}


def told(found: Mapping[str, Any]) -> Iterator[str]:
    """Lines for people."""
    memory, samples = found["sequence"], found["samples"]
    megabytes = [f"{memory[key] / 1e6:,.0f}" for key in ("early", "last")]
    yield (
        f"numbered meshes: {megabytes[0]} MB after {EARLY} frames, {megabytes[1]} MB after {memory['frames']}"
    )
    yield "samples: " + ", ".join(f"{key} take {value / 1e6:,.0f} MB" for key, value in samples.items())


def _write_scenes(folder: Path) -> None:
    """Balls before a cube, once at rest and once turning, and a few meshes of other triangles each."""
    import trimesh

    for number in range(4):
        ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5 + 0.02 * number)
        keep = np.arange(len(ball.faces)) % (50 + number) > 0
        (folder / f"ball.{number}.ply").write_bytes(
            trimesh.Trimesh(ball.vertices, ball.faces[keep], process=False).export(file_type="ply")
        )
    (folder / "display.obj").write_text(obj(CUBE, CUBE_FACES[:5]))
    (folder / "display.yaml").write_text(
        "quilt_display: 1\nmesh: display.obj\nunits: m\nresolution: {pixels_per_metre: 340}\n"
    )
    places = [[0.5 * x, 0.0, 0.5 * z] for x in (-1, 1) for z in (-1, 1)][:_OBJECTS]
    for name in ("still", "moving"):
        lines = []
        for place in places:
            at = f", translate: {place}"
            move = _TURNS.format(at=at) if name == "moving" else f"transform: {{translate: {place}}}"
            lines.append(f"- {{mesh: ball.0.ply, {move}}}\n")
        (folder / f"{name}.yaml").write_text("quilt_scene: 1\nobjects:\n" + "".join(lines))
        (folder / f"{name}_job.yaml").write_text(_JOB.format(scene=name, frames=_FRAMES, side=2048))


def _frames_of(folder: Path, name: str, ends: ExitStack) -> Callable[[], None]:
    """What draws the next frame of a job by two workers, whenever it is called."""
    stage = set_stage(load_job(folder / f"{name}_job.yaml"))
    buffers = shared_buffers(stage)
    pool = ends.enter_context(Pool(stage, [buffers], 2))
    numbers = count(1)

    def draw() -> None:
        frame = next(numbers) % _FRAMES + 1
        draw_moment(moment(stage, stage.views([frame])[0]), buffers, crew=pool)

    return draw


def _memory(what: str, number: int, folder: Path) -> dict[str, int]:
    command = [sys.executable, "-m", "tests.benchmarks.moving", what, str(number), str(folder)]
    root = Path(__file__).parents[2]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    found: dict[str, int] = json.loads(done.stdout)
    return found


def _resident(kind: str = "VmRSS") -> int:
    """Bytes of this process in memory; of the kind VmHWM the most there were."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(kind)) * 1024


def _of_sequence(frames: int, folder: Path) -> dict[str, int]:
    """Memory early in a sequence of numbered meshes and at its end."""
    for frame in range(1, frames + 1):
        link = folder / f"numbered.{frame:04d}.ply"
        if not link.exists():
            link.hardlink_to(folder / f"ball.{frame % 4}.ply")
    (folder / "numbered.yaml").write_text(
        f"quilt_scene: 1\nobjects: [{{mesh: 'numbered.####.ply', frames: 1-{frames}}}]\n"
    )
    (folder / "numbered_job.yaml").write_text(_JOB.format(scene="numbered", frames=frames, side=1024))
    text = (folder / "display.yaml").read_text().replace("340", "100")
    (folder / "small.yaml").write_text(text)
    job = (folder / "numbered_job.yaml").read_text().replace("display.yaml", "small.yaml")
    (folder / "numbered_job.yaml").write_text(job)
    stage = set_stage(load_job(folder / "numbered_job.yaml"))
    buffers, early = new_buffers(stage), 0
    for frame in range(1, frames + 1):
        draw_moment(moment(stage, stage.views([frame])[0]), buffers)
        if frame == EARLY:
            early = _resident()
    return {"early": early, "last": _resident()}


def _of_samples(samples: int) -> dict[str, int]:
    """The most memory while a frame of so many samples is drawn."""
    place = cube(DENSITY / 8)
    stage: Stage = stage_for(place, meshes.room(), (1024, 1024))
    render = stage.job.render.model_copy(update={"samples": samples})
    stage = replace(stage, job=stage.job.model_copy(update={"render": render}))
    draw_frame(stage, viewer_of(place), new_buffers(stage))
    return {"most": _resident("VmHWM")}


if __name__ == "__main__":
    what, number, folder = sys.argv[1:]
    told_of = _of_samples(int(number)) if what == "samples" else _of_sequence(int(number), Path(folder))
    print(json.dumps(told_of))
