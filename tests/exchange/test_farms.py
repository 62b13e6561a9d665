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


def test_the_template_of_eyes_and_facets_is_one(pair, tmp_path):
    pytest.importorskip("openjd.cli")
    out = tmp_path / "job.openjd.yaml"
    quilt("farm", pair, "-o", out, "--by", "eyes", "--by", "facets")
    openjd = [sys.executable, "-m", "openjd", "check", str(out)]
    done = subprocess.run(openjd, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


def test_an_outline_of_opencue(job, tmp_path):
    out = tmp_path / "job.outline.py"
    quilt("farm", job, "-o", out, "--command", 'C:\\quilt "new"')
    tree = ast.parse(out.read_text())
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    shell = next(call for call in calls if getattr(call.func, "id", "") == "Shell")
    found = {word.arg: word.value for word in shell.keywords}
    (loop,) = (node for node in ast.walk(tree) if isinstance(node, ast.For))
    command = ['C:\\quilt "new"', "render", str(job), "--frames", "#IFRAME#"]
    command += ["--output", str(tmp_path / "out"), "--resume"]
    assert ast.literal_eval(loop.iter) == [["render", command]]
    assert ast.literal_eval(found["range"]) == "1-4"


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


@pytest.fixture
def pair(job, tmp_path):
    """A job of two eyes without quilts."""
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-2\noutput: {quilts: false}")
    return job


def test_eyes_and_facets_are_handed_out(pair, tmp_path):
    out = tmp_path / "job.openjd.yaml"
    quilt("farm", pair, "-o", out, "--by", "eyes", "--by", "facets", "--set", "fps=24")
    data = yaml.safe_load(out.read_text())
    (step,) = data["steps"]
    space = step["parameterSpace"]["taskParameterDefinitions"]
    assert [(one["name"], one["type"]) for one in space] == [
        ("Frame", "CHUNK[INT]"),
        ("Eye", "STRING"),
        ("Facet", "INT"),
    ]
    assert [one["range"] for one in space[1:]] == [["left", "right"], "1-2"]
    args = step["script"]["actions"]["onRun"]["args"]
    assert args[-6:] == ["--set", "fps=24", "--eye", "{{Task.Param.Eye}}", "--facets", "{{Task.Param.Facet}}"]
    quilt("farm", pair, "-o", tmp_path / "a.outline.py", "--by", "eyes", "--by", "facets")
    (loop,) = (node for node in ast.walk(ast.parse((tmp_path / "a.outline.py").read_text()))
               if isinstance(node, ast.For))  # fmt: skip
    layers = dict(ast.literal_eval(loop.iter))
    sides = [(eye, name) for eye in ("left", "right") for name in ("back", "right")]
    assert list(layers) == [f"render_{eye}_{name}" for eye, name in sides]
    assert layers["render_right_back"][-4:] == ["--eye", "right", "--facets", "1"]


def test_what_shares_a_file_is_not_handed_out_apart(job, pair, tmp_path):
    """The first is a job of two eyes without quilts as well."""
    for words, sets in (
        ("--by facets: the pages of a quilt hold facets together", "output.quilts=true"),
        ("--by eyes: both eyes are parts of one file", "output.stereo=parts"),
        ("--by eyes: the job has one eye", "viewer.stereo=null"),
    ):
        by = words.split()[1].rstrip(":")
        code, said = quilt("farm", pair, "-o", tmp_path / "x.openjd.yaml", "--by", by, "--set", sets)
        assert (code, words in said) == (2, True), said
    code, said = quilt("render", pair, "--eye", "left", "--set", "output.stereo=parts")
    assert (code, "both eyes are parts of one file, which is drawn whole" in said) == (2, True), said
    code, said = quilt("render", pair, "--eye", "left", "--set", "viewer.stereo=null")
    assert (code, "--eye left: the job has one eye" in said) == (2, True), said


def test_tasks_of_eyes_and_facets_make_what_one_run_makes(pair, tmp_path):
    assert quilt("render", pair, "-o", tmp_path / "whole")[0] == 0
    for eye in ("right", "left"):
        for facet in ("2", "back"):
            words = ("render", pair, "-o", tmp_path / "parts", "--eye", eye, "--facets", facet, "--resume")
            code, said = quilt(*words)
            assert code == 0, said
            assert quilt(*words)[1].endswith("complete already\n")
    names = [f"facet_000{facet}.{eye}.000{frame}.exr" for facet in (1, 2) for eye in ("left", "right")
             for frame in (1, 2)]  # fmt: skip
    for name in names:
        one, other = (tmp_path / folder / "facets" / name for folder in ("whole", "parts"))
        assert one.read_bytes() == other.read_bytes()
    assert sorted(path.name for path in (tmp_path / "parts/facets").iterdir()) == sorted(names)
    whole = quilt("render", pair, "-o", tmp_path / "parts", "--resume")
    assert whole[1].endswith("complete already\n")
    assert quilt("render", pair, "-o", tmp_path / "parts", "--facets", "2")[0] == 2
