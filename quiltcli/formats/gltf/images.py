"""The pictures of a file: their bytes, their sizes and their pixels, each only when it is asked for.

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

from quiltcli.errors import MeshError
from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.container import Container
from quiltcli.formats.gltf.json_values import Json

MOST_PIXELS = 2**28
MOST_SIDE = 2**16
_PNG = b"\x89PNG\r\n\x1a\n"
# After its last scan a JPEG says that it ends; its reader makes up what is missing, grey and silent.
_JPEG, _SCAN_OF_JPEG, _END_OF_JPEG = b"\xff\xd8\xff", b"\xff\xda", b"\xff\xd9"
_KTX2 = b"\xabKTX 20\xbb"


@dataclass(frozen=True, eq=False)
class Images:
    """The images of a file, by their index."""

    container: Container
    accessors: Accessors

    def name(self, index: int) -> str:
        """What to call an image: its file, its name, or its number."""
        entry = self._entry(index)
        uri = entry["uri"].text("")
        if uri and not uri.startswith("data:"):
            return repr(uri if len(uri) <= 80 else uri[:79] + "…")
        return repr(entry["name"].text()) if entry["name"] else f"image {index}"

    def data(self, index: int) -> bytes:
        """The bytes of an image as they are stored.

        Raises:
            MeshError: they are not there.
        """
        entry = self._entry(index)
        if entry["uri"]:
            return self.container.resource(entry["uri"])
        if not entry["bufferView"]:
            raise entry.expected("a uri or a bufferView")
        return bytes(self.accessors.view(entry["bufferView"]))

    def size(self, index: int, use: str = "") -> tuple[int, int]:
        """Width and height of an image, from its header.

        Args:
            index: of the image.
            use: whose picture it is, to say so in errors.

        Raises:
            MeshError: it is not there, of no kind that is read, or larger than any that is shown.
        """
        with _opened(self, index, use) as picture:
            return picture.spec().width, picture.spec().height

    def pixels(self, index: int, use: str = "") -> NDArray[Any]:
        """The pixels (H, W, channels) of an image as they are stored, alpha not multiplied in.

        Raises:
            MeshError: as of `size`, and for a file that is cut off or broken.
        """
        with _opened(self, index, use) as picture:
            spec = picture.spec()
            values = picture.read_image(0, 0, 0, spec.nchannels, spec.format)
            if values is None:
                raise _unreadable(self, index, use, picture.geterror() or "it is broken")
        return np.asarray(values).reshape(spec.height, spec.width, spec.nchannels)

    def _entry(self, index: int) -> Json:
        return self.container.json["images"].at(index)


@contextmanager
def _opened(images: Images, index: int, use: str) -> Iterator[Any]:
    """An image as OpenImageIO's input, its size known to be sane."""
    import OpenImageIO as oiio  # noqa: N813 - its own short name

    data = images.data(index)
    if data.startswith(_KTX2):
        raise _unreadable(images, index, use, "it is KTX2, which is not read (export it as PNG or JPEG)")
    cut_off = data.startswith(_JPEG) and data.rfind(_END_OF_JPEG) < data.rfind(_SCAN_OF_JPEG)
    if cut_off or (data.startswith(_PNG) and not _whole_png(data)):
        raise _unreadable(images, index, use, "it is damaged or cut off")
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    with _as_file(data) as name:
        before = oiio.get_int_attribute("limits:imagesize_MB", 0)
        # The largest that passes the check below: half a gigabyte of 16-bit pixels, and some more.
        oiio.attribute("limits:imagesize_MB", 8192)
        try:
            picture = oiio.ImageInput.open(name, config)
            if picture is None:
                raise _unreadable(images, index, use, oiio.geterror() or "it is of no kind that is read")
            try:
                _check_size(images, index, use, picture.spec())
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


def _check_size(images: Images, index: int, use: str, spec: Any) -> None:
    if spec.width > MOST_SIDE or spec.height > MOST_SIDE or spec.width * spec.height > MOST_PIXELS:
        size = f"it has {spec.width:,} × {spec.height:,} pixels (expected at most {MOST_PIXELS:,})"
        raise _unreadable(images, index, use, size)


def _unreadable(images: Images, index: int, use: str, reason: str) -> MeshError:
    entry = images.container.json["images"].at(index)
    # OpenImageIO names the memory the bytes lie in, which says nothing to anybody.
    words = " ".join(reason.split())
    if "/proc/self/fd" in words or "OpenImageIO" in words or "could not" in words.lower():
        words = "it is damaged or of no kind that is read"
    if "limits:imagesize" in reason:
        words = "it has more pixels than any image that is shown"
    start = f"{use}: " if use else ""
    return entry.error(f"{start}{images.name(index)} cannot be read: {words}")


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
