"""Cameras of other programs' files and films, as pictures that are put on facets."""

import json
from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import JobError, OutputError
from quiltcli.exchange.elsewhere import MadeOptions
from quiltcli.exchange.project.cameras import Asked, read_camera
from quiltcli.exchange.project.master import Master
from quiltcli.exchange.project.project import project
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.formats.films import film_picture
from quiltcli.formats.pictures import to_linear
from quiltcli.formats.video import CODECS, film
from quiltcli.images.names import quilt_path
from quiltcli.job import load_job
from quiltcli.viewer.view import views_at
from tests.helpers.gltf_files import GltfFile
from tests.helpers.tiny_job import replaced, write_tiny_job


@pytest.fixture
def job(tmp_path):
    return write_tiny_job(tmp_path, "144, 72")


def camera(path, view, size=(200, 100), name="", fps=24.0):
    return read_camera(Asked(path, name, view, fps, size))


def exported(job, path):
    done = CliRunner().invoke(main, ["cameras", str(job), "-o", str(path)])
    assert done.exit_code == 0, done.output
    return path


@pytest.mark.parametrize("ending", ["usda", "usdc"])
def test_cameras_of_usd_are_those_of_json(job, tmp_path, ending):
    pytest.importorskip("pxr")
    files = [exported(job, tmp_path / f"cameras.{one}") for one in ("json", ending)]
    loaded = load_job(job)
    for view in (view for frame in (1, 3, 4) for view in views_at(loaded, frame)):
        one, other = (camera(path, view, name="back", fps=float(loaded.fps)) for path in files)
        np.testing.assert_allclose(other.lens.window, one.lens.window, rtol=1e-12)
        np.testing.assert_allclose(other.lens.axes, one.lens.axes, atol=1e-12)
        np.testing.assert_allclose(other.position, one.position, atol=1e-12)
        assert one.notice(view) == other.notice(view) == ""
    with pytest.raises(JobError, match=r"2 cameras, expected one \(--camera-name says which: back, right"):
        camera(files[1], view)
    with pytest.raises(JobError, match="has 0 cameras called 'bakc', expected one; did you mean back"):
        camera(files[1], view, name="bakc")


def test_apertures_of_usd_grow_to_the_picture(job, tmp_path):
    """A photographer's camera of 36 × 24 and 50 mm on a stage in centimetres with Z up."""
    pytest.importorskip("pxr")
    (tmp_path / "shot.usda").write_text(
        '#usda 1.0\n(metersPerUnit = 0.01\n upAxis = "Z"\n timeCodesPerSecond = 48)\n'
        'def Camera "hero" {\n float horizontalAperture = 36\n float verticalAperture = 24\n'
        " float horizontalApertureOffset = 3.6\n float focalLength = 50\n"
        " double3 xformOp:translate.timeSamples = { 2: (100, 0, 0), 4: (300, 0, 500) }\n"
        ' uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
    )
    (one,) = views_at(load_job(job), 2)
    found = camera(tmp_path / "shot.usda", one, (300, 200))
    np.testing.assert_allclose(found.lens.window, (-0.288, 0.432, -0.24, 0.24), rtol=1e-6)
    # The file's −Z, where a camera looks, is down.
    np.testing.assert_allclose(found.lens.axes, [[1, 0, 0], [0, 0, -1], [0, -1, 0]], atol=1e-12)
    np.testing.assert_allclose(found.position, [3, 5, 0], atol=1e-9)
    assert "its camera stands" in found.notice(one)
    wide = camera(tmp_path / "shot.usda", one, (400, 200)).lens.window
    np.testing.assert_allclose(wide, (-0.408, 0.552, -0.24, 0.24), rtol=1e-6)
    high = camera(tmp_path / "shot.usda", one, (300, 400)).lens.window
    np.testing.assert_allclose(high, (-0.288, 0.432, -0.48, 0.48), rtol=1e-6)


def test_eyes_choose_their_camera(job, tmp_path):
    pytest.importorskip("pxr")
    cameras = "".join(
        f'def Camera "{eye}" {{ token stereoRole = "{eye}"\n float focalLength = {focal}\n}}\n'
        for eye, focal in (("left", 30), ("right", 60))
    )
    (tmp_path / "pair.usda").write_text("#usda 1.0\n" + cameras)
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    left, right = (camera(tmp_path / "pair.usda", view).lens.window for view in views_at(load_job(job), 1))
    assert left[1] == pytest.approx(2 * right[1])


def shot(**more):
    """A file with a camera that is turned to the right by a quarter, below a node that rises."""
    file = GltfFile()
    lens = file.add("cameras", type="perspective", perspective={"yfov": np.pi / 2, "znear": 0.1, **more})
    half = np.sqrt(0.5)
    child = file.node(name="hero", camera=lens, rotation=[0, -half, 0, half], translation=[1, 0, 0])
    crane = file.node(name="crane", children=[child])
    file.animation(crane, "translation", [0, 1], [[0, 0, 0], [0, 2, 0]])
    file.json["scenes"], file.json["scene"] = [{"nodes": [crane]}], 0
    return file


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_cameras_of_gltf(job, tmp_path, ending):
    path = shot(aspectRatio=2).write(tmp_path / f"shot.{ending}")
    (view,) = views_at(load_job(job), 3)
    found = camera(path, view, fps=4.0)
    np.testing.assert_allclose(found.lens.window, (-2, 2, -1, 1), rtol=1e-12)
    np.testing.assert_allclose(found.lens.axes, [[0, 0, 1], [0, 1, 0], [1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.position, [1, 1, 0], atol=1e-9)
    with pytest.raises(JobError, match="2 times as wide as high, this is 300×200"):
        camera(path, view, (300, 200))


def test_what_is_no_camera_is_told(job, tmp_path):
    (view,) = views_at(load_job(job), 1)
    flat = GltfFile()
    flat.node(camera=flat.add("cameras", type="orthographic", orthographic={"xmag": 1}))
    with pytest.raises(JobError, match="node 0 is not a perspective camera"):
        camera(flat.write(tmp_path / "flat.gltf"), view)
    two = shot()
    two.node(name="other", camera=0)
    two.json["scenes"][0]["nodes"].append(2)
    path = two.write(tmp_path / "two.glb")
    with pytest.raises(JobError, match=r"2 cameras, expected one \(--camera-name says which: hero, other"):
        camera(path, view)
    assert camera(path, view, name="other").position.tolist() == [0, 0, 0]
    with pytest.raises(JobError, match="--camera-name names a camera of a file"):
        Master(path, "pinhole", fov=60, camera_name="hero").check()


def test_a_camera_elsewhere_is_worth_a_word(job, tmp_path):
    """The viewer of frame 1 stands at (0, 0, 2)."""
    record = {"right": [1, 0, 0], "up": [0, 1, 0], "forward": [0, 0, -1]}
    record["window"] = {"left": -2, "right": 2, "bottom": -2, "top": 2}
    write_exr(tmp_path / "m.exr", {c: np.ones((20, 20), np.float32) for c in "RGB"}, {})
    for place, told in (([0, 0, 2], False), ([0.3, 0, 2.4], True), (None, False)):
        given = record if place is None else {**record, "position": place}
        (tmp_path / "c.json").write_text(json.dumps(given))
        master = Master(tmp_path / "m.exr", "pinhole", camera=tmp_path / "c.json")
        options = MadeOptions(tmp_path / "out", (1,), overwrite=True)
        (made,) = project(load_job(job), master, options)
        assert any("its camera stands 0.5 m" in words for words in made.warnings) == told


@pytest.fixture
def clip(tmp_path):
    """Five pictures of one colour each, 24 a second."""
    pytest.importorskip("av")
    with film(tmp_path / "clip.mov", Fraction(24), CODECS["prores"]) as show:
        for k in range(5):
            show(np.full((48, 96, 3), (k + 1) * 10000, np.uint16))
    return tmp_path / "clip.mov"


def test_pictures_of_a_film_by_their_time(clip):
    for k in (0, 1, 4, 2):
        expected = to_linear(np.array([(k + 1) * 10000 / 65535]))[0]
        light = film_picture(clip, k / 24)
        assert light.shape == (48, 96, 4)
        np.testing.assert_allclose(light[..., :3], expected, rtol=0.01)
        assert (light[..., 3] == 1).all()
    between = film_picture(clip, 1.5 / 24, "linear")
    np.testing.assert_allclose(between[..., :3], 20000 / 65535, rtol=0.01)
    with pytest.raises(OutputError, match=r"has 5 pictures at 24 a second, and none at second 0\.208"):
        film_picture(clip, 5 / 24)
    assert film_picture(clip, 0)[0, 0, 0] > 0


def test_a_film_is_put_on_the_facets(job, clip, tmp_path):
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-4\nfps: 24")
    words = ["project", str(job), "--picture", str(clip), "--as", "equirect", "-o", str(tmp_path / "out")]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    for frame in (1, 4):
        page = read_exr(quilt_path(tmp_path / "out", 1, frame)).channels
        expected = to_linear(np.array([frame * 10000 / 65535]))[0]
        assert page["G"].astype(float).max() == pytest.approx(expected, rel=0.01)
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-9")
    words[-1] = str(tmp_path / "long")
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2
    assert "clip.mov: has 5 pictures at 24 a second, and none of frame 9" in done.output
    assert not (tmp_path / "long").exists()
    replaced(tmp_path, "job.yaml", "frames: 1-9\nfps: 24", "frames: 1-5\nfps: 30")
    (made, *_) = project(load_job(job), Master(clip, "equirect"), MadeOptions(tmp_path / "other"))
    assert "the film has 24 pictures a second, the job 30 frames: the nearest before" in made.warnings
    page = read_exr(quilt_path(tmp_path / "other", 1, 5)).channels
    assert page["G"].astype(float).max() == pytest.approx(to_linear(np.array([40000 / 65535]))[0], rel=0.01)
    (tmp_path / "no.mov").write_text("no film")
    words[3] = str(tmp_path / "no.mov")
    assert "is no film that can be read" in CliRunner().invoke(main, words).output
