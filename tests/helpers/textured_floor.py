"""A floor with a picture on it, before a wall-sized display; and what rays see of it, in plain float64."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import quiltcli

EYE = (0.1, 1.2, 1.0)
PIXELS = (160, 100)
Pixels = NDArray[np.float64]


def checker(texels: int = 64, squares: int = 2) -> NDArray[np.uint8]:
    """Black and white squares, (texels, texels, 3)."""
    places = np.arange(texels) * squares // texels
    board = (places[:, None] + places) % 2 * 255
    return np.repeat(board[..., None], 3, axis=2).astype(np.uint8)


def write_floor_job(
    folder: Path,
    picture: NDArray[np.uint8],
    *,
    repeats: tuple[float, float] = (40, 120),
    textures: str = "",
    material: str = "unlit: true",
    render: str = "{}",
    channels: str = "[rgba]",
    lights: str = "[]",
    display: Sequence[Sequence[float]] = ((-2, 0, -1), (2, 0, -1), (2, 2.5, -1), (-2, 2.5, -1)),
) -> Path:
    """Write the files of a job that looks at a floor from y = 1.2 to its horizon; returns the job file."""
    Image.fromarray(picture).save(folder / "floor.png")
    u, v = repeats
    (folder / "floor.obj").write_text(
        "v -40 0 30\nv 40 0 30\nv 40 0 -210\nv -40 0 -210\n"
        f"vt 0 0\nvt {u} 0\nvt {u} {v}\nvt 0 {v}\nf 1/1 2/2 3/3 4/4\n"
    )
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in display)
    (folder / "wall.obj").write_text(f"{corners}f 1 2 3 4\n")
    (folder / "display.yaml").write_text(
        f"quilt_display: 1\nmesh: wall.obj\nresolution: {{facet_pixels: [{PIXELS[0]}, {PIXELS[1]}]}}\n"
    )
    (folder / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- mesh: floor.obj\n"
        f"  material: {{{material}, textures: {{color: floor.png{textures}}}}}\nlights: {lights}\n"
    )
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1\n"
        "viewer: {near: 0.05, far: 1000, path: {keyframes: "
        f"[{{frame: 1, position: {list(EYE)}, look_at: [0, 1.2, -1]}}]}}}}\n"
        f"render: {render}\noutput: {{channels: {channels}}}\n"
    )
    return folder / "job.yaml"


def drawn(job: Path, *names: str) -> tuple[NDArray, ...]:
    """Channels of the facet's picture, (H, W) each."""
    ((frame,),) = [list(quiltcli.draw(job, threads=1))]
    picture = frame.facet(1)
    return tuple(picture[name] for name in names)


def floor_places(offset: tuple[float, float] = (0, 0)) -> tuple[Pixels, Pixels]:
    """Where rays through the pixels meet the floor, as texture coordinates u, v (v up) of one repeat a
    metre; not a number beyond it."""
    wide, high = PIXELS
    x = -2 + (np.arange(wide) + 0.5 + offset[0]) / wide * 4
    y = 2.5 - (np.arange(high) + 0.5 + offset[1]) / high * 2.5
    down = y - EYE[1]
    with np.errstate(divide="ignore"):
        along = np.where(down < 0, -EYE[1] / down, np.nan)[:, None]
    px, pz = EYE[0] + along * (x - EYE[0]), EYE[2] - 2 * along + 0 * x
    inside = (np.abs(px) <= 40) & (pz >= -210)
    return np.where(inside, px + 40, np.nan), np.where(inside, 30 - pz, np.nan)


def bilinear(texels: Pixels, u: Pixels, v: Pixels) -> Pixels:
    """Texels (h, w) of a repeating picture between their centres, v up."""
    high, wide = texels.shape
    x, y = u * wide - 0.5, (1 - v) * high - 0.5
    column, row = np.floor(x), np.floor(y)
    fx, fy = x - column, y - row
    i, j = column.astype(int) % wide, row.astype(int) % high
    k, m = (i + 1) % wide, (j + 1) % high
    upper = texels[j, i] * (1 - fx) + texels[j, k] * fx
    lower = texels[m, i] * (1 - fx) + texels[m, k] * fx
    return np.asarray(upper * (1 - fy) + lower * fy)


def floor_truth(texels: Pixels, repeats: tuple[float, float], samples: int) -> Pixels:
    """Means over the pixels of the picture itself, by samples² rays each, 0 beyond the floor."""
    total = np.zeros(PIXELS[::-1])
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    for dy in steps:
        for dx in steps:
            u, v = floor_places((dx, dy))
            some = np.isfinite(u)
            total[some] += bilinear(texels, u[some] / 80 * repeats[0], v[some] / 240 * repeats[1])
    return total / samples**2
