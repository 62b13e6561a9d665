"""Jobs for farms, proxies, and lines that farms read."""

import ast
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.display import load_display, scaled
from quiltcli.errors import JobError
from quiltcli.formats import capacity
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.names import facet_path
from quiltcli.job import load_display_file, load_job
from quiltcli.job.digest import job_sha256
from quiltcli.job.frames import parse_frames
from tests.helpers.tiny_job import replaced, write_tiny_job


@pytest.fixture
def job(tmp_path):
    return write_tiny_job(tmp_path, "144, 72")


def quilt(*words):
    done = CliRunner().invoke(main, [str(word) for word in words])
    return done.exit_code, done.output


def test_an_open_job_description(job, tmp_path):
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-9x2")
    out = tmp_path / "job.openjd.yaml"
    assert quilt("farm", job, "-o", out, "--chunk", "3", "-j", "2") == (0, f"written to {out}\n")
    data = yaml.safe_load(out.read_text())
    given = {one["name"]: one["default"] for one in data["parameterDefinitions"]}
    assert given.pop("Quilt") == "quilt"
    expected = {"Job": "job.yaml", "OutputDir": "out", "Frames": "1-9:2", "ChunkSize": 3}
    assert given == expected
    action = data["steps"][0]["script"]["actions"]["onRun"]
    assert action["args"][:4] == ["render", "{{Param.Job}}", "--frames", "{{Task.Param.Frame}}"]
    assert action["args"][-2:] == ["--threads", "2"]
    assert quilt("farm", job, "-o", out)[0] == 2
    code, said = quilt("farm", job, "-o", tmp_path / "job.txt")
    assert code == 2
    assert "expected a name that ends in .openjd.yaml or .outline.py" in said


def test_the_template_is_one_and_runs(job, tmp_path):
    """By Open Job Description's own program, where it is installed."""
    pytest.importorskip("openjd.cli")
    out, called = tmp_path / "job.openjd.yaml", tmp_path / "quilt"
    called.write_text(f'#!/bin/sh\nexec {sys.executable} -m quiltcli "$@"\n')
    called.chmod(0o755)
    quilt("farm", job, "-o", out, "--chunk", "3", "--command", called)
    for word in ("check", "run"):
        openjd = [sys.executable, "-m", "openjd", word, str(out)]
        done = subprocess.run(openjd, capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
    assert facet_path(tmp_path / "out", 1, 4).is_file()


def test_an_outline_of_opencue(job, tmp_path):
    out = tmp_path / "job.outline.py"
    quilt("farm", job, "-o", out, "--command", 'C:\\quilt "new"')
    calls = [node for node in ast.walk(ast.parse(out.read_text())) if isinstance(node, ast.Call)]
    shell = next(call for call in calls if getattr(call.func, "id", "") == "Shell")
    found = {word.arg: ast.literal_eval(word.value) for word in shell.keywords}
    command = ['C:\\quilt "new"', "render", str(job), "--frames", "#IFRAME#"]
    assert found["command"] == [*command, "--output", str(tmp_path / "out"), "--resume"]
    assert found["range"] == "1-4"


def test_a_colon_is_a_step_where_a_farm_means_that(job):
    assert parse_frames("1-9:4, 20-24 : 2", colon=True) == (1, 5, 9, 20, 22, 24)
    with pytest.raises(JobError, match="':' means different things"):
        parse_frames("1-9:4")
    code, said = quilt("render", job, "-f", "1-3:2", "--progress", "openjd")
    assert code == 0
    lines = [line for line in said.splitlines() if line.startswith("openjd_")]
    assert lines == [
        "openjd_progress: 50.0",
        "openjd_status: frame 1, 1 of 2",
        "openjd_progress: 100.0",
        "openjd_status: frame 3, 2 of 2",
    ]
    assert quilt("render", job, "-f", "1-3:2", "--overwrite")[0] == 2


def test_a_proxy_has_fewer_pixels_of_the_same_places(job, tmp_path):
    facets = load_display(load_display_file(tmp_path / "display.yaml"))
    small = scaled(facets, Fraction(1, 3))
    assert small.size.tolist() == [[22, 22], [22, 22]]
    np.testing.assert_allclose(small.du * 21 + facets.origin, facets.du * 63 + facets.origin)
    code, said = quilt(
        "render", job, "-f", "1", "--scale", "1/4", "--set", f"output.directory={tmp_path}/proxy"
    )
    assert code == 0, said
    assert read_exr(facet_path(tmp_path / "proxy", 1, 1)).channels["R"].shape == (16, 16)
    seen = quilt(
        "simulate", tmp_path / "proxy/job.yaml", "-f", "1", "--size", "48x36", "-o", tmp_path / "e.png"
    )
    assert f"read from {tmp_path / 'proxy'}" in seen[1]
    again = quilt("render", tmp_path / "proxy/job.yaml", "-f", "1", "--resume")
    assert again[1].endswith("complete already\n")
    assert quilt("check", tmp_path / "proxy/job.yaml")[0] == 0
    for wrong in ("2", "0", "1/0", "a"):
        assert quilt("render", job, "--scale", wrong, "--dry-run")[0] == 2


def test_the_scale_of_all_pixels_changes_no_hash(job):
    whole = job_sha256(load_job(job))
    assert job_sha256(load_job(job, ["render.scale=1"])) == whole
    assert job_sha256(load_job(job, ["render.scale=1/2"])) != whole


def test_memory_may_be_limited(job, monkeypatch):
    monkeypatch.setattr(capacity, "_limit", None)
    assert capacity.read_bytes("1.5 GB") == 1_500_000_000
    assert capacity.read_bytes("512MiB") == 512 << 20
    assert capacity.read_bytes("1000") == 1000
    code, said = quilt("render", job, "-f", "1", "--max-memory", "300MB")
    assert code == 2
    assert "of memory, but 0.1 MB are free" in said
    assert quilt("render", job, "-f", "1", "--max-memory", "64GB")[0] == 0
    assert "expected a size such as 8GB" in quilt("render", job, "--max-memory", "much")[1]
