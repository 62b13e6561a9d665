"""What an EXR image is: windows, channels and their range, compression, attributes."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, size
from quiltcli.formats.exr.image import Channel, Image, read_parts

_TYPES = {"float16": "half", "float32": "float", "uint32": "uint"}


def image_info(path: Path) -> Info:
    """Parts, windows, channels and attributes of an EXR file.

    Raises:
        OutputError: the file cannot be read.
    """
    parts = [_part(image) for image in read_parts(path)]
    lines: list[tuple[str, str]] = []
    for entry in parts:
        lines += _lines(entry, f"{entry['name']} " if len(parts) > 1 else "")
    columns = ("part", "channel", "type", "least", "greatest", "finite pixels", "nan", "inf")
    first = 0 if len(parts) > 1 else 1  # one part needs no column for its name
    rows = [_row(entry, channel)[first:] for entry in parts for channel in entry["channels"]]
    return Info("image", {"path": str(path), "parts": parts}, lines, columns[first:], rows)


def _part(image: Image) -> dict[str, Any]:
    return {
        "name": image.name,
        "data_window": [list(corner) for corner in image.data_window],
        "display_window": [list(corner) for corner in image.display_window],
        "compression": image.compression,
        "attributes": {name: _plain(value) for name, value in image.attributes.items()},
        "channels": [_channel(name, pixels) for name, pixels in image.channels.items()],
    }


def _channel(name: str, pixels: Channel) -> dict[str, Any]:
    """Type and range of a channel; the range is of its finite pixels, None when it has none."""
    found = pixels[np.isfinite(pixels)]
    whole = pixels.dtype == np.uint32
    ends = (found.min(), found.max()) if found.size else ()
    return {
        "name": name,
        "type": _TYPES[pixels.dtype.name],
        "range": [int(v) if whole else float(v) for v in ends] if found.size else None,
        "finite": int(found.size),
        "nan": int(np.count_nonzero(np.isnan(pixels))),
        "inf": int(np.count_nonzero(np.isinf(pixels))),
    }


def _plain(value: object) -> Any:
    """An attribute as plain data; what has no plain form is told as text."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Fraction):
        return f"{value.numerator}/{value.denominator}" if value.denominator != 1 else int(value)
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value if isinstance(value, bool | int | float | str) else str(value)


def _lines(entry: dict[str, Any], before: str) -> list[tuple[str, str]]:
    windows = [entry[f"{kind}_window"] for kind in ("data", "display")]
    texts = [
        f"{size((x1 - x0 + 1, y1 - y0 + 1))} pixels, from ({x0}, {y0})" for (x0, y0), (x1, y1) in windows
    ]
    return [
        (f"{before}data window", texts[0]),
        *([(f"{before}display window", texts[1])] if texts[0] != texts[1] else []),
        (f"{before}compression", entry["compression"]),
        *((f"{before}{name}", _text(value)) for name, value in entry["attributes"].items()),
    ]


def _text(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _row(entry: dict[str, Any], channel: dict[str, Any]) -> list[str]:
    low, high = channel["range"] or (None, None)
    ends = [
        "none" if end is None else f"{end:g}" if isinstance(end, float) else str(end) for end in (low, high)
    ]
    counts = [f"{channel[key]:,}" for key in ("finite", "nan", "inf")]
    return [entry["name"], channel["name"], channel["type"], *ends, *counts]
