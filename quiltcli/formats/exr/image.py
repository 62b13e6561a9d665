"""OpenEXR images: written whole, read strictly.

One image is one part of planar channels, each (H, W) of float16, float32 or uint32.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.check import exr_fault, pixels_fault, structure_fault
from quiltcli.formats.exr.digest import ATTRIBUTE, BLANK, seal
from quiltcli.formats.whole import whole_file, write_problem

Channel: TypeAlias = NDArray[Any]
Window: TypeAlias = tuple[tuple[int, int], tuple[int, int]]

_PIXEL_TYPES = (np.dtype(np.float16), np.dtype(np.float32), np.dtype(np.uint32))
# What the library derives from the pixels and from `write_exr`'s own arguments.
_WINDOWS = {"dataWindow", "displayWindow"}
_STRUCTURE = _WINDOWS | {
    ATTRIBUTE,
    "channels",
    "chunkCount",
    "compression",
    "lineOrder",
    "name",
    "tiles",
    "type",
    "version",
}


@dataclass(frozen=True)
class Image:
    """One part of an EXR file.

    Attributes:
        channels: name → (H, W) float16, float32 or uint32, C-contiguous, owned by the image.
        attributes: all attributes but the structural ones (windows, compression, channel list …).
        compression: name as in `compressions()`.
        data_window: inclusive pixel bounds ((x0, y0), (x1, y1)) of the channels.
        display_window: inclusive pixel bounds of the frame.
        name: the part's name, empty in a single-part file.
    """

    channels: Mapping[str, Channel]
    attributes: Mapping[str, object]
    compression: str
    data_window: Window
    display_window: Window
    name: str = ""


def compressions() -> dict[str, Any]:
    """Names of all compressions of the installed OpenEXR, with the library's constants."""
    found = (name.removesuffix("_COMPRESSION") for name in dir(OpenEXR) if name.endswith("_COMPRESSION"))
    constants = {name.lower(): getattr(OpenEXR, f"{name}_COMPRESSION") for name in found}
    return {"none": constants.pop("no"), **dict(sorted(constants.items()))}


def compression_constant(name: str) -> Any:
    """The library's constant for a compression `name`, in any case (OutputError lists the names)."""
    known = compressions()
    if name.lower() not in known:
        raise OutputError(f"compression {name!r} is unknown, expected one of {', '.join(known)}")
    return known[name.lower()]


def use_threads(count: int) -> None:
    """Let the library compress with so many threads; it has none of its own accord.

    The bytes do not depend on it. They are threads of this process: fork before, not after.
    """
    count = count if count > 1 else 0
    if OpenEXR.global_thread_count() != count:
        OpenEXR.set_global_thread_count(count)


def write_exr(
    path: Path,
    channels: Mapping[str, Channel],
    attributes: Mapping[str, object],
    compression: str = "zip",
    *,
    data_window: Window | None = None,
    display_window: Window | None = None,
) -> None:
    """Write one image, whole or not at all; the same input gives the same bytes.

    Args:
        path: the file; its folder must exist.
        channels: name → (H, W) array of float16, float32 or uint32, all of one shape, any strides.
        attributes: str, int (32 bits), float (stored as 32 bits), Fraction, arrays of 2 to 4 numbers
            (V3f and its family) and whatever else the library stores.
        compression: a name of `compressions()`.
        data_window: where the pixels lie; by default at ((0, 0), (W−1, H−1)).
        display_window: the frame; by default the data window.

    Raises:
        OutputError: the file cannot be written; nothing is left behind.
    """
    shape = next((np.shape(array) for array in channels.values()), ())
    frame = (0, 0), (shape[-1] - 1, shape[0] - 1) if len(shape) == 2 else (0, 0)
    data = data_window or frame
    write_images(path, [Image(channels, attributes, compression, data, display_window or data)])


def write_images(path: Path, images: Sequence[Image]) -> None:
    """Write an image, or several with names of their own as the parts of one file; see `write_exr`."""
    with whole_file(path) as temporary:
        try:
            _library_file(path, images).write(str(temporary))
        except RuntimeError as error:
            raise OutputError(write_problem(path, error)) from error
        # The library's stream is flushed when it is destroyed, where a full disk goes unreported.
        with temporary.open("rb") as written:
            fault = structure_fault(written)
        if fault:
            raise OutputError(Problem(f"cannot be written: what reached the disk {fault}", file=str(path)))
        seal(temporary)


def _library_file(path: Path, images: Sequence[Image]) -> Any:
    """The file as the library has it; its dicts are made anew, for the library adds to them."""
    headers = [_header(path, image) for image in images]
    headers[0][ATTRIBUTE] = BLANK
    pixels = [_pixels(path, image.channels) for image in images]
    if len(images) == 1:
        return OpenEXR.File(headers[0], pixels[0])
    names = [image.name for image in images]
    return OpenEXR.File([OpenEXR.Part(*part) for part in zip(headers, pixels, names, strict=True)])


def _header(path: Path, image: Image) -> dict[str, Any]:
    """The library's header of an image."""
    header: dict[str, Any] = {name: _attribute(path, name, value) for name, value in image.attributes.items()}
    header["compression"] = compression_constant(image.compression)
    header["type"] = OpenEXR.scanlineimage
    header["dataWindow"] = image.data_window
    header["displayWindow"] = image.display_window
    return header


def _pixels(path: Path, channels: Mapping[str, Channel]) -> dict[str, Channel]:
    """Contiguous views or copies of `channels`: the library ignores strides and writes wrong pixels."""
    shapes = {np.shape(array) for array in channels.values()}
    if len(shapes) != 1 or len(shape := shapes.pop()) != 2 or 0 in shape:
        raise OutputError(Problem("channels must share one shape (H, W) that is not empty", file=str(path)))
    for name, array in channels.items():
        if array.dtype not in _PIXEL_TYPES:
            expected = "expected float16, float32 or uint32"
            raise OutputError(Problem(f"channel {name} is {array.dtype}, {expected}", file=str(path)))
    return {name: np.ascontiguousarray(array) for name, array in channels.items()}


def _attribute(path: Path, name: str, value: object) -> object:
    """`value` in a form the library stores unharmed; it cuts numbers to 32 bits without a word."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, int | Fraction):
        top, bottom = value.as_integer_ratio()
        if not (-(2**31) <= top < 2**31 and bottom < 2**32):
            wrong = f"is {value}, expected an integer or a fraction of 32 bits"
            raise OutputError(Problem(wrong, file=str(path), key=name))
    return value


def read_parts(path: Path) -> tuple[Image, ...]:
    """Read every part of an EXR file, in file order.

    Raises:
        OutputError: the file is missing, truncated, damaged, subsampled or no flat OpenEXR image.
    """
    headers = _read_headers(path)
    if fault := pixels_fault(path):
        raise OutputError(Problem(fault, file=str(path)))
    # `with` would empty the parts: the arrays are handed over by the library, not shared with it.
    parts = _open(path, separate_channels=True).parts
    if len(parts) != len(headers):
        wrong = f"is damaged: {len(parts)} of {len(headers)} parts can be read"
        raise OutputError(Problem(wrong, file=str(path)))
    images = tuple(_image(part.header, part.channels) for part in parts)
    if any(len({channel.shape for channel in image.channels.values()}) > 1 for image in images):
        raise OutputError(Problem("has subsampled channels, expected all of one size", file=str(path)))
    return images


def read_exr(path: Path, part: str = "") -> Image:
    """Read a file of one part, or the part of this name; errors as for `read_parts`."""
    parts = read_parts(path)
    if part and len(parts) > 1:
        named = [image for image in parts if image.name == part]
        if not named:
            names = ", ".join(image.name for image in parts)
            raise OutputError(Problem(f"has no part {part} (its parts are {names})", file=str(path)))
        return named[0]
    if len(parts) != 1:
        raise OutputError(Problem(f"has {len(parts)} parts, expected an image of one part", file=str(path)))
    return parts[0]


def part_names(path: Path) -> tuple[str, ...]:
    """Names of the parts of a file, empty for one that has none; errors as for `read_parts`."""
    return tuple(header.get("name", "") for header in _read_headers(path))


def channel_names(path: Path) -> list[tuple[str, ...]]:
    """Names of the channels of each part of a file; errors as for `read_parts`."""
    return [tuple(channel.name for channel in header["channels"]) for header in _read_headers(path)]


def read_first(path: Path) -> Image:
    """The first part of a file, whatever others there are: the left eye's; errors as for `read_parts`."""
    return read_parts(path)[0]


def read_header(path: Path) -> Image:
    """Everything of the first part but its pixels (`channels` is empty); errors as for `read_parts`."""
    return _image(_read_headers(path)[0], {})


def _read_headers(path: Path) -> list[Mapping[str, Any]]:
    """Headers of the parts of a file whose structure is whole."""
    if fault := exr_fault(path):
        raise OutputError(Problem(fault, file=str(path)))
    return [part.header for part in _open(path, header_only=True).parts]


def _open(path: Path, **how: bool) -> Any:
    try:
        return OpenEXR.File(str(path), **how)
    except (MemoryError, KeyboardInterrupt):
        raise
    except Exception as error:  # the bindings raise whatever they meet in a damaged file
        words = error if isinstance(error, RuntimeError) else "is damaged"
        raise OutputError(Problem(f"cannot be read: {words}", file=str(path))) from error


def _image(header: Mapping[str, Any], channels: Mapping[str, Any]) -> Image:
    compression = next(name for name, value in compressions().items() if value == header["compression"])
    return Image(
        channels={name: channels[name].pixels for name in sorted(channels)},
        attributes={name: header[name] for name in sorted(header) if name not in _STRUCTURE},
        compression=compression,
        data_window=_window(header["dataWindow"]),
        display_window=_window(header["displayWindow"]),
        name=header.get("name", ""),
    )


def _window(corners: Any) -> Window:
    (x0, y0), (x1, y1) = corners
    return (int(x0), int(y0)), (int(x1), int(y1))
