"""A farm as people have it: a scheduler and workers that are processes, some of which die."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.farm import Farm, kill, wait_until
from tests.helpers.tiny_job import IMAGES, SETTINGS, files_in, replaced, write_tiny_job

pytest.importorskip("distributed")
pytestmark = pytest.mark.long


@pytest.fixture
def farm(tmp_path: Path) -> Iterator[Farm]:
    write_tiny_job(tmp_path, "144, 72")
    with Farm(tmp_path) as farm:
        yield farm


def large(folder: Path) -> None:
    """Make the quilt one of four megapixels, which is drawn by worker processes where that can be."""
    replaced(folder, "display.yaml", "pixels_per_metre: 32", "pixels_per_metre: 720")
    replaced(folder, "job.yaml", "144, 72", "2900, 1450")


def whole(folder: Path) -> dict[str, bytes]:
    """The images that one machine makes."""
    render(load_job(folder / "job.yaml"), RenderOptions(folder=folder / "whole"))
    return {name: (folder / "whole" / name).read_bytes() for name in IMAGES}


def images(folder: Path) -> dict[str, bytes]:
    """The images of the farm, where there is nothing else."""
    assert files_in(folder / "out") == sorted(IMAGES + SETTINGS)
    return {name: (folder / "out" / name).read_bytes() for name in IMAGES}


def ended(running: subprocess.Popen[str], seconds: float = 120) -> tuple[int, list[str]]:
    """The code that a run ends with, and the lines it says on stderr."""
    _, said = running.communicate(timeout=seconds)
    assert "Traceback" not in said
    return running.returncode, said.splitlines()


def heard(running: subprocess.Popen[str], words: str) -> float:
    """Seconds until a run says something on stderr."""
    assert running.stderr is not None
    start = time.monotonic()
    while line := running.stderr.readline():
        if words in line:
            return time.monotonic() - start
    pytest.fail(f"it never said: {words}")


def test_two_ordinary_workers_leave_the_bytes_of_one_machine(farm: Farm, tmp_path: Path) -> None:
    large(tmp_path)
    farm.start_workers(2)
    code, said = ended(farm.render())
    assert (code, len(said)) == (0, 4), said
    assert images(tmp_path) == whole(tmp_path)


def test_a_worker_that_is_killed_makes_no_difference(farm: Farm, tmp_path: Path) -> None:
    large(tmp_path)
    farm.start_workers(2)
    running = farm.render()
    wait_until(lambda: list(tmp_path.glob("out/quilt/.page*.tmp")) or list(tmp_path.glob("out/quilt/page*")))
    kill(farm.workers[0])
    assert ended(running)[0] == 0
    assert images(tmp_path) == whole(tmp_path)


def test_a_worker_that_dies_and_is_replaced_by_its_nanny_makes_no_difference(
    farm: Farm, tmp_path: Path
) -> None:
    large(tmp_path)
    farm.start_workers(1)
    running = farm.render()
    wait_until(lambda: list(tmp_path.glob("out/quilt/page*")))
    children = Path(f"/proc/{farm.workers[0].pid}/task/{farm.workers[0].pid}/children").read_text().split()
    for child in children:
        subprocess.run(["kill", "-9", child], check=True)
    assert ended(running)[0] == 0
    assert images(tmp_path) == whole(tmp_path)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_farm_without_workers_says_so_and_ends_at_once(
    farm: Farm, number: signal.Signals, code: int
) -> None:
    running = farm.render()
    heard(running, f"the scheduler {farm.address} has no workers: 4 frames are waiting")
    start = time.monotonic()
    running.send_signal(number)
    assert ended(running) == (code, [f"stopped by {number.name}"])
    assert time.monotonic() - start < 10


def test_workers_may_come_late(farm: Farm, tmp_path: Path) -> None:
    running = farm.render()
    heard(running, "has no workers")
    farm.start_workers(1)
    assert ended(running)[0] == 0
    assert images(tmp_path) == whole(tmp_path)


def test_all_workers_killed_is_told_and_what_they_left_is_resumed(farm: Farm, tmp_path: Path) -> None:
    large(tmp_path)
    farm.start_workers(2)
    running = farm.render()
    heard(running, "frame ")
    for worker in farm.workers:
        kill(worker)
    assert heard(running, "has no workers") < 12
    running.send_signal(signal.SIGTERM)
    assert ended(running)[0] == 143
    farm.start_workers(1)
    assert ended(farm.render("--resume"))[0] == 0
    assert images(tmp_path) == whole(tmp_path)


def test_a_scheduler_that_dies_is_one_message(farm: Farm, tmp_path: Path) -> None:
    large(tmp_path)
    farm.start_workers(1)
    running = farm.render()
    heard(running, "frame ")
    kill(farm.scheduler)
    code, said = ended(running)
    assert code == 1
    assert said[-1].startswith(f"error: --scheduler {farm.address}: the scheduler is gone: ")
    assert all(line.startswith("frame ") for line in said[:-1])


def test_a_scheduler_that_does_not_answer_holds_nobody_up(farm: Farm) -> None:
    running = farm.render()
    heard(running, "has no workers")
    farm.scheduler.send_signal(signal.SIGSTOP)
    start = time.monotonic()
    running.send_signal(signal.SIGTERM)
    assert ended(running, 60)[0] == 143
    assert time.monotonic() - start < 30


def test_a_worker_that_reads_other_files_is_one_error(farm: Farm, tmp_path: Path) -> None:
    # The worker's clock of the check: the mesh is another by the time it looks.
    running = farm.render()
    heard(running, "has no workers")
    replaced(tmp_path, "ball.obj", "v 0 0 -0.2", "v 0 0 -0.3")
    farm.start_workers(1)
    code, [error] = ended(running)
    assert code == 2
    assert (
        f"has another file {tmp_path / 'ball.obj'} (all machines need the same quilt, and the same" in error
    )
    assert files_in(tmp_path / "out") == ["job.yaml", "layout.yaml"]
