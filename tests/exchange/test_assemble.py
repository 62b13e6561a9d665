"""Pictures of facets made elsewhere, put into pages."""

import os

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.cli import main
from quiltcli.errors import JobError, OutputError
from quiltcli.exchange.assemble import Source, assemble
from quiltcli.exchange.elsewhere import MadeOptions
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.formats.pictures import to_linear
from quiltcli.images.facets import facet_image, lay_facet
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.job import load_job
from quiltcli.layout import pixel_owners
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import replaced, write_tiny_job
from tests.helpers.turned_layout import turned_layout


@pytest.fixture
def job(tmp_path):
    return write_tiny_job(tmp_path, "144, 72")


def put(folder, job, frames=(1, 2), eyes=("",), change=lambda light: light):
    """What a render of the job writes, under the names another renderer gives it."""
    render(load_job(job), RenderOptions(frames=frames, folder=job.parent / "own"))
    folder.mkdir()
    for frame in frames:
        for eye in eyes:
            for facet, name in ((1, "back"), (2, "right")):
                image = read_exr(facet_path(job.parent / "own", facet, frame, eye))
                channels = {c: change(image.channels[c]) for c in "RGBA"}
                write_exr(folder / f"{name}{eye and '.' + eye}.{frame:04}.exr", channels, {})


@pytest.mark.parametrize("turned", [False, True])
def test_pictures_come_back_as_pages_to_the_bit(job, tmp_path, turned):
    if turned:
        spots = "facets: {1: {place: {at: [0, 0], rotate: 90}}, 2: {place: {at: [70, 2], rotate: 180}}}\n"
        replaced(tmp_path, "display.yaml", "resolution", spots + "resolution")
    put(tmp_path / "pictures", job)
    options = MadeOptions(tmp_path / "got", frames=(1, 2))
    records = assemble(load_job(job), Source(tmp_path / "pictures"), options)
    assert [record.frame for record in records] == [1, 2]
    for frame in (1, 2):
        for path in (quilt_path, facet_path):
            own, got = (read_exr(path(tmp_path / out, 1, frame)) for out in ("own", "got"))
            inside = True
            if path is quilt_path:  # a render draws in the bleed what is there
                inside = read_owners(tmp_path) > 0
            for name in "RGBA":
                assert np.array_equal(own.channels[name] * inside, got.channels[name] * inside)
            kept, told = map(without_job, (own, got))
            assert str(told) == str(kept)
            assert got.attributes["quilt:made"] == "assemble"


def without_job(image):
    return {
        name: value for name, value in image.attributes.items() if name not in ("quilt:job", "quilt:made")
    }


def read_owners(folder):
    from quiltcli.layout import read_layout

    layout = read_layout(folder / "own/layout.yaml")
    return pixel_owners(layout, 2).reshape(layout.pages[0][::-1])


def test_the_bleed_repeats_the_edge():
    layout = turned_layout()
    owners = pixel_owners(layout, 3)
    rng = np.random.default_rng(1)
    flat = {"R": np.zeros(owners.size, np.float32)}
    for row in np.flatnonzero(layout.page >= 0).tolist():
        width, height = layout.size[row]
        image = {"R": rng.uniform(1, 2, (height, width)).astype(np.float32)}
        lay_facet(flat, image, layout, row, owners, 3)
        cut = facet_image(flat, layout, row, owners)["R"]
        mine = cut > 0
        assert np.array_equal(cut[mine], image["R"][mine])
        bleed = flat["R"][owners == -layout.facet[row]]
        assert bleed.size
        assert np.isin(bleed, image["R"]).all()
    assert ((flat["R"] > 0) == (owners != 0)).all()


def test_what_comes_of_it_works_like_a_render(job, tmp_path):
    put(tmp_path / "pictures", job)
    run = CliRunner()
    words = ["assemble", job, "--from", tmp_path / "pictures", "-o", tmp_path / "got", "-f", "1-2"]
    done = run.invoke(main, list(map(str, words)))
    assert done.exit_code == 0, done.output
    assert f"2 views written to {tmp_path / 'got'}" in done.output
    again = run.invoke(main, list(map(str, words)))
    assert again.exit_code == 2
    assert "exists already" in again.output
    for words in (
        ["simulate", tmp_path / "got/job.yaml", "-f", "1", "--size", "48x36", "-o", tmp_path / "eye.png"],
        ["contact", tmp_path / "got", "-o", tmp_path / "sheet.png"],
        ["info", tmp_path / "got"],
        ["view", tmp_path / "got", "-o", tmp_path / "page.html"],
    ):
        done = run.invoke(main, list(map(str, words)))
        assert done.exit_code == 0, done.output
        if words[0] == "simulate":
            assert f"read from {tmp_path / 'got'}" in done.output


def test_two_eyes(job, tmp_path):
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    put(tmp_path / "pictures", job, frames=(1,), eyes=("left", "right"))
    assemble(load_job(job), Source(tmp_path / "pictures"), MadeOptions(tmp_path / "got", frames=(1,)))
    for eye in ("left", "right"):
        own, got = (read_exr(facet_path(tmp_path / out, 1, 1, eye)) for out in ("own", "got"))
        assert np.array_equal(own.channels["R"], got.channels["R"])
        assert got.attributes["view"] == eye
    with pytest.raises(JobError, match=r"--pattern: .* lacks {.eye} or {eye}: there are two eyes"):
        assemble(load_job(job), Source(tmp_path, "{name}.####.exr"), MadeOptions(tmp_path / "x"))


def test_png_with_other_names_over_a_background(job, tmp_path):
    replaced(tmp_path, "scene.yaml", "quilt_scene: 1", "quilt_scene: 1\nbackground: [0.5, 0, 0]")
    (tmp_path / "pictures").mkdir()
    size = (64, 64)
    pixels = np.zeros((*size, 4), np.uint8)
    pixels[:, 32:] = [0, 188, 0, 255]
    for facet in (1, 2):
        Image.fromarray(pixels).save(tmp_path / f"pictures/shot_0007_{facet}.png")
    source = Source(tmp_path / "pictures", "shot_####_{facet}.png")
    assemble(load_job(job), source, MadeOptions(tmp_path / "got", frames=(7,)))
    image = read_exr(facet_path(tmp_path / "got", 1, 7)).channels
    assert image["R"][5, 5] == 0.5
    assert image["A"][5, 5] == 0
    assert image["G"][5, 40] == np.float16(to_linear(np.float64(188 / 255)))
    assert image["R"][5, 40] == 0


def test_every_wrong_picture_is_told(job, tmp_path):
    put(tmp_path / "pictures", job)
    loaded, options = load_job(job), MadeOptions(tmp_path / "got", frames=(1, 2))
    small = {c: np.zeros((3, 5), np.float16) for c in "RGB"}
    write_exr(tmp_path / "pictures/right.0001.exr", small, {})
    (tmp_path / "pictures/back.0002.exr").unlink()
    (tmp_path / "pictures/right.0002.exr").write_bytes(b"no")
    with pytest.raises(OutputError) as caught:
        assemble(loaded, Source(tmp_path / "pictures"), options)
    said = str(caught.value)
    assert "right.0001.exr: is 5×3 pixels, facet 2 (right) is 64×64" in said
    assert "back.0002.exr: no such picture of facet 1 (back), frame 2" in said
    assert "right.0002.exr" in said
    assert not (tmp_path / "got").exists()
    with pytest.raises(OutputError, match=r"has no picture called back\.0003\.exr"):
        assemble(loaded, Source(tmp_path / "pictures"), MadeOptions(tmp_path / "got", frames=(3, 4)))
    with pytest.raises(OutputError, match=r"nowhere: is no folder"):
        assemble(loaded, Source(tmp_path / "nowhere"), options)


def test_pictures_older_than_the_cameras_are_refused(job, tmp_path):
    put(tmp_path / "pictures", job, frames=(1,))
    cameras = tmp_path / "cameras.json"
    cameras.touch()
    loaded, options = load_job(job), MadeOptions(tmp_path / "got", frames=(1,))
    os.utime(cameras, (1e9, 1e9))
    os.utime(tmp_path / "pictures/back.0001.exr", (1e9 - 9, 1e9 - 9))
    with pytest.raises(OutputError, match=r"^\S+back\.0001\.exr: is older than \S+cameras\.json"):
        assemble(loaded, Source(tmp_path / "pictures", cameras=cameras), options)
    os.utime(tmp_path / "pictures/back.0001.exr", (1e9 + 9, 1e9 + 9))
    assemble(loaded, Source(tmp_path / "pictures", cameras=cameras), options)


def test_missing_pictures_may_be_dark(job, tmp_path):
    put(tmp_path / "pictures", job, frames=(1,))
    (tmp_path / "pictures/right.0001.exr").unlink()
    source = Source(tmp_path / "pictures", lenient=True)
    record = assemble(load_job(job), source, MadeOptions(tmp_path / "got", frames=(1,)))[0]
    assert record.warnings == ("there is no picture of facet 2 (right): dark",)
    dark = read_exr(facet_path(tmp_path / "got", 2, 1))
    assert not any(channel.any() for channel in dark.channels.values())
