"""Images that make up for what panels make of them: after shading, on the pixels of finished buffers.

Each pixel has its own angle between the normal of its panel and the view, whether flat or curved, in its
facet's bleed too. Black stays black. What each pixel becomes depends on it alone, not on who works it out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, TypeAlias, TypeVar

import numpy as np

from quiltcli.channels import MOST_HALF
from quiltcli.display import Facets
from quiltcli.display.check import called
from quiltcli.display.response import Place, Response
from quiltcli.geometry import BoolArray, FloatArray, OwnerArray
from quiltcli.images.facets import page_of, surroundings
from quiltcli.job import JobFile
from quiltcli.layout import Layout
from quiltcli.projection.curved import inverse_affine
from quiltcli.render.buffers import Buffers
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import viewers_of
from quiltcli.viewer.viewer import Viewer

_BAND = 1 << 16  # pixels of a band of rows, so that what is worked out of them stays near
_DENSE = 0.6  # of the pixels of a band
_MOST_FRAMES = 50  # looked at before anything is drawn
_PLACES = 17  # across and down a curved facet, likewise
_LIMB = 0.05  # a round display always has pixels that are seen edge-on: those say nothing


@dataclass(frozen=True)
class Headroom:
    """What corrections asked of the panels in a frame.

    Attributes:
        pixels: quilt pixels that show some light.
        over: those of them that want more light than the panels can give.
        limited: those that want to be brightened by more than the limit.
        brightest: the brightest image that was wanted, over what the panels can give.
        brightened: the most that a pixel was brightened to make up for its angle.
    """

    pixels: int = 0
    over: int = 0
    limited: int = 0
    brightest: float = 0.0
    brightened: float = 0.0

    def __add__(self, other: Headroom) -> Headroom:
        """What both asked for."""
        return Headroom(
            self.pixels + other.pixels,
            self.over + other.over,
            self.limited + other.limited,
            max(self.brightest, other.brightest),
            max(self.brightened, other.brightened),
        )

    def as_json(self, response: Response) -> dict[str, Any]:
        """As `report.json` holds it, with the level at which nothing would be over, where there is light."""
        fits = _rounded_down(response.level / self.brightest) if self.brightest > 0 else None
        return {**asdict(self), "fits": fits}

    def words(self, response: Response) -> Iterator[str]:
        """What a user should know of it: the same words for every frame, the figures stand beside them."""
        if self.over:
            what = "are as bright as they can be" if response.clip else "are written all the same"
            yield (
                f"corrections: some pixels want more light than the panels can give, and {what}"
                " (corrections.level makes room)"
            )
        if self.limited:
            yield (
                f"corrections: some pixels are seen so aslant that brightening them {response.limit:g} times"
                " is not enough (corrections.brightness.limit); they look darker"
            )


def _rounded_down(number: float) -> float:
    """A number with two digits, not above it."""
    scale = 10.0 ** (1 - int(np.floor(np.log10(number))))
    return float(np.floor(number * scale) / scale)


def corrects(stage: Stage) -> Response | None:
    """What the images of a stage make up for; None for nothing."""
    wanted = stage.job.render.corrections and "rgba" in stage.job.output.channels
    return stage.facets.response if wanted else None


def correct(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> Headroom:
    """Correct the light of the facets that a viewer sees, in place.

    Args:
        stage: with a response.
        viewer: for whose eye the images are.
        buffers: R, G and B, flat over all pages, as they were drawn.
        threads: bands of pixels worked on at a time.
        only: (F,) facets to correct; all that are theirs where None.
    """
    response = stage.facets.response
    assert response is not None
    lit = their_lit_facets(stage.facets, viewer) & (stage.layout.page >= 0)
    if only is not None:
        lit &= only
    rows = np.flatnonzero(lit).tolist()
    change = partial(_corrected, response)
    found = on_panels(stage, stage.owners, rows, buffers, viewer.eye, change, threads, black=response.lifts)
    return sum(found, Headroom())


def _corrected(
    response: Response, row: int, light: FloatArray, cosine: FloatArray, place: Place
) -> tuple[FloatArray, Headroom]:
    """The image (3, P) of a facet for light (3, P) at angles with these cosines (P,), and what it asked."""
    brightness = response.brightness(cosine)
    wanted = response.wanted(row, light, cosine, place, brightness)
    most = min(response.peak, float(MOST_HALF)) if response.clip else float(MOST_HALF)
    some = (light[0] != 0) | (light[1] != 0) | (light[2] != 0)
    limited = some & (brightness * response.limit < 1).reshape(-1, cosine.size).any(axis=0)
    dark = brightness.reshape(-1, some.size)[:, some]
    most_brightened = np.minimum(1 / dark, response.limit).max(initial=0)
    high = wanted.max(axis=0) / response.peak
    headroom = Headroom(
        pixels=int(np.count_nonzero(some)),
        over=int(np.count_nonzero(high > 1)),
        limited=int(np.count_nonzero(limited)),
        brightest=float(high.max()),
        brightened=float(most_brightened),
    )
    return np.clip(wanted, -most, most), headroom


T = TypeVar("T")
Change: TypeAlias = Callable[[int, FloatArray, FloatArray, Place], tuple[FloatArray, T]]
"""From a facet, light (3, P), cosines (P,) of its angles and its pixels to other light, and what to say."""


def on_panels(
    stage: Stage,
    owners: OwnerArray,
    rows: Iterable[int],
    buffers: Buffers,
    eye: FloatArray,
    change: Change[T],
    threads: int = 1,
    *,
    black: bool = False,
) -> list[T]:
    """Change the light of facets, in place, by the angle at which an eye (3,) sees each pixel.

    Args:
        stage: display and layout.
        owners: flat, of `buffers`.
        rows: the facets, 0-based.
        buffers: R, G and B, flat over all pages.
        eye: world metres.
        change: what becomes of pixels that show some light.
        threads: bands of pixels worked on at a time.
        black: change pixels that show no light too, as far as they are lit.

    Returns:
        What `change` said of bands of pixels, in an order that does not depend on the threads.
    """

    def band(place: tuple[int, int, int, int, int]) -> list[T]:
        row, x0, y0, x1, y1 = place
        page, facet = int(stage.layout.page[row]), stage.layout.facet[row]
        here = np.s_[y0:y1, x0:x1]
        mine = np.abs(page_of(owners, stage.layout, page)[here]) == facet
        channels = [page_of(buffers[name], stage.layout, page)[here] for name in "RGB"]
        if not black:
            mine &= (channels[0] != 0) | (channels[1] != 0) | (channels[2] != 0)
        whole = np.count_nonzero(mine) > _DENSE * mine.size
        if whole:
            # Looking at all of a rectangle is quicker than picking most of it.
            y, x = np.arange(y0, y1)[:, None], np.arange(x0, x1)
            light = np.stack([np.where(mine, channel, 0) for channel in channels]).astype(np.float64)
            light = light.reshape(3, -1)
        else:
            y, x = np.nonzero(mine)
            if not y.size:
                return []
            light = np.stack([channel[y, x] for channel in channels]).astype(np.float64)
            y, x = y + y0, x + x0
        (a, b, c), (d, e, f) = inverse_affine(stage.layout.quilt_from_facet[row])
        i = (a * (x + 0.5) + b * (y + 0.5) + c).reshape(-1)
        j = (d * (x + 0.5) + e * (y + 0.5) + f).reshape(-1)
        light, said = change(row, light, cosines(stage.facets, stage.layout, row, (i, j), eye), (i, j))
        for channel, values in zip(channels, light, strict=True):
            if whole:
                np.copyto(channel, values.reshape(channel.shape), where=mine, casting="same_kind")
            else:
                channel[y - y0, x - x0] = values
        return [said]

    with ThreadPoolExecutor(threads) as pool:
        return [said for some in pool.map(band, _bands(stage, rows)) for said in some]


def _bands(stage: Stage, rows: Iterable[int]) -> Iterator[tuple[int, int, int, int, int]]:
    """Facets, and the bounds x0, y0, x1, y1 of bands of their pages' rows that hold all their pixels."""
    for row in rows:
        x0, y0, x1, y1 = surroundings(stage.layout, row, stage.job.render.bleed + 1)
        step = max(_BAND // max(x1 - x0, 1), 1)
        for y in range(y0, y1, step):
            yield row, x0, y, x1, min(y + step, y1)


def cosines(
    facets: Facets, layout: Layout, row: int, place: tuple[FloatArray, FloatArray], eye: FloatArray
) -> FloatArray:
    """Cosines (P,) of the angles between a facet's normal and the view from an eye (3,).

    Args:
        facets: the display.
        layout: where the facets' rasters lie in the world.
        row: the facet, 0-based.
        place: x and y (P,), facet pixels.
        eye: world metres.

    Returns:
        Cosines, below 0 where a curved facet faces away; a flat one that is lit on both sides faces all eyes.
    """
    x, y = place
    chart = facets.charts[row] if facets.charts else None
    if chart is not None:
        points = chart.points(x, y)
        above = chart.towards(x, y, points, eye)
    else:
        origin, du, dv = layout.origin[row], layout.du[row], layout.dv[row]
        points = origin[:, None] + du[:, None] * x + dv[:, None] * y
        above = np.abs(float(facets.normal[row] @ (eye - origin)))
    away = eye[:, None] - points
    distance = np.sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2])
    return np.asarray(above / np.maximum(distance, 1e-12))


def correction_notices(job: JobFile, facets: Facets, frames: Sequence[int]) -> Iterator[str]:
    """What a job's corrections would ask of the panels for a white scene, from the eyes of some frames."""
    response = facets.response
    if response is None or not job.render.corrections:
        return
    worst, where, frame = 1.0, -1, 0
    for viewer in viewers_of(job, frames[:: -(-len(frames) // _MOST_FRAMES)]):
        for row in np.flatnonzero(their_lit_facets(facets, viewer)).tolist():
            cosine = _seen_at(facets, row, viewer.eye)
            least = float(cosine.min()) if cosine.size else 1.0
            if least < worst:
                worst, where, frame = least, row, viewer.frame
    at = np.array([worst])
    if where < 0:
        return
    degrees = float(np.degrees(np.arccos(worst)))
    brighter = float((1 / response.brightness(at)).max())
    seen = (
        f"corrections: {called(where, facets.names)} is seen as far as {degrees:.0f} degrees from its normal"
    )
    if brighter > response.limit:
        yield (
            f"{seen} (frame {frame}) and would have to be brightened {brighter:.3g} times:"
            f" {response.limit:g} at most are allowed (corrections.brightness.limit); it looks darker there"
        )
    most = float(response.wanted(where, np.ones((3, 1)), at).max()) / response.peak
    if most > 1:
        yield (
            f"{seen} (frame {frame}): white asks {most:.3g} times what its panel can give there"
            f" (corrections.level: {_rounded_down(response.level / most):g} leaves room for it)"
        )


def _seen_at(facets: Facets, row: int, eye: FloatArray) -> FloatArray:
    """Cosines (n,) of the angles at which a facet is seen at places all over it, those that are lit."""
    chart = facets.charts[row] if facets.charts else None
    if chart is None:
        away = eye - facets.polygon(row)
        return np.asarray(np.abs(away @ facets.normal[row]) / np.sqrt((away**2).sum(axis=1)))
    x, y = (side * (np.arange(_PLACES) + 0.5) / _PLACES for side in chart.size)
    points = chart.points(x, y[:, None])
    away = eye[:, None, None] - points
    cosine = chart.towards(x, y[:, None], points, eye) / np.sqrt((away**2).sum(axis=0))
    return np.asarray(cosine[np.isfinite(cosine) & (cosine > _LIMB)])
