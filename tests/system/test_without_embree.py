"""A machine that has no Embree draws the same bytes; what cannot do without says so."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.tiny_job import files_in, replaced, write_tiny_job

ROOT = Path(__file__).parents[2]
HIDDEN = """
import sys
for name in ("embreex", "embreex.mesh_construction", "embreex.rtcore_scene"):
    sys.modules[name] = None
from quiltcli.cli import run
run()
"""


def quilt(folder: Path, *arguments: str, code: str = HIDDEN) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def images(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in files_in(folder) if name.endswith(".exr")}


def test_a_render_without_embree_is_the_same_and_says_so_once(tmp_path: Path) -> None:
    write_tiny_job(tmp_path)
    shown = quilt(tmp_path, "render", "job.yaml", "-o", "with", code="from quiltcli.cli import run\nrun()")
    assert (shown.returncode, "embreex" in shown.stderr) == (0, False)
    hidden = quilt(tmp_path, "render", "job.yaml", "-o", "without")
    assert hidden.returncode == 0, hidden.stderr
    assert hidden.stderr.count("embreex is not installed: triangles are sorted to facets without it") == 1
    assert images(tmp_path / "with") == images(tmp_path / "without") != {}


@pytest.mark.parametrize(
    "command",
    [
        ["verify", "job.yaml"],
        ["compare", "job.yaml"],
        ["render", "job.yaml", "--set", "render.method=raycast"],
    ],
)
def test_what_cannot_do_without_says_so(command: list[str], tmp_path: Path) -> None:
    write_tiny_job(tmp_path)
    done = quilt(tmp_path, *command)
    assert done.returncode == 2
    assert "rays are cast with Embree, but embreex is not installed" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.rglob("*.exr"))


@pytest.mark.parametrize("command", ["render", "check"])
def test_shadows_need_it_and_can_be_left_out(command: str, tmp_path: Path) -> None:
    write_tiny_job(tmp_path)
    replaced(tmp_path, "scene.yaml", "color: [3, 3, 3]}", "color: [3, 3, 3], shadows: true}")
    done = quilt(tmp_path, command, "job.yaml")
    assert done.returncode in (1, 2)
    assert (
        "rays cast with Embree (render.shadows: false draws none), but embreex is not"
        in done.stderr + done.stdout
    )
    assert not list(tmp_path.rglob("*.exr"))
    if command == "render":
        done = quilt(tmp_path, "render", "job.yaml", "--set", "render.shadows=false", "-f", "1")
        assert done.returncode == 0, done.stderr


def test_everything_else_runs(tmp_path: Path) -> None:
    write_tiny_job(tmp_path)
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1")
    for command in (
        ["simulate", "job.yaml", "-f", "1", "-o", "eye.png", "--size", "32x24"],
        ["sweetspot", "display.yaml", "--eye", "0,0,2"],
        ["check", "job.yaml"],
        ["info", "job.yaml"],
    ):
        done = quilt(tmp_path, *command)
        assert done.returncode == 0, (command, done.stderr)


def test_one_module_imports_embree() -> None:
    found = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "quiltcli").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.ImportFrom) and str(node.module).startswith("embreex"))
        or (isinstance(node, ast.Import) and any(alias.name.startswith("embreex") for alias in node.names))
    ]
    assert set(found) == {"quiltcli/visibility/rays/embree.py"}
