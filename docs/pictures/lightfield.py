"""The picture of docs/lightfields.md: a mirror position of a scene, and of photographs of it.

python docs/pictures/lightfield.py PICTURE.png
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from quiltcli.exchange.capture import Ring, capture
from quiltcli.formats.png import save_png
from quiltcli.images.preview import srgb
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.ring.picture import draw_picture

SCENES = Path(__file__).parents[2] / "scenes"
SCENE = f"""\
quilt_scene: 1
objects:
- mesh: {SCENES / "teapot.obj"}
  transform: {{translate: [0, -0.02, 0], scale: 0.2}}
  material: {{color: [0.9, 0.35, 0.1], roughness: 0.35}}
lights:
- {{type: directional, direction: [-1, -2, -1], color: [1.6, 1.6, 1.6]}}
- {{type: ambient, color: [0.15, 0.15, 0.15]}}
"""
DISPLAY = """\
quilt_display: 1
kind: lightfield360
image: [320, 320]
projector: {height: 0.6, diameter: 0.13}
mirror: {outline: {disk: 0.13}}
"""
JOB = """\
quilt_job: 1
display: display.yaml
CONTENT
frames: 1
ring: {height: 0.3, distance: 0.8}
"""
ANGLE = np.radians(75)

with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "display.yaml").write_text(DISPLAY)
    (folder / "scene_job.yaml").write_text(JOB.replace("CONTENT", "scene: scene.yaml"))
    shown = [folder / "scene_job.yaml"]
    for views in (18, 72):
        ring = Ring(views=views, heights=(0.2, 0.3, 0.4), size=(384, 384))
        capture(folder / "scene.yaml", folder / f"ring{views}", ring)
        shown.append(folder / f"job{views}.yaml")
        shown[-1].write_text(JOB.replace("CONTENT", f"lightfield: ring{views}/lightfield.yaml"))
    pictures = [
        draw_picture(set_ring_stage(load_job(path)).show(1), ANGLE).rgb().astype(np.float32) for path in shown
    ]
    for picture in pictures[1:]:
        print(f"{-10 * np.log10(np.mean((picture - pictures[0]) ** 2)):.1f} dB")
    save_png(Path(sys.argv[1]), np.rint(255 * srgb(np.hstack(pictures))).astype(np.uint8))
