"""Pictures that surfaces are covered with: bytes → sizes and pixels, each only when it is asked for.

OpenImageIO tells the kind of a picture by its contents. Its size is known from the header alone, so
that a few kilobytes that promise 60,000 × 60,000 pixels are refused before any memory is taken.
"""

from __future__ import annotations

import os
import struct
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_PIXELS = 2**28
MOST_SIDE = 2**16
_PNG = b"\x89PNG\r\n\x1a\n"
# After its last scan a JPEG says that it ends; its reader makes up what is missing, grey and silent.
_JPEG, _SCAN_OF_JPEG, _END_OF_JPEG = b"\xff\xd8\xff", b"\xff\xda", b"\xff\xd9"
_KTX2 = b"\xabKTX 20\xbb"
_AVIF = (b"ftypavif", b"ftypavis", b"ftypheic", b"ftypmif1")
_EXPORT = "(export it as PNG or JPEG)"


class UnreadablePictureError(Exception):
    """A picture that cannot be read; its text says why, as the end of a sentence."""


@dataclass(frozen=True)
class PictureSize:
    """What the header of a picture says.

    Attributes:
        width: pixels.
        height: pixels.
        linear: whether its numbers are light as it is (float files), not as displays encode it.
    """

    width: int
    height: int
    linear: bool


def picture_size(data: bytes) -> PictureSize:
    """What the header of a picture says.

    Raises:
        UnreadablePictureError: it is of no kind that is read, or larger than any that is shown.
    """
    with _opened(data) as picture:
        spec = picture.spec()
        return PictureSize(spec.width, spec.height, str(spec.format) in ("half", "float", "double"))


def picture_pixels(data: bytes) -> NDArray[Any]:
    """The pixels (H, W, channels) of a picture as they are stored, alpha not multiplied in.

    Channels of a file that names red, green and blue come in that order, alpha behind them.

    Raises:
        UnreadablePictureError: as of `picture_size`, and for a file that is cut off or broken.
    """
    with _opened(data) as picture:
        spec = picture.spec()
        values = picture.read_image(0, 0, 0, spec.nchannels, spec.format)
        if values is None:
            raise UnreadablePictureError(_words(picture.geterror() or "it is broken"))
        names = list(spec.channelnames)
    pixels = np.asarray(values).reshape(spec.height, spec.width, spec.nchannels)
    if all(name in names for name in "RGB") and names[:3] != ["R", "G", "B"]:
        pixels = pixels[..., [names.index(name) for name in "RGBA" if name in names]]
    return pixels


@contextmanager
def _opened(data: bytes) -> Iterator[Any]:
    """A picture as OpenImageIO's input, its size known to be sane."""
    import OpenImageIO as oiio  # noqa: N813 - its own short name

    if data.startswith(_KTX2):
        raise UnreadablePictureError(f"it is KTX2, which is not read {_EXPORT}")
    if data[4:12] in _AVIF:
        raise UnreadablePictureError(f"it is AVIF or HEIF, which is not read {_EXPORT}")
    cut_off = data.startswith(_JPEG) and data.rfind(_END_OF_JPEG) < data.rfind(_SCAN_OF_JPEG)
    if cut_off or (data.startswith(_PNG) and not _whole_png(data)):
        raise UnreadablePictureError("it is damaged or cut off")
    if data.startswith(_PNG):
        _check_size(*struct.unpack_from(">II", data, len(_PNG) + 8))
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    with _as_file(data) as name:
        before = oiio.get_int_attribute("limits:imagesize_MB", 0)
        # The largest that passes the check below: half a gigabyte of 16-bit pixels, and some more.
        oiio.attribute("limits:imagesize_MB", 8192)
        try:
            picture = oiio.ImageInput.open(name, config)
            if picture is None:
                raise UnreadablePictureError(_words(oiio.geterror() or "it is of no kind that is read"))
            try:
                _check_size(picture.spec().width, picture.spec().height)
                yield picture
            finally:
                picture.close()
        finally:
            oiio.attribute("limits:imagesize_MB", before)


def _whole_png(data: bytes) -> bool:
    """Whether the chunks of a PNG are whole; the library that reads it would print what is wrong."""
    at, kind = len(_PNG), b""
    while kind != b"IEND" and at + 12 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if at + 12 + size > len(data) or (at == len(_PNG) and (kind, size) != (b"IHDR", 13)):
            return False
        (check,) = struct.unpack_from(">I", data, at + 8 + size)
        if zlib.crc32(memoryview(data)[at + 4 : at + 8 + size]) != check:
            return False
        at += 12 + size
    return kind == b"IEND"


def _check_size(width: int, height: int) -> None:
    if width > MOST_SIDE or height > MOST_SIDE or width * height > MOST_PIXELS:
        size = f"it has {width:,} × {height:,} pixels (expected at most {MOST_PIXELS:,})"
        raise UnreadablePictureError(size)


def _words(reason: str) -> str:
    # OpenImageIO names the memory the bytes lie in, which says nothing to anybody.
    words = " ".join(reason.split())
    if "/proc/self/fd" in words or "OpenImageIO" in words or "could not" in words.lower():
        words = "it is damaged or of no kind that is read"
    return "it has more pixels than any image that is shown" if "limits:imagesize" in reason else words


@contextmanager
def _as_file(data: bytes) -> Iterator[str]:
    """A name under which bytes can be opened: of memory where the system can do that."""
    if hasattr(os, "memfd_create") and os.path.isdir("/proc/self/fd"):  # noqa: PTH112 - no path, a test
        number = os.memfd_create("image")
        try:
            with open(number, "wb", closefd=False) as file:
                file.write(data)
            yield f"/proc/self/fd/{number}"
        finally:
            os.close(number)
        return
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "image")  # noqa: PTH118 - OpenImageIO wants text
        with open(name, "wb") as file:  # noqa: PTH123
            file.write(data)
        yield name
