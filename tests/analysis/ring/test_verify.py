"""`verify` of turns: what is right passes, and every kind of fault is found."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.ring.verify import RingVerifyOptions, verify_turn
from quiltcli.cli import main
from quiltcli.formats.bitplanes import read_packed, write_packed
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.job import load_job
from quiltcli.render.ring.walk import RingOptions, render_turns
from tests.helpers.ring_job import ring_job

ROOT = Path(__file__).parents[3]


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    job = ring_job(tmp_path, tones=True, lobe=15, size=32)
    render_turns(load_job(job), RingOptions(workers=1))
    return job


@pytest.mark.parametrize("method", ["exact", "raycast"])
@pytest.mark.parametrize("reflection", ["plane", "cone"])
def test_a_turn_passes(tmp_path: Path, method: str, reflection: str) -> None:
    job = ring_job(tmp_path, method=method, tones=True, size=32)
    display = tmp_path / "turn.yaml"
    display.write_text(
        display.read_text().replace("{horizontal_deg", f"{{reflection: {reflection}, horizontal_deg")
    )
    render_turns(load_job(job), RingOptions(workers=1))
    verdict = verify_turn(load_job(job), RingVerifyOptions(everything=True))
    assert verdict.passed
    assert (verdict.bits, verdict.tones, verdict.source) == (24, 24, "packed pictures")
    assert verdict.rays > 24 * 500
    assert verdict.trip_error < 1e-9


def test_the_display_that_comes_with_quilt_passes() -> None:
    verdict = verify_turn(load_job(ROOT / "scenes" / "demo_mirror.yaml"), RingVerifyOptions(redraw=True))
    assert verdict.passed
    assert (verdict.positions, verdict.rays) == (12, 12 * math.ceil(20_000 / 12))
    assert verdict.edges > 0


@pytest.mark.long
@pytest.mark.parametrize("reflection", ["plane", "cone"])
def test_what_the_display_that_comes_with_quilt_is_sent_passes(tmp_path: Path, reflection: str) -> None:
    """Positions on the disk, bits and light, and a quarter of their pixels by rays."""
    display = tmp_path / "turn.yaml"
    text = (ROOT / "display_models" / "spinning_mirror.yaml").read_text()
    display.write_text(text.replace("reflection: plane", f"reflection: {reflection}"))
    sets = [f"display={display}", "output.tones=true", f"output.directory={tmp_path / 'out'}"]
    job = load_job(ROOT / "scenes" / "demo_mirror.yaml", sets)
    render_turns(job, RingOptions(positions=range(1, 289, 24)))
    verdict = verify_turn(job, RingVerifyOptions(pixels=12 * 120_000))
    assert verdict.passed, verdict
    assert (verdict.bits, verdict.tones, verdict.rays) == (12, 12, 12 * 120_000)


def test_straight_edges_are_found_wrong(tmp_path: Path) -> None:
    job = load_job(ring_job(tmp_path, method="vertex", size=160), ["render.tessellate=9"])
    verdict = verify_turn(job, RingVerifyOptions(redraw=True))
    assert verdict.rays_wrong > 0
    assert not verdict.passed


def test_a_bit_that_is_turned_is_found(drawn: Path) -> None:
    path = drawn.parent / "out" / "packed" / "dvi.00000001.png"
    picture = read_packed(path).copy()
    picture[16, 16, 0] ^= 1
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
    changed["G"][16, 16] += 1
    write_exr(path, changed, {})
    verdict = verify_turn(load_job(drawn), RingVerifyOptions(everything=True))
    assert (verdict.tones_wrong, verdict.bits_wrong, verdict.passed) == (1, 0, False)


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
