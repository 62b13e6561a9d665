"""A colour for each light, as a table, as bytes and as universes of DMX."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import OutputError
from quiltcli.exchange.points import Wiring, lights_of, write_colors
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.preview import Look, display_values
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import write_tiny_job

RAW = Look("raw")


def quad(x: float, y: float, z: float, half: float) -> str:
    return "".join(f"v {x + a * half} {y + b * half} {z}\n" for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)))


def rendered(tmp_path: Path, points: list, columns: int = 5, frames: str = "1-2") -> Path:
    """A render of lights before a red square and a half-bright green one, on black, with fixed colours."""
    (tmp_path / "leds.json").write_text(json.dumps(points))
    (tmp_path / "display.yaml").write_text(
        f"quilt_display: 1\npoints: {{file: leds.json, columns: {columns}, size: 1 mm}}\n"
    )
    (tmp_path / "red.obj").write_text(quad(-1, 0, -1, 0.5) + "f 1 2 3 4\n")
    (tmp_path / "green.obj").write_text(quad(1, 0, -1, 0.5) + "f 1 2 3 4\n")
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n"
        "- {mesh: red.obj, material: {color: [1, 0, 0], unlit: true}}\n"
        "- {mesh: green.obj, material: {color: [0, 0.5, 0], unlit: true}}\n"
    )
    (tmp_path / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: {frames}\n"
        "viewer:\n  near: 0.1\n  far: 500\n"
        "  path: {keyframes: [{frame: 1, position: [0, 0, 100], look_at: [0, 0, 0]}]}\n"
        "render: {bleed: 0}\noutput: {facets: false}\n"
    )
    render(load_job(tmp_path / "job.yaml"), RenderOptions(folder=tmp_path / "out"))
    return tmp_path / "out"


# Far from the eye a light shows what is behind it: red, green, nothing.
POINTS = [[-1, 0, 0], [1, 0, 0], [0, 0, 0], None, [1, 0.3, 0], [-1, -0.3, 0], [-1.2, 0, 0]]
COLORS = [(255, 0, 0), (0, 128, 0), (0, 0, 0), (0, 0, 0), (0, 128, 0), (255, 0, 0), (255, 0, 0)]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rendered(tmp_path_factory.mktemp("points"), POINTS)


def test_lights_are_those_of_the_list(out: Path) -> None:
    lights = lights_of(out)
    assert lights.number.tolist() == [0, 1, 2, 4, 5, 6]
    assert lights.count == 7
    np.testing.assert_allclose(lights.place, [p for p in POINTS if p], atol=1e-9)


def test_bytes_are_the_colours_in_the_order_of_the_list_frame_after_frame(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.rgb", Wiring(RAW))
    assert path.read_bytes() == bytes(v for color in COLORS for v in color) * 2
    files, _ = write_colors(out, tmp_path / "new" / "c.####.rgb", Wiring(RAW), frames=[2])
    assert [file.name for file in files] == ["c.0002.rgb"]
    assert files[0].read_bytes() == path.read_bytes()[:21]


def test_channels_come_in_the_order_that_is_asked_for(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.rgb", Wiring(RAW, order="grb"), frames=[1])
    assert path.read_bytes()[:6] == bytes([0, 255, 0, 128, 0, 0])


def test_sixteen_bits_have_the_high_byte_first(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.rgb", Wiring(Look("raw", depth=16)), frames=[1])
    assert path.read_bytes()[:12] == bytes([255, 255, 0, 0, 0, 0, 0, 0, 0x80, 0, 0, 0])
    assert len(path.read_bytes()) == 42


def test_universes_are_512_channels_each(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.dmx", Wiring(RAW, per_universe=3), frames=[1])
    block = np.frombuffer(path.read_bytes(), np.uint8).reshape(3, 512)
    values = np.array([*COLORS, (0, 0, 0), (0, 0, 0)], np.uint8).reshape(3, 9)
    assert (block[:, :9] == values).all()
    assert not block[:, 9:].any()


def test_a_universe_holds_170_lights_of_three_channels(tmp_path: Path) -> None:
    points = [[-1 + 2 * (k % 2), 0, 0] for k in range(171)]
    folder = rendered(tmp_path, points, columns=170, frames="1")
    (path,), lights = write_colors(folder, tmp_path / "c.dmx", Wiring(RAW))
    block = np.frombuffer(path.read_bytes(), np.uint8).reshape(2, 512)
    assert lights.count == 171
    assert block[0, 507:].tolist() == [0, 128, 0, 0, 0]
    assert block[1, :6].tolist() == [255, 0, 0, 0, 0, 0]


def test_a_table_says_where_each_light_is_and_which_channel_it_has(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.csv", Wiring(RAW, universe=7, per_universe=4))
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert len(rows) == 12
    first = {"frame": "1", "point": "1", "x": "-1", "y": "0", "z": "0", "universe": "7", "channel": "1"}
    assert rows[0] == {**first, "r": "255", "g": "0", "b": "0"}
    assert [(r["frame"], r["point"], r["universe"], r["channel"]) for r in rows[3:7]] == [
        ("1", "5", "8", "1"),
        ("1", "6", "8", "4"),
        ("1", "7", "8", "7"),
        ("2", "1", "7", "1"),
    ]


def test_light_becomes_values_by_the_view(out: Path, tmp_path: Path) -> None:
    (path,), _ = write_colors(out, tmp_path / "c.rgb", Wiring(Look("srgb", exposure=-1.0)), frames=[1])
    light = np.array([[[0.5, 0, 0], [0, 0.25, 0]]], np.float32)
    assert list(path.read_bytes()[:6]) == display_values(light, Look("srgb")).reshape(-1).tolist()


@pytest.mark.parametrize("moved", [False, True])
def test_a_page_wider_than_the_list_has_columns_is_no_matter(tmp_path: Path, moved: bool) -> None:
    """The display says which number each has; where that is gone, the page's pixels are taken for them."""
    rendered(tmp_path, POINTS, columns=5, frames="1")
    job = load_job(tmp_path / "job.yaml", ("layout={size: [9, 4]}",))
    render(job, RenderOptions(folder=tmp_path / "wide"))
    if moved:
        (tmp_path / "leds.json").unlink()
    (path,), lights = write_colors(tmp_path / "wide", tmp_path / "c.rgb", Wiring(RAW))
    if moved:
        assert lights.number.tolist() == [0, 1, 2, 4, 9, 10]
        return
    assert lights.number.tolist() == [0, 1, 2, 4, 5, 6]
    assert path.read_bytes() == bytes(v for color in COLORS for v in color)


def test_samples_are_the_mean_over_a_light(tmp_path: Path) -> None:
    """A light of 1 mm on the edge of the red square: half of it shows red."""
    points = [[-0.5, 0, -1 + 1e-9], [-1, 0, 0], [3, 2, -4]]
    rendered(tmp_path, points, frames="1")
    job = load_job(tmp_path / "job.yaml", ("render.samples=64",))
    render(job, RenderOptions(folder=tmp_path / "many"))
    red = read_exr(tmp_path / "many" / "quilt" / "page_01.0001.exr").channels["R"][0]
    assert red[0] == pytest.approx(0.5, abs=0.05)
    assert red[1] == 1


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("-o", "c.txt"), "c.txt: expected a name that ends in .csv, .rgb, .dmx"),
        (("-o", "c.rgb", "--order", "rgw"), "--order: expected rgb, rbg, grb, gbr, brg, bgr, got 'rgw'"),
        (("-o", "c.dmx", "--per-universe", "171"), "expected 1 to 170 lights of 3 channels, got 171"),
        (("-o", "c.dmx", "--bits", "16", "--per-universe", "86"), "expected 1 to 85 lights of 6 channels"),
        (("-o", "c.dmx", "--universe", "64000"), "7 points end in universe 64,000 (there are 63,999)"),
        (("-o", "c.rgb", "-f", "9"), "has no pages of frames 9 (it has 1-2)"),
        (("-o", "c.rgb", "--eye", "left"), "has no pages of the left eye (it has one eye)"),
    ],
)  # fmt: skip
def test_what_cannot_be_written_is_told(out: Path, tmp_path: Path, words: tuple, complaint: str) -> None:
    words = tuple(str(tmp_path / word) if word.startswith("c.") else word for word in words)
    done = CliRunner().invoke(main, ["points", str(out), *words])
    assert done.exit_code == 2
    assert complaint in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_render_of_facets_is_no_render_of_points(tmp_path: Path) -> None:
    render(load_job(write_tiny_job(tmp_path, "144, 72"), ("frames=1",)), RenderOptions(folder=tmp_path / "o"))
    with pytest.raises(OutputError, match=r"is no render of points: facet 1 is 64 × 64 pixels on page 1"):
        write_colors(tmp_path / "o", tmp_path / "c.csv")
    with pytest.raises(OutputError, match=r"has no layout.yaml"):
        write_colors(tmp_path, tmp_path / "c.csv")


def test_the_command_says_what_it_wrote(out: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(
        main, ["points", str(out), "-o", str(tmp_path / "c.dmx"), "--per-universe", "5"]
    )
    assert done.exit_code == 0
    assert done.stdout == f"{tmp_path / 'c.dmx'}\n"
    assert done.stderr == "6 points, universes 1 to 2\n"
