"""Jobs that show one colour everywhere, so that whatever is uneven is the panels' doing."""

from __future__ import annotations

from pathlib import Path

from quiltcli.job import JobFile, load_job
from tests.helpers.in_memory import icosphere
from tests.helpers.verified_jobs import obj

COLOR = (0.8, 0.6, 0.4)
WALLS = (
    "panels:\n"
    "- {name: left, pixels: [48, 32], size: [1.5, 1], at: [-0.75, 0, 0]}\n"
    "- {name: right, pixels: [32, 32], size: [1, 1], at: [0, 0, 0.5], yaw_deg: -90}\n"
)
CYLINDER = (
    "surfaces:\n- kind: cylinder\n  pixels: [96, 32]\n  radius: 1\n  height: 0.7\n"
    "  arc_deg: [-60, 60]\n  lit: inside\n"
)


def even_job(folder: Path, display: str, more: str = "", eye: object = (-1.2, 0.2, 1.6)) -> JobFile:
    """A job of two frames in which every pixel that is lit shows `COLOR`."""
    points, faces = icosphere(2)
    (folder / "ball.obj").write_text(obj(points * 50, faces))
    (folder / "display.yaml").write_text(f"quilt_display: 1\n{display}")
    (folder / "scene.yaml").write_text(
        f"quilt_scene: 1\nobjects:\n- {{mesh: ball.obj, material: {{color: {list(COLOR)}, unlit: true}}}}\n"
    )
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1-2\nviewer:\n  near: 0.01\n"
        "  far: 200\n  path:\n    keyframes:\n"
        f"    - {{frame: 1, position: {list(eye)}, look_at: [-0.3, 0, 0.2]}}\n"
        "    - {frame: 2, position: [-0.8, 0.4, 2], look_at: [-0.3, 0, 0.2]}\n"
        f"{more}"
    )
    return load_job(folder / "job.yaml")
