"""The curved display models held against rays, with fewer pixels, from inside, outside and the side."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.verify import verify_images
from quiltcli.analysis.verify.images import draw_images
from tests.helpers.curved_jobs import boxes, curved_job
from tests.helpers.verified_jobs import EVERY
from tests.render.test_curved import staged

FOLDER = Path(__file__).parents[2] / "display_models"
DEGREE = np.tan(np.radians(1))
EYES = {
    "sphere": [(0.5, 1.7, 2.4), (-3.0, 0.5, -0.4), (0.0, 1.0 + DEGREE, 1.02)],
    "cylinder_wall": [(0.0, 1.7, 0.0), (2.0, 1.2, -2.5)],
    "dome": [(0.0, 1.7, 0.0), (3.0, 2.5, 1.0)],
    "paraboloid": [(0.4, 1.5, 0.6), (1.6, 2.2, -1.0), (1.5, 1.0 + 0.5 * 0.9, 0.2)],
    "bezier_panel": [(0.2, 1.5, 2.6), (-1.9, 1.2, 1.1)],
    "projected_sphere": [(1.5, 1.7, 2.4), (0.3, 3.0, 0.8)],
    "panorama160": [(0.1, 1.6, 0.2), (0.7, 1.2, -0.5)],
}


EVERY_EYE = [(name, eye) for name, eyes in EYES.items() for eye in eyes]


@pytest.mark.parametrize(("name", "eye"), EVERY_EYE)
def test_a_model_is_within_tolerance(name: str, eye: tuple[float, float, float], tmp_path: Path) -> None:
    verify_model(name, eye, 16, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize(("name", "eye"), EVERY_EYE)
def test_a_model_with_many_pixels_is(name: str, eye: tuple[float, float, float], tmp_path: Path) -> None:
    verify_model(name, eye, 4, tmp_path)


def verify_model(name: str, eye: tuple[float, float, float], part: int, tmp_path: Path) -> None:
    """Hold a model with so much fewer pixels a side against rays."""
    text = (FOLDER / f"{name}.yaml").read_text().partition("quilt_display: 1\n")[2]
    pixels = [int(side) // part for side in re.findall(r"pixels: \[(\d+), (\d+)\]", text)[0]]
    text = text.replace("screen: ", f"screen: {FOLDER}/")
    text = re.sub(r"pixels: \[\d+, \d+\]", f"pixels: {pixels}", text)
    vertices, faces = boxes(60, 0.8, 4.0)
    job = curved_job(tmp_path, text, (vertices, faces), eye, (0.01, 1, 0))
    stage, viewer = staged(job)
    images = draw_images(stage, stage.views([1])[0], 1)
    verdict = verify_images(stage, viewer, images, EVERY)
    assert verdict.passed, verdict.faults
    assert verdict.inside.counts["covered"] > 100
