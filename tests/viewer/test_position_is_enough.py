"""A picture for one eye does not depend on where the head looks, so a path need not say it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import QuiltError
from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.notices import stage_warnings
from quiltcli.render.sequence import render
from quiltcli.render.setup import set_stage
from quiltcli.viewer.view import views_at
from tests.helpers.tiny_job import replaced, write_tiny_job

KEYS = (
    "    keyframes:\n"
    "    - {frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}\n"
    "    - {frame: 4, position: [-0.5, 0.2, 3], look_at: [0, 0, 0]}\n"
)
PATHS = {
    "csv": "    csv: places.csv\n",
    "recorded": "    recorded: {file: places.csv, units: m, up_axis: y, rate: 30}\n",
    "keyframes": (
        "    keyframes:\n    - {frame: 1, position: [0, 0, 2]}\n    - {frame: 4, position: [-0.5, 0.2, 3]}\n"
    ),
}


def job_of(folder: Path, path: str, render: str = "render: {depth: radial}\n") -> Path:
    file = write_tiny_job(folder)
    (folder / "places.csv").write_text("frame,x,y,z\n1,0,0,2\n2,-0.1,0,2.2\n3,-0.3,0.1,2.5\n4,-0.5,0.2,3\n")
    replaced(folder, "job.yaml", KEYS, path)
    file.write_text(file.read_text() + render)
    return file


@pytest.mark.parametrize("kind", PATHS)
def test_a_path_of_places_alone_looks_at_the_middle_of_the_display(kind: str, tmp_path: Path) -> None:
    [view] = views_at(load_job(job_of(tmp_path, PATHS[kind])), 4)
    # The display is a box from (-1, -1, 0) to (1, 1, 2).
    way = np.array([0, 0, 1]) - np.array([-0.5, 0.2, 3])
    assert view.viewer.eye == pytest.approx([-0.5, 0.2, 3])
    assert view.viewer.look == pytest.approx(way / np.linalg.norm(way))
    assert not view.viewer.aimed


def test_pictures_are_those_of_a_head_that_looks_somewhere(tmp_path: Path) -> None:
    pictures = []
    for name, path in (("aimed", KEYS), ("places", PATHS["keyframes"])):
        (tmp_path / name).mkdir()
        job = load_job(job_of(tmp_path / name, path), ["frames=4", "output.facets=false"])
        render(job)
        pictures.append(read_exr(tmp_path / name / "out/quilt/page_01.0004.exr").channels)
    assert pictures[0].keys() == pictures[1].keys()
    for name, pixels in pictures[0].items():
        assert np.array_equal(pixels, pictures[1][name]), name


def test_planar_depth_along_the_line_to_the_middle_is_said_once(tmp_path: Path) -> None:
    said = list(stage_warnings(set_stage(load_job(job_of(tmp_path, PATHS["csv"], "")))))
    assert [text for text in said if "middle" in text] == [
        "the path does not say where the head looks, on which no picture for one eye depends; depth is"
        " measured along the line to the display's middle (render.depth: radial measures the distance)"
    ]
    radial = stage_warnings(set_stage(load_job(job_of(tmp_path, PATHS["csv"]))))
    assert not [text for text in radial if "middle" in text]


@pytest.mark.parametrize("kind", PATHS)
def test_two_eyes_need_to_know_how_the_head_is_turned(kind: str, tmp_path: Path) -> None:
    file = job_of(tmp_path, PATHS[kind])
    replaced(tmp_path, "job.yaml", "  near: 0.05\n", "  near: 0.05\n  stereo: {separation: 0.06}\n")
    with pytest.raises(QuiltError, match=r"holds positions only|says no direction of view"):
        views_at(load_job(file), 1)
