"""Jobs whose display is curved, or a picture all around the eye."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.charts import Chart
from quiltcli.display import Facets, load_display
from quiltcli.formats.exr.image import write_exr
from quiltcli.geometry import FloatArray
from quiltcli.job import JobFile, load_display_file, load_job
from tests.helpers.in_memory import icosphere
from tests.helpers.verified_jobs import obj

SURFACES = {
    "plane": "kind: plane, width: 2, height: 1",
    "sphere": "kind: sphere, radius: 1",
    "dome": "kind: sphere, radius: 2, zenith_deg: [0, 90], lit: inside",
    "cylinder": "kind: cylinder, radius: 2, height: 1, arc_deg: [-60, 60], lit: inside",
    "cone": "kind: cone, radius_top: 0.4, radius_bottom: 1, height: 1",
    "torus": "kind: torus, radius: 1, tube: 0.3",
    "paraboloid": "kind: paraboloid, half_width: 1, coefficient: 0.5",
    "superquadric": "kind: superquadric, radii: [1, 0.8, 1], exponents: [0.5, 0.7]",
    "bezier": (
        "kind: bezier, points: [[[-1, 1, 0], [0, 1, 0.8], [1, 1, 0]], [[-1, 0, 0.3], [0, 0, 1], [1, 0, 0.3]],"
        " [[-1, -1, 0], [0, -1, 0.8], [1, -1, 0]]]"
    ),
    "nurbs": (
        "kind: nurbs, degree: [2, 1], weights: [[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]],"
        " points: [[[-1, 1, 0], [-1, 1, 1], [0, 1, 1]], [[-1, -1, 0], [-1, -1, 1], [0, -1, 1]]]"
    ),
    "formula": 'kind: formula, constants: {a: 0.8}, x: a*(2*s-1), y: "0.2*sin(4*s)", z: a*(2*t-1)',
}
"""One of every kind that needs no file, as the keys of its entry."""

PROJECTIONS = {
    "cylinder": "kind: cylinder",
    "pieces": "kind: cylinder, pieces: 20",
    "equirect": "kind: equirect",
    "fisheye": "kind: fisheye, mapping: equisolid, fov_deg: 200",
    "dome_master": "kind: dome_master, tilt_deg: 20",
    "cross": "kind: cubemap",
    "row": "kind: cubemap, layout: row, equiangular: true",
    "mirror_ball": "kind: mirror_ball",
}


def chart_of(keys: str, folder: Path, size: tuple[int, int] = (64, 32), more: str = "") -> Chart:
    """The chart of a surface."""
    chart = display_of(f"- {{{keys}, pixels: [{size[0]}, {size[1]}]{more}}}", folder).charts[0]
    assert chart is not None
    return chart


def projection_of(keys: str, folder: Path, size: tuple[int, int] = (64, 64)) -> Chart:
    """The chart of a projection."""
    text = f"quilt_display: 1\nprojection: {{{keys}, pixels: [{size[0]}, {size[1]}]}}\n"
    (folder / "display.yaml").write_text(text)
    chart = load_display(load_display_file(folder / "display.yaml")).charts[0]
    assert chart is not None
    return chart


def display_of(surfaces: str, folder: Path, more: str = "") -> Facets:
    """The facets of a display of surfaces, a line each."""
    (folder / "display.yaml").write_text(f"quilt_display: 1\nsurfaces:\n{surfaces}\n{more}")
    return load_display(load_display_file(folder / "display.yaml"))


def curved_job(
    folder: Path,
    display: str,
    scene: tuple[Any, Any],
    eye: Any = (0, 0, 4),
    at: Any = (0, 0, 0),
    more: str = "",
) -> JobFile:
    """A job of one frame; `display` is what follows `quilt_display: 1`."""
    (folder / "scene.obj").write_text(obj(*scene))
    (folder / "display.yaml").write_text(f"quilt_display: 1\n{display}\n")
    eye, at = (list(map(float, point)) for point in (eye, at))
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.obj\nframes: 1\nviewer:\n"
        "  near: 0.01\n  far: 100\n  path:\n    keyframes:\n"
        f"    - {{frame: 1, position: {eye}, look_at: {at}}}\n{more}"
    )
    return load_job(folder / "job.yaml")


def bumpy_ball(radius: float = 6.0, splits: int = 3, bumps: float = 0.15) -> tuple[FloatArray, Any]:
    """A closed star-shaped mesh about the origin."""
    vertices, triangles = icosphere(splits)
    x, y, z = vertices.T
    scale = radius * (1 + bumps * np.sin(5 * x) * np.cos(4 * y + z))
    return vertices * scale[:, None], triangles


def boxes(count: int, size: float, reach: float, seed: int = 7) -> tuple[FloatArray, FloatArray]:
    """Boxes anywhere within `reach` of the origin, turned anyhow, as quadrilaterals."""
    random = np.random.default_rng(seed)
    corner = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = np.array([[1, 5, 7, 3], [0, 2, 6, 4], [4, 6, 7, 5], [0, 1, 3, 2], [2, 3, 7, 6], [0, 4, 5, 1]])
    vertices, polygons = [], []
    for k in range(count):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        vertices.append(corner * size * random.uniform(0.5, 1.5, 3) @ turn + random.uniform(-reach, reach, 3))
        polygons.append(faces + 8 * k)
    return np.concatenate(vertices), np.concatenate(polygons)


def write_map(path: Path, points: FloatArray, dtype: Any = np.float32, **more: FloatArray) -> None:
    """An EXR of points (3, H, W)."""
    channels = dict(zip("XYZ", points.astype(dtype), strict=True))
    channels |= {name: value.astype(dtype) for name, value in more.items()}
    write_exr(path, channels, {})
