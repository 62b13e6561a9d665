"""Is an OpenEXR file whole? Answered from its structure, without decoding a pixel.

The library drops the parts of a truncated file and prints a warning; a renderer that resumes, or
cuts facets out of a quilt, has to know for certain. Layout of the file: OpenEXR File Layout,
openexr.com (magic, version, headers, offset tables, chunks).
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

_MAGIC = 20000630
_DEEP, _MULTIPART, _TILED = 0x800, 0x1000, 0x200


class _FaultError(Exception):
    """What is wrong with the file, for the reader of this module."""


def exr_fault(path: Path) -> str:
    """What is wrong with the structure of the file at `path`, "" when it is whole (OSError)."""
    with path.open("rb") as file:
        if not file.seek(0, 2):
            return "is empty, expected an OpenEXR image"
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            try:
                _check(data)
            except struct.error:
                return f"is truncated: it ends inside its header or chunk table, after {len(data)} bytes"
            except _FaultError as fault:
                return str(fault)
    return ""


def _check(data: mmap.mmap) -> None:
    magic, version = struct.unpack_from("<iI", data, 0)
    if magic != _MAGIC:
        raise _FaultError("is no OpenEXR image")
    if version & _DEEP:
        raise _FaultError("holds deep samples, expected flat pixels")
    table, kinds = _headers(data, bool(version & _MULTIPART))
    last = _last_chunk(data, table)
    if last + 4 > len(data):
        raise _FaultError(f"is truncated: {len(data)} bytes, expected more than {last}")
    tiled = bool(version & _TILED)
    if version & _MULTIPART:
        (part,) = struct.unpack_from("<i", data, last)
        tiled = 0 <= part < len(kinds) and kinds[part].startswith(b"tiled")
        last += 4
    last += 20 if tiled else 8  # a tile is led by four coordinates, a row of scanlines by one; then the size
    if last > len(data):
        raise _FaultError(f"is truncated: {len(data)} bytes, expected at least {last}")
    end = last + struct.unpack_from("<i", data, last - 4)[0]
    if end > len(data):
        raise _FaultError(f"is truncated: {len(data)} of {end} bytes")


def _headers(data: mmap.mmap, multipart: bool) -> tuple[int, list[bytes]]:
    """Where the first offset table starts, and the `type` attribute of every part."""
    at, kinds = 8, []
    while True:
        at, kind = _header(data, at)
        kinds.append(kind)
        if not multipart:
            return at, kinds
        if struct.unpack_from("<B", data, at)[0] == 0:
            return at + 1, kinds


def _header(data: mmap.mmap, at: int) -> tuple[int, bytes]:
    kind = b""
    while True:
        at, name = _word(data, at)
        if not name:
            return at, kind
        at, _ = _word(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        if size < 0:
            raise _FaultError("has a broken header")
        if name == b"type":
            kind = data[at + 4 : at + 4 + size]
        at += 4 + size


def _word(data: mmap.mmap, at: int) -> tuple[int, bytes]:
    """The position after a zero-terminated word, and the word."""
    end = data.find(b"\0", at)
    if end < 0:
        raise struct.error
    return end + 1, data[at:end]


def _last_chunk(data: mmap.mmap, at: int) -> int:
    """Largest offset of the tables that start at `at`; the tables end where the first chunk begins."""
    first, last = len(data) + 1, 0
    while at < first:
        (offset,) = struct.unpack_from("<Q", data, at)
        at += 8
        if offset < at:
            raise _FaultError("is unfinished: its chunk table is not filled in")
        first, last = min(first, offset), max(last, offset)
    return last
