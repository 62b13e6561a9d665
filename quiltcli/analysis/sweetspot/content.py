"""Where the content is that the facets show: what a pixel seen from beside the eye is held against.

A facet point X shows the content point P on the ray from the eye E through X. All that matters of P is
its *nearness*, |X − E| / |P − E|: 1 for content on the facet, less for content behind it, 0 for content
infinitely far away, more than 1 for content that stands before the facet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.sweetspot.samples import Samples, heights
from quiltcli.errors import JobError
from quiltcli.geometry import FloatArray, dot

Point = tuple[float, float, float]
_BESIDE = 1e-9  # content less near than this is on a plane the ray does not meet


@dataclass(frozen=True)
class Content:
    """A surface the content lies on.

    Attributes:
        kind: `depth`, planes parallel to the facets; `distance`, a sphere about the eye; `plane`, a
            plane that faces the eye.
        metres: behind the facets (negative: before them), or from the eye.
        point: (3,) of the plane.
    """

    kind: str
    metres: float = 0.0
    point: Point = (0.0, 0.0, 0.0)

    def __str__(self) -> str:
        """What it is, for people."""
        if self.kind == "plane":
            return f"on the plane through {', '.join(f'{x:.4g}' for x in self.point)} that faces the eye"
        if math.isinf(self.metres):
            return "infinitely far away"
        if self.kind == "distance":
            return f"{self.metres:g} m from the eye"
        if self.metres == 0:
            return "on the facets"
        return f"{abs(self.metres):g} m {'behind' if self.metres > 0 else 'before'} the facets"


def content_at(depth: float | None, distance: float | None, point: Point | None) -> Content | None:
    """The content that options ask for; None when they say nothing.

    Raises:
        JobError: more than one option is given, or a value is impossible.
    """
    given = [value for value in (depth, distance, point) if value is not None]
    if len(given) > 1:
        raise JobError("content is said more than once: give one of --depth, --distance and --at")
    if depth is not None:
        if math.isnan(depth) or depth == -math.inf:
            raise JobError(f"--depth is {depth:g}, expected metres behind the facets, negative before them")
        return Content("depth", depth)
    if distance is not None:
        if not distance > 0:
            raise JobError(f"--distance is {distance:g}, expected metres from the eye, above 0")
        return Content("distance", distance)
    return None if point is None else Content("plane", point=point)


def default_content(samples: Samples, eye: FloatArray) -> Content:
    """Content at the middle of the display's bounds, or infinitely far away for an eye inside them.

    A display that is flat holds nothing: what it shows is taken to be far away, too.
    """
    low, high = samples.point.min(axis=0), samples.point.max(axis=0)
    offset = dot(samples.point - samples.point[0], samples.normal[0])
    flat = np.abs(offset).max() < 1e-6 * np.linalg.norm(high - low)
    if flat or ((low <= eye) & (eye <= high)).all():
        return Content("distance", math.inf)
    x, y, z = ((low + high) / 2).tolist()
    return Content("plane", point=(x, y, z))


def nearness(content: Content, samples: Samples, eye: FloatArray) -> FloatArray:
    """Nearness (S,) of what an eye (3,) is shown at the samples; nan where nothing is there to show.

    Nothing is there on rays that meet the content's plane behind the eye, or nowhere.
    """
    ray = samples.point - eye
    if content.kind == "distance":
        result: FloatArray = np.sqrt(dot(ray, ray)) / content.metres
    elif content.kind == "depth":
        height = np.abs(heights(samples, eye))
        reach = height + content.metres
        result = np.divide(height, reach, out=np.full(len(ray), np.nan), where=reach > 0)
    else:
        ahead = np.asarray(content.point) - eye
        square = float(dot(ahead, ahead))
        near = dot(ray, ahead) / square if square > _BESIDE**2 else np.zeros(len(ray))
        result = np.where(near > _BESIDE, near, np.nan)
    return result
