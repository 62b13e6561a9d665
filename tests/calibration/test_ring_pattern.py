"""Test patterns of a spinning mirror."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from quiltcli.calibration.ring_pattern import KINDS, planes
from quiltcli.cli.group import main
from quiltcli.formats.bitplanes import read_packed, unpack
from quiltcli.formats.drawing.font import text_mask
from quiltcli.job.load import load_mirror_file
from quiltcli.ring.build import rig_of
from tests.helpers.ring_job import ring_job


def display(folder: Path, **more: object) -> Path:
    return ring_job(folder, size=96, positions=48, lobe=7.5, **more).with_name("turn.yaml")  # type: ignore[arg-type]


def quilt(*words: object) -> Result:
    return CliRunner().invoke(main, ["pattern", *map(str, words)])


def test_a_turn_of_packed_pictures_is_written(tmp_path: Path) -> None:
    path = display(tmp_path, more="packing: {order: brg, bits: msb}")
    run = quilt(path, "-o", tmp_path / "pat", "--kind", "id", "--kind", "white")
    assert run.exit_code == 0, run.output
    names = [f"dvi.{k:08d}.png" for k in (1, 2)]
    assert [p.name for p in sorted((tmp_path / "pat" / "id").iterdir())] == names
    bits = unpack(read_packed(tmp_path / "pat" / "white" / names[1])[None], "brg", "msb")
    (plane,) = planes(rig_of(load_mirror_file(path)), 24 + 5)
    np.testing.assert_array_equal(bits[5], plane.lit)
    assert quilt(path, "-o", tmp_path / "pat", "--kind", "white").exit_code == 2
    assert quilt(path, "-o", tmp_path / "pat", "--kind", "white", "--overwrite").exit_code == 0


def test_a_number_is_read_by_the_viewers_of_its_position(tmp_path: Path) -> None:
    """Taken from the mirror as its viewers see it, each dot of the number is where its font has it."""
    rig = rig_of(load_mirror_file(display(tmp_path)))
    for position in (0, 16, 36):
        (plane,) = planes(rig, position)
        drawn = KINDS["id"](plane) & ~KINDS["border"](plane)
        mask = text_mask(str(position + 1))
        dot = 1.2 * plane.radius / max(mask.shape[1], 18)
        rows, columns = np.nonzero(mask)
        for row, column in zip(rows, columns, strict=True):
            right, up = (column + 0.5 - mask.shape[1] / 2) * dot, (mask.shape[0] / 2 - row - 0.5) * dot
            nearest = np.argmin(np.hypot(plane.across - right, plane.up - up))
            assert drawn.ravel()[nearest]
        assert 0.5 < drawn.sum() / (mask.sum() * (dot * 96 / 0.13) ** 2) / 0.5**0.5 < 1.5


def test_every_pattern_stays_on_the_mirror(tmp_path: Path) -> None:
    rig = rig_of(load_mirror_file(display(tmp_path)))
    (plane,) = planes(rig, 3)
    for name, draw in KINDS.items():
        bits = draw(plane) & plane.lit
        assert bits.any(), name
        assert bits.all() == (name == "white" and plane.lit.all())
    assert (KINDS["border"](plane) & ~plane.lit).sum() == 0


@pytest.mark.parametrize("kind", ["marker", "checker"])
def test_patterns_of_facets_are_not_for_mirrors(tmp_path: Path, kind: str) -> None:
    run = quilt(display(tmp_path), "-o", tmp_path / "pat", "--kind", kind)
    assert run.exit_code == 2
    assert f"unknown pattern '{kind}' for a spinning mirror (known: id, border, grid, white)" in run.output
    assert not (tmp_path / "pat").exists()
