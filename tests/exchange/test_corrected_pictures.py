"""Pictures made elsewhere are made for perfect panels: what is written makes up for the real ones."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.even_light import COLOR, WALLS, even_job


def test_a_projected_picture_is_corrected_as_a_rendered_one(tmp_path):
    job = even_job(tmp_path, WALLS + "corrections:\n  brightness: {exponent: 1, limit: 9}\n  level: 0.2\n")
    render(job, RenderOptions(folder=tmp_path / "rendered", threads=1, frames=[1]))
    even = {name: np.full((16, 32), value, np.float16) for name, value in zip("RGB", COLOR, strict=True)}
    write_exr(tmp_path / "sky.exr", even, {})
    arguments = ["project", str(tmp_path / "job.yaml"), "--picture", str(tmp_path / "sky.exr")]
    arguments += ["--as", "equirect", "-f", "1", "-o", str(tmp_path / "made")]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    name = "facets/facet_0002.0001.exr"
    made, drawn = read_exr(tmp_path / "made" / name), read_exr(tmp_path / "rendered" / name)
    for channel in "RGB":
        assert made.channels[channel].astype(float) == pytest.approx(
            drawn.channels[channel].astype(float), rel=3e-3
        )
    assert made.attributes["quilt:made"] == "project equirect"
    assert json.loads(made.attributes["quilt:corrections"])["level"] == 0.2
