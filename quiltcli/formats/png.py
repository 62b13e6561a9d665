"""PNG files of 8 bits."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.whole import whole_file


def png_bytes(pixels: NDArray[np.uint8], **how: Any) -> bytes:
    """Pixels (H, W) or (H, W, 3 or 4) as the bytes of a PNG; `how` are Pillow's own options."""
    stream = io.BytesIO()
    _image(pixels).save(stream, format="PNG", **how)
    return stream.getvalue()


def save_png(path: Path, pixels: Any, **how: Any) -> None:
    """Write pixels as for `png_bytes`, or an image of Pillow's, whole or not at all (OutputError)."""
    with whole_file(path) as temporary:
        _image(pixels).save(temporary, format="PNG", **how)


def _image(pixels: Any) -> Any:
    from PIL import Image

    return Image.fromarray(pixels) if isinstance(pixels, np.ndarray) else pixels
