"""Channels as parts of a file each, and put together again.

A part is named for its channel, `Z`, after the eye where a file holds both: `left.Z`. All parts of an image
have its windows and attributes; what is said of Cryptomattes stands in their own parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from quiltcli.channels import CHANNELS
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.image import Image, Window, read_parts

_MATTE = "cryptomatte/"


def channel_parts(image: Image, channels: Sequence[str]) -> Iterator[Image]:
    """An image in parts, one for each of the job's channels, in their order."""
    for name in channels:
        own = {layer: image.channels[layer] for layer in CHANNELS[name].layers}
        about = _about(image, name)
        yield replace(
            image, channels=own, attributes=about, name=f"{image.name}.{name}" if image.name else name
        )


def _about(image: Image, channel: str) -> dict[str, object]:
    """The attributes of a part: of mattes those of its own."""
    layer = CHANNELS[channel].layers[0].removesuffix("00.R")
    groups = {
        name.rsplit("/", 1)[0]
        for name, value in image.attributes.items()
        if name.startswith(_MATTE) and name.endswith("/name") and value == layer
    }
    return {
        name: value
        for name, value in image.attributes.items()
        if not name.startswith(_MATTE) or name.rsplit("/", 1)[0] in groups
    }


def read_view(path: Path, eye: str = "") -> Image:
    """The image that a file of one part or of parts by channel holds, or that of an eye where it holds both.

    Raises:
        OutputError: the file is wrong, or has no such image.
    """
    views = joined(read_parts(path))
    if eye and (len(views) > 1 or views[0].name == eye):
        named = [image for image in views if image.name == eye]
        if not named:
            names = ", ".join(image.name for image in views)
            raise OutputError(Problem(f"has no part {eye} (its parts are {names})", file=str(path)))
        return named[0]
    if len(views) != 1:
        raise OutputError(Problem(f"has {len(views)} parts, expected an image of one part", file=str(path)))
    return views[0]


def joined(parts: Sequence[Image]) -> tuple[Image, ...]:
    """Parts that are channels of one image made that image, with the name of its eye; others as they are."""
    found: dict[str, list[Image]] = {}
    for part in parts:
        eye, _, channel = part.name.rpartition(".")
        own = found.setdefault(eye if channel in CHANNELS else part.name, [])
        if own and _frame(own[0]) != _frame(part):
            return tuple(parts)
        own.append(part)
    return tuple(_joined(name, own) for name, own in found.items())


def _frame(image: Image) -> tuple[Window, Window]:
    return image.data_window, image.display_window


def _joined(name: str, parts: Sequence[Image]) -> Image:
    if len(parts) == 1:
        return replace(parts[0], name=name)
    channels = {layer: pixels for part in parts for layer, pixels in part.channels.items()}
    attributes = {key: value for part in parts for key, value in part.attributes.items()}
    return replace(parts[0], channels=dict(sorted(channels.items())), attributes=attributes, name=name)
