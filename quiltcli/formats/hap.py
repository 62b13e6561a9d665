"""HAP films without an encoder: DXT1 blocks, as media servers hand them to graphics cards.

A frame is a header, of the length and the kind 0xAB (DXT1, not compressed any further), and the blocks (the
specification of HAP by Vidvox). A block holds two colours of 5, 6 and 5 bits and for each of 4 × 4 pixels
which of four steps between them it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem, missing_extra
from quiltcli.formats.whole import make_folder, whole_file
from quiltcli.geometry import Float32Array, IntArray

_DXT1 = 0xAB
_BANDS = 64  # rows of blocks worked on together: bounds the memory
_STEPS = np.array([1, 3, 2, 0], dtype=np.uint32)  # indices by thirds of the way from the second colour


def dxt1(picture: NDArray[np.uint8]) -> bytes:
    """Blocks of a picture (H, W, 3), by rows; the last pixels are repeated up to a multiple of 4."""
    height, width, _ = picture.shape
    padded = np.pad(picture, ((0, -height % 4), (0, -width % 4), (0, 0)), mode="edge")
    rows = padded.reshape(padded.shape[0] // 4, 4, padded.shape[1] // 4, 4, 3).transpose(0, 2, 1, 3, 4)
    return b"".join(
        _blocks(rows[first : first + _BANDS].reshape(-1, 16, 3)) for first in range(0, len(rows), _BANDS)
    )


def _blocks(pixels: NDArray[np.uint8]) -> bytes:
    """Blocks (8 bytes each) of pixels (N, 16, 3).

    Colours lie near a line: the axis along which they vary most, by the power method.
    """
    colours = pixels.astype(np.float32)
    middle = colours.mean(axis=1, keepdims=True)
    off = colours - middle
    spread = np.einsum("npi,npj->nij", off, off)
    axis = np.take_along_axis(spread, np.einsum("nii->ni", spread).argmax(axis=1)[:, None, None], axis=1)[
        :, 0
    ]
    for _ in range(4):
        length = np.abs(axis).max(axis=1, keepdims=True)
        axis = np.einsum("nij,nj->ni", spread, axis / np.maximum(length, 1e-20))
    axis /= np.maximum(np.sqrt((axis * axis).sum(axis=1, keepdims=True)), 1e-20)
    along = np.einsum("npi,ni->np", off, axis)
    low, high = along.min(axis=1, keepdims=True), along.max(axis=1, keepdims=True)
    ends = [_packed(middle[:, 0] + share * axis) for share in (high, low)]
    # The larger number first makes four colours of them, not three and black.
    first, second = (
        np.maximum(*ends),
        np.minimum(*ends),
    )
    top, bottom = _unpacked(first), _unpacked(second)
    way = top - bottom
    length2 = np.maximum((way * way).sum(axis=1), 1.0)
    share = np.einsum("npi,ni->np", colours - bottom[:, None], way) / length2[:, None]
    thirds = np.clip(np.rint(3 * share), 0, 3).astype(np.int64)
    index = np.where(first == second, 0, _STEPS[thirds].T).T.astype(np.uint32)
    bits = (index << (2 * np.arange(16, dtype=np.uint32))).sum(axis=1, dtype=np.uint32)
    block = np.empty(len(pixels), dtype=[("first", "<u2"), ("second", "<u2"), ("index", "<u4")])
    block["first"], block["second"], block["index"] = first, second, bits
    return block.tobytes()


def _packed(colour: Float32Array) -> IntArray:
    """Colours (N, 3) of 0 to 255 in 5, 6 and 5 bits."""
    levels = np.array([31, 63, 31], dtype=np.float32)
    red, green, blue = np.rint(np.clip(colour, 0, 255) / 255 * levels).astype(np.int64).T
    result: IntArray = red << 11 | green << 5 | blue
    return result


def _unpacked(packed: IntArray) -> Float32Array:
    """Colours (N, 3) as cards show them: the upper bits once more below."""
    red, green, blue = packed >> 11, packed >> 5 & 63, packed & 31
    parts = (red << 3 | red >> 2, green << 2 | green >> 4, blue << 3 | blue >> 2)
    return np.stack(parts, axis=1).astype(np.float32)


def hap_frame(picture: NDArray[np.uint8]) -> bytes:
    """A frame: header and blocks."""
    blocks = dxt1(picture)
    if len(blocks) < 1 << 24:
        return len(blocks).to_bytes(3, "little") + bytes([_DXT1]) + blocks
    return bytes([0, 0, 0, _DXT1]) + len(blocks).to_bytes(4, "little") + blocks


@contextmanager
def hap_film(path: Path, fps: Fraction) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Write a film of 8 bits, whole or not at all; as `video.film`.

    Raises:
        OutputError: the film cannot be written; nothing is left behind.
        MissingExtraError: PyAV is not installed, which writes the file around the frames.
    """
    try:
        import av
    except ImportError:
        raise missing_extra("a film", "PyAV", "video") from None
    make_folder(path.parent)
    with whole_file(path) as temporary:
        try:
            with av.open(str(temporary), "w", format="mov") as container:
                stream: Any = None
                count = 0

                def show(picture: NDArray[Any]) -> None:
                    nonlocal stream, count
                    if stream is None:
                        height, width = picture.shape[:2]
                        stream = container.add_mux_stream("hap", rate=fps, width=width, height=height)
                        stream.time_base = 1 / fps
                    packet = av.Packet(hap_frame(picture))
                    packet.stream, packet.time_base = stream, 1 / fps
                    packet.pts = packet.dts = count
                    packet.duration = 1
                    packet.is_keyframe = True
                    container.mux(packet)
                    count += 1

                yield show
        except av.error.FFmpegError as error:
            words = f"cannot be written: {error.strerror or error}"
            raise OutputError(Problem(words, file=str(path))) from error
