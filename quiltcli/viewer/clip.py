"""What near and far cut: along the look direction, or by the distance from the eye.

A plane before the eye cuts a display that surrounds the viewer in two: what lies behind it stays blank.
So the distance is the rule wherever a lit pixel lies behind the eye, unless a job says otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from quiltcli.charts.shapes import turned
from quiltcli.display import Facets, chart_points, corner_pixels, lit_facets
from quiltcli.geometry import BoolArray, FloatArray, dot
from quiltcli.job import JobFile
from quiltcli.viewer.view import views_at
from quiltcli.viewer.viewer import Viewer


def settled_clip(job: JobFile, facets: Facets) -> str:
    """What near and far cut in all frames of a job, `planar` or `distance`: `auto` looks at the display."""
    how = job.render
    if how.clip != "auto":
        return how.clip
    if how.depth != "planar":
        return "distance"
    if how.needs_planar_clip(job.output.channels):
        return "planar"
    viewers = (viewer for frame in job.frames for view in views_at(job, frame) for viewer in view.viewers)
    return "distance" if any(sees_behind(facets, viewer) for viewer in viewers) else "planar"


def sees_behind(facets: Facets, viewer: Viewer) -> bool:
    """Whether a corner of a lit facet does not lie ahead of the eye along the look direction."""
    lit = their_lit_facets(facets, viewer)
    if any(_curved_behind(facets, viewer)):
        return True
    lit &= ~facets.curved
    if not lit.any():
        return False
    nearest = np.minimum.reduceat(_ahead(facets, viewer), facets.corner_start[:-1])
    return bool((nearest[lit] <= 0).any())


def share_behind(facets: Facets, viewer: Viewer) -> float:
    """Share of the lit pixels, 0 to 1, that lie behind the eye along the look direction.

    By area: the part of each facet's polygon, in its pixels, on the far side of the plane through the eye.
    """
    if not sees_behind(facets, viewer):
        return 0.0
    lit = np.flatnonzero(their_lit_facets(facets, viewer) & ~facets.curved)
    ahead, pixels = _ahead(facets, viewer), corner_pixels(facets)
    whole = behind = 0.0
    for facet in lit.tolist():
        corners = slice(facets.corner_start[facet], facets.corner_start[facet + 1])
        whole += polygon_area(pixels[corners])
        behind += polygon_area(cut_polygon(pixels[corners], ahead[corners]))
    for facet, share in enumerate(_curved_behind(facets, viewer)):
        pixel_count = float(facets.size[facet].astype(np.int64).prod()) if share else 0.0
        whole, behind = whole + pixel_count, behind + share * pixel_count
    return behind / whole if whole else 0.0


def _curved_behind(facets: Facets, viewer: Viewer) -> list[float]:
    """Shares of the lit places of facets, 0 for flat ones, that do not lie ahead of the eye."""
    shares = []
    theirs = their_lit_facets(facets, viewer) if facets.charts else ()
    for chart, lit in zip(facets.charts, theirs, strict=False):
        if chart is None or not lit:
            shares.append(0.0)
            continue
        points = chart_points(chart)
        if chart.stands:
            points = points - viewer.eye[:, None]
        elif chart.follows == "view":
            points = turned(viewer.camera_from_world.T, points)
        shares.append(float((viewer.look @ points <= 0).mean()) if points.size else 0.0)
    return shares


def their_lit_facets(facets: Facets, viewer: Viewer) -> BoolArray:
    """Facets (F,) whose lit side faces a viewer, of those that are theirs."""
    lit = lit_facets(facets, viewer.eye)
    if viewer.facets is not None:
        lit &= np.isin(np.arange(1, facets.count + 1), viewer.facets)
    return lit


def cut_polygon(points: FloatArray, value: FloatArray) -> FloatArray:
    """The part (m, 2) of a polygon (n, 2) where a linear `value` (n,) is at most 0 (Sutherland, Hodgman)."""
    kept = []
    for k in range(len(points)):
        a, b = value[k - 1], value[k]
        if (a > 0) != (b > 0):
            kept.append(points[k - 1] + (points[k] - points[k - 1]) * (a / (a - b)))
        if b <= 0:
            kept.append(points[k])
    return np.array(kept).reshape(-1, 2)


def polygon_area(points: FloatArray) -> float:
    """Area of a polygon (n, 2)."""
    x, y = points.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def _ahead(facets: Facets, viewer: Viewer) -> FloatArray:
    """How far (C,) corners of facets lie ahead of the eye, metres."""
    return dot(facets.corners - viewer.eye, viewer.look)


def behind_words(facets: Facets, viewers: Iterable[Viewer]) -> str | None:
    """What is to be said of viewers that see pixels behind a plane that cuts them off; None for nothing."""
    shares = [share_behind(facets, viewer) for viewer in viewers if not viewer.by_distance]
    most = max(shares, default=0.0)
    if most < 5e-4:
        return None
    return (
        f"{100 * most:.1f} % of the lit pixels lie behind the eye, where a planar near plane draws nothing"
        " (render.clip: distance draws all around)"
    )
