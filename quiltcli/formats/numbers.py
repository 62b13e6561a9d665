"""Pictures of numbers: EXR and PFM as they are, others through OpenImageIO."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import DisplayError, OutputError, Problem
from quiltcli.formats.exr.image import read_first
from quiltcli.formats.inputs import read_input
from quiltcli.formats.noted import note_input
from quiltcli.formats.pfm import PfmError, read_pfm
from quiltcli.geometry import FloatArray

_NAMES = (("X", "Y", "Z"), ("R", "G", "B"))


@dataclass(frozen=True)
class Picture:
    """A picture of numbers.

    Attributes:
        values: (C, H, W) its channels, row 0 being the top.
        alpha: (H, W), or None.
    """

    values: FloatArray
    alpha: FloatArray | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.values.shape[2], self.values.shape[1]


def read_numbers(path: Path, least: int, *, exact: bool = False) -> Picture:
    """Read a picture.

    Args:
        path: EXR (X, Y, Z or R, G, B, or a single channel; and A), PFM, or what OpenImageIO reads.
        least: channels it must have.
        exact: whether half floats, which keep three digits, will not do.

    Raises:
        DisplayError: it cannot be read, has fewer channels, or half floats where that matters.
    """
    suffix = path.suffix.lower()
    if suffix == ".exr":
        found = _exr(path, least, exact)
    elif suffix == ".pfm":
        try:
            values = read_pfm(read_input(path, DisplayError, "a PFM"), finite=False)
        except PfmError as error:
            raise DisplayError(Problem(str(error), file=str(path))) from None
        found = Picture(np.moveaxis(values.astype(np.float64), 2, 0))
    else:
        found = _other(path)
    if len(found.values) < least:
        words = f"has {len(found.values)} channels (expected {least} or more)"
        raise DisplayError(Problem(words, file=str(path)))
    return found


def _exr(path: Path, least: int, exact: bool) -> Picture:
    try:
        note_input(path, read_input(path, DisplayError, "an EXR"))
        channels = read_first(path).channels
    except OutputError as error:
        raise DisplayError(error.problems) from None
    names: Sequence[str] = next((names for names in _NAMES if set(names[:least]) <= set(channels)), ())
    if not names:
        others = sorted(name for name in channels if name != "A")
        if least > 1:
            words = f"has the channels {', '.join(sorted(channels))} (expected {', '.join(_NAMES[0][:least])}"
            raise DisplayError(Problem(f"{words} or {', '.join(_NAMES[1][:least])})", file=str(path)))
        names = others[:1]
    chosen = [channels[name] for name in names if name in channels]
    if exact and any(channel.dtype == np.float16 for channel in chosen):
        words = "holds half floats, which are good to three digits (expected 32-bit floats)"
        raise DisplayError(Problem(words, file=str(path)))
    alpha = channels.get("A")
    return Picture(
        np.stack([np.asarray(channel, dtype=np.float64) for channel in chosen]),
        None if alpha is None else np.asarray(alpha, dtype=np.float64),
    )


def _other(path: Path) -> Picture:
    import OpenImageIO

    data = read_input(path, DisplayError, "a picture")
    note_input(path, data)
    file = OpenImageIO.ImageInput.open(str(path))
    pixels = None if file is None else file.read_image(OpenImageIO.FLOAT)
    if pixels is None:
        words = f"cannot be read: {OpenImageIO.geterror()[:200]}"
        raise DisplayError(Problem(words, file=str(path)))
    channels = np.moveaxis(np.asarray(pixels, dtype=np.float64), 2, 0)
    if len(channels) in (2, 4):
        return Picture(channels[:-1], channels[-1])
    return Picture(channels)
