"""Pictures of a light field, read when they are needed and kept while there is room."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.formats.exr.image import read_first
from quiltcli.formats.inputs import check_input
from quiltcli.geometry import Float32Array

ROOM = 1 << 29
"""Bytes of pictures that are kept."""


class Pictures:
    """Pictures by their files, of one size."""

    def __init__(
        self,
        size: tuple[int, int],
        read: Callable[[Path], NDArray[Any]] | None = None,
        room: int = ROOM,
    ) -> None:
        self._read = read or read_picture
        self._size, self._room, self._used = size, room, 0
        self._kept: OrderedDict[Path, NDArray[Any]] = OrderedDict()

    def __getitem__(self, path: Path) -> NDArray[Any]:
        """Values (H, W, 1 or 3): bytes as they are in the file, or linear floats (JobError)."""
        if path in self._kept:
            self._kept.move_to_end(path)
            return self._kept[path]
        values = self._read(path)
        found = (values.shape[1], values.shape[0])
        if found != self._size:
            words = f"has {found[0]} × {found[1]} pixels, expected {self._size[0]} × {self._size[1]}"
            raise JobError(Problem(words, str(path)))
        self._used += values.nbytes
        self._kept[path] = values
        while self._used > self._room and len(self._kept) > 1:
            self._used -= self._kept.popitem(last=False)[1].nbytes
        return values


def read_picture(path: Path, channels: tuple[str, ...] = ("R", "G", "B")) -> NDArray[Any]:
    """Values (H, W, C) of a picture: bytes of a PNG or JPEG, linear floats of an EXR file (JobError)."""
    check_input(path, JobError, "a picture")
    if path.suffix.lower() == ".exr" or channels == ("Z",):
        try:
            image = read_first(path)
        except OutputError as error:
            raise JobError(error.problems) from None
        if missing := [name for name in channels if name not in image.channels]:
            have = ", ".join(image.channels)
            raise JobError(Problem(f"has no channel {missing[0]} (it has {have})", str(path)))
        return np.stack([image.channels[name] for name in channels], axis=-1).astype(np.float32)
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("RGB"))
    except UnidentifiedImageError:
        raise JobError(Problem("is no picture (expected PNG, JPEG or EXR)", str(path))) from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise JobError(Problem(f"is damaged: {error}", str(path))) from None


def read_depth(path: Path) -> NDArray[Any]:
    """Distances (H, W, 1) ahead of the camera, of an EXR file's channel Z, metres (JobError)."""
    return read_picture(path, ("Z",))


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height of a picture (JobError)."""
    values = read_picture(path)
    return values.shape[1], values.shape[0]


def decoding(encoding: str) -> Float32Array:
    """Linear light (256,) of the bytes of a picture: of the curve of sRGB (IEC 61966-2-1), or as they are."""
    value = np.arange(256) / 255
    if encoding == "srgb":
        value = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return value.astype(np.float32)
