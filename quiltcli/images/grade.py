"""Light as values for a screen by OpenColorIO's configurations, those built into OpenImageIO or files.

The default is no look at all: what is brighter than white is cut, as a wall of light-emitting diodes does it.
A tone map is a choice. The configuration is pinned by name, so that values do not change with a machine's
settings.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import JobError
from quiltcli.geometry import Float32Array
from quiltcli.images.preview import CONFIG, Values
from quiltcli.job.model import suggest

DISPLAY = "sRGB - Display"
VIEW = "Un-tone-mapped"
_SOURCE = "lin_rec709"
_STRIP = 1 << 21  # pixels that go through a view together


@dataclass(frozen=True)
class Grade:
    """How light becomes values.

    Attributes:
        view: of the display, as the configuration calls it.
        display: the screen.
        config: a configuration built in (`ocio://…`), or a file.
        exposure: stops brighter.
    """

    view: str = VIEW
    display: str = DISPLAY
    config: str = CONFIG
    exposure: float = 0.0

    def check(self) -> None:
        """Raise JobError where the configuration has no such display or view; it names those it has."""
        from OpenImageIO import ColorConfig

        config = ColorConfig(self.config)
        displays = list(config.getDisplayNames())
        if not displays:
            raise JobError(f"{self.config}: there is no such colour configuration, or it has no displays")
        for word, value, known in (
            ("display", self.display, displays),
            ("view", self.view, list(config.getViewNames(self.display))),
        ):
            if value not in known:
                near = suggest(value, known)
                hint = f" (did you mean {near!r}?)" if near else ""
                names = ", ".join(known) or "none"
                raise JobError(f"--{word}: {self.config} has no {value!r}{hint}, it has: {names}")


def graded(rgb: NDArray[Any], grade: Grade, depth: int) -> Values:
    """Values (H, W, 3) of 8 bits, or of 10 or 16 in uint16, of linear light (H, W, 3).

    Raises:
        JobError: the view cannot be applied.
    """
    top = 2**depth - 1
    result = np.empty(rgb.shape, dtype=np.uint8 if depth == 8 else np.uint16)
    rows = max(_STRIP // max(rgb.shape[1], 1), 1)
    for start in range(0, len(rgb), rows):
        light = np.asarray(rgb[start : start + rows], dtype=np.float32)
        light = np.nan_to_num(light, nan=0.0, posinf=65504.0, neginf=0.0) * np.float32(2.0**grade.exposure)
        shown = np.clip(_viewed(light, grade), 0, 1).astype(np.float64)
        result[start : start + rows] = np.rint(shown * top)
    return result


def _viewed(light: Float32Array, grade: Grade) -> Float32Array:
    from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo

    source = ImageBuf(np.ascontiguousarray(light))
    shown = ImageBufAlgo.ociodisplay(source, grade.display, grade.view, _SOURCE, colorconfig=grade.config)
    # A failed transform returns an image that was never filled: its error has to be asked for.
    if shown.has_error:
        raise JobError(f"the view {grade.view!r} failed: {' '.join(shown.geterror().split())}")
    return np.asarray(shown.get_pixels(FLOAT), dtype=np.float32)
