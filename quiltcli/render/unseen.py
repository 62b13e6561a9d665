"""Frames that would show nothing, found before they are drawn: where the eye is, where the scene is from it.

A picture of nothing is exact, so nothing else complains of one: a take in millimetres read as metres, an eye
behind the walls, a scene beyond the far depth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets, lit_facets
from quiltcli.display.check import called
from quiltcli.geometry import BoolArray, FloatArray, dot, slices
from quiltcli.job.frames import format_frames
from quiltcli.layout import Layout
from quiltcli.render.setup import Stage
from quiltcli.scene import Scene
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.pairs import Cores, Parts, facet_parts, lit_cones, pairs_of
from quiltcli.visibility.draw import triangles_in_range
from quiltcli.visibility.shares import faces_eye

_FAR_OFF = 30.0
"""A display seen from farther away than so many times its size is a degree or two wide."""
_MOST_LOOKED_AT = 3  # frames in which the scene is looked for
_FLAT = 1e-9  # metres
_AT_ONCE = 1 << 16  # triangles


def unseen_notices(
    views: Sequence[View],
    facets: Facets,
    layout: Layout | None = None,
    scene_at: Callable[[float], Scene] | None = None,
    *,
    bleed: int = 0,
    culling: bool = False,
) -> Iterator[str]:
    """What keeps views from showing anything of the scene, a sentence a reason.

    Eyes are looked at in all views, the scene in the first, the middle and the last of those that could
    show it.

    Args:
        views: of a job, with what near and far cut settled.
        facets: the display.
        layout: its layout, None where that is wrong.
        scene_at: the scene of a frame, None where that is wrong.
        bleed: pixels drawn past the facets' edges.
        culling: whether triangles that face away are left out.
    """
    looks = [
        _Look(view.time, viewer, their_lit_facets(facets, viewer))
        for view in views
        for viewer in view.viewers
    ]
    low, high = _box(facets)
    size = float(np.linalg.norm(high - low))
    away = [_away(look.viewer.eye, low, high) for look in looks]
    far = [k for k, distance in enumerate(away) if distance > _FAR_OFF * size]
    if far:
        most = max(far, key=lambda k: away[k])
        yield (
            f"{_frames(looks, far)} the eye is up to {away[most]:.4g} m from the display, which is {size:.4g}"
            " m large: are the positions of the path metres (units: mm reads a file of millimetres)?"
        )
    dark = [k for k, look in enumerate(looks) if not look.lit.any()]
    if dark:
        words = "the eye is behind every facet: nothing is lit, nothing will be drawn"
        yield f"{_frames(looks, dark)} {words} ({_lit_side(facets)})"
    yield from _behind_walls(looks, facets, (low + high) / 2, {*far, *dark})
    if scene_at is None or layout is None:
        return
    parts = facet_parts(facets, layout, bleed)
    rest = [k for k in range(len(looks)) if k not in {*far, *dark}]
    for k in sorted({rest[0], rest[len(rest) // 2], rest[-1]}) if rest else ():
        scene = scene_at(looks[k].time)
        reason = _out_of_range(looks[k].viewer, scene) or _beside(looks[k], scene, facets, parts, culling)
        if reason:
            yield f"{_frames(looks, [k])} {reason}"
            return


@dataclass(frozen=True)
class _Look:
    """Somebody who looks at a time: the viewer, and the facets (F,) that are lit for them."""

    time: float
    viewer: Viewer
    lit: BoolArray


def _behind_walls(
    looks: Sequence[_Look], facets: Facets, middle: FloatArray, told: set[int]
) -> Iterator[str]:
    """Walls that an eye is behind, of a display whose middle they all face: nobody walks around that."""
    if facets.count < 2 or not lit_facets(facets, middle)[facets.enabled].all():
        return
    behind: dict[int, list[int]] = {}
    for k, look in enumerate(looks):
        mine = facets.enabled
        if look.viewer.facets is not None:
            mine = mine & np.isin(np.arange(1, facets.count + 1), look.viewer.facets)
        if k not in told:
            height = dot(look.viewer.eye - facets.origin, facets.normal)
            for facet in np.flatnonzero(mine & ~look.lit & (height < -_FLAT)).tolist():
                behind.setdefault(facet, []).append(k)
    for facet, which in list(behind.items())[:_MOST_LOOKED_AT]:
        name = called(facet, facets.names)
        words = f"the eye is behind {name}, which stays dark: is the viewer in the right place?"
        yield f"{_frames(looks, which)} {words}"


def _box(facets: Facets) -> tuple[FloatArray, FloatArray]:
    """Least and greatest corner (3,) of the enabled facets."""
    used = np.repeat(
        facets.enabled if facets.enabled.any() else ~facets.enabled, np.diff(facets.corner_start)
    )
    corners = facets.corners[used]
    return corners.min(axis=0), corners.max(axis=0)


def _away(eye: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Metres from the eye to a box."""
    return float(np.linalg.norm(np.maximum(np.maximum(low - eye, eye - high), 0.0)))


def _frames(looks: Sequence[_Look], which: Sequence[int]) -> str:
    """`in frame 3`, `in frames 1-20`, with the viewer's name where there are several."""
    numbers = sorted({looks[k].viewer.frame for k in which})
    names = sorted({looks[k].viewer.name for k in which if looks[k].viewer.name})
    several = len({look.viewer.name for look in looks}) > 1
    who = f" of {', '.join(names)}" if several and names else ""
    return f"in frame{'s' * (len(numbers) > 1)} {format_frames(numbers)}{who}"


def _lit_side(facets: Facets) -> str:
    if facets.both_sides:
        return "it lies in the planes of all facets"
    return "viewing_side of the display says which side that is, the path where the eye is"


def _out_of_range(viewer: Viewer, scene: Scene) -> str:
    """Why near and far leave nothing of the scene, empty when they leave something."""
    reach = viewer.reach_of((scene.vertices - viewer.eye).T)
    least, most = float(reach.min()), float(reach.max())
    if least <= viewer.far and most >= viewer.near:
        return ""
    how = "from the eye" if viewer.by_distance else "along the look direction"
    limits = f"near is {viewer.near:g} m and far {viewer.far:g} m"
    return f"the scene lies {least:.4g} to {most:.4g} m away {how}, but {limits}: nothing of it will be drawn"


def _beside(look: _Look, scene: Scene, facets: Facets, parts: Parts, culling: bool) -> str:
    """That no triangle in range shows on a lit facet, and where both are; empty when one does."""
    eye, triangles = look.viewer.eye, scene.triangles
    vertices = scene.vertices - eye
    wanted, _ = triangles_in_range(look.viewer.reach_of(vertices.T), vertices, triangles, look.viewer)
    if culling:
        wanted &= faces_eye(scene.planes, eye)
    cones = lit_cones(parts, look.lit, eye)
    core = Cores(cones).met_by(vertices)
    drawn = np.flatnonzero(wanted)
    for some in slices(0, drawn.size, _AT_ONCE):
        if pairs_of(vertices, triangles, drawn[some], core, cones).reaching:
            return ""
    low, high = (_place(corner) for corner in _box(facets))
    least, most = (_place(extreme(scene.vertices, axis=0)) for extreme in (np.min, np.max))
    where = (
        f"the scene is from {least} to {most} m, the display from {low} to {high} m, the eye at {_place(eye)}"
    )
    return (
        "no triangle of the scene shows on any lit facet: seen from the eye, it lies beside them all"
        f" ({where} m)"
    )


def _place(point: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.3g}" for value in point + 0.0) + "]"


def unseen_in(stage: Stage, views: Sequence[View]) -> Iterator[str]:
    """As `unseen_notices`, of a job that is set up."""
    how = stage.job.render
    yield from unseen_notices(
        views,
        stage.facets,
        stage.layout,
        lambda time: stage.at(time).scene,
        bleed=how.bleed,
        culling=how.backface_culling,
    )
