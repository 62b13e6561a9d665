"""How far the display is from the truth: what it shows against a direct picture of the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, Int32Array

_STEPS = (
    (0.0, 0.0, 0.0),
    (0.09, 0.02, 0.2),
    (0.42, 0.05, 0.4),
    (0.85, 0.22, 0.2),
    (1.0, 0.66, 0.1),
    (1, 1, 0.9),
)


@dataclass(frozen=True)
class Comparison:
    """Figures of one picture, over the pixels that lie wholly on lit facets.

    A pixel's error is that of its worst channel, in linear light where 1 is a white surface in full light.

    Attributes:
        share: share of the picture's pixels that are compared.
        mean, percentile_99, maximum: of the errors.
        psnr: decibels, all channels, of the light cut at white, 1; infinite where nothing differs.
        flip: mean of the ꟻLIP map (Andersson et al. 2020), as at 67 pixels a degree.
        seams: mean error within a pixel of where two lit facets meet, over that of all other pixels:
            what is shown there counts too; not a number without seams or errors.
        error: (H, W) errors, 0 where nothing is compared.
        resampled: mean error of direct pictures as dense as the display, resampled once; not a number
            where there is none.
        seams_alone: the same as `seams`, over what it is for those pictures, which show the same with
            as many pixels and have no seams: 1 where seams do not show.
    """

    share: float
    mean: float
    percentile_99: float
    maximum: float
    psnr: float
    flip: float
    seams: float
    error: Float32Array
    resampled: float = math.nan
    seams_alone: float = math.nan


def compare(
    shown: Float32Array,
    direct: Float32Array,
    covered: BoolArray,
    seam: BoolArray,
    resampled: Float32Array | None = None,
) -> Comparison:
    """Compare what the display shows with a direct picture.

    Args:
        shown: (H, W, 3) linear light.
        direct: (H, W, 3) linear light through the same camera.
        covered: (H, W) pixels to compare.
        seam: (H, W) those of them where facets meet.
        resampled: (H, W, 3) what resampling alone makes of a direct picture, if known.
    """
    both = [np.where(covered[..., None], image, np.float32(0)) for image in (shown, direct)]
    difference = np.abs(both[0].astype(np.float64) - both[1])
    error = difference.max(axis=-1)
    at_seams, elsewhere = covered & seam, covered & ~seam
    found = error[covered]
    if not found.size:
        return Comparison(0.0, 0.0, 0.0, 0.0, math.inf, 0.0, math.nan, error.astype(np.float32))
    seams = _ratio(error, at_seams, elsewhere)
    once = None if resampled is None else np.abs(resampled.astype(np.float64) - direct).max(axis=-1)
    white = [np.clip(image[covered], 0, 1).astype(np.float64) for image in both]
    square = float(np.mean((white[0] - white[1]) ** 2))
    return Comparison(
        share=found.size / covered.size,
        mean=float(found.mean()),
        percentile_99=float(np.percentile(found, 99)),
        maximum=float(found.max()),
        psnr=-10 * math.log10(square) if square else math.inf,
        flip=float(flip_map(both[1], both[0])[covered].mean()),
        seams=seams,
        error=error.astype(np.float32),
        resampled=math.nan if once is None else float(once[covered].mean()),
        seams_alone=math.nan if once is None else seams / _ratio(once, at_seams, elsewhere),
    )


def _ratio(error: NDArray[Any], part: BoolArray, rest: BoolArray) -> float:
    """Mean error of a part of the pixels over that of the rest; not a number where either has none."""
    if not (error[part].any() and error[rest].any()):
        return math.nan
    return float(error[part].mean() / error[rest].mean())


def flip_map(reference: NDArray[Any], test: NDArray[Any]) -> Float32Array:
    """ꟻLIP differences (H, W), 0 to 1, between two images (H, W, 3) in linear light, cut at white."""
    from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo

    first, second = (
        ImageBuf(np.ascontiguousarray(np.clip(image, 0, 1), dtype=np.float32)) for image in (reference, test)
    )
    result = ImageBufAlgo.FLIP_diff(first, second, hdr=0)
    if result.has_error:
        raise RuntimeError(result.geterror())
    return np.asarray(result.get_pixels(FLOAT), dtype=np.float32)[..., 0]


def seam_pixels(facet: Int32Array, samples: int) -> BoolArray:
    """Pixels (H, W) within one pixel of a place where two facets meet.

    Args:
        facet: (H·n, W·n) facet index of every sample, −1 where none is lit.
        samples: n.
    """
    rows, columns = facet.shape
    blocks = facet.reshape(rows // samples, samples, columns // samples, samples)
    least = np.where(blocks < 0, np.iinfo(np.int32).max, blocks).min(axis=(1, 3))
    most = blocks.max(axis=(1, 3))
    result: BoolArray = _around(least, np.minimum) < _around(most, np.maximum)
    return result


def _around(image: Int32Array, reduce: np.ufunc) -> Int32Array:
    """Greatest or least of each pixel and its eight neighbours (H, W), the border repeated."""
    padded = np.pad(image, 1, mode="edge")
    for axis in (0, 1):
        length = image.shape[axis]
        padded = reduce.reduce([padded.take(range(k, k + length), axis=axis) for k in (0, 1, 2)])
    return padded


def figures(comparison: Comparison) -> list[tuple[str, str]]:
    """The figures as rows of a label and a value."""
    if not comparison.share:
        return [("view on lit facets", "none: there is nothing to compare")]
    rows = [
        ("view on lit facets", f"{100 * comparison.share:.2f} %"),
        ("error, mean", f"{comparison.mean:.3e}"),
        ("error, 99 %", f"{comparison.percentile_99:.3e}"),
        ("error, max", f"{comparison.maximum:.3e}"),
        *_resampling(comparison),
        ("PSNR", f"{comparison.psnr:.2f} dB"),
        ("FLIP", f"{comparison.flip:.5f}"),
    ]
    # Without the second figure the first would be taken for what it is not.
    if not math.isnan(comparison.seams_alone):
        rows.append(("error at seams", f"{comparison.seams:.2f} × that elsewhere"))
        rows.append(("", f"{comparison.seams_alone:.2f} × that of the same picture without seams"))
    return rows


def _resampling(comparison: Comparison) -> list[tuple[str, str]]:
    if math.isnan(comparison.resampled):
        return []
    once = comparison.resampled
    share = f"; the display's is {comparison.mean / once:.3f} × that" if once else ""
    return [("resampled once, mean", f"{once:.3e}, of direct pictures as dense as the display{share}")]


def heat_scale(error: Float32Array) -> float:
    """The error that a heat map shows at its hottest: 1, 2 or 5 times a power of ten, seldom exceeded."""
    high = max(float(np.percentile(error, 99.9)), 1e-6)
    power = 10.0 ** math.floor(math.log10(high))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= high)


def heat_map(error: Float32Array, scale: float) -> NDArray[np.uint8]:
    """Display values (H, W, 3) of errors (H, W): black at 0, over red and yellow to white at `scale`."""
    place = np.clip(error / scale, 0, 1)
    at = np.linspace(0, 1, len(_STEPS))
    channels = [np.interp(place, at, [step[k] for step in _STEPS]) for k in range(3)]
    result: NDArray[np.uint8] = np.rint(np.stack(channels, axis=-1) * 255).astype(np.uint8)
    return result
