"""A whole job small enough to render in a blink: two walls, a tetrahedron, four frames."""

from __future__ import annotations

from pathlib import Path

FILES = {
    "walls.obj": (
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 1 -1 2\nv 1 1 2\n"
        "g back\nf 1 2 3 4\ng right\nf 2 5 6 3\n"
    ),
    "ball.obj": (
        "v -0.5 -0.5 -1\nv 0.5 -0.5 -1\nv 0 0.5 -1\nv 0 0 -0.2\n"
        "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    ),
    "display.yaml": "quilt_display: 1\nmesh: walls.obj\nresolution: {pixels_per_metre: 32}\n",
    "scene.yaml": (
        "quilt_scene: 1\n"
        "objects:\n"
        "- {name: ball, mesh: ball.obj, material: {color: [0.8, 0.2, 0.1]}}\n"
        "lights:\n"
        "- {type: directional, direction: [-1, -2, -1], color: [3, 3, 3]}\n"
    ),
    "job.yaml": (
        "quilt_job: 1\n"
        "display: display.yaml\n"
        "scene: scene.yaml\n"
        "frames: 1-4\n"
        "viewer:\n"
        "  near: 0.05\n"
        "  far: 50\n"
        "  path:\n"
        "    keyframes:\n"
        "    - {frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}\n"
        "    - {frame: 4, position: [-0.5, 0.2, 3], look_at: [0, 0, 0]}\n"
    ),
}  # fmt: skip
IMAGES = [
    f"{kind}.{frame:04d}.exr"
    for kind in ("facets/facet_0001", "facets/facet_0002", "quilt/page_01")
    for frame in range(1, 5)
]
SETTINGS = ["job.yaml", "layout.yaml", "report.json"]


def write_tiny_job(folder: Path, page: str = "") -> Path:
    """Write the files of the job; returns the job file. A page such as `144, 72` spares a search."""
    for name, text in FILES.items():
        (folder / name).write_text(text)
    if page:
        layout = f"layout: {{method: maxrects, size: [{page}]}}"
        replaced(folder, "job.yaml", "scene: scene.yaml", f"scene: scene.yaml\n{layout}")
    return folder / "job.yaml"


def replaced(folder: Path, name: str, old: str, new: str) -> None:
    """Replace a text in one of the files; an empty `old` replaces the whole file."""
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new) if old else new)


def files_in(folder: Path) -> list[str]:
    """All files below a folder, hidden ones too, in order."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
