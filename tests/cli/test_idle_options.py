"""Options that would do nothing are refused, by name, instead of being passed over."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from tests.helpers.ring_job import ring_job
from tests.helpers.tiny_job import write_tiny_job

ON_A_RING = {
    "simulate -o e.png --from 1,1,1": "--from: means nothing on a ring of viewers",
    "simulate -o e.png --third-person --scene solid": "--third-person, --scene: mean nothing on a ring",
    "simulate -o e.png --supersample 2": "--supersample: means nothing on a ring",  # even as it is by default
    "simulate -o e.png --no-compare": "--compare: means nothing on a ring",
    "verify --eye left": "--eye: means nothing on a ring of viewers",
    "verify --picture p.png": "--picture: means nothing on a ring of viewers",
}
ON_FACETS = {
    "simulate -o e.png --photometric": "--photometric: means nothing without a ring of viewers",
    "simulate -o e.png --content mcop --focus 1": "--content, --focus: mean nothing without a ring",
}
IN_GENERAL = {
    "calibrate clicks.yaml --units mm": "--units: means nothing beside clicks",
    "calibrate clicks.yaml --report r --eye 0,0,0": "--eye, --report: mean nothing beside clicks",
    "calibrate clicks.yaml --tolerance -1": "'--tolerance': -1.0 is not in the range x>=0",
    "calibrate c.csv --display display.yaml -o m.yaml --report r": "--report: means nothing beside a table",
    "calibrate a.jpg --display display.yaml -o m.yaml --units m": "--units: means nothing beside photos",
    "film out -o f.mp4 --size 10x10": "--size: means nothing without --of simulation",
    "film out -o f.mp4 --bits 16": "--bits: means nothing without --codec png or tiff",
    "film out -o f.mp4 --bits 8 --codec dpx": "--bits: means nothing without --codec png or tiff",
    "project job.yaml --picture a.png -o p --as equirect --tilt-deg 3": "--tilt-deg: means nothing",
    "project job.yaml --picture a.png -o p --as pinhole --fov-deg 9 --yaw-deg 3": "--yaw-deg: means nothing",
    "pattern turn.yaml -o p --step 3": "--step: means nothing in patterns of a mirror",
    "view ring --ghost 3 --errors": "--errors, --ghost: mean nothing on a page of a spinning mirror",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("idle")
    ring_job(folder, positions=24)
    (folder / "job.yaml").rename(folder / "turns.yaml")
    write_tiny_job(folder)
    (folder / "ring" / "packed").mkdir(parents=True)
    (folder / "ring" / "report.json").write_text('{"kind": "lightfield360"}')
    return folder


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        *((f"{line.replace(' ', ' turns.yaml ', 1)}", words) for line, words in ON_A_RING.items()),
        *((f"{line.replace(' ', ' job.yaml ', 1)}", words) for line, words in ON_FACETS.items()),
        *IN_GENERAL.items(),
    ],
)
def test_what_would_do_nothing_is_refused(
    words: str, expected: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    found = CliRunner().invoke(main, words.split())
    assert found.exit_code == 2, found.output
    assert expected in found.output
    assert sorted(folder.rglob("*")) == before
