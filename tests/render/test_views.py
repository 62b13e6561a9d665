"""Two eyes and several viewers, from a job to its files."""

import json

import numpy as np
import OpenEXR
import pytest
from click.testing import CliRunner

from quiltcli.analysis.verify import VerifyOptions, verify
from quiltcli.cli import main
from quiltcli.errors import JobError
from quiltcli.formats.exr.image import read_exr, read_header, read_parts
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.in_memory import CUBE, CUBE_FACES
from tests.helpers.verified_jobs import ball, write_job
from tests.viewer.test_view import two_viewers

EYES = ("left", "right")


def ball_job(folder, eye=(2.1, 1.7, 2.9), stereo="  stereo: {separation: 0.1}\n", more=""):
    """A ball in a cube."""
    write_job(folder, (CUBE, CUBE_FACES), ball(), eye, more=more)
    path = folder / "job.yaml"
    path.write_text(path.read_text().replace("viewer:\n", "viewer:\n" + stereo))
    return load_job(path)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stereo")
    job = ball_job(folder, more="output: {channels: [rgba, Z, triangle]}\n")
    records = render(job)
    return folder, job, records


def test_each_eye_has_files_and_a_record_of_its_own(rendered):
    folder, _, records = rendered
    names = sorted(path.name for path in (folder / "out" / "quilt").iterdir())
    assert names == ["page_01.left.0001.exr", "page_01.right.0001.exr"]
    assert len(list((folder / "out" / "facets").glob("facet_*.left.0001.exr"))) == 6
    assert [(record.frame, record.eye) for record in records] == [(1, "left"), (1, "right")]
    report = json.loads((folder / "out" / "report.json").read_text())
    assert [(entry["frame"], entry["eye"]) for entry in report["frames"]] == [(1, "left"), (1, "right")]


def test_attributes_are_those_of_the_eye_as_openexr_has_views(rendered):
    folder, _, _ = rendered
    seen = {}
    for eye in EYES:
        found = read_header(folder / "out" / "facets" / f"facet_0003.{eye}.0001.exr").attributes
        assert found["view"] == eye
        assert list(found["multiView"]) == [eye]
        assert found["quilt:head"] == pytest.approx([2.1, 1.7, 2.9], abs=1e-6)
        seen[eye] = found["quilt:eye"]
    assert np.linalg.norm(seen["right"] - seen["left"]) == pytest.approx(0.1, abs=1e-6)


def test_both_eyes_are_right_and_not_the_same(rendered):
    folder, job, _ = rendered
    left, right = (read_exr(folder / "out" / "quilt" / f"page_01.{eye}.0001.exr").channels for eye in EYES)
    assert (left["triangle"] != right["triangle"]).mean() > 0.01
    found = list(verify(job, VerifyOptions(everything=True)))
    assert [one.verdict.eye for one in found] == list(EYES)
    assert all(one.verdict.passed and "the quilt in" in one.verdict.images for one in found)
    [right_only] = verify(job, VerifyOptions(eye="right"))
    assert right_only.verdict.eye == "right"


def test_an_eye_sees_what_one_eye_in_its_place_sees(rendered, tmp_path):
    folder, _, _ = rendered
    place = read_header(folder / "out" / "quilt" / "page_01.right.0001.exr").attributes["quilt:eye"]
    head = np.array([2.1, 1.7, 2.9])
    right = np.cross(-head / np.linalg.norm(head), [0, 1, 0])
    eye = head + 0.05 * right / np.linalg.norm(right)
    assert place == pytest.approx(eye, abs=1e-6)
    how = "output: {channels: [Z]}\n"
    mono = write_job(tmp_path, (CUBE, CUBE_FACES), ball(), tuple(eye), at=tuple(eye - head), more=how)
    render(mono)
    one = read_exr(tmp_path / "out" / "quilt" / "page_01.0001.exr").channels["Z"]
    two = read_exr(folder / "out" / "quilt" / "page_01.right.0001.exr").channels["Z"]
    assert np.isfinite(one).sum() > 1500
    same = np.isfinite(one) & np.isfinite(two)
    assert same.sum() >= np.isfinite(one).sum() - 2
    assert np.abs(one[same] - two[same]).max() < 1e-5


def test_eyes_as_parts_of_one_file_hold_the_same_pixels(rendered, tmp_path):
    folder, _, _ = rendered
    job = ball_job(tmp_path, more="output: {channels: [rgba, Z, triangle], stereo: parts}\n")
    render(job)
    path = tmp_path / "out" / "quilt" / "page_01.0001.exr"
    parts = read_parts(path)
    assert [part.name for part in parts] == list(EYES)
    for part in parts:
        assert part.attributes["view"] == part.name
        assert "multiView" not in part.attributes
        apart = read_exr(folder / "out" / "quilt" / f"page_01.{part.name}.0001.exr").channels
        for name, pixels in apart.items():
            np.testing.assert_array_equal(part.channels[name], pixels, err_msg=name)
    assert len(OpenEXR.File(str(path), header_only=True).parts) == 2
    found = list(verify(job, VerifyOptions()))
    assert all(one.verdict.passed and "the quilt in" in one.verdict.images for one in found)
    assert render(job, RenderOptions(resume=True)) == []


def test_a_job_of_one_eye_has_no_other(tmp_path):
    ball_job(tmp_path, stereo="")
    result = CliRunner().invoke(main, ["verify", str(tmp_path / "job.yaml"), "--eye", "left"])
    assert result.exit_code == 2
    assert "the job has one eye" in result.stderr


def test_everybody_sees_their_own_facets_and_nobody_elses(tmp_path):
    from tests.viewer.test_view import job_with

    job = job_with(tmp_path, two_viewers("1-3", '"4,5"'), "output: {channels: [rgba, Z, triangle]}\n")
    render(job)
    found = list(verify(job, VerifyOptions(everything=True)))
    assert [one.verdict.viewer for one in found] == ["ann", "bob"]
    assert all(one.verdict.passed and one.verdict.lit for one in found)
    for facet, viewer in ((1, "ann"), (4, "bob")):
        attributes = read_header(tmp_path / "out" / "facets" / f"facet_{facet:04}.0001.exr").attributes
        assert attributes["quilt:viewer"] == viewer
    assert "quilt:viewer" not in read_header(tmp_path / "out" / "facets" / "facet_0006.0001.exr").attributes
    page = read_header(tmp_path / "out" / "quilt" / "page_01.0001.exr").attributes
    assert [one["name"] for one in json.loads(page["quilt:viewers"])] == ["ann", "bob"]
    dark = read_exr(tmp_path / "out" / "facets" / "facet_0006.0001.exr").channels["Z"]
    assert not np.isfinite(dark).any()


def test_two_eyes_go_no_farther_than_their_head(tmp_path):
    from quiltcli.analysis.info import describe

    assert describe(ball_job(tmp_path).source.path).data["path_length_m"] == 0


def test_a_facet_that_is_a_line_to_the_eye_is_dark_and_the_others_are_drawn(tmp_path):
    job = write_job(tmp_path, (CUBE, CUBE_FACES), ball(), (1.0, 0.3, 4.0))
    [record] = render(job)
    assert record.visible_pixels > 100
    found = list(verify(job, VerifyOptions(everything=True)))
    assert all(one.verdict.passed and one.verdict.lit == 1 for one in found)


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    from tests.viewer.test_view import job_with

    folder = tmp_path_factory.mktemp("two")
    job = job_with(folder, two_viewers("1-3", '"4,5"'), "output: {channels: [rgba, Z, triangle]}\n")
    render(job)
    return folder


def quilt(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def test_the_job_of_two_viewers_that_a_render_leaves_is_read_again(two):
    assert quilt("check", two / "out" / "job.yaml").exit_code == 0


def test_facets_that_are_not_there_are_told(tmp_path):
    from tests.viewer.test_view import job_with

    job_with(tmp_path, two_viewers("1-3", '"4,9"'))
    for command in ("check", "render"):
        said = quilt(command, tmp_path / "job.yaml")
        assert said.exit_code in (1, 2)
        assert "viewers.bob.facets: there is no facet 9 (the display has 1 to 6)" in said.output


def test_keys_of_a_viewer_are_suggested(tmp_path):
    from tests.viewer.test_view import job_with

    with pytest.raises(JobError, match=r"viewers.ann.faar: unknown key \(did you mean 'far'\?\)"):
        job_with(tmp_path, two_viewers("1", "2").replace("ann: {", "ann: {faar: 3, "))


def test_each_viewer_has_a_picture_of_their_own_facets(two):
    said = quilt("simulate", two / "job.yaml", "-o", two / "eye.png", "--size", "160x120")
    assert said.exit_code == 0, said.output
    assert (two / "eye.ann.png").exists()
    assert (two / "eye.bob.png").exists()


def test_pages_of_one_eye_are_no_pages_of_two(two, tmp_path):
    said = quilt("stereo", two / "out", "-o", tmp_path / "x", "--as", "sequential")
    assert said.exit_code == 2
    assert "has no pages of two eyes" in said.output


@pytest.mark.parametrize("kind", ["--pages", "--facets"])
def test_a_sheet_shows_both_eyes(rendered, tmp_path, kind):
    folder, _, _ = rendered
    said = quilt("contact", folder / "out", "-o", tmp_path / "sheet.png", kind, "--width", "64")
    assert said.exit_code == 0, said.output
    assert f"{2 if kind == '--pages' else 12} images" in said.output


def test_a_page_shows_the_left_eye(rendered, tmp_path):
    folder, _, _ = rendered
    said = quilt("view", folder / "out", "-o", tmp_path / "page.html")
    assert said.exit_code == 0, said.output


def test_parts_are_looked_at_by_the_left_eyes(tmp_path):
    render(ball_job(tmp_path, more="output: {channels: [rgba], stereo: parts}\n"))
    said = quilt("preview", tmp_path / "out" / "quilt" / "page_01.0001.exr", "-o", tmp_path / "a.png")
    assert said.exit_code == 0, said.output
