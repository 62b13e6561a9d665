"""The picture of docs/panels.md: residuals over a made-up photo of a cube that was put up loosely."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from quiltcli.calibration.markers import place_markers
from quiltcli.calibration.panels.calibrate import Wishes, calibrate
from quiltcli.calibration.panels.report import write_report
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from tests.helpers import photos

ROOT = Path(__file__).parents[2]


def main(out: Path) -> None:
    """Take the photos, calibrate, keep one picture."""
    facets = load_display(load_display_file(ROOT / "display_models" / "cube5.yaml"))
    rng = np.random.default_rng(5)
    turns, shifts = rng.uniform(-0.05, 0.05, (facets.count, 3)), rng.uniform(-0.015, 0.015, (facets.count, 3))
    real, markers, lens = photos.moved(facets, turns, shifts), place_markers(facets), photos.camera()
    middle = facets.corners.mean(axis=0)
    with tempfile.TemporaryDirectory() as scratch:
        pictures = []
        for k in range(6):
            a = 2 * np.pi * k / 6 + 0.4
            pose = photos.looking(middle + 1.5 * np.array((np.cos(a), 0.7, np.sin(a))), middle)
            pictures.append(photos.photo(real, markers, lens, pose))
        paths = photos.save(Path(scratch), pictures)
        solution, used = calibrate(facets, paths, Wishes())
        write_report(Path(scratch) / "report", solution, facets, used)
        with Image.open(Path(scratch) / "report" / "photo_02.residuals.png") as picture:
            picture.crop((400, 300, 1200, 900)).save(out)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
