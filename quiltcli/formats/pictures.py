"""Pictures of other programs as linear light: EXR, PNG, TIFF, JPEG and what else OpenImageIO reads.

Whole numbers are taken for sRGB (IEC 61966-2-1) and floats for linear light, unless one says otherwise.
Alpha that is kept apart from colour, as in a PNG, is multiplied in after that, in linear light.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.formats.exr.image import Image, read_first, read_header
from quiltcli.formats.inputs import check_input
from quiltcli.geometry import Float32Array

COLORSPACES = ("auto", "srgb", "linear")
SUFFIXES = (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg")


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height of a picture by its header (OutputError)."""
    if path.suffix.lower() == ".exr":
        (x0, y0), (x1, y1) = read_header(path).display_window
        return x1 - x0 + 1, y1 - y0 + 1
    file = _opened(path)
    spec = file.spec()
    file.close()
    return int(spec.width), int(spec.height)


def read_picture(path: Path, colorspace: str = "auto") -> Float32Array:
    """A picture (H, W, 4) in linear light, colour multiplied by alpha; alpha is 1 where it has none.

    Args:
        path: the file; of several parts the first is read.
        colorspace: a name of `COLORSPACES`; `auto` goes by the type of the numbers.

    Raises:
        OutputError: it cannot be read, or has no colours.
    """
    if path.suffix.lower() == ".exr":
        return _from_exr(path, colorspace)
    file = _opened(path)
    spec = file.spec()
    width, height, channels = int(spec.width), int(spec.height), int(spec.nchannels)
    free = free_memory()
    needed = width * height * (channels + 4) * 4
    if free is not None and needed > free:
        words = f"would take {bytes_text(needed)} of memory, and {bytes_text(free)} are free"
        raise OutputError(Problem(words, file=str(path)))
    whole = str(spec.format) in ("uint8", "uint16")
    pixels: Any = file.read_image(str(spec.format) if whole else "float")
    said = file.geterror()
    file.close()
    if pixels is None:
        raise OutputError(Problem(f"cannot be read: {' '.join(said.split())}", file=str(path)))
    apart = bool(spec.get_int_attribute("oiio:UnassociatedAlpha", 0))
    pixels = np.asarray(pixels).reshape(height, width, channels)
    curved = colorspace == "srgb" or (colorspace == "auto" and whole)
    return linear_light(pixels, curved, apart)


def _opened(path: Path) -> Any:
    import OpenImageIO

    check_input(path, OutputError, "a picture")
    hints = OpenImageIO.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)  # to be multiplied in when the light is linear
    file = OpenImageIO.ImageInput.open(str(path), hints)
    if file is None:
        said = " ".join(OpenImageIO.geterror().split())
        raise OutputError(Problem(f"cannot be read: {said}", file=str(path)))
    return file


def linear_light(pixels: NDArray[Any], curved: bool, apart: bool) -> Float32Array:
    """Light (H, W, 4) of pixels (H, W, C): whether on the curve of sRGB, and not yet multiplied by alpha."""
    height, width, channels = pixels.shape
    light = np.empty((height, width, 4), dtype=np.float32)
    for to, c in zip(range(3), (0, 1, 2) if channels >= 3 else (0, 0, 0), strict=True):
        light[..., to] = _curve(pixels[..., c], curved)
    has_alpha = channels in (2, 4)
    light[..., 3] = _curve(pixels[..., channels - 1], curved=False) if has_alpha else 1
    if has_alpha and apart:
        light[..., :3] *= light[..., 3:]
    return light


def _curve(values: NDArray[Any], curved: bool) -> Float32Array:
    if values.dtype.kind == "u":
        light: Float32Array = _table(int(np.iinfo(values.dtype).max), curved)[values]
        return light
    return to_linear(values.astype(np.float64)).astype(np.float32) if curved else values.astype(np.float32)


@lru_cache(maxsize=4)
def _table(top: int, curved: bool) -> Float32Array:
    """Light of every whole number from 0 to `top`."""
    values = np.arange(top + 1) / top
    return (to_linear(values) if curved else values).astype(np.float32)


def to_linear(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Light of values on the curve of sRGB (IEC 61966-2-1), carried on below 0 and beyond 1."""
    size = np.abs(values)
    curved = ((size + 0.055) / 1.055) ** 2.4
    result: NDArray[np.float64] = np.copysign(np.where(size <= 0.04045, size / 12.92, curved), values)
    return result


def _from_exr(path: Path, colorspace: str) -> Float32Array:
    image = read_first(path)
    names = _colour_channels(path, image.channels)
    (x0, y0), (x1, y1) = image.display_window
    light = np.zeros((y1 - y0 + 1, x1 - x0 + 1, 4), dtype=np.float32)
    for to, name in enumerate(filter(None, names)):
        into, pixels = _placed(light[..., to], image, name)
        into[...] = pixels.astype(np.float32)
    if not names[3]:
        light[..., 3] = 1
    if colorspace == "srgb":
        light[..., :3] = to_linear(light[..., :3].astype(np.float64))
    return light


def _placed(whole: Float32Array, image: Image, name: str) -> tuple[Float32Array, NDArray[Any]]:
    """What of a frame an image's data window covers, and the pixels of a channel that lie there."""
    pixels = image.channels[name]
    (x0, y0), (fx, fy) = image.data_window[0], image.display_window[0]
    left, top = x0 - fx, y0 - fy
    rows = slice(max(top, 0), min(top + pixels.shape[0], whole.shape[0]))
    columns = slice(max(left, 0), min(left + pixels.shape[1], whole.shape[1]))
    if rows.stop <= rows.start or columns.stop <= columns.start:
        return whole[:0, :0], pixels[:0, :0]  # it lies beside the frame
    cut = pixels[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    return whole[rows, columns], cut


def _colour_channels(path: Path, channels: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Names of red, green, blue and alpha, of the plain layer or the first that has colours."""
    prefixes = ["", *sorted(name[:-1] for name in channels if name.endswith(".R"))]
    best = sorted(prefixes, key=lambda prefix: (prefix != "", "Combined" not in prefix))
    for prefix in best:
        if all(prefix + c in channels for c in "RGB"):
            return prefix + "R", prefix + "G", prefix + "B", prefix + "A" if prefix + "A" in channels else ""
    if "Y" in channels:
        return "Y", "Y", "Y", "A" if "A" in channels else ""
    have = ", ".join(channels)
    raise OutputError(Problem(f"has no colours, expected R, G and B (it has {have})", file=str(path)))
