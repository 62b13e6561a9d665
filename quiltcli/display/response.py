"""What the panels of a display make of their images, and what images must be for the light to be right.

A panel whose image is `w` shows `w^p · b(θ) / g`: p its gamma over that of the signal, b how bright it is
at the angle θ between its normal and the view, g what its facet is to be multiplied by. The image that
shows the light v is `(v · g · min(1/b, limit))^(1/p)`, as far as the panel can give that. Harish and
Narayanan (*Designing Perspectively-Correct Multiplanar Displays*, section 3) change pixels by the product
of the facet's normal and the view; that is b = cos θ, an exponent of 1.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.errors import DisplayError, Problem, raise_all
from quiltcli.geometry import FloatArray
from quiltcli.job.corrections import CorrectionsSpec
from quiltcli.job.display import DisplayFile
from quiltcli.job.dump import plain

# Rec.709: chromaticities of red, green and blue, and of white (D65).
_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
_WHITE = (0.3127, 0.3290)
_EDGE_ON = 1e-9
_LEAST_SHARE = 0.001
Place: TypeAlias = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Blend:
    """What blending makes of pictures.

    Attributes:
        shares: of each projector (H, W) shares of the light; 0 outside its mask.
        lift: of each (H, W) light that is added to make black even; empty where that is not known to differ.
        black: light of a black pixel as a share of a white one's.
    """

    shares: tuple[FloatArray, ...]
    lift: tuple[FloatArray, ...]
    black: float

    def scaled(self, sizes: Sequence[tuple[int, int]]) -> Blend:
        """The same for pictures with other numbers of pixels, width and height."""
        shares = tuple(_resized(values, size) for values, size in zip(self.shares, sizes, strict=True))
        lift = tuple(_resized(values, size) for values, size in zip(self.lift, sizes, strict=False))
        return Blend(shares, lift, self.black)


def _resized(values: FloatArray, size: tuple[int, int]) -> FloatArray:
    """The values (H, W) under the centres of other pixels, width and height."""
    row, column = (
        np.minimum((np.arange(new) + 0.5) * old // new, old - 1).astype(np.int64)
        for new, old in zip(size[::-1], values.shape, strict=True)
    )
    return values[np.ix_(row, column)]


@dataclass(frozen=True, eq=False)
class Response:
    """Panels of F facets.

    Attributes:
        exponent: b = cos^exponent θ; where there is a table, nothing.
        angles: (n,) degrees of a table of b; None without one.
        bright: (n, 3) b at those angles, red, green and blue; None likewise.
        limit: the most that 1/b is made up for.
        level: share of its light that the display is to show.
        peak: the brightest light that a panel can give.
        clip: whether images end there.
        gain: (F, 3) what each facet's light is multiplied by, its white point's part too.
        power: (F,) gamma of each panel over that of the signal.
        record: all of this in words, JSON, for images.
        blend: how pictures of projectors overlap; None where there are none.
    """

    exponent: float
    angles: FloatArray | None
    bright: FloatArray | None
    limit: float
    level: float
    peak: float
    clip: bool
    gain: FloatArray
    power: FloatArray
    record: str
    blend: Blend | None = None

    @property
    def lifts(self) -> bool:
        """Whether images that are black are not, once corrected."""
        return self.blend is not None and bool(self.blend.lift)

    def brightness(self, cosine: FloatArray) -> FloatArray:
        """How bright panels are at angles with these cosines (P,): (P,), or (3, P) by a table."""
        cosine = np.clip(cosine, _EDGE_ON, 1.0)
        if self.angles is None or self.bright is None:
            return cosine if self.exponent == 1 else np.asarray(cosine**self.exponent)
        degrees = np.degrees(np.arccos(cosine))
        return np.stack([np.interp(degrees, self.angles, column) for column in self.bright.T])

    def brightening(self, cosine: FloatArray, brightness: FloatArray | None = None) -> FloatArray:
        """What light is multiplied by to make up for the angle, `limit` at most: (P,) or (3, P)."""
        found = self.brightness(cosine) if brightness is None else brightness
        return np.minimum(1.0 / found, self.limit)

    def wanted(
        self,
        facet: int,
        light: FloatArray,
        cosine: FloatArray,
        place: Place | None = None,
        brightness: FloatArray | None = None,
    ) -> FloatArray:
        """Images that make a facet show some light, whether or not the panel can give that.

        Args:
            facet: 0-based.
            light: (3, P).
            cosine: (P,) of the angles at which pixels are seen.
            place: x and y (P,) of the pixels, facet pixels; where pictures are blended.
            brightness: of these cosines, where it is known already.

        Returns:
            (3, P).
        """
        image = light * (self.level * self.gain[facet])[:, None] * self.brightening(cosine, brightness)
        if self.blend is not None and place is not None:
            image = image * self._at(self.blend.shares[facet], place)
            if self.blend.lift:
                image = image + self._at(self.blend.lift[facet], place)
        return _raised(image, 1.0 / float(self.power[facet]))

    def meant(self, facet: int, image: FloatArray, cosine: FloatArray, place: Place) -> FloatArray:
        """The light (3, P) that images were made to show together: `wanted` undone, but for `level`.

        Where a projector gives next to nothing of the light its images say next to nothing of it.
        """
        light = _raised(image, float(self.power[facet]))
        share = np.ones(cosine.shape)
        if self.blend is not None:
            if self.blend.lift:
                light = np.maximum(light - self._at(self.blend.lift[facet], place), 0.0)
            share = np.maximum(self._at(self.blend.shares[facet], place), _LEAST_SHARE)
        return np.asarray(light / (self.gain[facet][:, None] * self.brightening(cosine) * share))

    @staticmethod
    def _at(values: FloatArray, place: Place) -> FloatArray:
        """Values (H, W) of the pixels under places."""
        high, wide = values.shape
        column = np.clip(np.floor(place[0]), 0, wide - 1).astype(np.int64)
        row = np.clip(np.floor(place[1]), 0, high - 1).astype(np.int64)
        return values[row, column]

    def shown(self, facet: int, image: FloatArray, cosine: FloatArray) -> FloatArray:
        """The light (3, P) of a facet's image (3, P) as it is seen at angles with these cosines (P,)."""
        light = _raised(image, float(self.power[facet]))
        if self.blend is not None:
            light = light + self.blend.black
        return np.asarray(light / self.gain[facet][:, None] * self.brightness(cosine))


def _raised(light: FloatArray, power: float) -> FloatArray:
    return light if power == 1 else np.asarray(np.copysign(np.abs(light) ** power, light))


def response_of(
    spec: DisplayFile, charts: tuple[Chart | None, ...], count: int, blend: Blend | None = None
) -> Response | None:
    """The response that a display file tells of its facets; None where it tells none.

    Args:
        spec: the file.
        charts: the facets' charts; empty where all are flat.
        count: how many facets there are.
        blend: how pictures of projectors overlap.

    Raises:
        DisplayError: it speaks of facets that there are not, or of whites that no panel has.
    """
    given = spec.corrections
    if given is None:
        if blend is None:
            return None
        given = CorrectionsSpec.model_construct()
    raise_all(DisplayError, _problems(spec, given, charts, count))
    gain, power = np.ones((count, 3)), np.ones(count)
    for facet, own in given.facets.items():
        gain[facet - 1] = own.gain
        if own.white is not None:
            gain[facet - 1] *= white_gain(own.white)
        if own.gamma is not None:
            power[facet - 1] = own.gamma / given.signal_gamma
    record = {} if spec.corrections is None else plain(given, str)
    if spec.blend is not None:
        record["blend"] = plain(spec.blend, str)
    how = given.brightness
    table = None if how is None or how.table is None else np.array(how.table)
    return Response(
        exponent=(how.exponent or 0.0) if how is not None else 0.0,
        angles=None if table is None else table[:, 0],
        bright=None if table is None else table[:, 1:],
        limit=1.0 if how is None else how.limit,
        level=given.level,
        peak=given.peak,
        clip=given.clip,
        gain=gain,
        power=power,
        record=json.dumps(record, sort_keys=True, separators=(",", ":")),
        blend=blend,
    )


def white_gain(white: tuple[float, float]) -> FloatArray:
    """What turns light (3,) meant for D65 into the same colour on primaries whose white is another.

    Both whites are equally bright; the primaries are those of Rec.709. How much of each primary makes a
    white follows from chromaticities (SMPTE RP 177, 1993). Not all above 0 where there is no such white.
    """
    primaries = np.stack([_tristimulus(*primary) for primary in _PRIMARIES], axis=1)
    meant, own = (np.linalg.solve(primaries, _tristimulus(*w)) for w in (_WHITE, white))
    with np.errstate(divide="ignore"):
        return np.asarray(meant / own)


def _tristimulus(x: float, y: float) -> FloatArray:
    """X, Y, Z of a chromaticity of brightness 1."""
    return np.array([x / y, 1.0, (1 - x - y) / y])


def _problems(
    spec: DisplayFile, given: CorrectionsSpec, charts: tuple[Chart | None, ...], count: int
) -> list[Problem]:
    found = []
    if given.brightness is not None and any(chart is not None and not chart.stands for chart in charts):
        words = "a projection stands nowhere and is not seen aslant (expected no such key beside projection)"
        found.append(spec.source.problem(("corrections", "brightness"), words))
    for facet, own in given.facets.items():
        if facet > count:
            words = f"there is no facet {facet} (the display has facets 1 to {count})"
            found.append(spec.source.problem(("corrections", "facets", facet), words))
        if own.white is not None:
            gain = white_gain(own.white)
            if not (np.isfinite(gain).all() and (gain > 0).all()):
                x, y = own.white
                words = f"no mixture of the primaries of Rec.709 is [{x:g}, {y:g}] (D65 is [0.3127, 0.329])"
                found.append(spec.source.problem(("corrections", "facets", facet, "white"), words))
    return found
