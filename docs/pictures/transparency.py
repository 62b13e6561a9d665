"""The demo with a teapot of glass, and panes that cross one another.

python docs/pictures/transparency.py -o PICTURE.png
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
GLASS = {"teapot": 0.45, "cube": 0.5, "icosahedron": 0.6}
PANE = "v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n"
COLORS = ([0.9, 0.15, 0.1], [0.1, 0.5, 0.9], [0.95, 0.75, 0.1])


def glass_scene(folder):
    """The demo's scene with opacities, and three panes turned about one axis."""
    (folder / "pane.obj").write_text(PANE)
    scene = yaml.safe_load((ROOT / "scenes/teapot_and_solids.yaml").read_text())
    for item in scene["objects"]:
        item["mesh"] = str(ROOT / "scenes" / item["mesh"])
        if item["name"] in GLASS:
            item["material"]["opacity"] = GLASS[item["name"]]
    for number, color in enumerate(COLORS):
        place = {"scale": 0.13, "rotate_deg": [0, 60 * number + 10, 0], "translate": [0.02, 0.018, 0.16]}
        material = {"color": color, "opacity": 0.45, "roughness": 0.3}
        scene["objects"].append({"mesh": "pane.obj", "transform": place, "material": material})
    return scene


with tempfile.TemporaryDirectory() as name:
    scene = Path(name) / "scene.yaml"
    scene.write_text(yaml.safe_dump(glass_scene(Path(name))))
    job = load_job(ROOT / "scenes/demo.yaml")
    render = job.render.model_copy(update={"samples": 16})
    (drawn,) = draw(job.model_copy(update={"scene": scene, "render": render}), [3])
    Image.fromarray(tone_map(drawn.stack(1, "RGB").astype(np.float32))).save(sys.argv[2])
