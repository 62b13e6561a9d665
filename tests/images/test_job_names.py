"""Names that a job chooses for its images, read and written."""

import re

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import JobError
from quiltcli.images.names import ImageName, Names, fit_names, names_in
from quiltcli.job import load_job
from quiltcli.job.names import FACET, PAGE, read_template
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import SETTINGS, files_in, replaced, write_tiny_job

TEMPLATES = [
    ("page", PAGE),
    ("page", "{eye}/canvas-{page}.{frame:05}.exr"),
    ("facet", FACET),
    ("facet", "{name}/{name}{.eye}.{frame:04}.exr"),
    ("facet", "{eye}/{name}/{facet:03}_{frame:06}.exr"),
]


@pytest.mark.parametrize(("kind", "text"), TEMPLATES)
@pytest.mark.parametrize("eye", ["", "left", "right"])
@pytest.mark.parametrize("frame", [-12, 0, 7, 123456])
@pytest.mark.parametrize("number", [1, 12, 12345])
def test_a_name_tells_what_it_was_made_of(kind, text, eye, frame, number):
    values = {kind: number, "name": "top", "frame": frame, "eye": eye}
    back = read_template(text, kind).values_in(read_template(text, kind).filled(values))
    assert {**values, **back} == values


def test_other_names_are_not_read():
    template = read_template("{name}/{name}.{frame:04}.exr", "facet")
    assert template.values_in("top/left.0001.exr") is None
    assert template.values_in("top/top.001.exr") is None
    assert read_template(PAGE, "page").values_in("quilt/page_001.0001.exr") is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{page:02}.exr", r"lacks \{frame:04\}: all frames would have one name"),
        ("{frame:04}/{page}.exr", r"must be the last thing before \.exr"),
        ("{page}.{frame}.{frame}.exr", r"must be the last thing before \.exr"),
        ("../{page}.{frame:04}.exr", r"expected names below the output folder"),
        ("/tmp/{page}.{frame:04}.exr", r"expected names below the output folder"),
        ("a//{page}.{frame:04}.exr", r"expected names below the output folder"),
        ("{.eye}/{page}.{frame:04}.exr", r"expected names below the output folder"),
        ("a\\{page}.{frame:04}.exr", r"cannot hold '\\\\' \(folders are parted by /\)"),
        ("{page}.{frame:04}.png", r"must end in \.exr"),
        ("{page}{frame:04}.exr", r"\{page\} and \{frame\} need something between them"),
        ("p{page}.2{frame:04}.exr", r"\{frame\} cannot stand beside '2': they would run together"),
        ("{pages}.{frame:04}.exr", r"there is no field \{pages\} of a page .* \(did you mean \{page\}\?\)"),
        ("{name}.{frame:04}.exr", r"there is no field \{name\} of a page"),
        ("{page:x}.{frame:04}.exr", r"cannot read \{page:x\}"),
        ("{page.{frame:04}.exr", r"has a brace without its other half"),
    ],
)
def test_what_no_template_may_be(text, words):
    with pytest.raises(ValueError, match=words):
        read_template(text, "page")


def test_facets_have_names_that_are_fit_and_their_own():
    names = ("top", "left wall", "Side", "side", "facet_0001", "")
    assert fit_names(names) == ("top", "facet_0002", "facet_0003", "facet_0004", "facet_0005", "facet_0006")


def test_numbers_stand_for_names_only_where_there_are_names(tmp_path):
    names = Names(facet_name="{name}.{frame:04}.exr", facets=("top", "side"))
    for name in ("top.0001.exr", "side.0002.exr", "other.0001.exr"):
        (tmp_path / name).touch()
    found = [name for name, _ in names.found(tmp_path)]
    assert found == [ImageName("facet", 2, 2), ImageName("facet", 1, 1)]


NAMED = """output:
  names: {page: 'canvas/canvas{.eye}.{frame:05}.exr', facet: '{name}/{name}{.eye}.{frame:05}.exr'}
"""


@pytest.fixture
def job(tmp_path):
    path = write_tiny_job(tmp_path, "144, 72")
    path.write_text(path.read_text() + NAMED)
    replaced(tmp_path, "display.yaml", "resolution", "facets: {2: {name: side}}\nresolution")
    return path


def test_a_render_writes_and_finds_its_names(job, tmp_path, run):
    render(load_job(job), RenderOptions(frames=(1, 2)))
    out = tmp_path / "out"
    images = [f"{name}/{name}.0000{frame}.exr" for name in ("canvas", "back", "side") for frame in (1, 2)]
    assert files_in(out) == sorted([*images, *SETTINGS])
    assert run("render", job, "-f", "1-2", "--resume").output.startswith("every frame is complete")
    assert "1-2 (2)" in run("info", out).output
    assert "2 pages, 4 facet images" in run("info", out).output
    assert run("contact", out, "-o", tmp_path / "sheet.png", "--facets").exit_code == 0
    seen = run("simulate", job, "-f", "2", "-o", tmp_path / "eye.png", "--size", "48x36")
    assert f"read from {out}" in seen.output
    assert f"the quilt in {out}" in run("verify", job, "-f", "2").output
    cut = run("unmap", out / "canvas/canvas.00001.exr", "--layout", out / "layout.yaml", "-o", tmp_path / "u")
    assert cut.exit_code == 0
    same = run("diff", tmp_path / "u/facets/facet_0002.0001.exr", out / "side/side.00001.exr")
    assert same.exit_code == 0
    (out / "side/.side.00001.exr.1.tmp").touch()
    assert [name.number for name, _ in names_in(out).found(out)] == [1, 1, 1, 1, 2, 2]


@pytest.fixture
def run():
    return lambda *words: CliRunner().invoke(main, [str(word) for word in words])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{name}/{name}", "walls", r"job.yaml:\d+:\d+: output.names.facet: lacks .* 2 facets would have one"),
        ("canvas/canvas", "{page}", None),
        ("canvas/canvas", "facets", None),
    ],
)
def test_names_that_images_would_share_are_refused(job, tmp_path, old, new, words):
    replaced(tmp_path, "job.yaml", old, new)
    if words is None:
        render(load_job(job), RenderOptions(dry_run=True))
        return
    with pytest.raises(JobError, match=words):
        render(load_job(job), RenderOptions(dry_run=True))
    assert not (tmp_path / "out").exists()


def test_two_eyes_need_names_of_their_own(job, tmp_path):
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    load_job(job)
    replaced(tmp_path, "job.yaml", "canvas{.eye}", "canvas")
    with pytest.raises(JobError, match=r"output.names.page: lacks \{.eye\}: both eyes"):
        load_job(job)


def test_a_page_may_not_have_a_facet_s_name(job, tmp_path):
    replaced(tmp_path, "job.yaml", "canvas/canvas{.eye}", "all/{page:04}{.eye}")
    replaced(tmp_path, "job.yaml", "{name}/{name}{.eye}", "all/{facet:04}{.eye}")
    with pytest.raises(JobError, match=re.escape("is the name of a page, too")):
        render(load_job(job), RenderOptions(dry_run=True))


def test_each_eye_may_have_a_folder(job, tmp_path, run):
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    replaced(tmp_path, "job.yaml", "canvas/canvas{.eye}", "{eye}/canvas")
    replaced(tmp_path, "job.yaml", "output:", "output:\n  facets: false")
    render(load_job(job), RenderOptions(frames=(1,)))
    pages = ["left/canvas.00001.exr", "right/canvas.00001.exr"]
    assert files_in(tmp_path / "out") == sorted([*pages, *SETTINGS])
    made = run("stereo", tmp_path / "out", "-o", tmp_path / "glasses", "--as", "anaglyph")
    assert made.exit_code == 0, made.output
    assert files_in(tmp_path / "glasses") == ["page_01.0001.exr"]
