"""Write the pictures that cover the hall of this folder's scenes.

    python scenes/pictures.py [FOLDER]

They are drawn by formulas: tiles of a floor, and bricks with their slopes and their roughness. Each repeats
without a seam and stands for a metre and a half.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

FloatArray = NDArray[np.float64]
SIZE = 256
_ROWS, _COLUMNS = 18, 6  # bricks in a metre and a half


def noise(seed: int, cells: int) -> FloatArray:
    """Smooth noise from 0 to 1 that repeats, (SIZE, SIZE): cubic between `cells` × `cells` dice."""
    dice = np.random.default_rng(seed).uniform(size=(cells, cells))
    place = (np.arange(SIZE) + 0.5) / SIZE * cells
    first = np.floor(place).astype(int)
    share = place - first
    share = share * share * (3 - 2 * share)
    rows = dice[first % cells] * (1 - share)[:, None] + dice[(first + 1) % cells] * share[:, None]
    return np.asarray(rows[:, first % cells] * (1 - share) + rows[:, (first + 1) % cells] * share)


def tiles() -> NDArray[np.uint8]:
    """Four stone tiles with joints, light and dark."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2
    cell = np.floor(place).astype(int)
    edge = np.minimum(place % 1, 1 - place % 1)
    joint = np.minimum(edge[:, None], edge) < 0.012
    dark = (cell[:, None] + cell) % 2 == 1
    veins = np.abs(noise(1, 4) + 0.5 * noise(2, 9) + 0.25 * noise(3, 21) - 0.9)
    light = np.where(dark, 70, 190)[..., None] * (1.0, 0.97, 0.92) * (0.82 + 0.35 * veins)[..., None]
    light = np.where(joint[..., None], (60, 58, 55), light)
    return np.clip(light, 0, 255).astype(np.uint8)


def brick_places() -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """How far a pixel is from its brick's edges, 0 to 1 inside, how high it is, and the brick's number."""
    y = (np.arange(SIZE) + 0.5) / SIZE * _ROWS
    row = np.floor(y).astype(int)
    x = (np.arange(SIZE) + 0.5) / SIZE * _COLUMNS + 0.5 * (row % 2)[:, None]
    column = np.floor(x).astype(int) % _COLUMNS
    across = np.minimum(x % 1, 1 - x % 1) * _ROWS / _COLUMNS
    down = np.minimum(y % 1, 1 - y % 1)[:, None]
    depth = np.clip((np.minimum(across, down) - 0.06) / 0.1, 0, 1)
    height = depth * depth * (3 - 2 * depth) + 0.25 * noise(5, 40)
    return depth, height, row[:, None] * _COLUMNS + column


def bricks() -> NDArray[np.uint8]:
    """Red bricks in mortar, each of a shade of its own."""
    depth, _, number = brick_places()
    shade = np.random.default_rng(4).uniform(0.65, 1.15, _ROWS * _COLUMNS)[number]
    brick = (150, 72, 48) * (shade * (0.8 + 0.4 * noise(6, 30)))[..., None]
    mortar = (150, 143, 132) * (0.85 + 0.2 * noise(7, 50))[..., None]
    return np.clip(mortar + (brick - mortar) * depth[..., None], 0, 255).astype(np.uint8)


def brick_normals() -> NDArray[np.uint8]:
    """The slopes of the bricks: red to the right, green to the upper edge."""
    _, height, _ = brick_places()
    along = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * 1.2
    up = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) * 1.2
    normal = np.stack((-along, -up, np.ones_like(height)), axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.rint(normal * 127.5 + 127.5).astype(np.uint8)


def brick_roughness() -> NDArray[np.uint8]:
    """Mortar is dull, bricks less so."""
    depth, _, _ = brick_places()
    return np.rint(255 * (0.95 - 0.45 * depth * noise(8, 12))).astype(np.uint8)


PICTURES = {
    "tiles": tiles,
    "bricks": bricks,
    "bricks_normal": brick_normals,
    "bricks_roughness": brick_roughness,
}


def write(folder: Path) -> None:
    """Write all pictures into a folder."""
    for name, draw in PICTURES.items():
        Image.fromarray(draw()).save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
