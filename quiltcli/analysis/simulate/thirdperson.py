"""The display, its viewer and the scene as somebody else sees them.

Eye, rays and display are triangles of one scene and drawn by the program's own rasterizer; what is
seen of the display is looked up in its images. Walls seen from behind are glass, or nobody would see into
a room of them. The scene itself lies over it all, solid or as a ghost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.analysis.simulate.overlaps import all_light
from quiltcli.analysis.simulate.picture import (
    Camera,
    camera_stage,
    displayed_light,
    exact,
    first_triangles,
    outlined,
    picture_rays,
    with_channels,
)
from quiltcli.analysis.simulate.skin import skin_of
from quiltcli.display import Facets, lit_facets
from quiltcli.geometry import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    cross,
    dot,
    hull,
    normalized,
    segments,
)
from quiltcli.projection.camera import aimed, frame_display
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.scene.bare import bare_scene
from quiltcli.viewer.viewer import Viewer

SCENES = ("ghost", "solid", "none")
RAYS = 8
"""Rays from the eye to the display's outline at most."""

HEAD = (0.075, 0.115, 0.095)
"""Half of how wide, high and deep a head is, metres."""

_HEAD = (0.30, 0.27, 0.25)
_EYE, _RAY = (1.0, 0.62, 0.05), (0.95, 0.5, 0.04)
_ASIDE, _ABOVE = math.radians(55), math.radians(22)
_GLASS = np.float32(0.3)  # how much of a wall's back shows
_BEFORE, _BEHIND = np.float32(0.55), np.float32(0.25)  # how much of a ghost shows


@dataclass(frozen=True)
class Marks:
    """Bare triangles that show the eye and its rays.

    Attributes:
        vertices: (V, 3) world metres.
        triangles: (T, 3) into the vertices.
        color: (T, 3) linear.
    """

    vertices: FloatArray
    triangles: Int32Array
    color: Float32Array


def third_person_camera(
    viewer: Viewer,
    facets: Facets,
    place: FloatArray | None,
    look_at: FloatArray | None,
    aspect: float,
    eyes: FloatArray | None = None,
    *,
    head: bool = False,
) -> tuple[Viewer, float]:
    """A camera that sees display and eye, and its field of view, degrees from top to bottom.

    Without a place it stands aside of the eye and above it: to the right or the left, where it sees more
    of what is lit.

    Args:
        viewer: who is seen.
        facets: the display.
        place: where it stands, world metres.
        look_at: what it looks at, world metres.
        aspect: width over height of the picture.
        eyes: (N, 3) where the viewer's eyes are in all frames, so that the camera is the same for all.
        head: whether there is a head around the eye.
    """
    if eyes is not None and len(eyes) > 1:
        # Aside of where the viewer is in the mean, or what moves would be the camera.
        viewer = replace(viewer, eye=eyes.mean(axis=0))
    else:
        eyes = viewer.eye[None]
    points = np.concatenate((facets.corners, eyes))
    if head:
        around = 2 * max(HEAD) * np.concatenate((np.eye(3), -np.eye(3)))
        points = np.concatenate((points, (eyes[:, None] + around).reshape(-1, 3)))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.sqrt(dot(points - middle, points - middle).max()))
    if place is None:
        place = middle + 2.6 * radius * _way_aside(viewer, facets)
    camera = replace(viewer, eye=np.asarray(place, np.float64), up=np.array([0.0, 1.0, 0.0]))
    camera = aimed(camera, (middle if look_at is None else look_at) - camera.eye)
    return frame_display(camera, points, aspect, turn=look_at is None)


def _way_aside(viewer: Viewer, facets: Facets) -> FloatArray:
    """The direction (3,) from a display in which a third person stands."""
    back = viewer.eye - (facets.corners.min(axis=0) + facets.corners.max(axis=0)) / 2
    turns = math.atan2(back[0], back[2]) + np.array([_ASIDE, -_ASIDE])
    level = math.cos(_ABOVE)
    ways = np.stack((level * np.sin(turns), np.full(2, math.sin(_ABOVE)), level * np.cos(turns)), axis=1)
    area = np.where(lit_facets(facets, viewer.eye), facets.size.prod(axis=1), 0)
    seen = area @ np.maximum(facets.normal @ ways.T, 0)
    return np.asarray(ways[int(seen[1] > 1.001 * seen[0])])


def outline_points(
    viewer: Viewer, facets: Facets, lit: BoolArray, most: int = RAYS, bent: FloatArray | None = None
) -> FloatArray:
    """At most so many corners (N, 3) of lit facets on the display's outline as the eye sees it, well apart.

    Around an eye that the display surrounds there is no outline: any corners then. Curved facets count by
    the points of theirs that are given, `bent` (M, 3).
    """
    row, _ = segments(facets.corner_start)
    flat = lit & ~facets.curved
    corners = np.unique(facets.corners[flat[row]], axis=0)
    if bent is not None:
        corners = np.concatenate((corners, bent))
    if not len(corners):
        return corners
    way = normalized(corners - viewer.eye)
    ahead = normalized(way.mean(axis=0)) if np.abs(way.mean(axis=0)).max() > 1e-6 else viewer.look
    slope = dot(way, ahead)
    if slope.min() > 0.05:
        side = normalized(cross(ahead, np.eye(3)[int(np.argmin(np.abs(ahead)))]))
        seen = np.stack((dot(way, side), dot(way, cross(ahead, side))), axis=1) / slope[:, None]
        outline = hull(seen)
        corners, way, slope = corners[outline], way[outline], slope[outline]
    chosen = [int(np.argmin(slope))]
    while len(chosen) < min(most, len(corners)):
        apart = (1 - way @ way[chosen].T).min(axis=1)
        if apart.max() < 1e-4:
            break
        chosen.append(int(np.argmax(apart)))
    return np.asarray(corners[chosen])


def viewer_marks(
    viewer: Viewer, points: FloatArray, radius: float, half: float, *, head: bool = False
) -> Marks:
    """The eye as a ball with its look direction, rays to points (N, 3) of half a thickness; and a head."""
    parts = [(*_ball(viewer.eye, radius), _EYE)]
    if head:
        parts.append((*_head(viewer), _HEAD))
    parts.append((*_box(viewer.eye, viewer.eye + 3.5 * radius * viewer.look, radius / 4), _EYE))
    parts += [(*_box(viewer.eye, point, half), _RAY) for point in points]
    start = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts)])
    return Marks(
        np.concatenate([vertices for vertices, _, _ in parts]),
        np.concatenate([t + first for (_, t, _), first in zip(parts, start, strict=False)]).astype(np.int32),
        np.concatenate([np.repeat([color], len(t), axis=0) for _, t, color in parts]).astype(np.float32),
    )


def _ball(centre: FloatArray, radius: float) -> tuple[FloatArray, Int32Array]:
    """A ball of 12 × 24 faces."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, 13), np.linspace(0, 2 * np.pi, 25), indexing="ij")
    ring = np.stack((np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)), axis=-1)
    row, column = np.divmod(np.arange(12 * 24), 24)
    a = 25 * row + column
    triangles = np.concatenate((np.stack((a, a + 1, a + 26), 1), np.stack((a, a + 26, a + 25), 1)))
    return centre + radius * ring.reshape(-1, 3), triangles.astype(np.int32)


def _head(viewer: Viewer) -> tuple[FloatArray, Int32Array]:
    """A head of a grown person behind the eye, or behind the place between both, that looks where they do."""
    ball, triangles = _ball(np.zeros(3), 1.0)
    between = viewer.eye if viewer.head is None else viewer.head
    axes = np.stack((cross(viewer.look, viewer.up), viewer.up, viewer.look))
    # Eyes lie in its front, a little above its middle.
    middle = between - HEAD[2] * viewer.look - 0.1 * HEAD[1] * viewer.up
    return middle + (ball * HEAD) @ axes, triangles


def _box(start: FloatArray, end: FloatArray, half: float) -> tuple[FloatArray, Int32Array]:
    """A square rod without ends."""
    along = normalized(end - start)
    side = normalized(cross(along, np.eye(3)[int(np.argmin(np.abs(along)))]))
    other = cross(along, side)
    ring = half * np.stack((side + other, other - side, -side - other, side - other))
    faces = [
        triangle
        for k, n in ((0, 1), (1, 2), (2, 3), (3, 0))
        for triangle in ((k, n, n + 4), (k, n + 4, k + 4))
    ]
    return np.concatenate((start + ring, end + ring)), np.array(faces, dtype=np.int32)


def third_person_light(
    stage: Stage,
    viewer: Viewer,
    shown: Shown,
    camera: Viewer,
    through: Camera,
    how: str,
    scene: str,
    threads: int,
    *,
    head: bool = False,
) -> tuple[Float32Array, Int32Array]:
    """What the camera sees (3, P) linear light, and the facet (P,) that each ray meets, −1 for none.

    Args:
        stage: display and scene.
        viewer: who is seen.
        shown: the display's images.
        camera: where from.
        through: its display of one facet.
        how: a filter of `lookup.FILTERS`.
        scene: a name of `SCENES`.
        threads: batches drawn at a time.
        head: draw a head around the eye.
    """
    skin = skin_of(stage.facets, viewer)
    # The backs of flat facets are looked through, like glass.
    back = ~lit_facets(stage.facets, camera.eye)[skin.facet]
    rear = np.flatnonzero(back)
    triangles, facet_of = skin.triangles[~back], skin.facet[~back]
    reach = np.concatenate((skin.vertices, viewer.eye[None]))
    size = float(np.sqrt(dot(np.ptp(reach, axis=0), np.ptp(reach, axis=0))))
    thick = float(np.linalg.norm(through[0].dv[0])) * float(np.linalg.norm(reach.mean(axis=0) - camera.eye))
    points = outline_points(viewer, stage.facets, shown.lit, bent=skin.lit_points())
    radius, half = max(0.018 * size, 6 * thick), max(1.2 * thick, 1.2e-3 * size)
    marks = viewer_marks(viewer, points, radius, half, head=head)
    corners = skin.vertices
    everything = bare_scene(
        np.concatenate((corners, marks.vertices)),
        np.concatenate((triangles, marks.triangles + len(corners))).astype(np.int32),
    )
    met, depth = first_triangles(stage, camera, through, everything, threads)
    marked = met - len(triangles)
    facet = np.concatenate((facet_of, [-1])).astype(np.int32)[
        np.where((met < 0) | (marked >= 0), len(facet_of), met)
    ]
    front = np.append(np.flatnonzero(~back), -1)[np.where(facet >= 0, met, -1)]
    light, _ = all_light(
        stage, shown, camera, through, facet, how, skin, front.astype(np.int32), depth, threads
    )
    on = np.flatnonzero(marked >= 0)
    light[:, on] = _mark_light(marks, marked[on], picture_rays(camera, through, on))
    if rear.size:
        walls = bare_scene(corners, skin.triangles[rear])
        pane, before = first_triangles(stage, camera, through, walls, threads)
        panes = np.where(before < depth, np.append(skin.facet[rear], -1)[pane], -1).astype(np.int32)
        light = _through_glass(shown, camera, through, panes, light)
    if scene != "none":
        light = _with_scene(stage, camera, through, light, depth, threads, solid=scene == "solid")
    return light, facet


def _through_glass(
    shown: Shown, camera: Viewer, through: Camera, facet: Int32Array, light: Float32Array
) -> Float32Array:
    """Light (3, P) with the backs of the facets (P,) that stand before it, −1 for none, laid over it."""
    glass, _ = displayed_light(shown, camera, through, facet, "nearest")
    mixed = np.where(facet >= 0, light + _GLASS * (glass - light), light).astype(np.float32)
    return outlined(mixed, facet, int(through[1].pages[0, 0]))


def _mark_light(marks: Marks, triangle: Int32Array, rays: FloatArray) -> Float32Array:
    """Light (3, P) of marks: brighter where they face the camera, so that a ball is round."""
    a, b, c = marks.vertices[marks.triangles].transpose(1, 0, 2)
    facing = np.abs(dot(normalized(cross(b - a, c - a) + 1e-300)[triangle], normalized(rays.T)))
    return (marks.color[triangle] * (0.35 + 0.65 * facing[:, None])).T.astype(np.float32)


def _with_scene(
    stage: Stage,
    camera: Viewer,
    through: Camera,
    light: Float32Array,
    depth: Float32Array,
    threads: int,
    *,
    solid: bool,
) -> Float32Array:
    """The light with the scene over it: what is nearer hides, or a ghost lets through."""
    job = exact(with_channels(stage.job, ("rgba", "Z")), samples=1)
    direct = camera_stage(job, through, stage.scene)
    buffers = new_buffers(direct)
    draw_frame(direct, replace(camera, near=1e-3, far=1e6, depth="radial", clip=None), buffers, threads)
    there, before = buffers["A"] > 0, buffers["Z"] < depth
    share = there * (before if solid else np.where(before, _BEFORE, _BEHIND))
    color = np.stack([buffers[name].astype(np.float32) for name in "RGB"])
    return np.asarray(light + share.astype(np.float32) * (color - light))
