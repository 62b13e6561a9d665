"""How far one method's images are from the truth, pixel by pixel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.simulate.compare import Comparison
from quiltcli.analysis.verify.seams import Seams
from quiltcli.errors import JobError
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray
from quiltcli.job.job import DEPTH_BITS
from quiltcli.job.model import either
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.buffers import Buffers
from quiltcli.render.methods.raycast import RESOLUTION
from quiltcli.render.setup import Stage
from quiltcli.visibility.rays.embree import Target, plane_depth
from quiltcli.visibility.rays.pixels import places

_CHUNK = 1 << 18
_SAME = 4 * RESOLUTION  # of a depth: nobody can say which of two surfaces is nearer


@dataclass(frozen=True)
class Variant:
    """A method with the depth buffer it is given.

    Attributes:
        method: its name.
        bits: bits of the buffer, None for exact depth.
    """

    method: str
    bits: str | None = None

    @property
    def name(self) -> str:
        """For people: `offaxis 24`."""
        return self.method if self.bits is None else f"{self.method} {self.bits}"


BUFFERED = ("homography", "offaxis", "raskar", "zscale")
REFERENCE = Variant("raycast")
VARIANTS: tuple[Variant, ...] = (
    REFERENCE,
    Variant("homography"),
    *(Variant(method, bits) for method in BUFFERED for bits in DEPTH_BITS),
    Variant("twopass"),
)
"""What is compared on flat facets, the reference first."""
IMAGED = (Variant("tessellate"), Variant("cubemap"))
"""What is compared on curved facets beside the exact methods; on flat ones when it is asked for."""


def variants_of(methods: Sequence[str]) -> tuple[Variant, ...]:
    """The variants of some methods, of all for flat facets where none is named.

    Raises:
        JobError: there is no such method.
    """
    known = list(dict.fromkeys(variant.method for variant in (*VARIANTS[:-1], *IMAGED, VARIANTS[-1])))
    for method in methods:
        if method not in known:
            raise JobError(f"--method: expected {either(known)}, got {method!r}")
    return tuple(v for v in (*VARIANTS, *IMAGED) if v.method in methods) if methods else VARIANTS


@dataclass(frozen=True)
class Errors:
    """Figures of some errors; all 0 where there is none.

    Attributes:
        mean: of all.
        percentile_99: 99 of a hundred are no greater.
        maximum: the greatest.
    """

    mean: float
    percentile_99: float
    maximum: float


@dataclass(frozen=True)
class Findings:
    """What is found of one method.

    Attributes:
        variant: the method.
        image: errors of the light of a pixel's worst channel, 1 being a white surface in full light.
        psnr: decibels, of the light cut at white; infinite where nothing differs.
        depth: errors of Z, metres, where both show something.
        wrong: pixels that show a surface behind another; None where pixels are mixtures of several.
        lost: pixels that show nothing where there is something; None likewise.
        behind: the most a surface that is shown lies behind the one that should be, metres.
        seams: how Z runs across seams.
        seen: the picture from the eye against a direct one.
        seconds: what drawing took, by stage.
    """

    variant: Variant
    image: Errors
    psnr: float
    depth: Errors
    wrong: int | None
    lost: int | None
    behind: float
    seams: Seams
    seen: Comparison
    seconds: Mapping[str, float]


@dataclass(frozen=True)
class Difference:
    """One variant's pixels against the reference's, inside the lit facets.

    Attributes:
        pixel: (P,) flat quilt addresses.
        light: (P,) difference of the worst channel.
        square: mean square of all channels' differences, cut at white.
        depth: (Q,) differences of Z, metres, where both show something.
        wrong: (P,) pixels that show a surface behind another.
        lost: (P,) pixels that show nothing where there is something.
        behind: (P,) metres by which what is shown lies behind what should be; 0 where it does not.
    """

    pixel: IntArray
    light: Float32Array
    square: float
    depth: FloatArray
    wrong: BoolArray
    lost: BoolArray
    behind: FloatArray


def difference(stage: Stage, rays: QuiltRays, target: Target, shown: Buffers, truth: Buffers) -> Difference:
    """Hold a variant's buffers against the reference's."""
    parts = [_part(stage, rays, target, shown, truth, at) for at in inside_pixels(stage, rays.lit)]
    if not parts:
        nothing = np.zeros(0)
        none = nothing.astype(np.bool_)
        return Difference(nothing.astype(np.int64), nothing.astype("f4"), 0.0, nothing, none, none, nothing)
    columns = [np.concatenate(column) for column in zip(*(part[1:] for part in parts), strict=True)]
    pixel, light, depth, wrong, lost, behind = columns
    return Difference(
        pixel, light, sum(part[0] for part in parts) / (3 * pixel.size), depth, wrong, lost, behind
    )


def inside_pixels(stage: Stage, lit: BoolArray) -> Iterator[IntArray]:
    """Addresses of the pixels of lit facets without their bleed, a chunk at a time."""
    wanted = np.concatenate(([False], lit))
    for start in range(0, stage.owners.size, _CHUNK):
        chunk = np.flatnonzero(wanted[np.maximum(stage.owners[start : start + _CHUNK], 0)])
        if chunk.size:
            yield chunk + start


def _part(
    stage: Stage, rays: QuiltRays, target: Target, shown: Buffers, truth: Buffers, at: IntArray
) -> tuple[float, IntArray, Float32Array, FloatArray, BoolArray, BoolArray, FloatArray]:
    """The sum of squares and the arrays of `Difference`, of the pixels at some addresses."""
    a, b = (np.stack([image[name][at] for name in "RGB"]).astype(np.float32) for image in (shown, truth))
    cut = (np.clip(a, 0, 1).astype(np.float64) - np.clip(b, 0, 1)) ** 2
    z, true_z = shown["Z"][at].astype(np.float64), truth["Z"][at].astype(np.float64)
    both = np.isfinite(z) & np.isfinite(true_z)
    named, right = (image["triangle"][at].astype(np.int64) - 1 for image in (shown, truth))
    differ = np.flatnonzero((named != right) & (named >= 0))
    pixels = places(at[differ], stage.layout, stage.owners, rays)
    directions = pixels.directions()
    far = plane_depth(target, named[differ], directions, pixels.origin)
    nearest = np.full(differ.size, -np.inf)
    hit = right[differ] >= 0
    nearest[hit] = plane_depth(
        target, right[differ][hit], directions[hit], pixels.from_eye(np.flatnonzero(hit))
    )
    beyond = far > nearest + _SAME * np.abs(np.where(hit, nearest, 0.0))
    wrong = np.zeros(at.size, dtype=np.bool_)
    wrong[differ] = beyond
    behind = np.zeros(at.size)
    behind[differ] = np.where(beyond & hit, far - np.where(hit, nearest, 0.0), 0.0)
    lost = (named < 0) & (right >= 0)
    light: Float32Array = np.abs(a - b).max(axis=0)
    return float(cut.sum()), at, light, np.abs(z[both] - true_z[both]), wrong, lost, behind


def errors_of(values: FloatArray | Float32Array) -> Errors:
    """Figures of some errors (N,)."""
    if not values.size:
        return Errors(0.0, 0.0, 0.0)
    ninety_nine = float(np.percentile(values, 99))
    return Errors(float(values.mean(dtype=np.float64)), ninety_nine, float(values.max()))


def decibels(square: float) -> float:
    """Peak signal to noise of a mean square error, white being 1."""
    return -10 * math.log10(square) if square else math.inf
