"""A golden turn of a spinning mirror: the bits of 24 positions, the last look at everything together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.formats.bitplanes import read_packed
from quiltcli.job import load_job
from quiltcli.render.ring.walk import RingOptions, render_turns

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden" / "turn_24.png"
DISPLAY = """\
quilt_display: 1
kind: lightfield360
image: [96, 96]
projector: {height: 0.6, diameter: 0.13}
mirror: {outline: {disk: 0.13}}
rotation: {positions: 24}
diffuser: {horizontal_deg: 15}
"""
JOB = """\
quilt_job: 1
display: turn.yaml
scene: {scene}
frames: 1
ring: {{height: 0.4, distance: 1.0, users: [{{azimuth_deg: 120, height: 0.15, distance: 0.7}}]}}
"""


def test_golden_turn(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    (tmp_path / "turn.yaml").write_text(DISPLAY)
    (tmp_path / "job.yaml").write_text(JOB.format(scene=ROOT / "scenes" / "teapot_on_mirror.yaml"))
    render_turns(load_job(tmp_path / "job.yaml"), RingOptions(workers=1))
    found = tmp_path / "out" / "packed" / "dvi.00000001.png"
    if request.config.getoption("--update-golden"):
        GOLDEN.write_bytes(found.read_bytes())
        return
    assert np.array_equal(read_packed(found), read_packed(GOLDEN))
