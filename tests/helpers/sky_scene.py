"""A scene that is alike in all directions from the eye: triangles of any colour, all around, for tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.job import JobFile, load_job


def write_sky(path: Path, eye: tuple[float, float, float], count: int, extent: float, seed: int = 7) -> None:
    """Write a PLY file of `count` triangles about 3 m from an eye, each some `extent` radians across."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 1, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    corners = (way + rng.normal(size=(count, 3, 3)) * extent) * rng.uniform(2.5, 3.5, (count, 1, 1)) + eye
    lines = ["ply", "format ascii 1.0", f"element vertex {3 * count}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines += [f"element face {count}", "property list uchar int vertex_indices", "end_header"]
    colors = np.repeat(rng.integers(20, 255, (count, 3)), 3, axis=0)
    lines += [
        f"{x:.6f} {y:.6f} {z:.6f} {r} {g} {b}"
        for (x, y, z), (r, g, b) in zip(corners.reshape(-1, 3), colors, strict=True)
    ]
    lines += [f"3 {k} {k + 1} {k + 2}" for k in range(0, 3 * count, 3)]
    path.write_text("\n".join(lines) + "\n")


def sky_job(
    folder: Path,
    mesh: Path,
    pixels: float,
    eye: tuple[float, float, float],
    look_at: tuple[float, float, float],
    *sets: str,
    side: str = "front",
    count: int = 12000,
    extent: float = 0.03,
) -> JobFile:
    """A job of one frame with such a sky behind a display of so many pixels a metre."""
    write_sky(folder / "sky.ply", eye, count, extent)
    (folder / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects: [{mesh: sky.ply, material: {unlit: true}}]\nbackground: [0.1, 0.2, 0.3]\n"
    )
    (folder / "display.yaml").write_text(
        f"quilt_display: 1\nmesh: {mesh}\nviewing_side: {side}\nresolution: {{pixels_per_metre: {pixels}}}\n"
    )
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1\n"
        "viewer: {near: 0.05, far: 10, path: {keyframes:"
        f" [{{frame: 1, position: {list(eye)}, look_at: {list(look_at)}}}]}}}}\n"
    )
    return load_job(folder / "job.yaml", sets)
