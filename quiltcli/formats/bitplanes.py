"""Twenty-four pictures of one bit in a picture of 24: what fast projectors take for pictures in a row.

Such a projector shows the bits of each channel one after another. Which channel comes first, and which end
of it, differs from board to board: `order` and `bits` say so.
"""

from __future__ import annotations

from itertools import permutations
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.inputs import check_input
from quiltcli.formats.png import save_png
from quiltcli.geometry import BoolArray

Packed: TypeAlias = NDArray[np.uint8]

PLANES = 24
"""Pictures of one bit in a packed one."""
ORDERS = tuple("".join(order) for order in permutations("rgb"))
"""Channels in the order in which they are shown."""
STREAMS = ("red", "green", "blue")
"""Colours of a projector of three chips, which are sent pictures of their own."""
BITS = ("lsb", "msb")
"""Which bit of a channel is shown first: the least or the most significant one."""
_END: dict[str, Literal["little", "big"]] = {"lsb": "little", "msb": "big"}


def pack(bits: BoolArray, order: str = "rgb", first: str = "lsb") -> Packed:
    """Pack pictures of one bit.

    Args:
        bits: (N, H, W); where N is no multiple of 24, dark pictures follow.
        order: a name of `ORDERS`.
        first: a name of `BITS`.

    Returns:
        (⌈N/24⌉, H, W, 3) uint8.
    """
    count, height, width = bits.shape
    missing = -count % PLANES
    if missing:
        bits = np.concatenate((bits, np.zeros((missing, height, width), dtype=np.bool_)))
    planes = bits.reshape(-1, 3, 8, height, width)
    packed = np.empty((len(planes), height, width, 3), dtype=np.uint8)
    for place, channel in enumerate(order):
        eight = np.packbits(planes[:, place], axis=1, bitorder=_END[first])
        packed[..., "rgb".index(channel)] = eight[:, 0]
    return packed


def unpack(packed: Packed, order: str = "rgb", first: str = "lsb") -> BoolArray:
    """Pictures (24 N, H, W) of one bit out of packed ones (N, H, W, 3), in the order they are shown."""
    count, height, width, _ = packed.shape
    planes = np.empty((count, 3, 8, height, width), dtype=np.bool_)
    for place, channel in enumerate(order):
        eight = packed[:, None, ..., "rgb".index(channel)]
        planes[:, place] = np.unpackbits(eight, axis=1, bitorder=_END[first])
    return planes.reshape(-1, height, width)


def packed_name(number: int, stream: str = "") -> str:
    """Name of a packed picture's file; those of a stream are numbered from 1 through a whole job."""
    return f"dvi{stream and '_' + stream}.{number:08d}.png"


def stream_of(name: str) -> str:
    """The stream that a packed picture's file is of, by its name; empty where there is but one."""
    stream = name.split(".")[0].removeprefix("dvi_")
    return stream if stream in STREAMS else ""


def write_packed(path: Path, packed: Packed) -> None:
    """Write a packed picture (H, W, 3), whole or not at all (OutputError).

    Without a colour profile or gamma: what reads it must change no bit.
    """
    save_png(path, packed, compress_level=1)


def write_plane(path: Path, bits: BoolArray) -> None:
    """Write a picture (H, W) of one bit a pixel, whole or not at all (OutputError)."""
    save_png(path, bits, bits=1, optimize=True)


def read_packed(path: Path) -> Packed:
    """Read a packed picture (H, W, 3) uint8.

    Raises:
        OutputError: it is no picture, has no three channels of 8 bits, or is damaged.
    """
    from PIL import Image, UnidentifiedImageError

    check_input(path, OutputError, "a packed picture")
    try:
        with Image.open(path) as image:
            if image.mode != "RGB":
                words = f"has pixels of kind {image.mode}, expected three channels of 8 bits"
                raise OutputError(Problem(words, file=str(path)))
            return np.asarray(image, dtype=np.uint8)
    except UnidentifiedImageError:
        raise OutputError(Problem("is no picture (expected a packed one, a PNG)", file=str(path))) from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(Problem(f"is damaged: {error}", file=str(path))) from None
