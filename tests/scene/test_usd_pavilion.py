"""The shipped pavilion, written as a USD stage, is the same picture."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.usd_files import needs_usd

needs_usd()
ROOT = Path(__file__).parents[2]
STAGE = """
quilt_scene: 1
objects: [{mesh: pavilion.usdc, animation: {}}]
lights: [{type: file, shadows: true}]
background: [0.012, 0.018, 0.04]
"""


def exporter():
    """The script that makes the picture of the documents."""
    spec = importlib.util.spec_from_file_location("usd_picture", ROOT / "docs/pictures/usd.py")
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def page(folder, name, scene):
    text = (ROOT / "scenes/show_box.yaml").read_text()
    text = text.replace("../display_models", str(ROOT / "display_models")).replace(
        "pavilion.yaml", str(scene)
    )
    text = text.replace("../out/show_box", name) + "render: {scale: 0.0625, shadows: false}\n"
    (folder / f"{name}.yaml").write_text(text)
    render(load_job(folder / f"{name}.yaml"), RenderOptions(frames=[7], threads=1))
    return read_exr(folder / name / "quilt/page_01.0007.exr").channels


@pytest.mark.long
def test_a_set_piece_is_the_same_picture_as_a_stage(tmp_path):
    exporter().write_stage(tmp_path / "pavilion.usdc")
    (tmp_path / "stage.yaml").write_text(STAGE)
    one = page(tmp_path, "yaml", ROOT / "scenes/pavilion.yaml")
    other = page(tmp_path, "usd", tmp_path / "stage.yaml")
    here = np.isfinite(one["Z"])
    assert here.mean() > 0.1
    # Points of a stage are single precision, which may decide at outlines.
    assert (here != np.isfinite(other["Z"])).mean() < 1e-3
    here &= np.isfinite(other["Z"])
    assert np.quantile(np.abs(one["Z"][here] - other["Z"][here]), 0.995) < 1e-5
    # Shadows of environments have as many rays as a scene file says, which a stage cannot.
    for name in "RGB":
        error = np.abs(one[name][here].astype(np.float64) - other[name][here])
        assert np.quantile(error, 0.99) < 2e-3
