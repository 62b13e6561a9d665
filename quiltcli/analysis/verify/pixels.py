"""Pixels held against rays: five a pixel, its centre's and four around it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.verify.arbiter import CLOSE_BY, FAULT, IMPRECISE, judge
from quiltcli.analysis.verify.images import Images
from quiltcli.analysis.verify.tally import MOST_FAULTS, Fault, Tally, errors_of
from quiltcli.analysis.verify.tolerances import depth_tolerance
from quiltcli.geometry import BoolArray, FloatArray, IntArray, OwnerArray
from quiltcli.layout import Layout
from quiltcli.projection.planar import QuiltRays
from quiltcli.scene import Scene
from quiltcli.shading.along import cast_on, presence
from quiltcli.visibility.rays.embree import MISS, Target, plane_depth, plane_distance
from quiltcli.visibility.rays.exact import Neighbours
from quiltcli.visibility.rays.pixels import OFFSETS, Places, places

Kinds: TypeAlias = NDArray[np.str_]


@dataclass(frozen=True)
class Trial:
    """All that a frame is verified with.

    Attributes:
        layout: the layout.
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
        rays: rays through the quilt.
        target: the scene from the eye.
        neighbours: which of its triangles touch.
        images: what is verified.
        scene: the scene.
    """

    layout: Layout
    owners: OwnerArray
    rays: QuiltRays
    target: Target
    neighbours: Neighbours
    images: Images
    scene: Scene

    def presence(self, pixels: Places, row: IntArray, triangle: IntArray) -> NDArray[np.uint8]:
        """Whether triangles (M,) are there at the centres of pixels `row` (M,); see `along.presence`."""
        return presence(self.scene, self.target, pixels.take(row), triangle)


@dataclass(frozen=True)
class Sighting:
    """What rays and images say of P pixels.

    Attributes:
        pixels: the pixels.
        named: (5, P) triangles the rays meet, MISS or UNSURE.
        z: (P,) depths of the images, +inf for none.
        drawn: (P,) triangles of the images, −1 for none or where they do not tell.
        known: whether the images tell triangles.
        plane: (5, P) depths along the centre's ray of the planes of `named`, +inf for none.
    """

    pixels: Places
    named: IntArray
    z: FloatArray
    drawn: IntArray
    known: bool
    plane: FloatArray

    @cached_property
    def covered(self) -> BoolArray:
        """Pixels (P,) in which the scene shows."""
        return np.isfinite(self.z)

    @cached_property
    def all_hit(self) -> BoolArray:
        """Pixels (P,) all of whose rays hit."""
        return np.asarray((self.named >= 0).all(axis=0))

    @cached_property
    def all_miss(self) -> BoolArray:
        """Pixels (P,) all of whose rays miss."""
        return np.asarray((self.named == MISS).all(axis=0))

    @cached_property
    def agree(self) -> BoolArray:
        """Pixels (P,) all of whose rays hit the same triangle."""
        return np.asarray(self.all_hit & (self.named == self.named[0]).all(axis=0))

    @cached_property
    def error(self) -> FloatArray:
        """Depth errors (5, P) against each named triangle's plane, +inf where there is none."""
        shown = np.where(self.covered, self.z, 0.0)
        return np.where(self.covered & (self.named >= 0), np.abs(self.plane - shown), np.inf)

    @cached_property
    def fits(self) -> BoolArray:
        """Whether (5, P) the pixel shows what each ray names; by depth where triangles are unknown."""
        if self.known:
            return np.asarray((self.named >= 0) & (self.named == self.drawn))
        near_enough: BoolArray = self.error <= depth_tolerance(np.where(self.named >= 0, self.plane, 0.0))
        return near_enough

    def take(self, rows: IntArray) -> Sighting:
        """The sighting of some of the pixels."""
        return Sighting(
            self.pixels.take(rows),
            self.named[:, rows],
            self.z[rows],
            self.drawn[rows],
            self.known,
            self.plane[:, rows],
        )


def sight(trial: Trial, address: IntArray) -> Sighting:
    """Cast the five rays of the pixels at `address` (P,), and look at the images there."""
    pixels = places(address, trial.layout, trial.owners, trial.rays)
    named = np.stack([cast_on(trial.scene, trial.target, pixels, offset) for offset in OFFSETS])
    centre = pixels.directions()
    plane = np.full(named.shape, np.inf)
    for k, row in enumerate(named):
        hit = np.flatnonzero(row >= 0)
        plane[k, hit] = plane_depth(trial.target, row[hit], centre[hit], pixels.from_eye(hit))
    drawn = trial.images.triangle(address)
    z = trial.images.depth(address)
    unknown = np.full(address.size, -1)
    return Sighting(pixels, named, z, unknown if drawn is None else drawn, drawn is not None, plane)


def check_pixels(trial: Trial, address: IntArray) -> tuple[Tally, Tally]:
    """Hold the pixels at `address` (P,) against rays.

    Returns:
        The tallies of pixels inside facets and of those in their bleed.
    """
    seen = sight(trial, address)
    kind, verdict, shown = _faults(trial, seen)
    alpha = trial.images.alpha_covers(address)
    differs = np.zeros(address.size, dtype=np.bool_) if alpha is None else alpha != seen.covered
    results = []
    for zone in (~seen.pixels.bleed, seen.pixels.bleed):
        rows = np.flatnonzero(zone)
        tally = _tally(seen.take(rows), kind[rows], verdict[rows], shown[rows])
        odd = rows[differs[rows]]
        extra = Tally({"alpha": odd.size}, faults=tuple(_listed(seen.take(odd), np.full(odd.size, "alpha"))))
        results.append(tally + extra)
    return results[0], results[1]


def _faults(trial: Trial, seen: Sighting) -> tuple[Kinds, IntArray, IntArray]:
    """What speaks against each pixel.

    Returns:
        kind (P,), "" for nothing; the arbiter's verdict (P,), −1 where it was not asked; and the
        triangle (P,) it found shown, −1 for none.
    """
    fits = seen.fits
    off = seen.agree & (seen.error[0] > depth_tolerance(np.where(seen.agree, seen.plane[0], 0.0)))
    unsure = (seen.named < MISS).any(axis=0)
    kind = np.full(seen.z.size, "", dtype="U8")
    kind[seen.all_hit & ~seen.covered] = "crack"
    kind[seen.all_miss & seen.covered] = "extra"
    kind[~seen.agree & ~seen.all_miss & ~unsure & seen.covered & ~fits.any(axis=0)] = "stray"
    kind[seen.agree & seen.covered & off] = "depth"
    if seen.known:
        kind[seen.agree & seen.covered & ~fits[0]] = "triangle"
    verdict, shown = np.full(seen.z.size, -1), np.full(seen.z.size, -1)
    rows = np.flatnonzero(kind != "")
    if rows.size:
        # What lies behind the first hit may be as near as makes no difference.
        some = seen.take(rows)
        centre = some.pixels.directions()
        start = np.where(some.named[0] >= 0, _distance(trial.target, some, centre), 0.0)
        behind = cast_on(trial.scene, trial.target, some.pixels, beyond=start * (1 + 1e-6))
        named = np.concatenate((some.named, behind[None]))
        verdict[rows], shown[rows] = judge(
            trial.target, trial.neighbours, some.pixels, named, some.drawn, some.z, trial.presence
        )
    return kind, verdict, shown


def _distance(target: Target, some: Sighting, centre: FloatArray) -> FloatArray:
    """Distance (P,) along unit rays to the first hit's plane; 0 where that is nowhere."""
    distance = plane_distance(target, np.maximum(some.named[0], 0), centre, some.pixels.origin)
    return np.where(np.isfinite(distance) & (distance > 0), distance, 0.0)


def _tally(seen: Sighting, kind: Kinds, verdict: IntArray, shown: IntArray) -> Tally:
    """Count what was found."""
    wrong = np.flatnonzero(verdict == FAULT)
    agree = seen.agree & seen.covered
    same = agree & seen.fits[0] if seen.known else agree & (verdict != CLOSE_BY) & (verdict != IMPRECISE)
    counts = {
        "pixels": seen.z.size,
        "covered": seen.covered.sum(),
        "partly": (~seen.all_hit & ~seen.all_miss).sum(),
        "several": (seen.all_hit & ~seen.agree).sum(),
        "triangles": (agree & (verdict != CLOSE_BY)).sum() if seen.known else 0,
        "close": (verdict == CLOSE_BY).sum(),
        "depths": same.sum(),
        "imprecise": (verdict == IMPRECISE).sum(),
    }
    for name in np.unique(kind[wrong]):
        counts[str(name)] = (kind[wrong] == name).sum()
    errors = errors_of(seen.error[0, same], depth_tolerance(seen.plane[0, same]))
    faults = tuple(_listed(seen.take(wrong[:MOST_FAULTS]), kind[wrong[:MOST_FAULTS]]))
    return Tally({name: int(count) for name, count in counts.items()}, errors, faults)


def _listed(seen: Sighting, kind: Kinds) -> list[Fault]:
    at = seen.pixels
    expected = np.where(seen.named[0] >= 0, seen.named[0] + 1, 0)
    columns = (kind, at.page + 1, at.x, at.y, at.facet + 1, expected, seen.drawn + 1, seen.plane[0], seen.z)
    return [Fault(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
