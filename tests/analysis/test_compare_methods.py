"""The comparison of methods: the paper's ordering on near-coplanar plates, and figures by closed form."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.methods import (
    COLUMNS,
    VARIANTS,
    CompareOptions,
    compare,
    study_json,
    study_rows,
    study_words,
)
from quiltcli.analysis.methods.eyeviews import _densest
from quiltcli.analysis.methods.findings import REFERENCE, decibels, errors_of, variants_of
from quiltcli.analysis.methods.page import page_text, write_comparison
from quiltcli.analysis.methods.profile import SAMPLES
from quiltcli.cli import main
from quiltcli.errors import JobError
from quiltcli.formats.drawing.charts import Curve, bar_chart, line_chart, ticks
from quiltcli.job import load_job
from tests.helpers.tiny_job import write_tiny_job

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory):
    """All methods on the plates and the sphere, in a small box of five panels that they stick out of."""
    folder = tmp_path_factory.mktemp("plates")
    (folder / "box.yaml").write_text(
        f"quilt_display: 1\nmesh: {ROOT / 'display_models' / 'cube5.obj'}\n"
        "resolution: {facet_pixels: [240, 135]}\nfacets: {5: {facet_pixels: [240, 240]}}\n"
        "transform: {scale: 0.7}\n"
    )
    (folder / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: box.yaml\nscene: {ROOT / 'scenes' / 'plates_and_sphere.yaml'}\nframes: 1\n"
        "viewer: {near: 0.01, far: 50, path: {orbit: {center: [0, 0.15, 0], radius: 1.05, height: 0.5,"
        " start_deg: -40, end_deg: 60, end_frame: 8}}}\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quiltcli.analysis.methods.eyeviews.SIZE", (240, 180))
        return compare(load_job(folder / "job.yaml"), CompareOptions(threads=2))


@pytest.fixture
def found(study):
    """Findings by name."""
    return {one.variant.name: one for one in study.findings}


def test_everything_is_compared_the_reference_first(study) -> None:
    assert tuple(one.variant for one in study.findings) == VARIANTS
    assert VARIANTS[0] == REFERENCE
    assert study.pixels > 40_000


@pytest.mark.parametrize("name", ["raycast", "homography"])
def test_exact_depth_puts_no_pixel_in_the_wrong_order_and_no_seam_jumps(found, name: str) -> None:
    assert (found[name].wrong, found[name].lost) == (0, 0)
    assert found[name].seams.counts["points_compared"] > 20
    assert found[name].seams.failures == 0
    assert found[name].depth.maximum < 1e-6
    assert found[name].image.maximum < 0.01


@pytest.mark.parametrize("method", ["offaxis", "raskar", "zscale"])
@pytest.mark.parametrize("bits", ["16", "24"])
def test_the_others_buffers_order_pixels_wrongly_and_jump_at_seams(found, method: str, bits: str) -> None:
    one = found[f"{method} {bits}"]
    assert one.wrong > 0
    assert one.behind > 0
    assert one.seams.failures > 0.9 * one.seams.counts["points_compared"] > 0
    assert one.depth.mean > 0.01


def test_what_the_figures_come_to_is_said_in_words(study, found) -> None:
    order, blur = study_words(study)
    assert order == "no pixel in wrong order and no seam jump: raycast, homography"
    factor = found["twopass"].seen.mean / found["homography"].seen.mean
    assert blur == f"seen from the eye, twopass errs {factor:.2f} × as much as homography"


def test_fewer_bits_order_more_pixels_wrongly_and_raskars_factor_most(found) -> None:
    for method in ("homography", "offaxis", "raskar", "zscale"):
        assert found[f"{method} 16"].wrong > 10 * found[f"{method} 24"].wrong
    assert found["raskar 16"].wrong > found["zscale 16"].wrong > found["homography 16"].wrong


def test_at_16_bits_only_the_corrected_depth_stays_near_the_truth_across_seams(found) -> None:
    """Rounded, it jumps by a step of its buffer; the others jump by what they hold."""
    step = found["homography 16"].depth.maximum
    assert 0 < found["homography 16"].seams.most < 20 * step
    for method in ("offaxis", "raskar"):
        assert found[f"{method} 24"].seams.most > 100 * found["homography 24"].seams.most


def test_two_passes_blur(found) -> None:
    """At as many pixels, and seen from the eye, the second resampling costs a measured share."""
    ours, theirs = found["homography"], found["twopass"]
    assert theirs.wrong is None
    assert theirs.image.mean > 1e4 * max(ours.image.mean, 1e-9)
    assert theirs.seen.mean > 1.25 * ours.seen.mean
    assert theirs.depth.maximum > 1e3 * ours.depth.maximum


def test_along_the_line_across_a_seam_only_honest_buffers_follow_the_ray(study) -> None:
    depths = dict(zip((one.variant.name for one in study.findings), study.depths, strict=True))
    across = slice(SAMPLES - 1, SAMPLES + 1)
    assert study.profile.along[across].sum() == 0
    assert (np.diff(study.profile.along) > 0).all()
    truth = depths["raycast"][across]
    assert np.isfinite(truth).all()
    np.testing.assert_allclose(depths["homography"][across], truth, atol=1e-6)
    slope = abs(np.log(truth[1] / truth[0]))
    for method in ("offaxis", "raskar"):
        before, after = depths[f"{method} 24"][across]
        assert abs(np.log(after / before)) > 50 * slope


def test_close_views_show_where_depth_goes_wrong(study) -> None:
    by_name = {one.variant.name: k for k, one in enumerate(study.findings)}
    truth = study.crops[0].astype(int)
    assert (np.abs(study.crops[by_name["homography"]].astype(int) - truth) <= 1).all()

    def red(name: str) -> int:
        return int((study.marks[by_name[name]] == (255, 48, 32)).all(axis=-1).sum())

    assert red("raycast") == red("homography") == 0
    assert red("raskar 16") > 500
    assert study.marks[by_name["twopass"]] is None


def test_the_page_stands_alone_and_its_data_are_json(study, tmp_path: Path) -> None:
    page, data = write_comparison(study, tmp_path)
    text = page.read_text()
    assert page.name == "compare.0001.html"
    assert text == page_text(study)
    assert not re.search(r"(src|href)=\"(?!data:)", text)
    assert text.count("<svg") == 3
    assert text.count("data:image/png;base64,") == 2 * len(VARIANTS) - 1
    for cell in next(iter(study_rows(study))):
        assert f"<td>{cell}</td>" in text
    loaded = json.loads(data.read_text())
    assert loaded == json.loads(json.dumps(study_json(study)))
    assert [row["method"] for row in loaded["methods"]] == [one.variant.method for one in study.findings]
    assert loaded["methods"][0]["light_error"]["psnr"] is None


def test_rows_are_as_long_as_their_heads(study) -> None:
    assert {len(row) for row in study_rows(study)} == {len(COLUMNS)}


def test_figures_of_errors() -> None:
    assert errors_of(np.zeros(0)) == errors_of(np.zeros(3))
    one = errors_of(np.arange(101.0))
    assert (one.mean, one.percentile_99, one.maximum) == (50, 99, 100)
    assert decibels(0.01) == pytest.approx(20)
    assert decibels(0.0) == math.inf


def test_the_densest_place_is_found() -> None:
    hit = np.zeros((200, 300), bool)
    assert _densest(hit) == (100, 150)
    hit[30, 40] = True
    hit[150:160, 220:230] = True
    row, column = _densest(hit)
    assert (abs(row - 155) <= 25, abs(column - 225) <= 25) == (True, True)


def test_ticks_are_round() -> None:
    assert ticks(0, 1) == pytest.approx([0, 0.2, 0.4, 0.6, 0.8, 1])
    assert ticks(-3, 47, 5) == pytest.approx([0, 10, 20, 30, 40])
    assert ticks(2, 2) == [2]


def test_a_curve_is_broken_where_it_is_not_known() -> None:
    chart = line_chart(np.arange(4.0), [Curve("a<b", np.array([0, 1, np.nan, 2.0]))], ("x", "y"))
    path = re.search(r'<path d="([^"]*)"', chart)[1]
    assert [word[0] for word in path.split()] == ["M", "L", "M"]
    assert "a&lt;b" in chart


def test_bars_are_as_long_as_their_parts_and_cut_at_the_most() -> None:
    chart = bar_chart([("one", {"a": 1.0, "b": 1.0}), ("two", {"a": 4.0})], "s", width=430, most=2.0)
    widths = [float(w) for w in re.findall(r'width="([\d.]+)" height="16"', chart)]
    assert widths == [100, 100, 200]
    assert "4 s" in chart


def test_only_some_methods_are_compared() -> None:
    assert [v.name for v in variants_of(["offaxis"])] == ["offaxis 16", "offaxis 24", "offaxis 32f"]
    assert variants_of([]) == VARIANTS
    with pytest.raises(JobError, match=r"expected raycast, homography, .* or twopass, got 'ray'"):
        variants_of(["ray"])


def test_the_command_prints_a_table_and_says_where_the_page_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quiltcli.analysis.methods.eyeviews.SIZE", (120, 90))
    job = write_tiny_job(tmp_path)
    result = CliRunner().invoke(
        main, ["compare", str(job), "-f", "2", "--method", "zscale", "-o", str(tmp_path / "c")]
    )
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    names = ["method", "raycast", "zscale 16", "zscale 24", "zscale 32f"]
    assert [line.split("  ")[0] for line in lines[:5]] == names
    assert lines[5].startswith("no pixel in wrong order and no seam jump: raycast")
    assert lines[6:] == [f"written to {tmp_path / 'c' / 'compare.0002'}.{kind}" for kind in ("html", "json")]
    assert "drawing zscale 24" in result.stderr


def test_a_frame_without_a_lit_facet_is_refused(tmp_path: Path) -> None:
    job = load_job(write_tiny_job(tmp_path), ("viewer.path.keyframes[0].position=[3, 0, -2]",))
    with pytest.raises(JobError, match="at frame 1 no facet is lit"):
        compare(job, CompareOptions(variants=()))
