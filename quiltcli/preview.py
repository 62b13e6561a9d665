"""Pictures to look at: linear light through a display's view into an 8-bit PNG.

The view is the SDR view of ACES 1.0 from an OpenColorIO configuration that is built into the library
and pinned by name, so a picture does not change with the machine's settings; the plain curve of
sRGB, which cuts what is brighter than white, is the alternative.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.exr import read_exr
from quiltcli.exrwindow import whole_frame
from quiltcli.geometry import Float32Array
from quiltcli.wholefile import make_folder, whole_file

Bytes: TypeAlias = NDArray[np.uint8]

CONFIG = "ocio://cg-config-v2.2.0_aces-v1.3_ocio-v2.4"
LARGEST = 2048
"""Pixels a preview has at most in width and height."""


def aces(rgb: Float32Array) -> Float32Array:
    """Display values (H, W, 3) of linear Rec. 709 through the SDR view of ACES 1.0.

    Raises:
        OutputError: the installed library does not know the pinned configuration.
    """
    from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo

    source = ImageBuf(np.ascontiguousarray(rgb, dtype=np.float32))
    shown = ImageBufAlgo.ociodisplay(
        source, "sRGB - Display", "ACES 1.0 - SDR Video", "lin_rec709", colorconfig=CONFIG
    )
    # A failed transform returns an image that was never filled: its error has to be asked for.
    if shown.has_error:
        raise OutputError(f"the ACES view failed ({shown.geterror()}): the plain view is srgb")
    return np.asarray(shown.get_pixels(FLOAT), dtype=np.float32)


def srgb(rgb: Float32Array) -> Float32Array:
    """Display values (H, W, 3) of linear Rec. 709 by the curve of sRGB (IEC 61966-2-1), cut at white."""
    linear = np.clip(rgb, np.float32(0), np.float32(1))
    curved = np.float32(1.055) * linear ** np.float32(1 / 2.4) - np.float32(0.055)
    result: Float32Array = np.where(linear <= np.float32(0.0031308), np.float32(12.92) * linear, curved)
    return result


VIEWS: dict[str, Callable[[Float32Array], Float32Array]] = {"aces": aces, "srgb": srgb}


def tone_map(rgb: NDArray[Any], view: str = "aces", exposure: float = 0.0) -> Bytes:
    """Turn linear light into what a screen is sent.

    Args:
        rgb: (H, W, 3) linear Rec. 709; what is not a number counts as black.
        view: a name of `VIEWS`.
        exposure: stops the picture is made brighter by.

    Returns:
        (H, W, 3) uint8.
    """
    light = np.nan_to_num(np.asarray(rgb, dtype=np.float32), nan=0.0, posinf=65504.0, neginf=0.0)
    shown = VIEWS[view](light * np.float32(2.0**exposure))
    result: Bytes = np.rint(np.clip(shown, 0, 1) * 255).astype(np.uint8)
    return result


def write_png(path: Path, rgb: NDArray[Any], view: str = "aces", exposure: float = 0.0) -> None:
    """Write linear light (H, W, 3) as a PNG, whole or not at all.

    Raises:
        OutputError: the file cannot be written; nothing is left behind.
    """
    write_bytes(path, tone_map(rgb, view, exposure))


def write_bytes(path: Path, pixels: Bytes) -> None:
    """Write display values (H, W, 3) uint8 as a PNG, whole or not at all (OutputError)."""
    from PIL import Image

    if path.suffix.lower() != ".png":
        raise OutputError(Problem("a picture's name must end in .png", file=str(path)))
    with whole_file(path) as temporary:
        Image.fromarray(pixels).save(temporary, format="PNG", optimize=pixels.size < 1 << 23)


def block_means(image: NDArray[Any], factor: int) -> Float32Array:
    """Means (⌈H/n⌉, ⌈W/n⌉, C) over n × n pixels of an image (H, W, C); blocks at the far ends may be cut."""
    rows, columns = (np.arange(0, length, factor) for length in image.shape[:2])
    sums = np.add.reduceat(image.astype(np.float32), rows, axis=0)
    sums = np.add.reduceat(sums, columns, axis=1)
    tall = np.diff(rows, append=image.shape[0])[:, None, None]
    wide = np.diff(columns, append=image.shape[1])[None, :, None]
    result: Float32Array = (sums / (tall * wide)).astype(np.float32)
    return result


def preview_paths(images: Sequence[Path], output: Path) -> list[tuple[Path, Path]]:
    """Every image with the PNG it becomes: the one named, or one of its own name in the folder `output`.

    Raises:
        OutputError: several images and one picture, or two images of one name.
    """
    if output.suffix.lower() == ".png":
        if len(images) > 1:
            wrong = f"is one picture for {len(images)} images, expected a folder"
            raise OutputError(Problem(wrong, file=str(output)))
        make_folder(output.parent)
        return [(images[0], output)]
    pairs = [(image, output / f"{image.stem}.png") for image in images]
    if len({picture for _, picture in pairs}) < len(pairs):
        raise OutputError(Problem("two images of the same name would become one picture", file=str(output)))
    make_folder(output)
    return pairs


def preview(image: Path, picture: Path, view: str = "aces", exposure: float = 0.0) -> tuple[int, int]:
    """Write a PNG of an EXR image's colours, scaled down to at most `LARGEST` pixels a side.

    Returns:
        Width and height of the picture.

    Raises:
        OutputError: the image cannot be read or has no colours, or the picture cannot be written.
    """
    channels = whole_frame(read_exr(image))
    if missing := [name for name in "RGB" if name not in channels]:
        have = ", ".join(channels)
        wrong = f"has no channel {missing[0]}, expected R, G and B (it has {have})"
        raise OutputError(Problem(wrong, file=str(image)))
    rgb = np.stack([channels[name] for name in "RGB"], axis=-1)
    small = block_means(rgb, -(-max(rgb.shape[:2]) // LARGEST))
    write_png(picture, small, view, exposure)
    return small.shape[1], small.shape[0]
