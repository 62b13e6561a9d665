"""Panoramas: pictures of all directions, longitude from left to right, latitude from top to bottom."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.errors import Problem, SceneError
from quiltcli.formats.mesh.colors import linear_from_srgb
from quiltcli.formats.packages import read_file
from quiltcli.formats.picture_bytes import PictureSize, UnreadablePictureError, picture_pixels, picture_size
from quiltcli.geometry import Float32Array, FloatArray

MOST_PIXELS = 1 << 26
"""Those of 11,585 × 5,792: more than any map made of them shows."""


def read_panorama(path: Path | str) -> Float32Array:
    """Radiance (H, W, 3), linear: of float files as it is, of others from sRGB.

    Raises:
        SceneError: the picture cannot be read, is not twice as wide as high, or holds what is no light.
    """
    data = read_file(path, SceneError)
    try:
        _check_size(picture_size(data))
        values = picture_pixels(data)
    except UnreadablePictureError as error:
        raise SceneError(Problem(f"cannot be read: {error}", str(path))) from None
    values = np.repeat(values, 3, axis=2) if values.shape[2] < 3 else values[..., :3]
    if values.dtype.kind in "ui":
        scale = np.iinfo(values.dtype).max
        table = linear_from_srgb((np.arange(scale + 1) / scale)[:, None])[:, 0]
        return np.asarray(table[values])
    wrong = np.count_nonzero(~np.isfinite(values).all(axis=2))
    if wrong:
        words = f"holds {wrong:,} pixels that are infinite or no numbers (expected light, 0 or more)"
        raise SceneError(Problem(words, str(path)))
    return np.maximum(values.astype(np.float32), 0)


def _check_size(size: PictureSize) -> None:
    words = f"it has {size.width:,} × {size.height:,} pixels"
    if size.width != 2 * size.height:
        raise UnreadablePictureError(f"{words} (expected all directions: twice as many across as down)")
    if size.width * size.height > MOST_PIXELS:
        raise UnreadablePictureError(f"{words} (expected at most {MOST_PIXELS:,})")


def reduced(picture: Float32Array, width: int) -> FloatArray:
    """Mean radiance (width / 2, width, 3) of cells of longitude and latitude."""
    height = width // 2
    rows = _overlaps(picture.shape[0], height, sines=True)
    columns = _overlaps(picture.shape[1], width, sines=False)
    wide = np.einsum("hwc,vw->hvc", picture.astype(np.float64), columns, optimize=True)
    return np.asarray(np.einsum("hvc,uh->uvc", wide, rows, optimize=True))


def _overlaps(pixels: int, cells: int, *, sines: bool) -> FloatArray:
    """Share (cells, pixels) that each pixel of a line has of a cell: of its length, or between parallels."""
    ends = [np.linspace(0, 1, count + 1) for count in (cells, pixels)]
    if sines:
        ends = [(1 - np.cos(np.pi * each)) / 2 for each in ends]
    cell, pixel = ends
    first = np.maximum(cell[:-1, None], pixel[None, :-1])
    last = np.minimum(cell[1:, None], pixel[None, 1:])
    share = np.maximum(last - first, 0)
    return np.asarray(share / share.sum(axis=1, keepdims=True))


def cell_directions(width: int) -> FloatArray:
    """Unit directions (width / 2, width, 3) to the middles of cells: the centre is −Z, +X to its right."""
    height = width // 2
    down = np.pi * (np.arange(height) + 0.5) / height
    across = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    sine = np.sin(down)[:, None]
    return np.stack(
        np.broadcast_arrays(sine * np.sin(across), np.cos(down)[:, None], -sine * np.cos(across)), axis=-1
    )


def cell_sizes(width: int) -> FloatArray:
    """Solid angles (width / 2,) of the cells of each row."""
    ends = np.cos(np.linspace(0, np.pi, width // 2 + 1))
    return np.asarray((ends[:-1] - ends[1:]) * (2 * np.pi / width))
