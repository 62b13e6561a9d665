"""New jobs: from tape-measure figures to files that render."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.check import check_files
from quiltcli.display import lit_facets, load_display, shared_edges
from quiltcli.errors import JobError, LayoutError, OutputError, QuiltError
from quiltcli.exchange.newjob.arenas import PRESETS
from quiltcli.exchange.newjob.figures import length_text, read_grain, read_sides
from quiltcli.exchange.newjob.kinds import KINDS, missing
from quiltcli.exchange.newjob.plan import draw_plan
from quiltcli.exchange.newjob.wishes import Wishes
from quiltcli.exchange.newjob.write import new_job, write_new_job
from quiltcli.formats.drawing.shapes import Label
from quiltcli.job import load_display_file
from quiltcli.job.lengths import read_length
from quiltcli.layout import read_layout

SMALL = {
    "corner": Wishes("corner", left="2x1m", right="1.5x1m", angle=90, pitch="50mm"),
    "wall": Wishes("wall", size="2x1m", pixels="64x32"),
    "curve": Wishes("curve", size="4x1m", columns=8, radius="3m", cabinet="250x250mm/8x8px"),
    "cave": Wishes("cave", size="3x2x3m", pitch="100mm", ceiling=True),
    "cube": Wishes("cube", size="0.6x0.4x0.5m", pitch="20mm"),
    "cylinder": Wishes("cylinder", size="2x1m", columns=12, pitch="40mm"),
    "sphere": Wishes("sphere", size="1m", columns=10, rows=6, pitch="20mm"),
    "stairs": Wishes("stairs", size="2x0.2x0.3m", steps=3, pitch="50mm"),
    "arena": Wishes("arena", columns=8, rows=2, installed=6, cabinet="40x40mm/16x16px"),
}
# Facets, edges that two of them share, and facets lit at the eye of frame 1 (None: at least one).
EXPECTED = {
    "corner": (2, 1, 2),
    "wall": (1, 0, 1),
    "curve": (8, 7, 8),
    "cave": (5, 8, 5),
    "cube": (5, 8, None),
    "cylinder": (12, 12, None),
    "sphere": (60, 110, None),
    "stairs": (6, 5, 6),
    "arena": (12, 16, 12),
}


def test_every_kind_is_tried_here() -> None:
    assert set(SMALL) == set(EXPECTED) == set(KINDS)


@pytest.mark.parametrize("kind", SMALL)
def test_what_is_written_passes_the_check_and_says_what_was_meant(kind: str, tmp_path: Path) -> None:
    paths = write_new_job(SMALL[kind], tmp_path / "new")
    assert check_files([path for path in paths if path.suffix == ".yaml"]) == []
    assert paths[-1].name == "plan.png"
    facets = load_display(load_display_file(tmp_path / "new" / "display.yaml"))
    job = new_job(SMALL[kind], tmp_path / "new")
    assert facets.sha256 == job.facets.sha256
    count, edges, lit = EXPECTED[kind]
    assert (facets.count, len(shared_edges(facets).facet_a)) == (count, edges)
    seen = int(lit_facets(facets, np.array(job.stand.eye)).sum())
    assert seen == lit if lit is not None else 0 < seen < count


@pytest.mark.parametrize("kind", SMALL)
def test_what_is_written_renders(kind: str, tmp_path: Path) -> None:
    from click.testing import CliRunner

    from quiltcli.cli.group import main

    write_new_job(SMALL[kind], tmp_path / "new")
    result = CliRunner().invoke(main, ["render", str(tmp_path / "new" / "job.yaml"), "-f", "1", "-j", "1"])
    assert result.exit_code == 0, result.output
    assert "no triangle" not in result.output
    assert (tmp_path / "new" / "out" / "quilt" / "page_01.0001.exr").is_file()


@pytest.mark.parametrize("angle", [90.0, 120.0, 270.0])
def test_walls_of_a_corner_stand_at_the_angle(angle: float, tmp_path: Path) -> None:
    facets = new_job(replace(SMALL["corner"], angle=angle), tmp_path).facets
    turned = np.degrees(np.arccos(facets.normal[0] @ facets.normal[1]))
    assert turned == pytest.approx(abs(180 - angle))
    # The right end of the left wall is the left end of the right one.
    np.testing.assert_allclose(facets.polygon(0)[1], facets.polygon(1)[0], atol=1e-11)
    np.testing.assert_allclose(facets.polygon(0)[1], [0, 0, 0], atol=1e-11)
    assert (facets.polygon(0)[0, 2] > 0) == (angle < 180)


def test_a_curve_lies_on_its_circle(tmp_path: Path) -> None:
    for radius, side in (("3m", 1), ("-3m", -1)):
        facets = new_job(replace(SMALL["curve"], radius=radius), tmp_path).facets
        centre = np.array([0, 3 * np.cos(np.arcsin(0.25 / 3)) * side])
        away = np.linalg.norm(facets.corners[:, [0, 2]] - centre, axis=1)
        np.testing.assert_allclose(away, 3, atol=1e-11)


def test_pieces_of_a_ball_are_lit_outside_or_inside(tmp_path: Path) -> None:
    for inside, sign in ((False, 1), (True, -1)):
        facets = new_job(replace(SMALL["sphere"], inside=inside), tmp_path).facets
        middles = np.array([facets.polygon(k).mean(axis=0) for k in range(facets.count)]) - (0, 0.5, 0)
        assert (sign * np.sum(middles * facets.normal, axis=1) > 0).all()


def test_a_canvas_has_the_panels_where_they_were_put(tmp_path: Path) -> None:
    wishes = Wishes(
        "corner",
        left="1333x750px",
        right="750x750px",
        pitch="6mm",
        canvas=(2112, 1024),
        places=("left=0,0", "right=1340,0,90"),
    )
    write_new_job(wishes, tmp_path)
    layout = read_layout(tmp_path / "layout.yaml")
    assert layout.pages.tolist() == [[2112, 1024]]
    np.testing.assert_array_equal(layout.quilt_from_facet[0], [[1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(layout.quilt_from_facet[1], [[0, -1, 2090], [1, 0, 0]])
    assert check_files([tmp_path / "job.yaml"]) == []


def test_nothing_is_overwritten_and_nothing_half_written(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text("mine\n")
    with pytest.raises(OutputError, match=r"job\.yaml: exists already"):
        write_new_job(SMALL["wall"], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]
    with pytest.raises(LayoutError):
        write_new_job(replace(SMALL["wall"], canvas=(32, 32)), tmp_path / "small")
    assert not (tmp_path / "small").exists()


def test_content_is_named_as_the_new_folder_sees_it(tmp_path: Path) -> None:
    (tmp_path / "thing.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    write_new_job(replace(SMALL["wall"], scene=str(tmp_path / "thing.obj")), tmp_path / "new")
    assert 'mesh: "../thing.obj"' in (tmp_path / "new" / "scene.yaml").read_text()
    assert not (tmp_path / "new" / "content.obj").exists()
    assert check_files([tmp_path / "new" / "job.yaml"]) == []


def test_sizes_are_snapped_to_whole_pixels() -> None:
    raster = read_grain("6mm", None, None).raster("wall", read_sides("8x4.5m", 2, "--size"))
    assert raster.pixels == (1333, 750)
    assert [float(side) for side in raster.size] == [7.998, 4.5]
    raster = read_grain(None, None, "500x500mm/128x128px").raster("wall", read_sides("8x4.5m", 2, "--size"))
    assert raster.pixels == (2048, 1152)


@pytest.mark.parametrize("metres", ["6 mm", "4.5 m", "1/3 m", "1/6 mm", "125/32 mm", "12 m"])
def test_lengths_are_written_as_they_are_read(metres: str) -> None:
    exact = read_length(metres)
    assert exact is not None
    assert read_length(length_text(exact)) == exact


@pytest.mark.parametrize(
    ("wishes", "said"),
    [
        (Wishes("cubicle"), "expected one of corner, wall"),
        (replace(SMALL["wall"], size="8by4"), "expected width x height such as 8x4.5m"),
        (replace(SMALL["wall"], size="8x4"), "such as 8x4.5m, got '8x4' (units: m, cm, mm, in, ft and px)"),
        (replace(SMALL["wall"], size="2x1km"), "got '2x1km' (units: m, cm, mm, in, ft and px)"),
        (replace(SMALL["wall"], size="wide"), "expected width x height such as 8x4.5m, got 'wide'"),
        (replace(SMALL["corner"], pitch="6 parsec"), "got '6 parsec' (units: m, cm, mm, in, ft)"),
        (replace(SMALL["wall"], pitch="1mm"), "expected one of --pitch"),
        (replace(SMALL["wall"], size="64x32px"), "needs a pitch or a cabinet"),
        (replace(SMALL["corner"], pitch="6"), "expected a length such as 6mm"),
        (replace(SMALL["corner"], pitch="6m"), "makes 0 pixels"),
        (replace(SMALL["corner"], angle=0), "expected 10 to 350 degrees"),
        (replace(SMALL["curve"], size="3.6x1m"), "no whole number of cabinets of 0.25 m (expected 0.25 m"),
        (replace(SMALL["curve"], radius="0.3m"), "more than around a circle"),
        (replace(SMALL["curve"], cabinet="500x500mm"), "500x500mm/128x128px"),
        (replace(SMALL["sphere"], pitch=None, pixels="8x8"), "a diameter and a pitch"),
        (replace(SMALL["stairs"], pitch=None, pixels="8x8"), "panels of two sizes"),
        (replace(SMALL["wall"], places=("wall=0,0",)), "--place needs a canvas"),
        (replace(SMALL["wall"], places=("w=0,0",), canvas=(99, 99)), "there is no panel 'w' (known: wall)"),
        (replace(SMALL["wall"], places=("wall=0",), canvas=(99, 99)), "expected NAME=X,Y or NAME=X,Y,TURN"),
        (replace(SMALL["wall"], scene="thing.txt"), "--scene: expected a mesh"),
        (replace(SMALL["wall"], scene="thing.obj"), "no such file: thing.obj"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_said(wishes: Wishes, said: str, tmp_path: Path) -> None:
    with pytest.raises(QuiltError) as caught:
        write_new_job(wishes, tmp_path / "new")
    assert said in str(caught.value)
    assert not (tmp_path / "new").exists()


def test_what_is_missing_is_known() -> None:
    assert list(missing(Wishes("corner", left="1x1m"))) == ["right", "grain"]
    assert missing(SMALL["stairs"]) == {}
    with pytest.raises(JobError):
        missing(Wishes("cubicle"))


def test_the_panels_of_the_page_are_what_it_says(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "new.md").read_text(encoding="utf-8")
    (tmp_path / "display.yaml").write_text(page.split("```yaml\n")[1].split("```")[0])
    facets = load_display(load_display_file(tmp_path / "display.yaml"))
    np.testing.assert_allclose(facets.polygon(0)[1], facets.polygon(1)[0], atol=1e-12)
    assert facets.size.tolist() == [[1333, 750], [750, 750]]


@pytest.mark.parametrize(
    ("kind", "figures"),
    [
        ("cave", {"size": "3x3x2.5m", "pixels": "400x333"}),
        ("corner", {"left": "8x4.5m", "right": "6x4.5m", "pitch": "6mm"}),
        ("cylinder", {"size": "2x1.5m", "columns": 12, "pitch": "6mm"}),
        ("stairs", {"size": "4x0.16x0.3m", "steps": 5, "pitch": "6mm"}),
    ],
)
def test_no_label_of_a_plan_lies_on_another(kind: str, figures: dict, tmp_path: Path) -> None:
    job = new_job(Wishes(kind, **figures), tmp_path)
    labels = [item for item in draw_plan(kind, job.facets, job.stand).items if isinstance(item, Label)]
    boxes = [
        (label.x - wide * (label.anchor == "middle") / 2, label.y, wide, label.size)
        for label in labels
        for wide in [0.5 * label.size * len(label.text)]
    ]
    for k, (x, y, wide, high) in enumerate(boxes):
        for u, v, across, down in boxes[:k]:
            beside = x + wide <= u or u + across <= x
            assert beside or abs(y - v) >= (high + down) / 2, (labels[k].text, u, v)


# ---- arenas ----


@pytest.mark.parametrize("name", PRESETS)
def test_an_arenas_panels_close_a_cylinder_that_faces_its_middle(name: str, tmp_path: Path) -> None:
    arena = PRESETS[name]
    job = new_job(Wishes("arena", preset=name), tmp_path)
    facets = job.facets
    side, pixels = float(arena.cabinet.split("x")[0]) / 1000, int(arena.cabinet.split("/")[1].split("x")[0])
    assert facets.count == arena.rows * arena.installed
    assert (facets.size == pixels).all()
    middle = facets.origin + (facets.size[:, :1] * facets.du + facets.size[:, 1:] * facets.dv) / 2
    eye = np.array(job.stand.eye)
    assert eye.tolist() == pytest.approx([0, arena.rows * side / 2, 0], abs=1e-5)
    # Corners lie on a circle around the eye, and the panels' middles half a side over tan(π/n) from it.
    corners = facets.corners[:, [0, 2]]
    np.testing.assert_allclose(
        np.linalg.norm(corners, axis=1), side / 2 / np.sin(np.pi / arena.columns), rtol=1e-9
    )
    level = middle * (1, 0, 1)
    reach = side / 2 / np.tan(np.pi / arena.columns)
    np.testing.assert_allclose(facets.normal, -level / reach, atol=1e-9)
    # The gap is behind, and as wide on both sides.
    assert np.abs(level.sum(axis=0)[0]) < 1e-9
    gap = arena.columns - arena.installed
    shared = len(shared_edges(facets).facet_a)
    assert shared == arena.rows * (arena.installed - (gap > 0)) + arena.installed * (arena.rows - 1)
    if gap:
        assert level[:, 2].max() < reach * np.cos(np.pi * gap / arena.columns) + 1e-9


def test_an_arenas_canvas_is_its_picture_unrolled(tmp_path: Path) -> None:
    """What is ahead lies in the middle; to the right on the canvas is to the right in the arena."""
    job = new_job(Wishes("arena", preset="G6_2x8of10"), tmp_path)
    layout = job.layout
    assert layout.pages.tolist() == [[160, 40]]
    place = layout.quilt_from_facet[:, :, 2]
    middle = layout.origin + 10 * layout.du + 10 * layout.dv
    azimuth = np.degrees(np.arctan2(middle[:, 0], -middle[:, 2]))
    np.testing.assert_allclose(azimuth, (place[:, 0] + 10 - 80) / 20 * 36, atol=1e-6)
    assert (place[middle[:, 1] > 0.0454, 1] == 0).all()
    assert (place[middle[:, 1] < 0.0454, 1] == 20).all()


@pytest.mark.parametrize(
    ("wishes", "complaint"),
    [
        (Wishes("arena", preset="G6_2x9"), "--preset: expected G3_3x24, G3_4x12"),
        (Wishes("arena", preset="g6_2x10"), "got 'g6_2x10' (did you mean G6_2x10?)"),
        (Wishes("arena", preset="G6_2x10", rows=3), "--rows: the preset G6_2x10 says 2"),
        (Wishes("arena", columns=12, rows=2, pitch="2mm"), "an arena is built of panels (expected --cabinet"),
        (Wishes("arena", columns=12, rows=2, installed=13, cabinet="40x40mm/16x16px"),
         "--installed: expected 1 to 12, got 13"),
        (Wishes("wall", size="2x1m", pixels="64x32", preset="G6_2x10"), "--preset: means nothing to a wall"),
    ],
)  # fmt: skip
def test_arenas_that_cannot_be_are_told(wishes: Wishes, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(JobError) as caught:
        new_job(wishes, tmp_path)
    assert complaint in str(caught.value)


def test_a_preset_leaves_nothing_to_ask() -> None:
    assert missing(Wishes("arena", preset="G4_4x12")) == {}
    assert set(missing(Wishes("arena"))) == {"columns", "rows", "grain"}
