"""Numbered pictures for those who edit or play them: PNG and TIFF of 8 or 16 bits, DPX of 10."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.whole import whole_file

KINDS = {".png": "png", ".tif": "tiff", ".tiff": "tiff", ".dpx": "dpx"}
_UNKNOWN = "    :  :     :  :  "


def write_still(
    path: Path,
    values: NDArray[np.uint8] | NDArray[np.uint16],
    bits: int,
    colorspace: str = "srgb_rec709_scene",
) -> None:
    """Write display values (H, W, 3), whole or not at all.

    Args:
        path: the file; its ending says which kind.
        values: uint8 for 8 bits, else uint16, from 0 to 2^bits − 1.
        bits: a channel; 8, 10 (DPX) or 16.
        colorspace: what the file says its values are, as OpenImageIO calls it.

    Raises:
        OutputError: the file cannot be written, or its ending is unknown.
    """
    import OpenImageIO

    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise OutputError(Problem(f"a picture's name must end in {', '.join(KINDS)}", file=str(path)))
    height, width, _ = values.shape
    spec = OpenImageIO.ImageSpec(width, height, 3, "uint8" if bits == 8 else "uint16")
    spec.attribute("oiio:ColorSpace", colorspace)
    spec.attribute("compression", "zip")
    # Unknown: the library would write the time of day, and two runs would differ.
    spec.attribute("DateTime", _UNKNOWN)
    if bits not in (8, 16):
        spec.attribute("oiio:BitsPerSample", bits)
        # The library takes the upper bits of sixteen: fill them so that white is white.
        values = np.rint(values.astype(np.float64) * (65535 / (2**bits - 1))).astype(np.uint16)
    with whole_file(path) as temporary:
        temporary.touch()  # so that what the system has against it is told in its own words
        file: Any = OpenImageIO.ImageOutput.create(kind)
        good = file.open(str(temporary), spec) and file.write_image(np.ascontiguousarray(values))
        if not (file.close() and good):
            said = " ".join(file.geterror().split()) or "the file is not whole"
            raise OutputError(Problem(f"cannot be written: {said}", file=str(path)))
        if kind == "dpx":
            _name_in_header(temporary, path.name)


def _name_in_header(temporary: Path, name: str) -> None:
    """A DPX has its own name in it, at byte 36 in 100 (SMPTE 268M): not that it was written under."""
    with temporary.open("r+b") as file:
        file.seek(36)
        file.write(name.encode()[:99].ljust(100, b"\0"))
