"""`verify` of turns: what is right passes, and every kind of fault is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.check import check_files
from quiltcli.analysis.info import describe
from quiltcli.analysis.ring.verify import RingVerifyOptions, verify_turn
from quiltcli.cli import main
from quiltcli.formats.bitplanes import read_packed, write_packed
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.job import load_job
from quiltcli.render.ring.walk import RingOptions, render_turns
from tests.helpers.ring_job import ring_job


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    job = ring_job(tmp_path, tones=True, lobe=15)
    render_turns(load_job(job), RingOptions(workers=1))
    return job


@pytest.mark.parametrize("method", ["exact", "raycast"])
@pytest.mark.parametrize("reflection", ["plane", "cone"])
def test_a_turn_passes(tmp_path: Path, method: str, reflection: str) -> None:
    job = ring_job(tmp_path, method=method, tones=True)
    display = tmp_path / "turn.yaml"
    display.write_text(
        display.read_text().replace("{horizontal_deg", f"{{reflection: {reflection}, horizontal_deg")
    )
    render_turns(load_job(job), RingOptions(workers=1))
    verdict = verify_turn(load_job(job), RingVerifyOptions(everything=True))
    assert verdict.passed
    assert (verdict.bits, verdict.tones, verdict.source) == (24, 24, "packed pictures")
    assert verdict.rays > 24 * 1000
    assert verdict.trip_error < 1e-9


def test_straight_edges_are_found_wrong(tmp_path: Path) -> None:
    job = load_job(ring_job(tmp_path, method="vertex", size=200), ["render.tessellate=9"])
    verdict = verify_turn(job, RingVerifyOptions(everything=True, redraw=True))
    assert verdict.rays_wrong > 0
    assert not verdict.passed


def test_a_bit_that_is_turned_is_found(drawn: Path) -> None:
    path = drawn.parent / "out" / "packed" / "dvi.00000001.png"
    picture = read_packed(path).copy()
    picture[24, 24, 0] ^= 1
    picture[0, 0, 1] ^= 128
    write_packed(path, picture)
    verdict = verify_turn(load_job(drawn), RingVerifyOptions(everything=True))
    assert (verdict.bits_wrong, verdict.stray, verdict.passed) == (2, 1, False)
    result = CliRunner().invoke(main, ["verify", str(drawn), "--all"])
    assert result.exit_code == 1
    assert "FAILED" in result.output


def test_light_that_was_changed_is_found(drawn: Path) -> None:
    path = drawn.parent / "out" / "tones" / "turn_0001.0007.exr"
    image = read_exr(path)
    changed = {name: np.array(values) for name, values in image.channels.items()}
    changed["G"][20, 20] += 1
    write_exr(path, changed, {})
    verdict = verify_turn(load_job(drawn), RingVerifyOptions(everything=True))
    assert (verdict.tones_wrong, verdict.bits_wrong, verdict.passed) == (1, 0, False)


def test_info_and_check_know_rings(drawn: Path) -> None:
    found = describe(drawn.parent / "turn.yaml")
    assert found.data["projector"] == [0, 0.6, 0]
    assert found.data["projector_mirrored"] == [-0.6, 0, 0]
    assert dict(found.lines)["timing"].startswith("200 Hz, 4800 pictures and 200 turns a second")
    told = describe(drawn)
    assert dict(told.lines)["positions seen"] == "1.3 from the ring"
    assert "cone" in dict(told.lines)["note"]
    notices: list[str] = []
    assert check_files([drawn, drawn.parent / "turn.yaml"], notices.append) == []
    assert notices == []
    display = drawn.parent / "turn.yaml"
    display.write_text(display.read_text().replace("horizontal_deg: 15", "horizontal_deg: 1.25"))
    check_files([drawn], notices.append)
    assert "cover 30° of 360°: an eye sees dark gaps" in notices[0]
    wrong = drawn.read_text().replace("distance: 1.0", "distance: 0.04")
    drawn.write_text(wrong)
    (problem,) = check_files([drawn])
    assert "viewers stand at 0.04 m" in problem.message


def test_commands_of_a_new_user(drawn: Path) -> None:
    def run(*words: str) -> str:
        result = CliRunner().invoke(main, [*words])
        assert result.exit_code == 0, result.output
        return result.output

    folder = drawn.parent
    assert "nothing is wrong" in run("verify", str(drawn))
    assert '"passed": true' in run("verify", str(drawn), "--json", "-")
    picture = folder / "seen.png"
    lines = run("simulate", str(drawn), "-o", str(picture), "--size", "40x40", "--eye", "30,0.4,1", "--tones")
    assert "against a direct picture" in lines
    assert picture.is_file()
    assert "nothing is wrong with this job" in run("render", str(drawn), "--dry-run", "--overwrite")
    assert "every frame is complete" in run("render", str(drawn), "--resume")
    result = CliRunner().invoke(main, ["render", str(drawn), "--facets", "1"])
    assert result.exit_code == 2
    result = CliRunner().invoke(main, ["simulate", str(drawn), "-o", str(picture), "--eye", "0,-2,1"])
    assert result.exit_code == 2
    assert "nothing is seen from -2 m high" in result.output
