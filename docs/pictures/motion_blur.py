"""The demo with things that fly, seen by someone who walks: at once, and with the shutter open.

python docs/pictures/motion_blur.py -o PICTURE.png
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from quiltcli import draw
from quiltcli.images.preview import tone_map
from quiltcli.job import load_job

ROOT = Path(__file__).parents[2]
FLIGHT = {
    "teapot": {"frame": 4, "translate": [0, 0.016, 0], "rotate_deg": [0, 95, 0], "scale": 0.56},
    "pearl": {"frame": 4, "translate": [0.1, 0.1, 0.24], "scale": 0.062},
    "cube": {"frame": 4, "translate": [-0.155, 0.08, 0.165], "rotate_deg": [60, 32, 0], "scale": 0.07},
}


def flying_scene():
    """The demo's scene with keyframes."""
    scene = yaml.safe_load((ROOT / "scenes/teapot_and_solids.yaml").read_text())
    for item in scene["objects"]:
        item["mesh"] = str(ROOT / "scenes" / item["mesh"])
        if item["name"] in FLIGHT:
            first = {"frame": 3, **item["transform"]}
            item["transform"] = {"keyframes": [first, FLIGHT[item["name"]]]}
    return scene


with tempfile.TemporaryDirectory() as folder:
    scene = Path(folder) / "scene.yaml"
    scene.write_text(yaml.safe_dump(flying_scene()))
    panels = []
    for shutter in (0.0, 0.6):
        job = load_job(ROOT / "scenes/demo.yaml")
        render = job.render.model_copy(update={"samples": 64, "shutter": shutter, "motion_samples": 32})
        job = job.model_copy(update={"scene": scene, "render": render})
        (drawn,) = draw(job, [3])
        panels.append(tone_map(drawn.stack(1, "RGB").astype(np.float32)))
    Image.fromarray(np.concatenate(panels, axis=1)).save(sys.argv[2])
