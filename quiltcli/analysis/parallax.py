"""How far apart two eyes see one point on a facet, and what else a stereo job should be asked about.

A point on the facet has no parallax. What lies behind is uncrossed, and never farther apart than the eyes
if the facet stands across the view; what lies in front is crossed, without bound.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import BoolArray, FloatArray, dot
from quiltcli.job import JobFile
from quiltcli.scene import Scene
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import views_of
from quiltcli.viewer.viewer import Viewer

LEAST_SEPARATION, MOST_SEPARATION = 0.040, 0.080
"""Metres: what people's eyes are apart."""
_ALONG = 1e-12
_MOST_POINTS, _MOST_FRAMES = 4000, 12


@dataclass(frozen=True)
class Parallax:
    """The largest parallax of the points that both eyes see on some facet.

    Attributes:
        front: of points before the facets, crossed: metres and pixels.
        behind: of points behind them, uncrossed: metres and pixels.
    """

    front: tuple[float, float] = (0.0, 0.0)
    behind: tuple[float, float] = (0.0, 0.0)

    def widened(self, other: Parallax) -> Parallax:
        """The larger of two."""
        return Parallax(max(self.front, other.front), max(self.behind, other.behind))


def facet_parallax(
    facets: Facets, facet: int, left: FloatArray, right: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Where two eyes see points on a facet's plane, one from the other.

    Args:
        facets: the display.
        facet: index.
        left: (3,) place of the left eye, metres.
        right: (3,) of the right one.
        points: (N, 3) metres.

    Returns:
        (N, 3) from where the left eye sees each to where the right one does, metres; (N, 2) the same in
        pixels; and (N,) points that both eyes see through the facet's raster.
    """
    normal, origin = facets.normal[facet], facets.origin[facet]
    du, dv = facets.du[facet], facets.dv[facet]
    width, height = facets.size[facet]
    places, inside = [], np.ones(len(points), dtype=np.bool_)
    for eye in (left, right):
        ray = points - eye
        slope = dot(ray, normal)
        # A ray along the facet's plane meets it nowhere: it stays at the eye, with t = 0.
        meets = np.abs(slope) > _ALONG * np.sqrt(dot(ray, ray))
        t = np.divide(dot(origin - eye, normal), slope, out=np.zeros_like(slope), where=meets)
        at = eye + t[:, None] * ray
        x, y = (dot(at - origin, step) / dot(step, step) for step in (du, dv))
        inside &= (t > 0) & (x >= 0) & (x <= width) & (y >= 0) & (y <= height)
        places.append((at, np.stack((x, y), axis=1)))
    (world_l, pixel_l), (world_r, pixel_r) = places
    return world_r - world_l, pixel_r - pixel_l, inside


def view_parallax(facets: Facets, scene: Scene, left: Viewer, right: Viewer) -> Parallax:
    """The largest parallax of a sample of the scene's vertices, on facets that are lit for both eyes."""
    step = -(-len(scene.vertices) // _MOST_POINTS)
    points = scene.vertices[::step]
    found = Parallax()
    lit = their_lit_facets(facets, left) & their_lit_facets(facets, right) & ~facets.curved
    across = right.eye - left.eye
    for facet in np.flatnonzero(lit).tolist():
        world, pixels, inside = facet_parallax(facets, facet, left.eye, right.eye, points)
        crossed = dot(world, across) < 0
        metres, steps = np.sqrt(dot(world, world)), np.hypot(*pixels.T)
        for rows, name in ((inside & crossed, "front"), (inside & ~crossed, "behind")):
            if rows.any():
                most = int(np.argmax(np.where(rows, metres, -1.0)))
                found = found.widened(Parallax(**{name: (float(metres[most]), float(steps[most]))}))
    return found


def stereo_notices(job: JobFile, facets: Facets, scene: Scene | None) -> Iterator[str]:
    """What is worth a second look in a stereo job: nothing is yielded for others."""
    if not job.is_stereo:
        return
    for name, spec in job.people.items():
        assert spec.stereo is not None
        if not LEAST_SEPARATION <= spec.stereo.separation <= MOST_SEPARATION:
            who = f" of {name}" if name else ""
            yield f"the eyes{who} are {1000 * spec.stereo.separation:g} mm apart (people's are 40 to 80 mm)"
    frames = job.frames[:: -(-len(job.frames) // _MOST_FRAMES)]
    alone, found = _over_frames(job, facets, scene, frames)
    if alone:
        which = ", ".join(str(facet) for facet in sorted(alone)[:8]) + (", …" if len(alone) > 8 else "")
        yield f"facets that are lit for one eye only at some frame: {which}"
    for words, (metres, pixels) in (("before", found.front), ("behind", found.behind)):
        if metres:
            yield f"the largest parallax {words} the facets is {1000 * metres:.1f} mm, {pixels:.1f} pixels"


def _over_frames(
    job: JobFile, facets: Facets, scene: Scene | None, frames: Sequence[int]
) -> tuple[set[int], Parallax]:
    """Ids of facets lit for one eye only, and the largest parallax, over some frames."""
    alone: set[int] = set()
    found = Parallax()
    for frame in frames:
        left, right = views_of(job, [frame])
        for one, other in zip(left.viewers, right.viewers, strict=True):
            apart = their_lit_facets(facets, one) != their_lit_facets(facets, other)
            alone |= set((np.flatnonzero(apart) + 1).tolist())
            if scene is not None:
                found = found.widened(view_parallax(facets, scene, one, other))
    return alone, found
