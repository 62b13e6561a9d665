"""Images that make up for their panels: what is written, and what is said of it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from quiltcli.formats.exr.image import read_exr
from quiltcli.images.diff import diff
from quiltcli.job import job_sha256, load_job
from quiltcli.render.corrections import cosines
from quiltcli.render.notices import stage_warnings
from quiltcli.render.report import summary, summary_warnings
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from tests.helpers.even_light import COLOR, CYLINDER, WALLS, even_job

FALL = "corrections:\n  brightness: {exponent: 1, limit: 50}\n"


def rendered(job, folder, threads=1, **how):
    return render(job, RenderOptions(folder=folder, threads=threads, frames=[1], overwrite=True, **how))


def image(folder, name="facets/facet_0001.0001.exr"):
    return read_exr(folder / name)


def light(found):
    return np.stack([found.channels[name] for name in "RGB"], axis=-1).astype(np.float64)


def test_each_pixel_is_as_much_brighter_as_its_panel_is_darker_there(tmp_path):
    job = even_job(tmp_path, WALLS + FALL + "  level: 0.1\n  facets: {2: {gain: [1, 0.5, 2]}}\n")
    rendered(job, tmp_path / "out")
    eye = np.array([-1.2, 0.2, 1.6])
    x, y = np.meshgrid(np.arange(32) + 0.5, np.arange(32) + 0.5)
    # The right wall: x = 0, from z = 1 on its left... seen from its lit side z falls to the right.
    points = np.stack((np.zeros(x.shape), 0.5 - y / 32, x / 32), axis=-1)
    away = eye - points
    cosine = np.abs(away[..., 0]) / np.sqrt((away**2).sum(axis=-1))
    expected = 0.1 * np.array(COLOR) * [1, 0.5, 2] / cosine[..., None]
    found = light(image(tmp_path / "out", "facets/facet_0002.0001.exr"))
    assert found == pytest.approx(expected, rel=1.2e-3)  # twice rounded to half floats


def test_pages_and_facet_images_show_the_same(tmp_path):
    rendered(even_job(tmp_path, WALLS + FALL), tmp_path / "out")
    page = light(read_exr(tmp_path / "out/quilt/page_01.0001.exr"))
    for facet in (1, 2):
        own = light(image(tmp_path / "out", f"facets/facet_{facet:04}.0001.exr"))
        values = {tuple(pixel) for pixel in own.reshape(-1, 3).tolist()}
        assert values <= {tuple(pixel) for pixel in page.reshape(-1, 3).tolist()}


@pytest.mark.parametrize("display", [WALLS, CYLINDER])
def test_bytes_are_the_same_for_any_number_of_workers(tmp_path, display):
    job = even_job(tmp_path, display + FALL)
    for threads in (1, 2, 3):
        rendered(job, tmp_path / str(threads), threads)
    for name in ("quilt/page_01.0001.exr", "facets/facet_0001.0001.exr"):
        one = (tmp_path / "1" / name).read_bytes()
        assert all((tmp_path / threads / name).read_bytes() == one for threads in "23")


def test_frames_that_share_buffers_are_each_corrected_once(tmp_path):
    job = even_job(tmp_path, WALLS + FALL)
    render(job, RenderOptions(folder=tmp_path / "both", threads=1))
    render(job, RenderOptions(folder=tmp_path / "alone", threads=1, frames=[2]))
    name = "quilt/page_01.0002.exr"
    assert (tmp_path / "both" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()


def test_facets_merged_into_a_quilt_leave_the_others_as_they_are(tmp_path):
    job = even_job(tmp_path, WALLS + FALL)
    rendered(job, tmp_path / "out")
    whole = (tmp_path / "out/quilt/page_01.0001.exr").read_bytes()
    render(job, RenderOptions(folder=tmp_path / "out", threads=1, frames=[1], facets=[2]))
    assert (tmp_path / "out/quilt/page_01.0001.exr").read_bytes() == whole


def test_nothing_is_brighter_than_a_panel_can_be_unless_told(tmp_path):
    job = even_job(tmp_path, WALLS + FALL)
    record = rendered(job, tmp_path / "out")[0]
    assert light(image(tmp_path / "out")).max() == 1
    assert record.corrections is not None
    assert record.corrections["over"] > 0
    assert record.corrections["brightest"] > 1
    assert any("want more light than the panels can give" in words for words in record.warnings)
    told = even_job(tmp_path, WALLS + FALL + "  clip: false\n")
    rendered(told, tmp_path / "told")
    wanted = record.corrections["brightest"]
    everything = [light(image(tmp_path / "told", f"facets/facet_000{k}.0001.exr")).max() for k in (1, 2)]
    assert max(everything) == pytest.approx(wanted, rel=2e-2)  # bleed reaches a little further
    assert max(everything) > 1


def test_the_level_that_is_said_to_leave_room_does(tmp_path):
    job = even_job(tmp_path, WALLS + FALL)
    found = rendered(job, tmp_path / "out")
    assert found[0].corrections is not None
    level = found[0].corrections["fits"]
    lines = dict(summary(found))
    assert lines["light wanted"].endswith(f"(room for it: level {level:g})")
    assert "%" in lines["pixels beyond that"]
    record = rendered(even_job(tmp_path, WALLS + FALL + f"  level: {level}\n"), tmp_path / "room")[0]
    assert record.corrections is not None
    assert record.corrections["over"] == 0
    assert record.corrections["brightest"] > 0.9
    assert not record.warnings
    assert "pixels beyond that" not in dict(summary([record]))


def test_warnings_are_the_same_words_for_every_frame(tmp_path):
    records = render(even_job(tmp_path, WALLS + FALL), RenderOptions(folder=tmp_path / "out", threads=1))
    assert len(records) == 2
    assert records[0].warnings == records[1].warnings
    assert len(summary_warnings(records)) == len(records[0].warnings)


def test_reports_and_images_tell_of_corrections_and_the_job_can_do_without(tmp_path):
    job = even_job(tmp_path, WALLS + FALL)
    rendered(job, tmp_path / "with")
    record = json.loads((tmp_path / "with/report.json").read_text())["frames"][0]
    assert set(record["corrections"]) == {"pixels", "over", "limited", "brightest", "brightened", "fits"}
    assert json.loads(image(tmp_path / "with").attributes["quilt:corrections"])["brightness"]["exponent"] == 1
    without = load_job(tmp_path / "job.yaml", ["render.corrections=false"])
    rendered(without, tmp_path / "without")
    bare = image(tmp_path / "without")
    assert "quilt:corrections" not in bare.attributes
    assert np.unique(light(bare)[..., 0]).tolist() == [np.float16(COLOR[0])]
    assert "corrections" not in json.loads((tmp_path / "without/report.json").read_text())["frames"][0]
    found = diff(tmp_path / "with", tmp_path / "without").files
    assert {file.note for file in found} == {"only the first is corrected for its panels"}


def test_a_display_without_corrections_has_the_hash_it_always_had(tmp_path):
    plain = even_job(tmp_path, WALLS)
    other = load_job(tmp_path / "job.yaml", ["render.corrections=false"])
    assert job_sha256(plain) != job_sha256(other)
    told = plain.model_copy(update={"render": plain.render.model_copy(update={"corrections": True})})
    assert job_sha256(told) == job_sha256(plain)


def test_a_check_says_what_white_asks_of_the_panels(tmp_path):
    job = even_job(tmp_path, WALLS + "corrections:\n  brightness: {exponent: 2, limit: 3}\n")
    notices = [words for words in stage_warnings(set_stage(job)) if words.startswith("corrections")]
    assert any("3 at most are allowed (corrections.brightness.limit)" in words for words in notices)
    assert any("white asks 3 times what its panel can give" in words for words in notices)
    calm = even_job(tmp_path, WALLS + "corrections:\n  brightness: {exponent: 0.2, limit: 3}\n  level: 0.5\n")
    assert not [words for words in stage_warnings(set_stage(calm)) if words.startswith("corrections")]


def test_angles_on_curved_facets_are_those_of_their_points(tmp_path):
    stage = set_stage(even_job(tmp_path, CYLINDER))
    eye = np.array([0.2, 0.1, 0.4])
    x, y = np.array([10.5, 48.0, 90.2]), np.array([4.0, 16.0, 30.0])
    found = cosines(stage.facets, stage.layout, 0, (x, y), eye)
    turn = np.radians(-(-60 + 120 * x / 96))  # seen from inside, columns run the other way
    points = np.stack((np.sin(turn), 0.35 - 0.7 * y / 32, np.cos(turn)), axis=1)
    inward = -np.stack((np.sin(turn), np.zeros(3), np.cos(turn)), axis=1)
    away = eye - points
    assert found == pytest.approx((away * inward).sum(axis=1) / np.linalg.norm(away, axis=1), abs=1e-9)
