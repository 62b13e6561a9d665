"""Write the sky and the floor of the pavilion anew.

    python scenes/generate_sky.py

`evening.exr` is a panorama of 256 × 128 half floats: a blue sky that gets warm towards the sun, a bright
veil of cloud before it, and ground. `mosaic.png` is a floor of coloured stones in rings, 512 × 512. Both come
of formulas alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).parent
SUN = np.array([0.80, 0.40, 0.42])
STONES = np.array(
    [
        (232, 222, 200),
        (206, 190, 160),
        (150, 62, 44),
        (40, 66, 92),
        (90, 122, 112),
        (196, 150, 70),
        (70, 58, 50),
    ],
    dtype=np.uint8,
)


def sky() -> np.ndarray:
    """Radiance (128, 256, 3): the middle looks to −Z, +X is to its right."""
    height, width = 128, 256
    down = np.pi * (np.arange(height) + 0.5) / height
    across = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    y = np.cos(down)[:, None] * np.ones(width)
    x, z = np.sin(down)[:, None] * np.sin(across), -np.sin(down)[:, None] * np.cos(across)
    towards = (np.stack((x, y, z), axis=-1) @ (SUN / np.linalg.norm(SUN)))[..., None]
    rise = np.clip(y, 0, 1)[..., None]
    zenith, horizon, warm = (
        np.array([0.10, 0.20, 0.48]),
        np.array([0.50, 0.52, 0.62]),
        np.array([1.0, 0.52, 0.24]),
    )
    above = zenith + (horizon - zenith) * (1 - rise) ** 3
    near = np.clip(towards * 0.5 + 0.5, 0, 1)
    above = above + warm * (1.2 * near**4 * (1 - rise) ** 2)
    veil = np.clip((towards - 0.86) / 0.14, 0, 1) ** 2
    above = above + np.array([16.0, 11.0, 6.5]) * veil
    ground = np.array([0.16, 0.14, 0.12]) * (0.6 + 0.4 * near)
    return np.where(y[..., None] >= 0, above, ground).astype(np.float16)


def floor() -> np.ndarray:
    """Stones (512, 512) as numbers of `STONES`; the last is what lies between them."""
    line = (np.arange(512) + 0.5) / 256 - 1
    x, y = np.meshgrid(line, -line)
    far, angle = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi) + 0.5
    ring = np.clip((far * 12).astype(int), 0, 11)
    count = np.array([1, 8, 8, 16, 16, 16, 32, 32, 32, 32, 64, 64])[ring]
    place = angle * count + 0.5 * (ring % 2)
    stone = np.array([5, 2, 0, 0, 3, 0, 1, 2, 1, 4, 0, 3])[ring]
    turn = np.floor(place).astype(int) % 2
    other = np.array([5, 0, 4, 1, 0, 1, 0, 0, 5, 0, 2, 0])[ring]
    stone = np.where(turn == 1, other, stone)
    edge = np.minimum(place % 1, 1 - place % 1) / count * 2 * np.pi * far
    gap = (np.minimum(far * 12 % 1, 1 - far * 12 % 1) / 12 < 0.006) | ((edge < 0.006) & (count > 1))
    return np.where(gap, 6, stone).astype(np.uint8)


def write(folder: Path) -> None:
    """Write both pictures into a folder."""
    from quiltcli.formats.exr.image import write_exr

    radiance = sky()
    write_exr(folder / "evening.exr", {name: radiance[..., k] for k, name in enumerate("RGB")}, {})
    picture = Image.fromarray(floor(), "P")
    picture.putpalette(STONES.ravel().tolist())
    picture.save(folder / "mosaic.png", optimize=True)


if __name__ == "__main__":
    write(HERE)
