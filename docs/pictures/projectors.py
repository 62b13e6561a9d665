"""Write docs/pictures/projectors.png: a projected sphere without blending and with it, and from aside.

python docs/pictures/projectors.py -o PICTURE.png
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

from quiltcli.analysis.simulate import PictureOptions
from quiltcli.analysis.simulate.files import Pictures, write_pictures
from quiltcli.job import load_job

ROOT = Path(__file__).resolve().parents[2]
SIZE = (440, 400)
SCREEN = "quilt_display: 1\nsurfaces:\n- {kind: sphere, radius: 0.3, at: [0, 0.3, 0], pixels: [512, 256]}\n"
PLACES = {"front": (0, 1), "right": (1, 0), "back": (0, -1), "left": (-1, 0)}
SEEN: tuple[dict[str, Any], ...] = (
    {"corrected": False},
    {},
    {"place": (1.0, 0.75, 0.1), "look_at": (0.0, 0.3, 0.0), "fov": 40.0},
)


def main() -> None:
    """Take the pictures and put them side by side."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", type=Path, required=True)
    output = parser.parse_args().output
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "screen.yaml").write_text(SCREEN)
        projectors = "".join(
            f"- name: {side}\n  pixels: [800, 600]\n"
            f"  lens: {{at: [{x * 0.96}, 0.6, {z * 0.96}], look_at: [0, 0.3, 0], throw: 1.1}}\n"
            for side, (x, z) in PLACES.items()
        )
        text = f"quilt_display: 1\nscreen: screen.yaml\nprojectors:\n{projectors}blend: {{black: 0.002}}\n"
        (folder / "display.yaml").write_text(text)
        (folder / "job.yaml").write_text(
            f"quilt_job: 1\ndisplay: display.yaml\nscene: {ROOT}/scenes/pavilion_in_sphere.yaml\nframes: 1\n"
            "viewer:\n  near: 0.05\n  far: 20\n  path:\n    keyframes:\n"
            "    - {frame: 1, position: [0.62, 0.52, 0.72], look_at: [0, 0.3, 0]}\n"
        )
        job = load_job(folder / "job.yaml")
        whole = Image.new("RGB", (SIZE[0] * len(SEEN) + 8 * (len(SEEN) - 1), SIZE[1]), "white")
        for k, how in enumerate(SEEN):
            options = PictureOptions(SIZE, samples=2, compare=False, **how)
            for line in write_pictures(job, [1], options, Pictures(folder / f"{k}.png", exposure=0.3)):
                print(line)
            whole.paste(Image.open(folder / f"{k}.png").convert("RGB"), (k * (SIZE[0] + 8), 0))
    whole.save(output)


if __name__ == "__main__":
    main()
