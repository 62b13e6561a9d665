"""Render a job, kill it without a word at a random moment, resume it: over and over, in forks of one process.

`python -m tests.helpers.killed_runs JOB FOLDER COUNT SEED` renders JOB once to its end and then COUNT
times until it is killed, and prints what is wrong with the folders after they were resumed.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from quiltcli.job import load_job
from quiltcli.render import sequence
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import files_in


def main() -> None:
    """Print every fault, and how many frames the killed runs had come to."""
    job, folder, count, seed = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    dice = random.Random(seed)
    start = time.perf_counter()
    finish(started(job, folder / "whole", threads=1))
    seconds = time.perf_counter() - start
    came, unfinished = [], 0
    for number in range(count):
        killed = folder / f"killed_{number}"
        sequence.worth_forking = lambda stage, pooled=bool(number % 2): pooled  # type: ignore[assignment]
        child = started(job, killed, threads=1 + number % 2)
        time.sleep(dice.uniform(0, seconds))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        came.append(len(frames_of(killed)))
        unfinished += any(name.endswith(".tmp") for name in files_in(killed))
        finish(started(job, killed, threads=1, resume=True))
        for fault in faults(folder / "whole", killed):
            print(f"run {number}, killed after {came[-1]} frames: {fault}")
        shutil.rmtree(killed)
    print(
        f"{count} runs killed, after {min(came)} to {max(came)} frames, {unfinished} in the midst of a file"
    )


def started(job: Path, folder: Path, threads: int, *, resume: bool = False) -> int:
    """A process that renders; its number."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            render(load_job(job), RenderOptions(folder=folder, threads=threads, resume=resume))
            code = 0
        finally:
            os._exit(code)
    return child


def finish(child: int) -> None:
    """Wait for a render to end well."""
    _, status = os.waitpid(child, 0)
    assert status == 0, f"a render ended with {status}"


def faults(whole: Path, resumed: Path) -> Iterator[str]:
    """In what a resumed folder differs from one rendered in one go, times apart."""
    if files_in(whole) != files_in(resumed):
        yield f"files {sorted(set(files_in(whole)) ^ set(files_in(resumed)))}"
        return
    for name in files_in(whole):
        if name != "report.json" and (whole / name).read_bytes() != (resumed / name).read_bytes():
            yield name
    if frames_of(whole) != frames_of(resumed):
        yield "report.json"


def frames_of(folder: Path) -> list[dict[str, object]]:
    """The entries of a report, without the times."""
    if not (folder / "report.json").exists():
        return []
    frames = json.loads((folder / "report.json").read_text())["frames"]
    times = ("seconds", "wall_seconds", "write_seconds")
    return [{name: value for name, value in frame.items() if name not in times} for frame in frames]


if __name__ == "__main__":
    main()
