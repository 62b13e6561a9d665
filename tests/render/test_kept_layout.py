"""A job that says how to pack gets its layout once, and keeps it while nothing it came of changes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.job import job_sha256, load_job
from quiltcli.layout import packing, read_layout
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import files_in, replaced, write_tiny_job

AGAIN = RenderOptions(overwrite=True)


@pytest.fixture
def packs(tmp_path, monkeypatch):
    """A rendered job in the working directory; how often facets were packed since."""
    calls = []

    def counted(*arguments):
        calls.append(arguments)
        return pack(*arguments)

    monkeypatch.chdir(tmp_path)
    write_tiny_job(tmp_path)
    render(load_job("job.yaml"))
    pack = packing.pack
    monkeypatch.setattr(packing, "pack", counted)
    return calls


def run(*arguments):
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in (0, 1), result.output


def images():
    return {name: Path("out", name).read_bytes() for name in files_in(Path("out")) if name.endswith(".exr")}


def test_the_resolved_job_names_the_layout_and_is_the_same_job(packs):
    assert yaml.safe_load(Path("out/job.yaml").read_text())["layout"] == "layout.yaml"
    assert job_sha256(load_job("out/job.yaml")) == job_sha256(load_job("job.yaml"))


@pytest.mark.parametrize("job", ["job.yaml", "out/job.yaml"])
def test_later_runs_pack_nothing_and_leave_the_same_bytes(job, packs):
    before, layout = images(), Path("out/layout.yaml").read_bytes()
    render(load_job(job), AGAIN)
    assert images() == before
    assert Path("out/layout.yaml").read_bytes() == layout
    assert packs == []


def test_nothing_that_looks_at_a_render_packs(packs):
    Path("out/quilt/page_01.0002.exr").unlink()
    run("render", "job.yaml", "--resume")
    run("verify", "job.yaml")
    run("simulate", "job.yaml", "-f", "1", "-o", "eye.png", "--size", "32x24")
    run("compare", "job.yaml")
    run("check", "job.yaml")
    run("view", "out", "-o", "view.html")
    assert packs == []


def test_another_folder_has_its_own_layout(packs):
    render(load_job("job.yaml"), RenderOptions(folder=Path("other")))
    assert len(packs) == 1
    render(load_job("job.yaml"), RenderOptions(folder=Path("other"), overwrite=True))
    assert len(packs) == 1


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("job.yaml", "quilt_job: 1\n", "quilt_job: 1\nlayout: {padding: 3}\n"),
        ("display.yaml", "32}\n", "33}\n"),
        ("display.yaml", "32}\n", "32}\nfacets:\n  2: {enabled: false}\n"),
        ("out/layout.yaml", "  page: 1\n", "  page: one\n"),
        ("out/layout.yaml", "[1, 0, 0]", "[1, 0, 300]"),
        ("out/layout.yaml", "quilt_layout: 1\n", ""),
    ],
)
def test_what_has_changed_is_packed_again(name, old, new, packs):
    replaced(Path(), name, old, new)
    before = job_sha256(load_job("job.yaml"))
    render(load_job("job.yaml"), AGAIN)
    assert len(packs) == 1
    assert job_sha256(load_job("out/job.yaml")) == before
    render(load_job("job.yaml"), AGAIN)
    assert len(packs) == 1


def test_places_of_the_display_file_count(packs):
    replaced(Path(), "job.yaml", "quilt_job: 1\n", "quilt_job: 1\nlayout: {size: [256, 256]}\n")
    render(load_job("job.yaml"), AGAIN)
    replaced(Path(), "display.yaml", "32}\n", "32}\nfacets:\n  2: {place: {at: [150, 20]}}\n")
    render(load_job("job.yaml"), AGAIN)
    assert len(packs) == 2
    assert read_layout("out/layout.yaml").quilt_from_facet[1].tolist() == [[1, 0, 150], [0, 1, 20]]


def test_a_layout_that_was_changed_by_hand_is_another_job(packs):
    shutil.copy("out/layout.yaml", "mine.yaml")
    named = job_sha256(load_job("job.yaml", ["layout=mine.yaml"]))
    assert named == job_sha256(load_job("job.yaml"))
    replaced(Path(), "mine.yaml", "\n- id: 2\n  page: 1", "\n- id: 2\n  page: 2")
    replaced(Path(), "mine.yaml", "facets:", f"{page_of('mine.yaml')}\nfacets:")
    assert job_sha256(load_job("job.yaml", ["layout=mine.yaml"])) != named


def page_of(name):
    return next(line for line in Path(name).read_text().splitlines() if line.startswith("- size: "))
