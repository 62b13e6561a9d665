"""A sequence of frames as `quilt render` makes it, against the writing of the same frames alone.

The work is done in a process of its own, `python -m tests.benchmarks.sequence`, so that the memory
measured is the program's and not that of its rivals.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_view
from quiltcli.render.outputs import Drawn, write_views
from quiltcli.render.sequence import Listener, Prepared, RenderOptions, prepare, render_frames
from tests.benchmarks.meshes import Mesh
from tests.benchmarks.race import children
from tests.helpers.in_memory import icosphere

_JOB = """quilt_job: 1
display: display.yaml
layout: {{method: rows, size: [8192, 8192]}}
scene: scene.ply
frames: 1-{frames}
viewer:
  near: 0.05
  far: 100
  path:
    orbit: {{center: [0, 0, 0], radius: 3.88, height: 1.8, start_deg: 30, end_deg: 50, end_frame: {frames}}}
output: {{directory: out, facets: false, compression: {compression}}}
"""
_SAMPLES = 4  # of the frames are written alone, each as often as it takes


def measure(mesh: Mesh, frames: int, compression: str, folder: Path) -> dict[str, Any]:
    """Render a mesh on 1280 facets, 8192 × 8192 pixels, with two workers.

    Returns:
        seconds of the sequence and of the writing alone, and the most memory of all processes, bytes.
    """
    job = _write_job(mesh, frames, compression, folder)
    command = [sys.executable, "-m", "tests.benchmarks.sequence", str(job)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]) as process:
        peak = memory_of_all(process)
        said = process.communicate()[0]
    if process.returncode:
        raise SystemExit(f"the sequence ended with code {process.returncode}")
    return {"frames": frames, "compression": compression, "memory": peak, **json.loads(said)}


def memory_of_all(process: subprocess.Popen[bytes]) -> int:
    """The most bytes of a process and its children at any time until it ends."""
    peak = 0
    while process.poll() is None:
        peak = max(peak, sum(map(_memory, [process.pid, *children(process.pid)])))
        time.sleep(0.05)
    return peak


def _write_job(mesh: Mesh, frames: int, compression: str, folder: Path) -> Path:
    import trimesh

    vertices, triangles = icosphere(3)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    (folder / "display.obj").write_text("\n".join(lines) + "\n")
    text = "quilt_display: 1\nmesh: display.obj\nunits: m\nresolution: {pixels_per_metre: 1360}\n"
    (folder / "display.yaml").write_text(text)
    scene = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    (folder / "scene.ply").write_bytes(scene.export(file_type="ply"))
    job = folder / f"{compression}.yaml"
    job.write_text(_JOB.format(frames=frames, compression=compression))
    return job


def _memory(pid: int) -> int:
    """Bytes of a process, what it shares divided by those who share it."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) * 1024


def main(job: Path) -> None:
    """Render, then write alone; print the seconds."""
    start = time.perf_counter()
    ready = prepare(load_job(job), RenderOptions(overwrite=True))
    loaded = time.perf_counter()
    for folder in ("quilt", "facets"):
        (ready.out.folder / folder).mkdir(parents=True, exist_ok=True)
    records = render_frames(ready, 2, Listener())
    done = time.perf_counter()
    drawing = sum(sum(s for name, s in r.seconds.items() if name != "write") for r in records)
    alone = _writing_alone(ready)
    result = {"load": loaded - start, "sequence": done - loaded, "drawing": drawing, "writing alone": alone}
    result["file bytes"] = sum(path.stat().st_size for path in ready.out.folder.glob("quilt/*.exr"))
    print(json.dumps(result))


def _writing_alone(ready: Prepared) -> float:
    """Seconds to write as many frames as the job has, from finished buffers, with nothing beside it."""
    stage, views = ready.stage, ready.views
    buffers = new_buffers(stage)
    chosen = views[:: max(len(views) // _SAMPLES, 1)]
    total = 0.0
    for view in chosen:
        draw_view(stage, view, buffers, 2)
        start = time.perf_counter()
        write_views(stage, ready.out, [Drawn(view, buffers)], 2)
        total += time.perf_counter() - start
    return total * len(views) / len(chosen)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
