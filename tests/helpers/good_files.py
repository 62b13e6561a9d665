"""One small good file of every kind, for tests to break."""

from __future__ import annotations

from pathlib import Path

JOB = """\
quilt_job: 1
display: display.yaml
scene: mesh.obj
frames: 1-120
viewer:
  near: 0.05
  far: 50
  path:
    keyframes:
    - {frame: 1, position: [0, 1.6, 2.5], look_at: [0, 1.2, 0]}
"""
DISPLAY = "quilt_display: 1\nmesh: mesh.obj\nresolution: {pixels_per_metre: 1200}\n"
SCENE = "quilt_scene: 1\nobjects:\n- mesh: mesh.obj\n"
PLACE = (
    "- {id: 1, page: 1, size: [9, 9], quilt_from_facet: [[1, 0, 0], [0, 1, 0]], origin: [0, 0, 0],"
    " du: [1, 0, 0], dv: [0, 1, 0], polygon: [[0, 0], [9, 0], [0, 9]]}\n"
)
LAYOUT = "quilt_layout: 1\npages:\n- size: [64, 64]\nfacets:\n" + PLACE
GOOD = {"job": JOB, "display": DISPLAY, "scene": SCENE, "layout": LAYOUT}


def write_good_files(folder: Path) -> Path:
    """Write the good files and what they name; returns the job."""
    for name, text in GOOD.items():
        (folder / f"{name}.yaml").write_text(text)
    (folder / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "track.csv").write_text("frame,x,y,z\n1,2,3,4\n")
    (folder / "folder.yaml").mkdir()
    return folder / "job.yaml"


def edited(folder: Path, name: str, old: str, new: str) -> Path:
    """Replace a text in one of the good files; an empty `old` adds at the end."""
    path = folder / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new) if old else text + new)
    return path
