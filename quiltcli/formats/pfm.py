"""PFM, the float pictures of MPCDI: bottom row first, written little-endian, read in either order."""

from __future__ import annotations

import re

import numpy as np

from quiltcli.geometry import Float32Array

_HEADER = re.compile(rb"(PF|Pf)\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,40})\s", re.DOTALL)


class PfmError(ValueError):
    """Bytes that are no PFM; the message says why."""


def pfm_bytes(image: Float32Array) -> bytes:
    """A PFM of three channels (H, W, 3), row 0 being the top."""
    height, width, _ = image.shape
    header = f"PF\n{width} {height}\n-1.000000\n".encode()
    return header + np.ascontiguousarray(image[::-1], dtype="<f4").tobytes()


def read_pfm(data: bytes, *, finite: bool = True) -> Float32Array:
    """The picture (H, W, 3 or 1) in a PFM, row 0 being the top.

    Args:
        data: the file's bytes.
        finite: whether values that are not finite become 0.

    Raises:
        PfmError: the header is none, or the data is not as long as it says.
    """
    match = _HEADER.match(data)
    if match is None:
        raise PfmError(f"starts with {data[:12]!r}, expected a PFM header such as 'PF 640 480 -1.0'")
    channels = 3 if match[1] == b"PF" else 1
    width, height = int(match[2]), int(match[3])
    try:
        scale = float(match[4])
    except ValueError:
        scale = 0.0
    if not (width and height and scale):
        raise PfmError(f"has the header {match[0].decode()!r}, expected sizes and a scale other than 0")
    expected, found = 4 * width * height * channels, len(data) - match.end()
    if found != expected:
        raise PfmError(f"holds {found} bytes, expected {expected} for {width}×{height} pixels")
    # A negative scale says little-endian.
    pixels = np.frombuffer(data, "<f4" if scale < 0 else ">f4", offset=match.end())
    image = pixels.reshape(height, width, channels)[::-1].astype(np.float32)
    if finite:
        image[~np.isfinite(image)] = 0  # common in the third channel, which means nothing in two dimensions
    return image
