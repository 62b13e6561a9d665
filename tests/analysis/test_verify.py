"""A good render passes, and every kind of fault is found by its name."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.verify import VerifyOptions, verdict_rows, verify
from quiltcli.analysis.verify.pixels import sight
from quiltcli.cli import main
from quiltcli.errors import MissingExtraError
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.images.names import quilt_path
from quiltcli.render.sequence import render
from tests.helpers.in_memory import CUBE, CUBE_FACES
from tests.helpers.verified_jobs import EVERY, cube_job, found, shoot, write_job


def verdict_on(job, options=None):
    """The verdict on the only view of a job's first frame."""
    [found] = verify(job, options)
    return found.verdict


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return shoot(cube_job(tmp_path_factory.mktemp("cube")))


@pytest.fixture(scope="module")
def verdict(shot):
    return shot.verify()


def middles(shot, rays=True):
    """Covered pixels inside facets whose five rays agree, or do not."""
    seen = sight(shot.trial, shot.covered)
    return shot.covered[seen.agree == rays]


def page_place(shot, pixel):
    y, x = divmod(int(pixel), int(shot.stage.layout.pages[0, 0]))
    return x, y


def test_a_good_render_passes(verdict):
    assert found(verdict) == {}
    assert verdict.passed
    assert verdict.words == "within tolerance"


def test_everything_is_looked_at(shot, verdict):
    lit = np.append(False, shot.trial.rays.lit)[np.abs(shot.stage.owners)]
    assert np.count_nonzero(lit & (shot.stage.owners > 0)) == verdict.inside["pixels"]
    assert np.count_nonzero(lit & (shot.stage.owners < 0)) == verdict.bleed["pixels"]
    assert shot.covered.size == verdict.inside["covered"] > 1000


def test_every_pixel_is_accounted_for(verdict):
    tally = verdict.inside
    assert tally["covered"] > tally["triangles"] == tally["depths"] > 500
    assert tally["several"] + tally["partly"] >= tally["covered"] - tally["triangles"]


def test_most_depth_errors_are_those_of_one_rounding_to_float32(verdict):
    errors = verdict.inside.errors
    assert 0 < errors.quantile(0.5) <= errors.quantile(0.9) < 2e-7
    assert errors.quantile(0.999) <= errors.most < 1e-6


def test_seams_are_compared(verdict):
    counts = verdict.seams.counts
    assert counts["edges"] == 3
    assert 0 < counts["points_compared"] < counts["points"]
    assert 0 < verdict.seams.most_share < 0.1


def test_depth_off_by_a_hundred_thousandth_is_found_everywhere(shot, verdict):
    spoiled = shot.spoiled(slice(None), shot.images.channels["Z"] * np.float32(1 + 1e-5)).verify()
    assert found(spoiled)["depth"] == verdict.inside["depths"]
    assert {"depth", "bleed depth"} == set(found(spoiled))
    assert spoiled.inside.errors.quantile(0.5) == pytest.approx(1e-5 * 3, rel=0.5)


def test_one_pixel_punched_out_is_a_crack(shot):
    pixel = middles(shot)[17]
    spoiled = shot.spoiled(pixel, np.inf, -1).verify()
    assert found(spoiled) == {"crack": 1}
    fault = spoiled.faults[0]
    assert ("crack", 1, *page_place(shot, pixel)) == (fault.kind, fault.page, fault.x, fault.y)
    assert fault.facet == shot.stage.owners[pixel]
    assert (fault.found, fault.depth_found) == (0, np.inf)
    assert fault.expected == shot.images.channels["triangle"][pixel]


def test_a_pixel_punched_out_on_the_edge_of_two_triangles_is_a_crack(shot):
    seen = sight(shot.trial, shot.covered)
    pixel = shot.covered[seen.all_hit & ~seen.agree][3]
    assert found(shot.spoiled(pixel, np.inf, -1).verify()) == {"crack": 1}


def test_a_pixel_too_many_is_an_extra(shot):
    pixel = shot.empty[99]
    assert found(shot.spoiled(pixel, 2.5, 5).verify()) == {"extra": 1}


def test_another_triangle_is_found(shot):
    pixel = middles(shot)[44]
    assert found(shot.spoiled(pixel, triangle=3).verify()) == {"triangle": 1}


def test_the_neighbour_is_another_triangle_though_its_plane_is_near(shot):
    pixel = middles(shot)[44]
    triangles, mine = shot.stage.scene.triangles, shot.images.channels["triangle"][pixel] - 1
    shared = np.isin(triangles, triangles[mine]).sum(axis=1)
    neighbour = int(np.flatnonzero(shared == 2)[0])
    assert found(shot.spoiled(pixel, triangle=neighbour).verify()) == {"triangle": 1}


def test_what_lies_behind_does_not_show_through_the_edge_of_two_triangles(shot):
    pixel = middles(shot, rays=False)[5]
    behind = np.argmax(shot.stage.scene.vertices[shot.stage.scene.triangles].mean(axis=1) @ shot.viewer.look)
    assert found(shot.spoiled(pixel, 4.2, int(behind)).verify()) == {"stray": 1}


def test_a_fault_in_the_bleed_is_told_apart(shot):
    seen_in_bleed = np.flatnonzero((shot.stage.owners < 0) & np.isfinite(shot.images.channels["Z"]))
    agree = sight(shot.trial, seen_in_bleed).agree
    assert found(shot.spoiled(seen_in_bleed[agree][0], np.inf, -1).verify()) == {"bleed crack": 1}


def test_what_no_lit_facet_owns_must_stay_empty(shot):
    nobody = np.flatnonzero(shot.stage.owners == 0)[0]
    unlit = np.flatnonzero(~shot.trial.rays.lit)[0]
    hidden = np.flatnonzero(shot.stage.owners == unlit + 1)[0]
    assert found(shot.spoiled([nobody, hidden], 2.0, 1).verify()) == {"outside": 2}


def test_a_step_between_two_facets_is_found_at_the_seams(shot):
    facet = int(np.flatnonzero(shot.trial.rays.lit)[0])
    shifted = np.where(np.abs(shot.stage.owners) == facet + 1, 1 + 1e-5, 1)
    spoiled = shot.spoiled(slice(None), (shot.images.channels["Z"] * shifted).astype(np.float32)).verify()
    assert found(spoiled)["seam"] > 10
    assert spoiled.seams.most == pytest.approx(3e-5, rel=0.3)
    assert {"seam", "depth"} <= {fault.kind for fault in spoiled.faults}


@pytest.mark.parametrize("value", [np.nan, -np.inf, 0.0, -3.0])
def test_numbers_that_are_no_depth_are_found(shot, value):
    assert found(shot.spoiled(middles(shot)[3], value).verify()) == {"depth": 1}
    nowhere = np.flatnonzero(shot.stage.owners == 0)[0]
    assert found(shot.spoiled(nowhere, value).verify()) == {"outside": 1}


class TestDepthAlone:
    """Images that do not tell triangles are held to coverage and depth."""

    def test_a_good_render_passes(self, shot, verdict):
        alone = shot.without_triangles().verify()
        assert found(alone) == {}
        assert (alone.inside["triangles"], alone.inside["depths"]) == (0, verdict.inside["depths"])

    def test_faults_are_found(self, shot):
        pixel, other, empty = middles(shot)[3], middles(shot)[77], shot.empty[5]
        spoiled = shot.spoiled([pixel, empty, other], [np.inf, 3, 2]).without_triangles().verify()
        assert found(spoiled) == {"crack": 1, "extra": 1, "depth": 1}

    def test_what_lies_behind_does_not_show_through(self, shot):
        pixel = middles(shot, rays=False)[5]
        assert found(shot.spoiled(pixel, 4.2).without_triangles().verify()) == {"stray": 1}


class TestSample:
    def test_every_lit_facet_is_sampled(self, shot):
        verdict = shot.verify(VerifyOptions(pixels=300, threads=1))
        assert 300 <= verdict.inside["pixels"] + verdict.bleed["pixels"] < 1000
        assert verdict.bleed["pixels"] > 0
        assert found(verdict) == {}

    def test_half_of_it_lies_along_the_outlines(self, shot):
        from quiltcli.analysis.verify.sample import sampled_pixels

        lit = shot.trial.rays.lit
        nothing = np.empty(0, np.int64)
        owners, layout = shot.stage.owners, shot.stage.layout
        pixels = np.concatenate(list(sampled_pixels(layout, owners, lit, 2, 800, 1, nothing)))
        width = layout.pages[0, 0]
        outline = (owners[pixels] != owners[pixels - 1]) | (owners[pixels] != owners[pixels + 1])
        outline |= (owners[pixels] != owners[pixels - width]) | (owners[pixels] != owners[pixels + width])
        assert np.count_nonzero(outline) > 300
        assert np.count_nonzero(~outline & (owners[pixels] > 0)) > 300
        assert set(np.flatnonzero(lit) + 1) == set(np.abs(owners[pixels]))

    def test_it_follows_from_the_frame_number(self, shot):
        from quiltcli.analysis.verify.sample import sampled_pixels

        def pixels(frame):
            lit, nothing = shot.trial.rays.lit, np.empty(0, np.int64)
            sample = sampled_pixels(shot.stage.layout, shot.stage.owners, lit, 2, 500, frame, nothing)
            return np.concatenate(list(sample)).tolist()

        assert pixels(7) == pixels(7) == sorted(set(pixels(7)))
        assert pixels(7) != pixels(8)
        assert pixels(-7) != pixels(7)

    def test_asking_for_more_than_there_are_gives_all(self, shot, verdict):
        assert shot.verify(VerifyOptions(threads=1)).inside.as_json() == verdict.inside.as_json()


def test_threads_do_not_change_the_verdict(shot):
    one, two = (shot.verify(replace(EVERY, threads=n)).as_json() for n in (1, 2))
    assert one == two


def test_no_facet_is_lit(tmp_path):
    verdict = shoot(write_job(tmp_path, (CUBE, CUBE_FACES), (CUBE, [[0, 1, 2]]), (0.2, 0.1, 0.3))).verify()
    assert (verdict.lit, verdict.inside["pixels"], verdict.seams.counts["edges"]) == (0, 0, 0)
    assert verdict.passed
    assert verdict.words == "nothing to verify, no facet is lit"
    assert verdict_rows(verdict)


class TestImagesOnDisk:
    def test_the_quilt_is_taken_when_this_job_made_it(self, tmp_path):
        job = cube_job(tmp_path)
        assert "drawn in memory (" in verdict_on(job).images
        render(job)
        verdict = verdict_on(job)
        assert verdict.images == f"the quilt in {tmp_path / 'out'}"
        assert found(verdict) == {}
        assert verdict.inside["depths"] > 500
        assert verdict_on(job, VerifyOptions(redraw=True)).images == "drawn in memory"

    def test_another_jobs_quilt_is_not(self, tmp_path):
        render(cube_job(tmp_path))
        assert "drawn in memory (" in verdict_on(cube_job(tmp_path, far=99)).images

    def test_a_quilt_without_depth_is_not(self, tmp_path):
        job = cube_job(tmp_path, more="output: {channels: [rgba]}\n")
        render(job)
        assert "has no Z)" in verdict_on(job).images

    def test_triangles_are_compared_where_they_were_written(self, tmp_path):
        job = cube_job(tmp_path, more="output: {channels: [Z, triangle]}\n")
        render(job)
        assert verdict_on(job).inside["triangles"] > 500

    @pytest.mark.parametrize(("name", "kind"), [("Z", "depth"), ("A", "alpha")])
    def test_what_was_changed_on_disk_is_found(self, tmp_path, name, kind):
        job = cube_job(tmp_path)
        render(job)
        path = quilt_path(tmp_path / "out", 1, 1)
        image = read_exr(path)
        channels = dict(image.channels)
        shown = np.isfinite(channels["Z"])
        channels[name] = np.where(
            shown, channels[name] * np.float32(0.99 if name == "Z" else 0), channels[name]
        )
        channels[name] = channels[name].astype(image.channels[name].dtype)
        write_exr(path, channels, image.attributes)
        assert kind in found(verdict_on(job))

    def test_several_samples_a_pixel_leave_depth_at_the_centre(self, tmp_path):
        job = cube_job(tmp_path, more="render: {samples: 2}\n")
        render(job)
        verdict = verdict_on(job)
        assert verdict.images.startswith("the quilt in")
        assert found(verdict) == {}


class TestCommand:
    @pytest.fixture
    def job(self, tmp_path):
        cube_job(tmp_path)
        return str(tmp_path / "job.yaml")

    def test_a_good_frame_exits_with_0(self, job):
        result = CliRunner().invoke(main, ["verify", job, "-f", "1"])
        assert result.exit_code == 0, result.output
        assert "within tolerance" in result.stdout
        assert "cracks" in result.stdout

    def test_json_and_picture(self, job, tmp_path):
        files = ["--json", str(tmp_path / "v.json"), "--picture", str(tmp_path / "v.png")]
        assert CliRunner().invoke(main, ["verify", job, "--all", *files]).exit_code == 0
        entry = json.loads((tmp_path / "v.json").read_text())
        assert (entry["quilt_verify"], entry["all_pixels"], entry["passed"]) == (1, True, True)
        assert entry["facets"]["crack"] == 0
        assert (tmp_path / "v.png").read_bytes().startswith(b"\x89PNG")

    def test_json_on_stdout_is_nothing_but_json(self, job):
        entry = json.loads(CliRunner().invoke(main, ["verify", job, "--json", "-"]).stdout)
        assert entry["faults"] == []

    def test_a_fault_exits_with_1(self, job, tmp_path):
        assert CliRunner().invoke(main, ["render", job]).exit_code == 0
        path = quilt_path(tmp_path / "out", 1, 1)
        image = read_exr(path)
        far = {**image.channels, "Z": image.channels["Z"] * np.float32(1.0001)}
        write_exr(path, far, image.attributes)
        picture = tmp_path / "v.png"
        result = CliRunner().invoke(main, ["verify", job, "--picture", str(picture)])
        assert result.exit_code == 1
        assert "OUT OF TOLERANCE" in result.stdout
        assert any(
            line.startswith("depth missed") and line.endswith("FAIL") for line in result.stdout.split("\n")
        )
        from PIL import Image

        marked = np.asarray(Image.open(picture).convert("RGB")) == (200, 80, 255)
        assert marked.all(axis=2).any()

    def test_a_machine_without_embree_says_so(self, tmp_path, monkeypatch):
        shot = shoot(cube_job(tmp_path))
        monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
        with pytest.raises(
            MissingExtraError, match="rays are cast with Embree, but embreex is not installed"
        ):
            shot.verify()
