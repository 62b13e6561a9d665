"""Pictures to look at and to hand on: linear light through a display's view, in 8 or 16 bits.

The view is the SDR view of ACES 1.0 from an OpenColorIO configuration that is built into the library
and pinned by name, so a picture does not change with the machine's settings. The alternatives cut what
is brighter than white: the plain curve of sRGB, and the light itself, raw.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.exr.image import read_parts
from quiltcli.formats.png import save_png
from quiltcli.formats.stills import write_still
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import Float32Array
from quiltcli.images.layers import joined
from quiltcli.images.window import whole_frame

Bytes: TypeAlias = NDArray[np.uint8]
Values: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]

CONFIG = "ocio://cg-config-v2.2.0_aces-v1.3_ocio-v2.4"
LARGEST = 2048
"""Pixels a preview has at most in width and height; a picture of 16 bits, made to be shown, has them all."""
DEPTHS = (8, 16)
FORMATS = {".png": "png", ".tif": "tiff", ".tiff": "tiff"}
_OTHER_PICTURES = (
    ".jpg",
    ".jpeg",
    ".exr",
    ".webp",
    ".gif",
    ".bmp",
    ".tga",
    ".dpx",
    ".hdr",
    ".mp4",
    ".mov",
    ".svg",
)
_FIELD = re.compile("#+")
_LAST_NUMBER = re.compile(r".*?(-?\d+)")
_STRIP = 1 << 21  # pixels that go through a view together


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


def raw(rgb: Float32Array) -> Float32Array:
    """The linear light itself."""
    return rgb


VIEWS: dict[str, Callable[[Float32Array], Float32Array]] = {"aces": aces, "srgb": srgb, "raw": raw}


def tone_map(rgb: NDArray[Any], view: str = "aces", exposure: float = 0.0) -> Bytes:
    """Turn linear light into what a screen is sent.

    Args:
        rgb: (H, W, 3) linear Rec. 709; what is not a number counts as black.
        view: a name of `VIEWS`.
        exposure: stops the picture is made brighter by.

    Returns:
        (H, W, 3) uint8.
    """
    return display_values(rgb, Look(view, exposure)).astype(np.uint8)


@dataclass(frozen=True)
class Look:
    """How light becomes a picture.

    Attributes:
        view: a name of `VIEWS`.
        exposure: stops the picture is made brighter by.
        depth: bits a channel, 8 or 16.
        largest: most pixels in width and height; 0 for all there are.
    """

    view: str = "aces"
    exposure: float = 0.0
    depth: int = 8
    largest: int = LARGEST


def display_values(rgb: NDArray[Any], look: Look) -> Values:
    """Linear light (H, W, 3) as what a screen is sent (H, W, 3), uint8 or uint16; see `tone_map`."""
    top = 2**look.depth - 1
    result = np.empty(rgb.shape, dtype=np.uint8 if look.depth == 8 else np.uint16)
    rows = max(_STRIP // max(rgb.shape[1], 1), 1)
    for start in range(0, len(rgb), rows):
        light = np.asarray(rgb[start : start + rows], dtype=np.float32)
        light = np.nan_to_num(light, nan=0.0, posinf=65504.0, neginf=0.0) * np.float32(2.0**look.exposure)
        shown = np.clip(VIEWS[look.view](light), 0, 1)
        # Twice as precise for 16 bits: half a step of a float at 1 is a 512th of a step there.
        result[start : start + rows] = np.rint(shown.astype(np.float64) * top)
    return result


def write_png(path: Path, rgb: NDArray[Any], view: str = "aces", exposure: float = 0.0) -> None:
    """Write linear light (H, W, 3) as a PNG, whole or not at all.

    Raises:
        OutputError: the file cannot be written; nothing is left behind.
    """
    write_bytes(path, tone_map(rgb, view, exposure))


def write_bytes(path: Path, pixels: Bytes) -> None:
    """Write display values (H, W, 3) uint8 as a PNG, whole or not at all (OutputError)."""
    if path.suffix.lower() != ".png":
        raise OutputError(Problem("a picture's name must end in .png", file=str(path)))
    save_png(path, pixels, optimize=pixels.size < 1 << 23)


def write_values(path: Path, pixels: Values, view: str) -> None:
    """Write display values (H, W, 3) of a view as PNG or TIFF, whole or not at all (OutputError)."""
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise OutputError(Problem("a picture's name must end in .png, .tif or .tiff", file=str(path)))
    if kind == "png" and pixels.dtype == np.uint8:
        write_bytes(path, pixels.astype(np.uint8, copy=False))
        return
    colorspace = "lin_rec709_scene" if view == "raw" else "srgb_rec709_scene"
    write_still(path, pixels, 8 if pixels.dtype == np.uint8 else 16, colorspace)


def block_means(image: NDArray[Any], factor: int) -> Float32Array:
    """Means (⌈H/n⌉, ⌈W/n⌉, C) over n × n pixels of an image (H, W, C); blocks at the far ends may be cut."""
    rows, columns = (np.arange(0, length, factor) for length in image.shape[:2])
    sums = np.add.reduceat(image.astype(np.float32), rows, axis=0)
    sums = np.add.reduceat(sums, columns, axis=1)
    tall = np.diff(rows, append=image.shape[0])[:, None, None]
    wide = np.diff(columns, append=image.shape[1])[None, :, None]
    result: Float32Array = (sums / (tall * wide)).astype(np.float32)
    return result


def preview_paths(images: Sequence[Path], output: Path, kind: str | None = None) -> list[tuple[Path, Path]]:
    """Every image with the picture it becomes: the one named, or one of its own name in the folder `output`.

    Args:
        images: EXR images; a run of `#` in a name stands for the frame numbers there are.
        output: a picture or a folder, which is made.
        kind: `png` or `tiff`; None goes by the picture's name, and in folders for PNG.

    Raises:
        OutputError: several images and one picture, or two images of one name, or no image of a sequence.
    """
    images = _every_frame(images)
    named = FORMATS.get(output.suffix.lower())
    if named is None and output.suffix.lower() in _OTHER_PICTURES and not output.is_dir():
        known = ", ".join(FORMATS)
        raise OutputError(
            Problem(f"has the suffix {output.suffix!r}, expected {known} or a folder", str(output))
        )
    if named is not None and _FIELD.search(output.name):
        return [(image, _numbered(output, image)) for image in images]
    if named is None:
        pairs = [(image, output / f"{image.stem}.{'tif' if kind == 'tiff' else 'png'}") for image in images]
        if len({picture for _, picture in pairs}) < len(pairs):
            wrong = "two images of the same name would become one picture"
            raise OutputError(Problem(wrong, file=str(output)))
        make_folder(output)
        return pairs
    if len(images) > 1:
        wrong = f"is one picture for {len(images)} images, expected a folder"
        raise OutputError(Problem(wrong, file=str(output)))
    if kind not in (None, named):
        raise OutputError(Problem(f"is a name for a {named} picture, not for {kind}", file=str(output)))
    make_folder(output.parent)
    return [(images[0], output)]


def domemaster_paths(images: Sequence[Path], folder: Path, name: str) -> list[tuple[Path, Path]]:
    """Every image with the picture of a planetarium's sequence that it becomes: NAME_000001.png and so on.

    Raises:
        OutputError: an image has no frame number, or two have the same.
    """
    if folder.suffix.lower() in (*FORMATS, *_OTHER_PICTURES) and not folder.is_dir():
        raise OutputError(Problem("is a picture's name (expected a folder for a sequence)", str(folder)))
    if not name or Path(name).name != name:
        raise OutputError(f"--domemaster: expected a name for the sequence, got {name!r}")
    make_folder(folder)
    pairs, seen = [], set()
    for image in _every_frame(images):
        match = _LAST_NUMBER.fullmatch(image.stem)
        if match is None or int(match[1]) in seen:
            words = "has no frame number" if match is None else f"is a second image of frame {int(match[1])}"
            raise OutputError(Problem(f"{words} (expected a sequence such as page_01.####.exr)", str(image)))
        seen.add(int(match[1]))
        pairs.append((image, folder / f"{name}_{int(match[1]):06d}.png"))
    return pairs


def _numbered(output: Path, image: Path) -> Path:
    """The picture of an image of a sequence: `#` in its name becomes the image's number."""
    match = _LAST_NUMBER.fullmatch(image.stem)
    if match is None:
        raise OutputError(Problem(f"has no frame number to stand for # in {output.name}", file=str(image)))
    make_folder(output.parent)
    return output.with_name(_FIELD.sub(match[1], output.name))


def _every_frame(images: Sequence[Path]) -> list[Path]:
    """The images, sequences such as `page_01.####.exr` as all their frames, by number."""
    found = [list(_frames(path)) if _FIELD.search(path.name) else [path] for path in images]
    missing = [path for path, frames in zip(images, found, strict=True) if not frames]
    raise_all(OutputError, (Problem("there is no image of this sequence", str(path)) for path in missing))
    return [path for frames in found for path in frames]


def _frames(pattern: Path) -> Iterator[Path]:
    before, after = (re.escape(part) for part in _FIELD.split(pattern.name, maxsplit=1))
    name = re.compile(f"{before}(-?\\d+){after}")
    known = ((name.fullmatch(path.name), path) for path in pattern.parent.glob("*"))
    yield from (path for _, path in sorted((int(match[1]), path) for match, path in known if match))


def image_colors(image: Path) -> NDArray[Any]:
    """Colours (H, W, 3) of an EXR image's whole frame.

    Raises:
        OutputError: the image cannot be read or has no colours.
    """
    found = joined(read_parts(image))[0]
    if missing := [name for name in "RGB" if name not in found.channels]:
        have = ", ".join(found.channels)
        wrong = f"has no channel {missing[0]}, expected R, G and B (it has {have})"
        raise OutputError(Problem(wrong, file=str(image)))
    channels = whole_frame(replace(found, channels={name: found.channels[name] for name in "RGB"}))
    return np.stack([channels[name] for name in "RGB"], axis=-1)


def scaled_down(rgb: NDArray[Any], largest: int) -> NDArray[Any]:
    """An image (H, W, 3) scaled down by a whole number to at most `largest` pixels a side; 0 for as it is."""
    factor = -(-max(rgb.shape[:2]) // largest) if largest else 1
    return block_means(rgb, factor) if factor > 1 else rgb


def preview(image: Path, picture: Path, look: Look | None = None) -> tuple[int, int]:
    """Write a picture of an EXR image's colours.

    Returns:
        Width and height of the picture.

    Raises:
        OutputError: the image cannot be read or has no colours, or the picture cannot be written.
    """
    look = look or Look()
    small = scaled_down(image_colors(image), look.largest)
    write_values(picture, display_values(small, look), look.view)
    return small.shape[1], small.shape[0]
