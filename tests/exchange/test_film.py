"""Films and numbered pictures of a render's images."""

import numpy as np
import OpenImageIO
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import JobError, OutputError
from quiltcli.exchange.film.film import FilmOptions, make_film
from quiltcli.exchange.film.reels import reels_of
from quiltcli.formats.exr.image import write_exr
from quiltcli.images.grade import Grade, graded
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.images.preview import srgb
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import files_in, replaced, write_tiny_job

CARD = np.array([[[0.8, 0.3, 0.1], [0.1, 0.6, 0.9]], [[0, 1, 5], [0.02, 0.002, 0]]], dtype=np.float32)


def put(path, light, fps=25):
    path.parent.mkdir(parents=True, exist_ok=True)
    channels = {c: np.ascontiguousarray(light[..., k], np.float16) for k, c in enumerate("RGB")}
    write_exr(path, channels, {"framesPerSecond": fps})


@pytest.fixture
def out(tmp_path):
    """Two pages and two facets of frames 9 and 10; facet 2 is dark in frame 10."""
    out, card = tmp_path / "out", CARD.repeat(32, axis=0).repeat(48, axis=1)
    for frame in (9, 10):
        for number in (1, 2):
            put(quilt_path(out, number, frame), card * (1 if frame == 9 else 0.5))
            if (number, frame) != (2, 10):
                put(facet_path(out, number, frame), card[:40] * number / 2)
    return out


def read(path):
    file = OpenImageIO.ImageInput.open(str(path))
    spec = file.spec()
    pixels = np.asarray(file.read_image("uint16")).reshape(spec.height, spec.width, spec.nchannels)
    file.close()
    return pixels, spec


def test_the_default_view_is_the_curve_of_srgb_cut_at_white():
    for depth in (8, 10, 16):
        top = 2**depth - 1
        expected = np.rint(srgb(CARD).astype(np.float64) * top)
        assert np.abs(graded(CARD, Grade(), depth) - expected).max() <= (0 if depth == 8 else 2)


def test_views_are_those_of_the_configuration():
    shown = graded(CARD, Grade(view="ACES 1.0 - SDR Video"), 8)
    assert not np.array_equal(shown, graded(CARD, Grade(), 8))
    assert np.array_equal(graded(CARD, Grade(exposure=1), 8), graded(CARD * 2, Grade(), 8))
    with pytest.raises(JobError, match=r"--view: .* \(did you mean 'Un-tone-mapped'\?\)"):
        Grade(view="Un-tone-maped").check()
    with pytest.raises(JobError, match=r"--display: .* it has: sRGB - Display"):
        Grade(display="Cinema").check()
    with pytest.raises(JobError, match=r"there is no such colour configuration"):
        Grade(config="ocio://nothing").check()


@pytest.mark.parametrize(
    ("codec", "bits", "ending", "stored"),
    [("png", 8, "png", 8), ("png", 16, "png", 16), ("tiff", 16, "tif", 16), ("dpx", 8, "dpx", 10)],
)
def test_numbered_pictures(out, tmp_path, codec, bits, ending, stored):
    folders = make_film(out, tmp_path / "f", FilmOptions(codec=codec, bits=bits))
    assert folders == [tmp_path / "f/page_01", tmp_path / "f/page_02"]
    names = [f"page_0{page}/page_0{page}.00{frame:02}.{ending}" for page in (1, 2) for frame in (9, 10)]
    assert files_in(tmp_path / "f") == names
    pixels, spec = read(tmp_path / "f" / names[0])
    assert pixels.shape == (64, 96, 3)
    assert spec.get_int_attribute("oiio:BitsPerSample", 8 * spec.format.size()) == stored
    top = 2**stored - 1
    stored_light = CARD.astype(np.float16).astype(np.float32)
    expected = np.rint(srgb(stored_light).astype(np.float64) * top) / top
    corners = pixels[::32, ::48] / 65535
    np.testing.assert_allclose(corners, expected, atol=1.5 / top)
    make_film(out, tmp_path / "g", FilmOptions(codec=codec, bits=bits))
    for name in names:
        assert (tmp_path / "f" / name).read_bytes() == (tmp_path / "g" / name).read_bytes()


FILMS = [
    ("a.mov", None, "prores", "apch"),
    ("a.mp4", None, "h264", "avc1"),
    ("a.mp4", "h265", "hevc", "hvc1"),
    ("a.mov", "hap", "hap", "Hap1"),
    ("a.mov", "dxv", "dxv", "DXD3"),
]


@pytest.mark.parametrize(("name", "codec", "codecs_name", "tag"), FILMS)
def test_films(out, tmp_path, name, codec, codecs_name, tag):
    av = pytest.importorskip("av")
    for page in out.glob("quilt/page_02*"):
        page.unlink()
    make_film(out, tmp_path / name, FilmOptions(codec=codec))
    with av.open(str(tmp_path / name)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.codec_tag) == (codecs_name, tag)
        assert (stream.width, stream.height, stream.average_rate) == (96, 64, 25)
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 2
    np.testing.assert_allclose(frames[0][10, 10] / 255, srgb(CARD)[0, 0], atol=0.03)
    np.testing.assert_allclose(frames[1][10, 10] / 255, srgb(CARD / 2)[0, 0], atol=0.03)


def test_dnxhr_needs_pictures_of_some_size(out, tmp_path):
    av = pytest.importorskip("av")
    with pytest.raises(OutputError, match=r"dnxhd takes pictures of 256×120 pixels or more"):
        make_film(out, tmp_path / "f", FilmOptions(codec="dnxhr"))
    put(tmp_path / "big/quilt/page_01.0001.exr", np.full((120, 256, 3), 0.5))
    make_film(tmp_path / "big", tmp_path / "a.mov", FilmOptions(codec="dnxhr"))
    with av.open(str(tmp_path / "a.mov")) as container:
        assert container.streams.video[0].codec_context.name == "dnxhd"


def test_dxv_takes_sizes_in_sixteens(tmp_path):
    pytest.importorskip("av")
    put(tmp_path / "o/quilt/page_01.0001.exr", np.full((68, 128, 3), 0.5))
    with pytest.raises(OutputError, match=r"in multiples of 16, and this is 128×68 pixels"):
        make_film(tmp_path / "o", tmp_path / "a.mov", FilmOptions(codec="dxv"))
    assert not (tmp_path / "a.mov").exists()


def test_a_facet_that_was_left_out_is_black_and_told(out, tmp_path):
    said = []
    options = FilmOptions(subject="facets", codec="png")
    folders = make_film(out, tmp_path / "f", options, said.append)
    assert [folder.name for folder in folders] == ["facet_0001", "facet_0002"]
    assert not read(folders[1] / "facet_0002.0010.png")[0].any()
    assert read(folders[1] / "facet_0002.0009.png")[0].any()
    assert "1 of them black, for which there is no image" in said[1]
    assert "black" not in said[0]


def test_what_cannot_be_filmed(out, tmp_path):
    for words, path, options in (
        (
            r"is one film, and there are 2 sequences \(expected a folder, and --codec prores\)",
            "a.mov",
            FilmOptions(),
        ),
        (r"does not say what is wanted", "a.avi", FilmOptions()),
        (r"must end in \.mov for hap", "a.mp4", FilmOptions(codec="hap")),
        (r"has no pages of frames 3 \(it has 9-10\)", "f", FilmOptions(codec="png", frames=(3,))),
    ):
        with pytest.raises(OutputError, match=words):
            make_film(out, tmp_path / path, options)
    make_film(out, tmp_path / "f", FilmOptions(codec="png"))
    with pytest.raises(OutputError, match=r"exists already \(use --overwrite"):
        make_film(out, tmp_path / "f", FilmOptions(codec="png"))
    put(quilt_path(out, 1, 14), CARD)
    with pytest.raises(OutputError, match=r"lacks frames 11-13 between others"):
        reels_of(out, "page")
    with pytest.raises(OutputError, match=r"page 2 has no image of frames 14, others have"):
        reels_of(out, "page", (9, 14))
    quilt_path(out, 2, 10).unlink()
    with pytest.raises(OutputError, match=r"has no images of pages"):
        reels_of(tmp_path, "page")


def test_both_eyes_and_the_simulation(tmp_path):
    pytest.importorskip("av")
    job = write_tiny_job(tmp_path, "144, 72")
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    render(load_job(job), RenderOptions(frames=(1, 2)))
    run = CliRunner()
    for words, names in (
        (["--codec", "h264"], ["page_01.left.mp4", "page_01.right.mp4"]),
        (["--of", "simulation", "--size", "48x36", "-f", "1", "--codec", "prores"],
         ["simulation.left.mov", "simulation.right.mov"]),
        (["--of", "facets", "-f", "1", "--codec", "hap"],
         [f"{name}.{eye}.mov" for name in ("back", "right") for eye in ("left", "right")]),
    ):  # fmt: skip
        folder = tmp_path / words[-1]
        done = run.invoke(main, ["film", str(tmp_path / "out"), "-o", str(folder), *words])
        assert done.exit_code == 0, done.output
        assert files_in(folder) == names
        assert all(str(folder / name) in done.output for name in names)


def test_a_spinning_mirror_is_told_from_a_folder_without_pictures(tmp_path):
    (tmp_path / "none").mkdir()
    with pytest.raises(OutputError, match="has no images of pages"):
        make_film(tmp_path / "none", tmp_path / "a.mp4", FilmOptions())
    (tmp_path / "report.json").write_text('{"kind": "lightfield360", "frames": []}')
    with pytest.raises(OutputError, match="is of a spinning mirror"):
        make_film(tmp_path, tmp_path / "a.mp4", FilmOptions())
