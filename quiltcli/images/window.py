"""Data windows: the part of a frame that an image holds, and the frame made whole again.

OpenEXR keeps two rectangles: the display window is the frame, the data window is where there are
pixels. A tight data window leaves out margins in which no pixel holds anything but its empty value;
what is left out is known to the bit, so nothing is lost.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import BACKGROUND
from quiltcli.formats.exr.image import Channel, Image, Window

_STRIP = 64  # rows or columns looked at together


def frame_size(image: Image) -> tuple[int, int]:
    """Width and height of an image's display window, pixels."""
    (x0, y0), (x1, y1) = image.display_window
    return x1 - x0 + 1, y1 - y0 + 1


def tight_window(channels: Mapping[str, Channel], empty: Mapping[str, float] = BACKGROUND) -> Window:
    """The least data window that leaves out nothing but empty values.

    Args:
        channels: name → (H, W), float16, float32 or uint32.
        empty: value by channel of a pixel that shows nothing, 0 where not named.

    Returns:
        Inclusive bounds; the first pixel alone where all are empty, for a window cannot be.
    """
    planes = [_bits(channel, empty.get(name, 0)) for name, channel in channels.items()]
    height, width = planes[0][0].shape
    top = _margin(planes)
    if top == height:
        return (0, 0), (0, 0)
    bottom = height - _margin([(plane[::-1], value) for plane, value in planes])
    rows = [(plane[top:bottom].T, value) for plane, value in planes]
    left = _margin(rows)
    right = width - _margin([(plane[::-1], value) for plane, value in rows])
    return (left, top), (right - 1, bottom - 1)


def cropped(channels: Mapping[str, Channel], window: Window) -> dict[str, Channel]:
    """Views of the channels (H, W) inside a window."""
    (x0, y0), (x1, y1) = window
    return {name: channel[y0 : y1 + 1, x0 : x1 + 1] for name, channel in channels.items()}


def whole_frame(image: Image, empty: Mapping[str, float] = BACKGROUND) -> Mapping[str, Channel]:
    """Channels over the display window, whatever the data window: cropped to it, filled up around.

    Args:
        image: an image.
        empty: value by channel of what the data window leaves out, 0 where not named.
    """
    if image.data_window == image.display_window:
        return image.channels
    width, height = frame_size(image)
    (fx, fy), _ = image.display_window
    (x0, y0), (x1, y1) = image.data_window
    left, top = max(x0 - fx, 0), max(y0 - fy, 0)
    right, bottom = min(x1 - fx + 1, width), min(y1 - fy + 1, height)
    whole: dict[str, Channel] = {}
    for name, channel in image.channels.items():
        whole[name] = np.full((height, width), empty.get(name, 0), channel.dtype)
        if left < right and top < bottom:
            data = channel[top + fy - y0 : bottom + fy - y0, left + fx - x0 : right + fx - x0]
            whole[name][top:bottom, left:right] = data
    return whole


def _bits(channel: Channel, empty: float) -> tuple[NDArray[np.unsignedinteger], int]:
    """The channel as whole numbers, and the one that stands for its empty value."""
    kind = np.dtype(f"u{channel.dtype.itemsize}")
    return channel.view(kind), int(np.array(empty, channel.dtype).view(kind))


def _margin(planes: list[tuple[NDArray[np.unsignedinteger], int]]) -> int:
    """How many first rows hold nothing, in all planes."""
    height = len(planes[0][0])
    for start in range(0, height, _STRIP):
        used = np.zeros(min(_STRIP, height - start), dtype=np.bool_)
        for plane, value in planes:
            used |= (plane[start : start + _STRIP] != value).any(axis=1)
        if used.any():
            return start + int(used.argmax())
    return height
