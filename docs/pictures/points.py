"""A ball of lights for the picture of docs/points.md: `points.py FOLDER` writes the files."""

import json
import math
import sys
from pathlib import Path

COUNT, RADIUS = 5000, 0.3

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
points = []
for k in range(COUNT):  # along a spiral, each with as much of the ball
    y, turn = 1 - (2 * k + 1) / COUNT, k * math.pi * (1 + math.sqrt(5))
    ring = math.sqrt(1 - y * y)
    point = RADIUS * ring * math.cos(turn), RADIUS + RADIUS * y, RADIUS * ring * math.sin(turn)
    points.append([round(c, 6) for c in point])
scene = Path(__file__).parents[2] / "scenes" / "teapot_in_sphere.yaml"
(folder / "leds.json").write_text(json.dumps(points))
(folder / "display.yaml").write_text("quilt_display: 1\npoints: {file: leds.json, size: 8 mm}\n")
(folder / "job.yaml").write_text(
    f"quilt_job: 1\ndisplay: display.yaml\nscene: {json.dumps(str(scene))}\nframes: 1\n"
    "viewer:\n  near: 0.1\n  far: 10\n"
    "  path: {keyframes: [{frame: 1, position: [0.2, 0.62, 1.15], look_at: [0, 0.3, 0]}]}\n"
    "render: {samples: 9, bleed: 0}\noutput: {directory: out, facets: false}\n"
)
