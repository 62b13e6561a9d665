from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.analysis.simulate.compare import compare, figures, flip_map, heat_map, heat_scale, seam_pixels
from quiltcli.analysis.simulate.images import shown_images
from quiltcli.analysis.simulate.lookup import Shown, look_up, nearest_pixels, quilt_places
from quiltcli.analysis.simulate.picture import displayed_light, picture_rays, visible_facets, with_channels
from quiltcli.cli import main
from quiltcli.job import load_job
from quiltcli.layout import pixel_owners
from quiltcli.projection.camera import camera_display
from quiltcli.render.sequence import render
from quiltcli.render.setup import set_stage
from quiltcli.viewer.view import views_at
from tests.helpers.even_light import COLOR, CYLINDER, WALLS, even_job
from tests.helpers.flat_displays import PITCH, flat_display, moved, placed, rectangle

MODELS = Path(__file__).parents[2] / "display_models"


def soup(path: Path, centre: tuple[float, float, float], spread: float) -> None:
    """Triangles of any colour in any direction, so that edges cross the seams everywhere alike."""
    rng = np.random.default_rng(7)
    points = rng.uniform(-1, 1, (400, 1, 3)) * spread + rng.normal(size=(400, 3, 3)) * spread * 0.2 + centre
    lines = ["ply", "format ascii 1.0", "element vertex 1200"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines += ["element face 400", "property list uchar int vertex_indices", "end_header"]
    colors = np.repeat(rng.integers(20, 255, (400, 3)), 3, axis=0)
    lines += [
        f"{x:.6f} {y:.6f} {z:.6f} {r} {g} {b}"
        for (x, y, z), (r, g, b) in zip(points.reshape(-1, 3), colors, strict=True)
    ]
    lines += [f"3 {k} {k + 1} {k + 2}" for k in range(0, 1200, 3)]
    path.write_text("\n".join(lines) + "\n")


def job(folder: Path, model: str, pixels: str, *sets: str):
    """A job with the soup behind the faces of a display model, of a resolution that keeps it quick."""
    soup(folder / "soup.ply", (0, 0.15, 0), 0.22)
    (folder / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects: [{mesh: soup.ply, material: {unlit: true}}]\nbackground: [0.1, 0.2, 0.3]\n"
    )
    (folder / "display.yaml").write_text(
        f"quilt_display: 1\nmesh: {MODELS / model}.obj\nresolution: {{pixels_per_metre: {pixels}}}\n"
    )
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1-2\n"
        "viewer: {near: 0.05, far: 10, path: {keyframes: ["
        "{frame: 1, position: [0.5, 0.7, 0.9], look_at: [0, 0.15, 0]}]}}\n"
    )
    return load_job(folder / "job.yaml", sets)


@pytest.mark.parametrize("model", ["cube5", "sphere840"])
def test_from_the_eye_the_display_is_the_scene(tmp_path, model):
    options = PictureOptions(size=(360, 270), samples=3)
    (result,) = simulate(job(tmp_path, model, "2000"), [1], options)
    found = result.comparison
    assert 0.3 < found.share < 0.9
    assert found.mean < 0.006
    assert found.percentile_99 < 0.12
    assert found.psnr > 34
    assert found.flip < 0.03
    assert math.isnan(found.seams_alone)  # it was not asked for


def test_no_error_at_all_where_the_scene_is_even(tmp_path):
    (result,) = simulate(job(tmp_path, "cube5", "500", "viewer.near=5"), [1], PictureOptions((90, 60)))
    assert result.comparison.maximum < 1e-6
    assert result.comparison.psnr > 120
    assert math.isnan(result.comparison.seams)


def test_nearest_shows_exactly_the_pixel_it_names(tmp_path):
    stage = set_stage(with_channels(job(tmp_path, "cube5", "600"), ("rgba",)))
    view = views_at(stage.job, 1)[0]
    viewer = view.viewer
    shown, _ = shown_images(stage, view, tmp_path / "none", "", 1)
    through = camera_display(viewer, 160, 120, 50)
    facet = visible_facets(stage, viewer, through, 1)
    light, lit = displayed_light(shown, viewer, through, facet, "nearest")
    pixel = np.flatnonzero(lit)
    assert pixel.size > 3000
    # By another way: to the facet's plane in the world, and from there to facet and quilt pixels.
    rays = picture_rays(viewer, through, pixel).T
    f = facet[pixel]
    normal = stage.facets.normal[f]
    away = ((stage.facets.origin[f] - viewer.eye) * normal).sum(1) / (rays * normal).sum(1)
    local = viewer.eye + rays * away[:, None] - stage.facets.origin[f]
    steps = [step[f] for step in (stage.facets.du, stage.facets.dv)]
    ij = np.stack([(local * step).sum(1) / (step * step).sum(1) for step in steps])
    maps = stage.layout.quilt_from_facet[f]
    x, y = np.floor([(maps[:, k, 0] * ij[0] + maps[:, k, 1] * ij[1] + maps[:, k, 2]) for k in (0, 1)]).astype(
        int
    )
    address = (
        stage.layout.page_offset[stage.layout.page[f]] + y * stage.layout.pages[stage.layout.page[f], 0] + x
    )
    expected = np.stack([shown.buffers[name][address].astype(np.float32) for name in "RGB"])
    assert (light[:, pixel] == expected).all()


def tiny():
    """Two facets of 4 × 3 pixels beside each other on one page; red is the address."""
    facets = flat_display([rectangle(4, 3)] * 2)
    layout = placed(facets, [moved(0, 0), moved(4, 0)], (8, 4))
    buffers = {name: np.arange(32).astype(np.float16) for name in "RGB"}
    return Shown(facets, layout, np.ones(2, bool), buffers, pixel_owners(layout), np.array([0, 0, 1.0]))


def test_linear_goes_between_pixel_centres_but_not_to_the_neighbour():
    place = np.array([[1.5, 2.0, 3.9, 4.2, 1.0], [0.5, 0.5, 0.5, 0.5, 1.0]])
    facet = np.array([0, 0, 0, 1, 0], np.int32)
    assert np.allclose(look_up(tiny(), facet, place)[0], [1, 1.5, 3, 4, 4.5])


def test_linear_finds_beyond_an_edge_what_the_viewer_sees_there():
    """Two facets of 4 × 3 pixels side by side in the world, on pages that have no room for bleed."""
    facets = flat_display([rectangle(4, 3)] * 2)
    step = np.array([[0, 0, 0], [4 * PITCH, 0, 0]])
    facets = replace(facets, origin=facets.origin + step, corners=facets.corners + step.repeat(4, axis=0))
    layout = placed(facets, [moved(0, 0)] * 2, (4, 3), on=[0, 1], pages=2)
    buffers = {name: np.arange(24).astype(np.float16) for name in "RGB"}
    eye = np.array([4 * PITCH, -PITCH, 1])
    shown = Shown(facets, layout, np.ones(2, bool), buffers, pixel_owners(layout), eye)
    assert shown.neighbours.tolist() == [[1], [0]]
    # The pixel that is missing has its centre at that of the other facet's first, or last, of the row.
    place = np.array([[3.9, 0.2, 0.2], [0.5, 0.5, 1.5]])
    found = look_up(shown, np.array([0, 1, 0], np.int32), place)[0]
    assert np.allclose(found, [0.6 * 3 + 0.4 * 12, 0.7 * 12 + 0.3 * 3, 4])
    alone = replace(shown, lit=np.array([True, False]))
    assert np.allclose(look_up(alone, np.array([0], np.int32), place[:, :1])[0], 3)


def test_nearest_finds_its_own_facet_at_the_edge():
    place = np.array([[3.2, 4.001, 1.5], [0.5, 0.5, 3.2]])
    assert nearest_pixels(tiny(), np.array([0, 0, 0], np.int32), place).tolist() == [3, 3, 17]


def test_places_in_the_quilt_in_closed_form():
    shown = tiny()
    eye = np.array([0.0, 0.0, 1.0])
    rays = np.array([[2.5, -1.5, 0], [1.0, -2.0, 0]]) * 2.0**-10 - (0, 0, 1)
    place = quilt_places(shown, np.array([0, 1], np.int32), rays.T, eye, np.ones(2, bool))
    assert np.allclose(place, [[2.5, 5], [1.5, 2]])


def test_from_elsewhere_only_lit_sides_show_images(tmp_path):
    loaded = job(tmp_path, "cube5", "400", "viewer.near=5")
    options = PictureOptions((60, 40), place=(-2, 0.15, -0.1), samples=1)
    (result,) = simulate(loaded, [1], options)
    assert result.comparison is None
    # The left side is dark for an eye on the right: nothing but greys is seen from there.
    assert np.ptp(result.picture, axis=2).max() < 0.01
    (result,) = simulate(loaded, [1], PictureOptions((60, 40), place=(2, 0.15, 0.1), samples=1))
    image = np.abs(result.picture - (0.1, 0.2, 0.3)).max(axis=2) < 1e-3
    assert image.mean() > 0.3


def test_images_on_disk_are_used_when_they_are_this_jobs(tmp_path):
    loaded = job(tmp_path, "cube5", "300", "output.compression=zips")
    options = PictureOptions((60, 40))
    (drawn,) = simulate(loaded, [1], options)
    render(loaded)
    (read,) = simulate(loaded, [1], options)
    assert (drawn.source, read.source) == (
        "drawn for this picture",
        f"read from {tmp_path / 'out' / 'quilt'}",
    )
    assert (drawn.picture == read.picture).all()
    for page in (tmp_path / "out" / "quilt").iterdir():
        page.unlink()
    (cut,) = simulate(loaded, [1], options)
    assert cut.source == f"read from {tmp_path / 'out' / 'facets'}"
    assert np.abs(cut.picture - drawn.picture).mean() < 1e-3
    other = job(tmp_path, "cube5", "300", "viewer.far=9")
    assert next(simulate(other, [1], options)).source == "drawn for this picture"


def test_figures_of_a_known_difference():
    direct = np.full((4, 5, 3), 0.5, np.float32)
    shown = direct.copy()
    shown[0, 0] += (0.1, -0.2, 0)
    shown[3, 4] = 9  # not compared
    covered = np.ones((4, 5), bool)
    covered[3] = False
    found = compare(shown, direct, covered, np.zeros((4, 5), bool))
    assert found.share == 0.75
    assert found.maximum == pytest.approx(0.2)
    assert found.mean == pytest.approx(0.2 / 15)
    assert found.psnr == pytest.approx(-10 * math.log10(0.05 / 45), abs=1e-4)
    assert found.error[3, 4] == 0
    assert math.isnan(found.seams)


def test_seams_are_held_against_the_rest_and_against_a_picture_without():
    direct = np.full((4, 6, 3), 0.5, np.float32)
    shown, once = direct + np.float32(0.01), direct + np.float32(0.02)
    seam = np.zeros((4, 6), bool)
    seam[:, 2:4] = True
    shown[seam] += np.float32(0.02)
    once[seam] += np.float32(0.01)
    found = compare(shown, direct, np.ones((4, 6), bool), seam, once)
    assert found.seams == pytest.approx(3, rel=1e-5)
    assert found.seams_alone == pytest.approx(3 / 1.5, rel=1e-5)
    assert found.resampled == pytest.approx((0.03 + 2 * 0.02) / 3, rel=1e-5)
    assert dict(figures(found))["error at seams"] == "3.00 × that elsewhere"
    assert dict(figures(found))["resampled once, mean"].endswith("the display's is 0.714 × that")


def test_nothing_to_compare_is_no_error():
    image = np.zeros((2, 2, 3), np.float32)
    assert compare(image, image, np.zeros((2, 2), bool), np.zeros((2, 2), bool)).share == 0


def test_flip_of_black_and_white():
    # Andersson et al. 2020: the greatest difference of colour, where edges make no difference.
    black, white = np.zeros((32, 32, 3)), np.ones((32, 32, 3))
    assert flip_map(black, black).max() == 0
    assert flip_map(black, white)[8:24, 8:24].mean() > 0.9


def test_seams_are_where_facets_meet_not_where_the_display_ends():
    facet = np.full((4, 12), -1, np.int32)
    facet[:, 2:6], facet[:, 6:10] = 0, 1
    assert np.flatnonzero(seam_pixels(facet, 1)[0]).tolist() == [5, 6]
    assert np.flatnonzero(seam_pixels(facet, 2)[0]).tolist() == [2, 3]


@pytest.mark.parametrize(("high", "scale"), [(0.03, 0.05), (0.011, 0.02), (0.0099, 0.01), (0, 1e-6)])
def test_heat_scales_are_round(high, scale):
    assert heat_scale(np.full((3, 3), high, np.float32)) == pytest.approx(scale)


def test_heat_runs_from_black_to_white():
    heat = heat_map(np.linspace(0, 2, 50, dtype=np.float32)[None], 1.0)[0].astype(int)
    assert heat[0].tolist() == [0, 0, 0]
    assert heat[-1].tolist() == [255, 255, 230]
    assert (np.diff(heat.sum(axis=1)) >= 0).all()


def test_command_writes_pictures_and_figures(tmp_path):
    job(tmp_path, "cube5", "300")
    arguments = ["simulate", str(tmp_path / "job.yaml"), "--size", "60x40", "-f", "1-2"]
    heat = ["--heat-map", str(tmp_path / "seen" / "heat.#.png"), "--direct", str(tmp_path / "direct.#.png")]
    result = CliRunner().invoke(main, [*arguments, "-o", str(tmp_path / "seen" / "eye.####.png"), *heat])
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in tmp_path.rglob("*.png")) == [
        *("direct.0001.png", "direct.0002.png", "eye.0001.png", "eye.0002.png"),
        *("heat.0001.png", "heat.0002.png"),
    ]
    with Image.open(tmp_path / "seen" / "eye.0001.png") as picture:
        assert picture.size == (60, 40)
    labels = [line[:24].strip() for line in result.stdout.splitlines()]
    assert labels[:9] == [
        *("picture", "images", "direct picture", "heat map", "view on lit facets"),
        *("error, mean", "error, 99 %", "error, max", "resampled once, mean"),
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "a.jpg"], "a.jpg: a picture's name must end in .png"),
        (
            ["-o", "a.png", "-f", "1,2"],
            "a.png: is one name for 2 frames (put #### where the frame number goes)",
        ),
        (
            ["-o", "a.png", "--heat-map", "b.png", "--from", "1,2,3"],
            "--direct and --heat-map need a comparison",
        ),
        (["-o", "a.png", "--from", "1,2"], "expected a point in metres, such as 0,1.6,2.5, got '1,2'"),
        (["-o", "a.png", "--from", "1,2,3", "--look-at", "1,2,3"], "is where it looks at"),
    ],
)
def test_command_refuses(tmp_path, monkeypatch, arguments, message):
    job(tmp_path, "cube5", "300")
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["simulate", "job.yaml", "--size", "40x30", *arguments])
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.rglob("*.png"))


@pytest.mark.parametrize("display", [WALLS, CYLINDER], ids=["flat", "curved"])
@pytest.mark.parametrize("fall", ["exponent: 1.7", "table: [[0, 1], [30, 0.8, 0.9, 0.85], [85, 0.1]]"])
def test_panels_that_darken_aslant_look_even_from_the_eye_once_corrected(tmp_path, display, fall):
    text = f"{display}corrections:\n  brightness: {{{fall}, limit: 100}}\n  level: 0.02\n"
    eye = (-1.2, 0.2, 1.6) if display == WALLS else (0.3, 0.1, 0.2)
    job = even_job(tmp_path, text, eye=eye)
    options = PictureOptions(size=(96, 72), threads=1)
    seen = next(simulate(job, [1], options))
    assert seen.comparison is not None
    assert seen.comparison.share > 0.1
    assert seen.comparison.maximum < 0.02 * 0.02 * min(COLOR)
    # Without, they look as uneven as they are.
    bare = next(simulate(job, [1], replace(options, corrected=False)))
    assert bare.comparison is not None
    assert bare.comparison.maximum > 0.3 * min(COLOR)


def test_each_eye_has_images_of_its_own_angles(tmp_path):
    stereo = "  stereo: {separation: 0.4}\n"
    job = even_job(
        tmp_path, f"{WALLS}corrections:\n  brightness: {{exponent: 2, limit: 100}}\n  level: 0.02\n", stereo
    )
    seen = list(simulate(job, [1], PictureOptions(size=(96, 72), threads=1)))
    assert [one.eye for one in seen] == ["left", "right"]
    for one in seen:
        assert one.comparison is not None
        assert one.comparison.maximum < 0.02 * 0.02 * min(COLOR)
