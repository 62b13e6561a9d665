"""Is an OpenEXR file whole? Answered from its structure, without decoding a pixel.

The library drops the parts of a truncated file and prints a warning; a renderer that resumes, or
cuts facets out of a quilt, has to know for certain. Layout of the file: OpenEXR File Layout,
openexr.com (magic, version, headers, offset tables, chunks).
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path
from typing import BinaryIO

from quiltcli.errors import OutputError
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.formats.exr.header import FaultError, Header, read_header
from quiltcli.formats.inputs import open_input

_MAGIC, _VERSION = 20000630, 2
_DEEP, _MULTIPART, _TILED = 0x800, 0x1000, 0x200


def exr_fault(path: Path) -> str:
    """What is wrong with the structure of the file at `path`, "" when it is whole.

    Raises:
        OutputError: there is no such file, or it cannot be read.
    """
    with open_input(path, OutputError, "an EXR") as file:
        return structure_fault(file)


def structure_fault(file: BinaryIO) -> str:
    """What is wrong with the structure of an open file, "" when it is whole (OSError)."""
    if not file.seek(0, 2):
        return "is empty, expected an OpenEXR image"
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        try:
            _check(data)
        except struct.error:
            return f"is truncated: it ends inside its header or chunk table, after {len(data)} bytes"
        except FaultError as fault:
            return str(fault)
    return ""


def pixels_fault(path: Path) -> str:
    """What keeps the pixels of a file whose structure is whole from being read: memory; "" when nothing does.

    Raises:
        OutputError: the file cannot be read.
    """
    with (
        open_input(path, OutputError, "an EXR") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data,
    ):
        _, version = struct.unpack_from("<iI", data, 0)
        _, headers = _headers(data, version)
    needed, free = sum(header.pixels * header.pixel_bytes for header in headers), free_memory()
    if free is None or needed <= free:
        return ""
    return f"has {sum(h.pixels for h in headers):,} pixels, which take {bytes_text(needed)} of memory, " + (
        f"but {bytes_text(free)} are free"
    )


def _check(data: mmap.mmap) -> None:
    magic, version = struct.unpack_from("<iI", data, 0)
    if magic != _MAGIC:
        raise FaultError("is no OpenEXR image")
    if version & 0xFF != _VERSION:
        raise FaultError(f"is of version {version & 0xFF} of OpenEXR, expected {_VERSION}")
    if version & _DEEP:
        raise FaultError("holds deep samples, expected flat pixels")
    table, headers = _headers(data, version)
    last = _last_chunk(data, table, sum(header.chunks for header in headers))
    if last + 4 > len(data):
        raise FaultError(f"is truncated: {len(data)} bytes, expected more than {last}")
    tiled = bool(version & _TILED)
    if version & _MULTIPART:
        (part,) = struct.unpack_from("<i", data, last)
        tiled = 0 <= part < len(headers) and headers[part].kind.startswith("tiled")
        last += 4
    last += 20 if tiled else 8  # a tile is led by four coordinates, a row of scanlines by one; then the size
    if last > len(data):
        raise FaultError(f"is truncated: {len(data)} bytes, expected at least {last}")
    end = last + struct.unpack_from("<i", data, last - 4)[0]
    if end > len(data):
        raise FaultError(f"is truncated: {len(data)} of {end} bytes")


def _headers(data: mmap.mmap, version: int) -> tuple[int, list[Header]]:
    """Where the first offset table starts, and the header of every part."""
    at, headers = 8, []
    while True:
        at, header = read_header(data, at, bool(version & _TILED))
        headers.append(header)
        if not version & _MULTIPART:
            return at, headers
        if struct.unpack_from("<B", data, at)[0] == 0:
            return at + 1, headers


def _last_chunk(data: mmap.mmap, at: int, least: int) -> int:
    """Largest offset of the tables that start at `at`; the tables end where the first chunk begins."""
    first, last, start = len(data) + 1, 0, at
    while at < first:
        (offset,) = struct.unpack_from("<Q", data, at)
        at += 8
        if offset < at:
            raise FaultError("is unfinished: its chunk table is not filled in")
        first, last = min(first, offset), max(last, offset)
    if (at - start) // 8 < least:
        raise FaultError(f"is damaged: its data window needs {least:,} chunks, it has {(at - start) // 8:,}")
    return last
