"""Write docs/pictures/brightness.png: a corner of panels that darken aslant, as they are and corrected.

python docs/pictures/brightness.py -o PICTURE.png
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from PIL import Image

from quiltcli.analysis.simulate import PictureOptions
from quiltcli.analysis.simulate.files import Pictures, write_pictures
from quiltcli.job import load_job

ROOT = Path(__file__).resolve().parents[2]
DISPLAY = f"""
quilt_display: 1
mesh: {ROOT}/display_models/corner_billboard.obj
resolution: {{pixels_per_metre: 120}}
corrections:
  brightness: {{table: [[0, 1], [20, 0.9], [40, 0.66], [60, 0.4], [80, 0.18]], limit: 4}}
  facets: {{2: {{gain: [1.08, 1, 0.93]}}}}
  level: 0.3
"""


def main() -> None:
    """Take both pictures and put them side by side."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", type=Path, required=True)
    output = parser.parse_args().output
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "display.yaml").write_text(DISPLAY)
        sets = [f"display={folder}/display.yaml", f"output.directory={folder}/out"]
        job = load_job(ROOT / "scenes/show_corner.yaml", sets)
        seen = []
        for corrected, exposure in ((False, 0.3), (True, 1.3)):
            options = PictureOptions((600, 480), samples=2, compare=False, corrected=corrected)
            path = folder / f"{corrected}.png"
            for line in write_pictures(job, [24], options, Pictures(path, view="srgb", exposure=exposure)):
                print(line)
            seen.append(Image.open(path).convert("RGB"))
    wide, high = seen[0].size
    both = Image.new("RGB", (2 * wide + 8, high), "white")
    both.paste(seen[0], (0, 0))
    both.paste(seen[1], (wide + 8, 0))
    both.save(output)


if __name__ == "__main__":
    main()
