"""Depth and other channels of pictures of facets: in the pages they are the job's."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import OutputError
from quiltcli.exchange.assemble import Source, assemble
from quiltcli.exchange.cameras.cameras import shots
from quiltcli.exchange.elsewhere import MadeOptions
from quiltcli.exchange.layers import layers_of
from quiltcli.formats.exr.image import read_exr, write_exr, write_images
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from tests.helpers.tiny_job import replaced, write_tiny_job

NAMES = {1: "back", 2: "right"}


@pytest.fixture(scope="module", params=["planar", "radial"])
def job(tmp_path_factory, request):
    """Its viewer looks along neither facet's axis."""
    folder = tmp_path_factory.mktemp("job")
    path = write_tiny_job(folder, "144, 72")
    how = f"frames: 4\nrender: {{depth: {request.param}}}\noutput: {{channels: [rgba, Z, object, N]}}"
    replaced(folder, "job.yaml", "frames: 1-4", how)
    replaced(folder, "job.yaml", "position: [-0.5, 0.2, 3], look_at: [0, 0, 0]",
             "position: [-0.5, 0.2, 3], look_at: [0.7, 0.3, 0]")  # fmt: skip
    return path


@pytest.fixture(scope="module")
def rendered(job):
    """Channels of each facet's image; (3, H, W) points its pixels see, relative to the eye; its camera."""
    render(load_job(job), RenderOptions(folder=job.parent / "own"))
    stage = set_stage(load_job(job), job.parent / "own")
    (view,) = stage.views([4])
    (shot,) = shots(stage.facets, [view])
    found = {}
    for camera in shot.cameras:
        channels = read_exr(facet_path(job.parent / "own", camera.facet, 4)).channels
        width, height = camera.pixels
        left, right, bottom, top = camera.window
        x = left + (right - left) * (np.arange(width) + 0.5) / width
        y = top - (top - bottom) * (np.arange(height)[:, None] + 0.5) / height
        d = np.stack((x + 0 * y, y + 0 * x, 1 + 0 * x + 0 * y))
        world = np.einsum("ji,jhw->ihw", camera.axes, d)
        depth = channels["Z"].astype(np.float64)
        if stage.job.render.depth == "radial":
            along = depth / np.linalg.norm(world, axis=0)
        else:
            along = depth / np.einsum("i,ihw->hw", view.viewer.look, world)
        found[camera.facet] = channels, along, np.linalg.norm(world, axis=0) * along
    assert sum(np.isfinite(channels["Z"]).sum() for channels, _, _ in found.values()) > 100
    return found


def put(folder, rendered, depth, name="Z", empty=np.inf, colours="{}"):
    """Pictures with depth along the camera's axis, or along the ray."""
    folder.mkdir(exist_ok=True)
    for facet, (channels, axis, ray) in rendered.items():
        far = {"axis": axis, "distance": ray, "job": channels["Z"]}[depth].astype(np.float32)
        layers = {colours.format(c): channels[c] for c in "RGBA"}
        layers[name] = np.where(np.isfinite(far), far, np.float32(empty))
        write_exr(folder / f"{NAMES[facet]}.0004.exr", layers, {})


CASES = [
    ("axis", None, "Z", np.inf, "{}"),
    ("axis", None, "ViewLayer.Depth.Z", 1e10, "ViewLayer.Combined.{}"),
    ("axis", "axis", "depth.V", 65504.0, "{}"),
    ("distance", "distance", "depth.Z", np.nan, "{}"),
    ("job", "job", "Z", 0.0, "{}"),
]


@pytest.mark.parametrize(("depth", "said", "name", "empty", "colours"), CASES)
def test_depth_becomes_that_of_the_job(job, rendered, tmp_path, depth, said, name, empty, colours):
    put(tmp_path / "pictures", rendered, depth, name, empty, colours)
    source = Source(tmp_path / "pictures", depth=said)
    assemble(load_job(job), source, MadeOptions(tmp_path / "got"))
    for facet, (channels, _, _) in rendered.items():
        got = read_exr(facet_path(tmp_path / "got", facet, 4))
        assert sorted(got.channels) == ["A", "B", "G", "R", "Z"]
        np.testing.assert_allclose(got.channels["Z"], channels["Z"], rtol=3e-7)
        np.testing.assert_array_equal(got.channels["G"], channels["G"])
    own, page = (
        read_exr(quilt_path(out, 1, 4)).channels["Z"] for out in (job.parent / "own", tmp_path / "got")
    )
    both = np.isfinite(own) & np.isfinite(page)
    np.testing.assert_allclose(page[both], own[both], rtol=3e-7)
    assert both.sum() == np.isfinite(page).sum()


def test_all_the_jobs_channels_of_its_own_images_come_back(job, rendered, tmp_path):
    source = Source(job.parent / "own/facets", "facet_{facet:04}.{frame:04}")
    assemble(load_job(job), source, MadeOptions(tmp_path / "got"))
    for facet, (channels, _, _) in rendered.items():
        got = read_exr(facet_path(tmp_path / "got", facet, 4)).channels
        assert sorted(got) == sorted(channels)
        for name, pixels in channels.items():
            np.testing.assert_array_equal(got[name], pixels, err_msg=name)


def test_parts_hold_layers_too(job, rendered, tmp_path):
    put(tmp_path / "pictures", rendered, "axis")
    for path in (tmp_path / "pictures").iterdir():
        image = read_exr(path)
        light = {c: image.channels[c] for c in "RGBA"}
        parts = {"light": light, "depth": {"Depth.Z": image.channels["Z"]}}
        write_images(path, [replace(image, channels=parts[name], name=name) for name in parts])
    assert layers_of(path, ("rgba", "Z", "N")) == ("Z",)
    assemble(load_job(job), Source(tmp_path / "pictures"), MadeOptions(tmp_path / "got"))
    for facet, (channels, _, _) in rendered.items():
        got = read_exr(facet_path(tmp_path / "got", facet, 4)).channels["Z"]
        np.testing.assert_allclose(got, channels["Z"], rtol=3e-7)


def test_a_picture_without_what_the_first_one_has_is_told(job, rendered, tmp_path):
    put(tmp_path / "pictures", rendered, "axis")
    path = tmp_path / "pictures/right.0004.exr"
    write_exr(path, {c: rendered[2][0][c] for c in "RGBA"}, {})
    with pytest.raises(OutputError, match=r"right\.0004\.exr: lacks Z, which the first picture has"):
        assemble(load_job(job), Source(tmp_path / "pictures"), MadeOptions(tmp_path / "got"))
    assert not (tmp_path / "got").exists()
    words = ["assemble", str(job), "--from", str(tmp_path / "pictures"), "-o", str(tmp_path / "got")]
    done = CliRunner().invoke(main, [*words, "--set", "output.channels=[rgba]"])
    assert done.exit_code == 0, done.output
    assert sorted(read_exr(quilt_path(tmp_path / "got", 1, 4)).channels) == ["A", "B", "G", "R"]
