"""Pages of a quilt as pictures a browser can show: reduced, tone-mapped, compressed.

A picture is a page reduced by a whole number, or not at all, so that corners keep their exact places.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.formats.png import png_bytes
from quiltcli.geometry import BoolArray, Float32Array
from quiltcli.images.facets import page_of
from quiltcli.images.preview import Bytes, block_means, tone_map
from quiltcli.layout import Layout

_BLEED = 2.0**-10  # weight of a pixel past a facet's edge: it counts only where no facet's own does

_AROUND = [(y, x) for y in range(3) for x in range(3)]


@dataclass(frozen=True)
class Coding:
    """How pages become pictures.

    Attributes:
        side: most pixels across or down.
        quality: of JPEG, 0 for PNG, which loses nothing.
    """

    side: int
    quality: int

    def __str__(self) -> str:
        return f"JPEG {self.quality}" if self.quality else "PNG"


@dataclass(frozen=True)
class Picture:
    """A compressed picture.

    Attributes:
        data: the file.
        kind: MIME type.
    """

    data: bytes
    kind: str

    @property
    def url(self) -> str:
        """The picture as text that needs no other file."""
        return f"data:{self.kind};base64,{base64.b64encode(self.data).decode()}"


def codings(side: int) -> tuple[Coding, ...]:
    """What to try in turn until a page is small enough, the best first."""
    smaller = (side // 2, side // 3, side // 4, side // 6, side // 8)
    return (Coding(side, 0), Coding(side, 92), *(Coding(less, 90) for less in smaller if less >= 64))


def factor(page: Sequence[int], side: int) -> int:
    """By how much a page (width, height) is reduced to be at most `side` pixels."""
    return -(-max(map(int, page)) // side)


def extents(layout: Layout, side: int) -> NDArray[np.int64]:
    """Width and height (G, 2) that the pages' pictures span, in pixels of the page."""
    sizes = layout.pages.astype(np.int64)
    by = np.array([[factor(page, side)] for page in sizes.tolist()], dtype=np.int64).reshape(-1, 1)
    result: NDArray[np.int64] = -(-sizes // by) * by
    return result


def page_picture(shown: Shown, page: int, coding: Coding, view: str, exposure: float) -> Picture:
    """One page (0-based) of the images a display shows."""
    light = page_light(shown, page, factor(shown.layout.pages[page].tolist(), coding.side))
    return picture(_tone_mapped(light, view, exposure), coding.quality)


def _tone_mapped(light: Float32Array, view: str, exposure: float) -> Bytes:
    """As `preview.tone_map`, which looks at every pixel by itself: here once a run of equal ones.

    Most of a page is the background of the scene, or of no facet.
    """
    flat = light.reshape(-1, 3)
    fresh = np.concatenate(([True], (flat[1:] != flat[:-1]).any(axis=1)))
    start = np.flatnonzero(fresh)
    mapped = tone_map(flat[start][None], view, exposure)[0]
    return np.repeat(mapped, np.diff(start, append=len(flat)), axis=0).reshape(light.shape)


def page_light(shown: Shown, page: int, by: int) -> Float32Array:
    """Linear light (⌈H/n⌉, ⌈W/n⌉, 3) of a page, by means over n × n pixels of facets.

    Pixels of no facet take no part, and around facets the picture goes on for a pixel, so that
    nothing dark comes in at an edge however the picture is looked up.
    """
    flat = [shown.buffers[name] for name in "RGB"]
    light = np.stack([page_of(channel, shown.layout, page) for channel in flat], axis=-1).astype(np.float32)
    owners = page_of(shown.owners, shown.layout, page)
    weight = np.where(owners > 0, 1.0, np.where(owners < 0, _BLEED, 0.0)).astype(np.float32)[..., None]
    if by > 1:
        light, weight = block_means(light * weight, by), block_means(weight, by)
        light = np.divide(light, weight, out=np.zeros_like(light), where=weight > 0)
    return _grown(light, weight[..., 0] > 0)


def _grown(light: Float32Array, known: BoolArray) -> Float32Array:
    """The light with pixels beside known ones filled with their mean."""
    around = np.pad(known, 1)
    height, width = known.shape
    near = np.zeros_like(known)
    for y, x in _AROUND:
        near |= around[y : y + height, x : x + width]
    row, column = np.nonzero(near & ~known)
    count = np.zeros(row.size, dtype=np.float32)
    total = np.zeros((row.size, 3), dtype=np.float32)
    for y, x in _AROUND:
        there = np.flatnonzero(around[row + y, column + x])
        count[there] += 1
        total[there] += light[row[there] + y - 1, column[there] + x - 1]
    result = np.where(known[..., None], light, np.float32(0))
    result[row, column] = total / count[:, None]
    return result


def picture(pixels: Bytes, quality: int = 0) -> Picture:
    """Compress display values (H, W, 3): as JPEG of a quality, as PNG where that is 0."""
    if quality:
        from PIL import Image

        stream = io.BytesIO()
        # Colours at full resolution: reduced ones would come in from beside a facet's edge.
        Image.fromarray(pixels).save(stream, format="JPEG", quality=quality, subsampling=0, optimize=True)
        return Picture(stream.getvalue(), "image/jpeg")
    return Picture(png_bytes(pixels, compress_level=9 if pixels.size < 1 << 23 else 6), "image/png")
