"""The header of an OpenEXR file, read strictly: what the library would trip over is said in words.

The library raises whatever its bindings meet (text that is not UTF-8, fractions over 0) and takes
windows of any size at their word. Layout: "OpenEXR File Layout", openexr.com; sizes of attribute
types: "Attribute Types" there.
"""

from __future__ import annotations

import mmap
import struct
from dataclasses import dataclass

# Lines of one chunk by the number that stands for the compression.
CHUNK_LINES = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256, 256, 32, 256, 1)
PIXEL_BYTES = (4, 2, 4)  # uint, half, float
_FIXED = {
    "box2f": 16, "box2i": 16, "chromaticities": 32, "compression": 1, "double": 8, "envmap": 1, "float": 4,
    "int": 4, "keycode": 28, "lineOrder": 1, "m33d": 72, "m33f": 36, "m44d": 128, "m44f": 64, "rational": 8,
    "tiledesc": 9, "timecode": 8, "v2d": 16, "v2f": 8, "v2i": 8, "v3d": 24, "v3f": 12, "v3i": 12,
}  # fmt: skip
_NEEDED = ("channels", "compression", "dataWindow", "displayWindow")
_FARTHEST = 2**30  # of a window's corners: the library's own limit
# A frame may be larger than the pixels in it, but a few bytes may not ask for gigabytes.
_FRAME_PIXELS, _FRAME_SHARE = 2**27, 64


class FaultError(Exception):
    """What is wrong with the file, for the readers of its structure."""


@dataclass(frozen=True)
class Header:
    """What the structure of a part depends on.

    Attributes:
        kind: its `type`, such as `scanlineimage`; empty in a file of one part that does not say.
        pixels: of the data window, by channel name; subsampled channels have fewer.
        pixel_bytes: of all channels together.
        chunks: chunks that the data window needs at least.
    """

    kind: str
    pixels: int
    pixel_bytes: int
    chunks: int


def read_header(data: mmap.mmap, at: int, tiled: bool) -> tuple[int, Header]:
    """The header at byte `at`, and the byte after it.

    Raises:
        FaultError: something in it is wrong.
        struct.error: the file ends inside it.
    """
    at, found = _attributes(data, at)
    kind = _text(found["type"][1], "type") if "type" in found else ""
    for name in _NEEDED:
        if name not in found:
            raise FaultError(f"has a broken header: it has no attribute {name!r}")
    compression = found["compression"][1][0]
    if compression >= len(CHUNK_LINES):
        raise FaultError(f"has the compression {compression}, expected one from 0 to {len(CHUNK_LINES) - 1}")
    pixel_bytes = _channels(found["channels"][1])
    width, height = _windows(found)
    chunks = -(-height // CHUNK_LINES[compression])
    if tiled or kind.startswith("tiled"):
        chunks = _tiles(found, width, height)
    return at, Header(kind, width * height, pixel_bytes, chunks)


def plausible_frame(frame: tuple[int, int], data: tuple[int, int]) -> bool:
    """Whether a display window of this width and height may stand around so small a data window."""
    return frame[0] * frame[1] <= max(_FRAME_PIXELS, _FRAME_SHARE * data[0] * data[1])


def _attributes(data: mmap.mmap, at: int) -> tuple[int, dict[str, tuple[str, bytes]]]:
    """Type and bytes of every attribute by its name, and the byte after the header."""
    found: dict[str, tuple[str, bytes]] = {}
    while True:
        at, raw = _word(data, at)
        if not raw:
            return at, found
        name = _text(raw, "the name of an attribute")
        at, raw = _word(data, at)
        kind = _text(raw, f"the type of {name}")
        (size,) = struct.unpack_from("<i", data, at)
        if size < 0:
            raise FaultError(f"has a broken header: the attribute {name!r} has {size} bytes")
        if at + 4 + size > len(data):
            raise struct.error
        value = data[at + 4 : at + 4 + size]
        at += 4 + size
        if name in found:
            raise FaultError(f"has a broken header: it has the attribute {name!r} twice")
        _check(name, kind, value)
        found[name] = (kind, value)


def _word(data: mmap.mmap, at: int) -> tuple[int, bytes]:
    """The position after a zero-terminated word, and the word."""
    end = data.find(b"\0", at)
    if end < 0:
        raise struct.error
    return end + 1, data[at:end]


def _text(raw: bytes, what: str) -> str:
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        wrong = f"byte 0x{raw[error.start]:02x} in {raw[:40].decode('latin-1')!a}"
        raise FaultError(f"holds text that is not UTF-8: {what} ({wrong})") from None


def _check(name: str, kind: str, value: bytes) -> None:
    """What is wrong with an attribute by itself."""
    expected = _FIXED.get(kind, len(value))
    if len(value) != expected:
        wrong = f"the attribute {name!r} has {len(value)} bytes, expected {expected} for its type {kind}"
        raise FaultError(f"has a broken header: {wrong}")
    if kind == "string":
        _text(value, f"the attribute {name!r}")
    elif kind == "stringvector":
        _texts(value, name)
    elif kind == "rational":
        top, bottom = struct.unpack("<iI", value)
        if not bottom:
            raise FaultError(f"has a broken header: the attribute {name!r} is {top}/0")


def _texts(value: bytes, name: str) -> None:
    """A list of texts, each led by its length."""
    at = 0
    while at < len(value):
        size = struct.unpack_from("<i", value, at)[0] if at + 4 <= len(value) else -1
        if not 0 <= size <= len(value) - at - 4:
            raise FaultError(f"has a broken header: the texts of the attribute {name!r} run past its end")
        _text(value[at + 4 : at + 4 + size], f"the attribute {name!r}")
        at += 4 + size


def _channels(value: bytes) -> int:
    """Bytes a pixel of the channels in a list."""
    at, total, names = 0, 0, set()
    while True:
        end = value.find(b"\0", at)
        if end < 0:
            raise FaultError("has a broken header: its list of channels does not end")
        if end == at:
            break
        name = _text(value[at:end], "the name of a channel")
        if end + 17 > len(value):
            raise FaultError("has a broken header: its list of channels does not end")
        kind, _, across, down = struct.unpack_from("<iiii", value, end + 1)
        if not 0 <= kind < len(PIXEL_BYTES):
            raise FaultError(f"has a broken header: the channel {name!r} is of the pixel type {kind}")
        if across < 1 or down < 1:
            raise FaultError(f"has a broken header: the channel {name!r} is sampled {across} by {down}")
        if name in names:
            raise FaultError(f"has a broken header: it has the channel {name!r} twice")
        names.add(name)
        total += PIXEL_BYTES[kind]
        at = end + 17
    if not names:
        raise FaultError("has no channels, expected one or more")
    return total


def _windows(found: dict[str, tuple[str, bytes]]) -> tuple[int, int]:
    """Width and height of the data window, which with the display window must be plausible."""
    areas = []
    for name in ("displayWindow", "dataWindow"):
        kind, value = found[name]
        if kind != "box2i":
            raise FaultError(f"has a broken header: the attribute {name!r} is a {kind}, expected box2i")
        x0, y0, x1, y1 = struct.unpack("<iiii", value)
        what = "display window" if name == "displayWindow" else "data window"
        if x1 < x0 or y1 < y0 or max(map(abs, (x0, y0, x1, y1))) >= _FARTHEST:
            raise FaultError(f"has a broken header: its {what} is from ({x0}, {y0}) to ({x1}, {y1})")
        areas.append((x1 - x0 + 1, y1 - y0 + 1))
    (width, height), (data_width, data_height) = areas
    if not plausible_frame((width, height), (data_width, data_height)):
        wrong = f"{width}×{height} pixels around {data_width}×{data_height}"
        raise FaultError(f"has a display window of {wrong}, far more than it has pixels for")
    return data_width, data_height


def _tiles(found: dict[str, tuple[str, bytes]], width: int, height: int) -> int:
    """Tiles of the largest level; the others only add to them."""
    kind, value = found.get("tiles", ("", b""))
    across, down = struct.unpack_from("<II", value) if kind == "tiledesc" else (0, 0)
    if not (across and down):
        raise FaultError("has a broken header: its tiles have no size")
    count: int = -(-width // across) * -(-height // down)
    return count
