"""Lengths of a calibrated display from distances that were measured with a tape.

Photos tell angles; what makes lengths of them is the size of the facets as the display's file says it.
Where that is not to be trusted, as of a projected picture or an unknown pixel pitch, distances between
corners say how large the display is: all of it is scaled about the facet that stays.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.calibration.pattern import corner_letter
from quiltcli.display import Facets
from quiltcli.errors import JobError
from quiltcli.geometry import FloatArray
from quiltcli.job.lengths import read_length

_FORM = re.compile(r"(.+?):?([A-Za-z])\s*-\s*(.+?):?([A-Za-z])\s*=\s*(\S.*)")
_LIKE = "1A-3C=1.532m"


@dataclass(frozen=True)
class Distance:
    """A distance between two corners.

    Attributes:
        text: as it was typed.
        ends: places of both among all corners of the display.
        length: metres.
    """

    text: str
    ends: tuple[int, int]
    length: float


def parse_distance(text: str, facets: Facets) -> Distance:
    """A distance from a text such as `1A-3C=1.532m`.

    Facets stand there by id or name, corners as the pattern `id` letters them.

    Raises:
        JobError: it is none.
    """
    found = _FORM.fullmatch(text.strip())
    length = read_length(found[5]) if found else None
    if found is None or length is None or length <= 0:
        raise JobError(f"--distance: expected two corners and a length such as {_LIKE}, got {text!r}")
    ends = _corner(found[1], found[2], facets), _corner(found[3], found[4], facets)
    if ends[0] == ends[1]:
        raise JobError(f"--distance: expected two different corners, got {text!r}")
    return Distance(text.strip(), ends, float(length))


def _corner(name: str, letter: str, facets: Facets) -> int:
    name = name.strip()
    if name in facets.names:
        row = facets.names.index(name)
    elif name.isascii() and name.isdigit() and 1 <= int(name) <= facets.count:
        row = int(name) - 1
    else:
        words = f"there is no facet {name!r} (expected a name, or an id from 1 to {facets.count})"
        raise JobError(f"--distance: {words}")
    first, last = (int(value) for value in facets.corner_start[row : row + 2])
    letters = [corner_letter(k) for k in range(last - first)]
    if letter.upper() not in letters:
        words = f"facet {name} has no corner {letter!r} (expected {letters[0]} to {letters[-1]})"
        raise JobError(f"--distance: {words}")
    return first + letters.index(letter.upper())


def scale_of(distances: Sequence[Distance], corners: FloatArray) -> float:
    """By how much corners (C, 3) have to be scaled for distances to be as measured: least squares.

    Raises:
        JobError: corners at the same place.
    """
    found = _lengths(distances, corners)
    if not (found > 0).all():
        raise JobError(f"--distance: {distances[int(found.argmin())].text}: these corners are at one place")
    stated = np.array([one.length for one in distances])
    return float((stated @ found) / (found @ found))


def enlarged(facets: Facets, scale: float, about: FloatArray) -> Facets:
    """The display, scaled about a point (3,); rasters keep their pixels."""
    return replace(
        facets,
        corners=about + scale * (facets.corners - about),
        origin=about + scale * (facets.origin - about),
        du=scale * facets.du,
        dv=scale * facets.dv,
    )


def distance_lines(distances: Sequence[Distance], corners: FloatArray, scale: float) -> Iterator[str]:
    """What distances came to, in words."""
    found = scale * _lengths(distances, corners)
    yield f"scaled by {scale:.6f} to the distances that were measured"
    for one, length in zip(distances, found.tolist(), strict=True):
        off = 1000 * (length - one.length)
        yield f"{one.text}: {1000 * length:.2f} mm now, {off:+.2f} mm from what was measured"


def _lengths(distances: Sequence[Distance], corners: FloatArray) -> FloatArray:
    ends = np.array([one.ends for one in distances])
    result: FloatArray = np.linalg.norm(corners[ends[:, 0]] - corners[ends[:, 1]], axis=1)
    return result
