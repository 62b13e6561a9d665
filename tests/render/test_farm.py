from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import CheckFailedError, JobError
from quiltcli.job import job_sha256, load_job
from quiltcli.render.farm import render_on
from quiltcli.render.farm_task import Task, render_task
from quiltcli.render.sequence import Listener, RenderOptions, render
from quiltcli.viewer.view import views_at
from tests.helpers.tiny_job import IMAGES, SETTINGS, files_in, replaced, write_tiny_job

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_tiny_job(tmp_path)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    distributed: Any = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "protocol": "tcp"}
    with distributed.LocalCluster(**options, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


def task(job_file: Path, frame: int, options: RenderOptions) -> Task:
    job = load_job(job_file)
    return Task(job_file, job_sha256(job), views_at(job, frame), options)


def test_what_is_missing_is_named(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    result = CliRunner().invoke(main, ["render", "job.yaml", "--scheduler", "tcp://farm:8786"])
    assert result.exit_code == 2
    assert result.stderr == (
        "error: --scheduler needs dask.distributed, which is not installed "
        "(in the folder of quilt's sources: pip install -e '.[dist]')\n"
    )
    assert not Path("out").exists()


def test_a_task_that_runs_again_leaves_the_whole_frame_alone(tiny: Path) -> None:
    render(load_job(tiny), RenderOptions(frames=(1,)))
    resolved = tiny.parent / "out" / "job.yaml"
    records = render_task(task(resolved, 2, RenderOptions()))
    assert records is not None
    assert [record.frame for record in records] == [2]
    before = {path: path.stat().st_mtime_ns for path in tiny.parent.rglob("*.exr")}
    assert render_task(task(resolved, 2, RenderOptions())) is None
    assert before == {path: path.stat().st_mtime_ns for path in tiny.parent.rglob("*.exr")}


def test_a_task_draws_again_what_it_is_told_to(tiny: Path) -> None:
    render(load_job(tiny), RenderOptions(frames=(1,)))
    resolved = tiny.parent / "out" / "job.yaml"
    assert render_task(task(resolved, 1, RenderOptions(overwrite=True))) is not None
    assert render_task(task(resolved, 1, RenderOptions(facets=(2,)))) is not None


def test_a_task_refuses_a_job_that_has_changed(tiny: Path) -> None:
    render(load_job(tiny), RenderOptions(frames=(1,)))
    resolved = tiny.parent / "out" / "job.yaml"
    sent = task(resolved, 2, RenderOptions())
    replaced(tiny.parent, "ball.obj", "v 0 0 -0.2", "v 0 0 -0.3")
    with pytest.raises(JobError) as caught:
        render_task(sent)
    assert str(caught.value) == f"{resolved}: has changed, or a file it names, since its frames were sent"


def test_a_farm_leaves_what_one_machine_leaves(address: str, tiny: Path) -> None:
    render(load_job(tiny))
    records = render_on(address, load_job(tiny), RenderOptions(folder=Path("farm")))
    assert [record.frame for record in records] == [1, 2, 3, 4]
    assert files_in(Path("farm")) == sorted(IMAGES + SETTINGS)
    for name in IMAGES:
        assert (Path("farm") / name).read_bytes() == (Path("out") / name).read_bytes()


def test_a_farm_resumes(address: str, tiny: Path) -> None:
    begun: list[int] = []
    render_on(address, load_job(tiny), RenderOptions(frames=(2, 3)))
    records = render_on(address, load_job(tiny), RenderOptions(resume=True), Listener(begun.append))
    assert [record.frame for record in records] == [1, 4]
    assert begun == [2]


def test_a_frame_that_fails_is_named_and_the_others_are_made(address: str, tiny: Path) -> None:
    (tiny.parent / "out/quilt/page_01.0003.exr").mkdir(parents=True)
    said: list[str] = []
    with pytest.raises(CheckFailedError) as caught:
        render_on(address, load_job(tiny), RenderOptions(overwrite=True), Listener(say=said.append))
    page = tiny.parent / "out/quilt/page_01.0003.exr"
    assert str(caught.value) == f"frame 3 failed: {page}: is a folder, expected a file to write"
    assert said == [str(caught.value)]
    assert files_in(tiny.parent / "out/quilt") == [f"page_01.000{frame}.exr" for frame in (1, 2, 4)]


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("nonsense", "missing port number in address 'nonsense'"),
        ("tcp://", "missing port number in address ''"),
    ],
)
def test_an_address_that_is_none(where: str, message: str, tiny: Path) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(JobError) as caught:
        render_on(where, load_job(tiny), RenderOptions())
    assert str(caught.value) == f"--scheduler {where}: cannot be reached: {message}"
    assert not Path("out").exists()
