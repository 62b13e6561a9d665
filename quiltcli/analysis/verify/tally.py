"""What was counted: tallies that add up, block by block, to the verdict on a frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from quiltcli.geometry import FloatArray, IntArray

MOST_FAULTS = 1000
"""Faults that are kept one by one; all are counted."""

FAULTS: Mapping[str, str] = {
    "crack": "cracks",
    "extra": "extras",
    "stray": "strays",
    "triangle": "wrong triangle",
    "depth": "depth missed",
    "alpha": "alpha against Z",
}
"""Kinds of faults in pixels, and what the table calls them.

A crack is empty where all five rays hit, an extra covered where all five miss; a stray shows, where
the five rays meet several surfaces, something that none of them meets.
"""

COUNTS: Mapping[str, str] = {
    "pixels": "pixels compared",
    "covered": "covered",
    "partly": "part of the rays hit: no verdict on coverage",
    "several": "all rays hit, not one triangle: no verdict on it",
    "triangles": "triangles compared",
    "close": "two surfaces within 1e-5: no verdict on which",
    "depths": "depths compared",
    "imprecise": "Embree overruled in double precision",
}
"""What is counted beside faults."""

_BINS = 1 << 15


@dataclass(frozen=True)
class Errors:
    """Depth errors, as a histogram that takes the same memory for any number of them.

    A bin holds all numbers with the same upper half as float32, so quantiles are good to 1 %.

    Attributes:
        bins: (32768,) counts by upper half.
        most: the greatest error, metres.
        most_share: the greatest error as a share of its tolerance.
    """

    bins: IntArray = field(default_factory=lambda: np.zeros(_BINS, dtype=np.int64))
    most: float = 0.0
    most_share: float = 0.0

    @property
    def count(self) -> int:
        """How many errors there are."""
        return int(self.bins.sum())

    def quantile(self, share: float) -> float:
        """The error that this share of all errors does not exceed, metres (0 when there are none)."""
        total = np.cumsum(self.bins)
        if not total[-1]:
            return 0.0
        # The upper end of the bin, but never more than the greatest.
        at = int(np.searchsorted(total, np.ceil(share * total[-1])))
        value = float((np.array([at], dtype=np.uint32) << 16 | 0xFFFF).view(np.float32)[0])
        return min(value, self.most)

    def __add__(self, other: Errors) -> Errors:
        """The errors of both."""
        worst = max(self.most, other.most), max(self.most_share, other.most_share)
        return Errors(self.bins + other.bins, *worst)


def errors_of(error: FloatArray, tolerance: FloatArray) -> Errors:
    """The record of errors (N,) against their tolerances (N,), metres."""
    if not error.size:
        return Errors()
    bins = np.bincount(error.astype(np.float32).view(np.uint32) >> 16, minlength=_BINS)
    return Errors(bins.astype(np.int64), float(error.max()), float((error / tolerance).max()))


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.

    Attributes:
        kind: a key of `FAULTS`, or `seam`.
        page: 1-based page.
        x: pixel column.
        y: pixel row.
        facet: facet id.
        expected: triangle the ray meets, 1-based, 0 for none.
        found: triangle that was drawn, 1-based, 0 for none or when the images do not tell.
        depth_expected: metres, infinite for none.
        depth_found: metres, infinite for none.
    """

    kind: str
    page: int
    x: int
    y: int
    facet: int
    expected: int
    found: int
    depth_expected: float
    depth_found: float

    def as_json(self) -> dict[str, Any]:
        """The fault for programs; depths that are infinite become null."""
        entry = dict(vars(self))
        for key in ("depth_expected", "depth_found"):
            entry[key] = entry[key] if np.isfinite(entry[key]) else None
        return entry


@dataclass(frozen=True)
class Tally:
    """Counts over some pixels.

    Attributes:
        counts: by the keys of `COUNTS` and `FAULTS`; what is missing is 0.
        errors: depth errors.
        faults: the first of the faults.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    errors: Errors = field(default_factory=Errors)
    faults: tuple[Fault, ...] = ()

    def __getitem__(self, key: str) -> int:
        """One count."""
        return self.counts.get(key, 0)

    def __add__(self, other: Tally) -> Tally:
        """The tally of both."""
        keys = self.counts.keys() | other.counts.keys()
        counts = {key: self[key] + other[key] for key in sorted(keys)}
        return Tally(counts, self.errors + other.errors, (self.faults + other.faults)[:MOST_FAULTS])

    @property
    def failures(self) -> int:
        """Number of faults."""
        return sum(self[kind] for kind in FAULTS)

    def as_json(self) -> dict[str, Any]:
        """The tally for programs."""
        counts = {key: self[key] for key in (*COUNTS, *FAULTS)}
        return counts | {
            "depth_error": {
                "median": self.errors.quantile(0.5),
                "p99_9": self.errors.quantile(0.999),
                "max": self.errors.most,
                "max_share_of_tolerance": self.errors.most_share,
            }
        }
