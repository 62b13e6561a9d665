from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.analysis.check import check_files
from quiltcli.cli import main
from tests.helpers.tiny_job import replaced, write_tiny_job

LINE = "f 2 5 6 3\n"
COLLAPSED = "f 1 2 2\n"


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_tiny_job(tmp_path).parent


def found(*names: str) -> list[str]:
    return [str(problem) for problem in check_files([Path(name) for name in names])]


def packed(folder: Path) -> None:
    result = CliRunner().invoke(main, ["pack", "display.yaml", "-o", "layout.yaml"])
    assert result.exit_code == 0
    replaced(folder, "job.yaml", "scene:", "layout: layout.yaml\nscene:")


def test_good_files_have_no_problem(tiny: Path) -> None:
    packed(tiny)
    assert found("job.yaml", "display.yaml", "scene.yaml", "layout.yaml", "ball.obj") == []


def test_a_scene_mesh_is_read(tiny: Path) -> None:
    (tiny / "points.obj").write_text("v 0 0 0\n")
    assert found("points.obj") == ["points.obj: holds no triangles"]


def test_a_display_is_built(tiny: Path) -> None:
    replaced(tiny, "walls.obj", LINE, COLLAPSED)
    assert found("display.yaml") == [
        "walls.obj:10: facet 2 (right): corners 2 and 3 are the same point (expected distinct corners)"
    ]


def test_the_own_layout_of_a_display_is_tried(tiny: Path) -> None:
    replaced(tiny, "display.yaml", "mesh:", "layout: {from_uv: true, size: [64, 64]}\nmesh:")
    assert found("display.yaml") == [
        "display.yaml: the mesh has no texture coordinates, which from_uv reads the layout from"
    ]


def test_a_layout_is_held_against_its_display(tiny: Path) -> None:
    packed(tiny)
    replaced(tiny, "walls.obj", "v 1 1 2", "v 1 1 3")
    [message] = found("layout.yaml")
    assert message.startswith("layout.yaml:3:17: display_sha256: made for other geometry: found the hash ")


def test_a_layout_whose_display_is_gone(tiny: Path) -> None:
    packed(tiny)
    (tiny / "display.yaml").unlink()
    assert found("layout.yaml") == ["layout.yaml:2:10: display: no such file: display.yaml"]


def test_every_stage_of_a_job_that_can_run_does(tiny: Path) -> None:
    packed(tiny)
    replaced(tiny, "walls.obj", LINE, COLLAPSED)
    replaced(tiny, "scene.yaml", "lights:", "lihgts:")
    replaced(tiny, "layout.yaml", "page: 1", "page: 2")
    replaced(tiny, "job.yaml", "position: [-0.5, 0.2, 3]", "position: [0, 0, -2]")
    replaced(tiny, "job.yaml", "frames: 1-4", "frames: 1-5x2")
    replaced(tiny, "job.yaml", "frame: 4", "frame: 5")
    assert sorted(found("job.yaml")) == [
        "job.yaml:11:7: viewer.path.keyframes[0]: at frame 3 the viewer is where it looks at:"
        " there is no direction of view",
        "layout.yaml:10:9: facets[0].page: there is no page 2 (the layout has 1 page)",
        "layout.yaml:18:9: facets[1].page: there is no page 2 (the layout has 1 page)",
        "scene.yaml:4:1: lihgts: unknown key (did you mean 'lights'?)",
        "walls.obj:10: facet 2 (right): corners 2 and 3 are the same point (expected distinct corners)",
    ]


def test_a_wrong_job_does_not_hide_the_files_it_names(tiny: Path) -> None:
    replaced(tiny, "job.yaml", "near:", "naer:")
    (tiny / "ball.obj").write_text("v 0 0 0\n")
    replaced(tiny, "walls.obj", LINE, COLLAPSED)
    assert found("job.yaml") == [
        "job.yaml:5:1: viewer.near: missing key (nearest depth that is drawn, from the eye, metres)",
        "job.yaml:6:3: viewer.naer: unknown key (did you mean 'near'?)",
        "walls.obj:10: facet 2 (right): corners 2 and 3 are the same point (expected distinct corners)",
        "scene.yaml:3:22: objects[0].mesh: ball.obj: holds no triangles",
    ]


def test_an_eye_in_the_plane_of_a_facet_is_told(tiny: Path) -> None:
    replaced(tiny, "job.yaml", "position: [-0.5, 0.2, 3]", "position: [3, 0.2, 2]")
    (tiny / "ball.obj").write_text("v 0 0 0\n")
    said: list[str] = []
    assert [str(problem) for problem in check_files([Path("job.yaml")], said.append)] == [
        "scene.yaml:3:22: objects[0].mesh: ball.obj: holds no triangles"
    ]
    words = "at frame 2 the eye lies in the plane of facet 2 (right): dark there"
    assert any(word.startswith(words) for word in said)


def test_the_same_problem_of_two_files_is_told_once(tiny: Path) -> None:
    replaced(tiny, "walls.obj", LINE, COLLAPSED)
    assert len(found("display.yaml", "job.yaml", "display.yaml")) == 1


def test_the_command_lists_problems_on_stdout_and_fails(tiny: Path) -> None:
    replaced(tiny, "scene.yaml", "lights:", "lihgts:")
    result = CliRunner().invoke(main, ["check", "scene.yaml", "nothere.yaml"])
    assert result.exit_code == 1
    assert result.stderr == ""
    assert result.stdout.splitlines() == [
        "scene.yaml:4:1: lihgts: unknown key (did you mean 'lights'?)",
        "nothere.yaml: no such file",
    ]


def test_the_command_is_content_with_good_files(tiny: Path) -> None:
    result = CliRunner().invoke(main, ["check", "job.yaml", "scene.yaml"])
    assert (result.exit_code, result.stdout) == (0, "")
    plan, verdict = result.stderr.splitlines()
    assert plan.startswith("job.yaml: takes about ")
    assert verdict == "2 files: nothing is wrong"
