from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from quiltcli.errors import JobError
from quiltcli.job import check_file, file_kind, load_display_file, load_job, load_layout_file, load_scene_file
from tests.helpers.good_files import GOOD, edited, write_good_files

LOADERS: dict[str, Callable[[Path], object]] = {
    "job": load_job,
    "display": load_display_file,
    "scene": load_scene_file,
    "layout": load_layout_file,
}


@dataclass
class Case:
    title: str
    whole: str | None = None
    old: str = ""
    new: str = ""
    messages: list[str] = field(default_factory=list)

    @property
    def kind(self) -> str:
        return self.title.partition(":")[0]

    @property
    def text(self) -> str:
        good = GOOD[self.kind]
        if self.whole is not None:
            return self.whole
        assert self.old in good
        return good.replace(self.old, self.new) if self.old else good + self.new


def _cases() -> list[Case]:
    cases: list[Case] = []
    for line in (Path(__file__).parent / "bad_files.txt").read_text(encoding="utf-8").splitlines():
        mark, _, rest = line.partition(" ")
        if mark == "==":
            cases.append(Case(rest))
        elif mark == "!":
            cases[-1].messages.append(rest)
        elif mark in ("=", "<", ">"):
            text = rest.encode("latin-1").decode("unicode_escape")
            setattr(cases[-1], {"=": "whole", "<": "old", ">": "new"}[mark], text)
    return cases


CASES = _cases()


def messages(load: Callable[[], object], folder: Path) -> list[str]:
    with pytest.raises(JobError) as caught:
        load()
    return str(caught.value).replace(f"{folder}/", "").splitlines()


def test_there_are_many_cases_and_none_twice() -> None:
    assert len(CASES) == len({case.title for case in CASES}) == 146


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_message(case: Case, tmp_path: Path) -> None:
    write_good_files(tmp_path)
    path = tmp_path / "FILE"
    path.write_text(case.text)
    assert messages(lambda: LOADERS[case.kind](path), tmp_path) == case.messages


@pytest.mark.parametrize("kind", LOADERS)
def test_good_file_has_no_problem(kind: str, tmp_path: Path) -> None:
    write_good_files(tmp_path)
    assert check_file(tmp_path / f"{kind}.yaml") == []
    assert file_kind(tmp_path / f"{kind}.yaml") == f"quilt_{kind}"


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("rendr.samples=4", "rendr: unknown key (did you mean 'render'?)"),
        ("render.sampels=4", "render.sampels: unknown key (did you mean 'samples'?)"),
        ("render.samples=two", "render.samples: expected a whole number, got the text 'two'"),
        ("viewer.path.keyframes[0].position.1=x",
         "viewer.path.keyframes[0].position[1]: expected a number, got the text 'x'"),
        ("viewer.near", "expected KEY=VALUE, such as render.samples=4"),
        ("viewer..near=3",
         "cannot read the key 'viewer..near' (expected names with dots between: viewer.near)"),
        ("viewer.near.x=3", "viewer.near: holds 0.05, which has no keys"),
        ("viewer.path.keyframes.7.frame=2",
         "viewer.path.keyframes: there is no item 7 (the list has 1 item, from 0)"),
        ("viewer.path.csv=track.csw", "viewer.path.csv: cannot stand beside keyframes "
         "(expected only one of keyframes, orbit, csv or recorded)"),
        ("frames=1:4", "frames: ':' means different things to different farms, in '1:4' "
         "(write the step with x: 1-9x2)"),
        ("scene=nothere.obj", "scene: no such file: nothere.obj"),
        ("viewer.far=[1", "not YAML: expected ',' or ']', but got the end of the file "
         "(while parsing a list in [ ] that starts in line 1)"),
    ],
)  # fmt: skip
def test_set_message_names_the_option(setting: str, message: str, tmp_path: Path) -> None:
    job = write_good_files(tmp_path)
    (tmp_path / "track.csw").touch()
    if "csw" in setting:
        setting = setting.replace("track.csw", str(tmp_path / "track.csv"))
    found = messages(lambda: load_job(job, [setting]), Path("nowhere"))
    assert found == [f"--set {setting}: {message}"]


def test_later_set_is_the_one_to_blame(tmp_path: Path) -> None:
    job = write_good_files(tmp_path)
    found = messages(lambda: load_job(job, ["render.samples=4", "render={samples: 0}"]), tmp_path)
    assert found == ["--set render={samples: 0}: render.samples: must be at least 1, got 0"]


def test_all_problems_come_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    write_good_files(tmp_path)
    path = edited(tmp_path, "job.yaml", "  near: 0.05\n  far: 50\n", "  far: x\n  near: -1\n  far: 3\n")
    edited(tmp_path, "job.yaml", "", "fps: 0\n")
    assert messages(lambda: load_job(path), tmp_path) == [
        "job.yaml:6:8: viewer.far: expected a number, got the text 'x'",
        "job.yaml:7:9: viewer.near: must be greater than 0, got -1",
        "job.yaml:8:3: viewer.far: duplicate key (first given in line 6)",
        "job.yaml:12:6: fps: must be greater than 0, got 0",
    ]


def test_job_brings_up_the_problems_of_the_files_it_names(tmp_path: Path) -> None:
    job = write_good_files(tmp_path)
    edited(tmp_path, "display.yaml", "mesh: mesh.obj\n", "")
    edited(tmp_path, "job.yaml", "scene: mesh.obj", "scene: scene.yaml")
    edited(tmp_path, "scene.yaml", "", "ligths: []\n")
    expected = [
        "display.yaml:1:1: mesh: missing key (polygon mesh; or panels: flat rectangles; or surfaces;"
        " or a projection)",
        "scene.yaml:4:1: ligths: unknown key (did you mean 'lights'?)",
    ]
    assert messages(lambda: load_job(job), tmp_path) == expected
    assert [str(problem).replace(f"{tmp_path}/", "") for problem in check_file(job)] == expected


def test_mesh_as_scene_must_be_there(tmp_path: Path) -> None:
    (tmp_path / "dir.obj").mkdir()
    assert messages(lambda: load_scene_file(tmp_path / "x.obj"), tmp_path) == [
        "x.obj: no such file (expected a mesh)"
    ]
    found = messages(lambda: load_scene_file(tmp_path / "dir.obj"), tmp_path)
    assert found == ["dir.obj: is a directory (expected a mesh file)"]


def test_a_file_of_no_kind_is_named_so(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("a: 1\n")
    assert messages(lambda: file_kind(tmp_path / "a.yaml"), tmp_path) == [
        "a.yaml:1:1: this is no file of quilt's (expected quilt_display: 1, quilt_layout: 1, quilt_scene: 1,"
        " quilt_job: 1, quilt_lightfield: 1, quilt_calibration: 1 or quilt_camera: 1 as the first key)"
    ]


def test_model_points_into_its_file_later(tmp_path: Path) -> None:
    write_good_files(tmp_path)
    edited(tmp_path, "display.yaml", "", "facets:\n  3: {name: top}\n")
    display = load_display_file(tmp_path / "display.yaml")
    text = str(display.source.problem(("facets", 3, "up"), "points along the normal"))
    assert text == f"{tmp_path}/display.yaml:5:6: facets.3.up: points along the normal"
    assert str(display.facets[3].source.problem("name", "x")).endswith(":5:13: facets.3.name: x")
