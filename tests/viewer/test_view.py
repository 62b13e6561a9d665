"""Views: two eyes on one head, and several viewers."""

import numpy as np
import pytest

from quiltcli.errors import JobError
from quiltcli.viewer.view import by_file, views_of
from tests.helpers.verified_jobs import cube_job

STEREO = "  stereo: {separation: 0.06}\n"


def job_with(folder, viewer, more=""):
    """The cube's job with other lines for its viewer."""
    cube_job(folder)
    path = folder / "job.yaml"
    text = path.read_text()
    path.write_text(text[: text.index("viewer:")] + viewer + more)
    from quiltcli.job import load_job

    return load_job(path)


def looking(position, look, up="[0, 1, 0]", more=STEREO):
    key = f"{{frame: 1, position: {position}, look: {look}, up: {up}}}"
    return f"viewer:\n  near: 0.1\n  far: 9\n{more}  path:\n    keyframes:\n    - {key}\n"


def eyes(job, frame=1):
    left, right = views_of(job, [frame])
    assert (left.eye, right.eye) == ("left", "right")
    return left.viewer, right.viewer


@pytest.mark.parametrize(
    ("look", "up", "right"),
    [
        ("[0, 0, -1]", "[0, 1, 0]", (1, 0, 0)),
        ("[0, 0, -1]", "[1, 0, 0]", (0, -1, 0)),
        (
            "[0, 0, -1]",
            [float(np.sin(np.radians(37))), float(np.cos(np.radians(37))), 0],
            (0.79863551, -0.60181502, 0),
        ),
        ("[-1, 0, 0]", "[0, 1, 0]", (0, 0, -1)),
        ("[0, -1, 0]", "[0, 0, -1]", (1, 0, 0)),
    ],
    ids=["level", "rolled by 90", "rolled by 36.9", "turned to the left", "straight down"],
)
def test_eyes_stand_at_half_the_separation_along_the_heads_right(tmp_path, look, up, right):
    job = job_with(tmp_path, looking("[0.5, 1, 3]", look, up))
    left, other = eyes(job)
    assert left.head.tolist() == other.head.tolist() == [0.5, 1, 3]
    assert other.eye - left.eye == pytest.approx(np.multiply(right, 0.06), abs=1e-9)
    assert (other.eye + left.eye) / 2 == pytest.approx([0.5, 1, 3], abs=1e-12)
    assert left.look.tolist() == other.look.tolist()


def test_the_right_eye_may_look_half_a_frame_later(tmp_path):
    moving = (
        "viewer:\n  near: 0.1\n  far: 9\n  stereo: {separation: 0.06, eye_time: own}\n"
        "  path:\n    keyframes:\n"
        "    - {frame: 1, position: [0, 0, 3], look: [0, 0, -1]}\n"
        "    - {frame: 2, position: [1, 0, 3], look: [0, 0, -1]}\n"
    )
    job = job_with(tmp_path, moving)
    left, right = views_of(job, [1])
    assert (left.time, right.time) == (1, 1.5)
    assert (left.frame, right.frame, right.viewer.frame) == (1, 1, 1)
    assert right.viewer.eye[0] - left.viewer.eye[0] == pytest.approx(0.5 + 0.06)


def test_eyes_in_parts_share_their_files(tmp_path):
    job = job_with(tmp_path, looking("[0, 0, 3]", "[0, 0, -1]"), "output: {stereo: parts}\n")
    [pair] = by_file(views_of(job, [1]))
    assert [view.part for view in pair] == ["left", "right"]
    assert {view.file_key for view in pair} == {(1, "")}
    alone = job_with(tmp_path, looking("[0, 0, 3]", "[0, 0, -1]"))
    assert [view.file_key for [view] in by_file(views_of(alone, [1]))] == [(1, "left"), (1, "right")]


def two_viewers(first, second, stereo=("", "")):
    def one(name, facets, eyes, z):
        path = f"{{keyframes: [{{frame: 1, position: [2, 1.7, {z}], look_at: [0, 0, 0]}}]}}"
        facets = f", facets: {facets}" if facets else ""
        return f"  {name}: {{near: 0.1, far: 9{facets}{eyes}, path: {path}}}\n"

    return "viewers:\n" + one("ann", first, stereo[0], 3) + one("bob", second, stereo[1], -3)


def test_each_viewer_has_facets_of_their_own(tmp_path):
    [view] = views_of(job_with(tmp_path, two_viewers("1-3", '"4,5"')), [1])
    assert [(viewer.name, viewer.facets) for viewer in view.viewers] == [("ann", (1, 2, 3)), ("bob", (4, 5))]
    assert view.viewer_of(5).name == "bob"
    assert not view.viewer_of(6).sees(6)


@pytest.mark.parametrize(
    ("viewers", "words"),
    [
        (two_viewers("1-3", "3-5"), "viewers.bob.facets: facet 3 belongs to ann already"),
        (two_viewers("1-3", ""), "viewers.bob.facets: missing key"),
        (two_viewers("0-3", "4"), "facets are counted from 1, got 0"),
        (two_viewers("1", "2", (", stereo: {}", "")), "viewers.bob: has one eye where others have two"),
        (two_viewers("1", "2") + looking("[0, 0, 3]", "[0, 0, -1]"), "viewers"),
        (
            looking("[0, 0, 3]", "[0, 0, -1]", more="  facets: 1-2\n"),
            "viewer.facets: belongs to one of",
        ),
        (looking("[0, 0, 3]", "[0, 0, -1]", more="  stereo: {separation: 0}\n"), "must be greater than 0"),
    ],
)
def test_what_cannot_be(tmp_path, viewers, words):
    with pytest.raises(JobError, match=words):
        job_with(tmp_path, viewers)
