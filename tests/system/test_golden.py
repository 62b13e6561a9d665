"""Golden pictures: the last look at everything together, after closed forms and rays have had theirs.

Few on purpose. `make golden` makes them anew; look at the differences before committing them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from quiltcli.images.facets import page_of
from quiltcli.images.preview import tone_map
from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import set_stage
from quiltcli.viewer.viewer import viewer_at

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden"
JOB = """\
quilt_job: 1
display: display.yaml
layout: {{method: rows}}
scene: {scene}
frames: 1
viewer:
  near: 0.05
  far: 20
  path:
    keyframes: [{{frame: 1, position: {eye}, look_at: {at}}}]
output: {{channels: [rgba]}}
"""
PICTURES = {
    "icosahedron_teapot": ("icosahedron", 420, "teapot_in_sphere.yaml", [0.5, 0.75, 1.1], [0, 0.3, 0]),
    "cave_room": ("cave5", 24, "room.yaml", [0.2, 1.6, 0.8], [0, 1.5, -3]),
}


def drawn(folder: Path, mesh: str, density: int, scene: str, eye: list[float], at: list[float]) -> np.ndarray:
    """The first page of a small quilt, tone-mapped by the plain curve."""
    model = (ROOT / "display_models" / f"{mesh}.yaml").read_text()
    lines = [line for line in model.splitlines() if not line.startswith(("mesh", "resolution", "  pixels"))]
    lines += [f"mesh: {ROOT / 'display_models' / mesh}.obj", f"resolution: {{pixels_per_metre: {density}}}"]
    (folder / "display.yaml").write_text("\n".join(lines))
    (folder / "job.yaml").write_text(JOB.format(scene=ROOT / "scenes" / scene, eye=eye, at=at))
    stage = set_stage(load_job(folder / "job.yaml"))
    buffers = new_buffers(stage)
    draw_frame(stage, viewer_at(stage.job.viewer, 1, "radial", 30.0), buffers)
    rgb = np.stack([page_of(buffers[name], stage.layout, 0).astype(np.float32) for name in "RGB"], axis=-1)
    return tone_map(rgb, "srgb")


@pytest.mark.parametrize("name", PICTURES)
def test_golden(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    found = drawn(tmp_path, *PICTURES[name])
    path = GOLDEN / f"{name}.png"
    if request.config.getoption("--update-golden"):
        GOLDEN.mkdir(exist_ok=True)
        Image.fromarray(found).save(path, optimize=True)
        return
    golden = np.asarray(Image.open(path).convert("RGB"))
    assert found.shape == golden.shape
    off = np.abs(found.astype(int) - golden).max(axis=2)
    if off.max() > 1:
        Image.fromarray((np.minimum(off * 16, 255)).astype(np.uint8)).save(tmp_path / "difference_x16.png")
    where = f"see {tmp_path / 'difference_x16.png'}"
    assert off.mean() <= 0.01, where
    assert np.percentile(off, 99.9) <= 1, where
    assert off.max() <= 24, where
