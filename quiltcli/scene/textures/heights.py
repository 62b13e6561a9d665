"""Normal maps made of pictures of heights, which MTL files call bumps (Blinn 1978)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array

RISE = 0.01
"""What is white lies so much of the picture's width higher than what is black. MTL has no unit for it."""

_BLUE, _GREY = 0.6, 0.1


def normals_of(pixels: NDArray[Any], wrap: tuple[str, str]) -> Float32Array:
    """A normal map (H, W, 3), its axes encoded from 0 to 1, of heights (H, W, channels); red counts.

    Many exporters write normal maps as bumps. A picture whose red and green are one half in the mean and
    whose blue is more is taken for one, and stays as it is.

    Args:
        pixels: the picture, whole numbers of full range or light.
        wrap: how it goes on along u and v.
    """
    scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind in "ui" else 1
    if pixels.shape[2] >= 3:
        mean = pixels[..., :3].mean(axis=(0, 1), dtype=np.float64) / scale
        if mean[2] > _BLUE and np.abs(mean[:2] - 0.5).max() < _GREY:
            return np.asarray(pixels[..., :3] / np.float64(scale), dtype=np.float32)
    height = np.nan_to_num(pixels[..., 0].astype(np.float64) / scale) * (RISE * pixels.shape[1])
    ends = ["wrap" if way == "repeat" else "edge" for way in wrap]
    across = np.pad(height, ((0, 0), (1, 1)), mode=ends[0])  # type: ignore[call-overload]
    down = np.pad(height, ((1, 1), (0, 0)), mode=ends[1])  # type: ignore[call-overload]
    # Green goes to the upper edge, rows go down.
    right, up = (across[:, 2:] - across[:, :-2]) / 2, (down[:-2] - down[2:]) / 2
    normals = np.stack((-right, -up, np.ones_like(right)), axis=-1)
    normals /= np.sqrt(1 + right * right + up * up)[..., None]
    return np.asarray(normals * 0.5 + 0.5, dtype=np.float32)
