"""Whole turns of a spinning mirror, with all that belongs to them, against their visibility alone.

`python -m tests.benchmarks.turns JOB.yaml` renders a job by two workers and then finds what its pictures see
by one process, in a process of its own whose memory can be watched.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import trimesh

from quiltcli.geometry import FloatArray, Int32Array
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.ring.walk import RingOptions, render_turns
from quiltcli.ring.raster import see
from tests.benchmarks.sequence import memory_of_all

_DISPLAY = """\
quilt_display: 1
kind: lightfield360
projector: {{height: 0.6, diameter: 0.13}}
mirror: {{outline: {{disk: 0.13}}}}
rotation: {{positions: {positions}}}
"""
_JOB = """\
quilt_job: 1
display: turn.yaml
scene: mesh.ply
frames: 1
ring: {height: 0.4, distance: 1}
output: {directory: out}
"""


def whole_turn(vertices: FloatArray, triangles: Int32Array, positions: int, folder: Path) -> dict[str, Any]:
    """Render a turn of a mesh and find what it sees.

    Returns:
        wall seconds and processor seconds, `whole` of the turn by two workers, `seen` of its visibility by
        one process; the most memory of all processes, bytes; the number of positions.
    """
    (folder / "mesh.ply").write_bytes(
        trimesh.Trimesh(vertices, triangles, process=False).export(file_type="ply")
    )
    (folder / "turn.yaml").write_text(_DISPLAY.format(positions=positions))
    (folder / "job.yaml").write_text(_JOB)
    command = [sys.executable, "-m", "tests.benchmarks.turns", str(folder / "job.yaml")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]) as process:
        peak = memory_of_all(process)
        said = process.communicate()[0]
    if process.returncode:
        raise SystemExit(f"the turn ended with code {process.returncode}")
    return {"positions": positions, "memory": peak, **json.loads(said)}


def timed(work: Callable[[], object]) -> dict[str, float]:
    """Wall seconds, and processor seconds of this process and of those it has waited for."""
    start, before = time.perf_counter(), _processor()
    work()
    return {"wall": time.perf_counter() - start, "cpu": _processor() - before}


def _processor() -> float:
    used = (resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def main(path: Path) -> None:
    """Render, then look; print the seconds."""
    job = load_job(path)
    whole = timed(lambda: render_turns(job, RingOptions(workers=2)))
    stage = set_ring_stage(job)
    show = stage.show(1)

    def look() -> None:
        for position in stage.positions:
            see(stage.rig.at(stage.rig.angle(position)), show.curve, show.mesh, stage.rig.size)

    print(json.dumps({"whole": whole, "seen": timed(look)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
