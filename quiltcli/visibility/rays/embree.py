"""Rays cast with Embree from one eye, with the near and far limits a render respects.

Embree is single precision and its rays start at 0, so the scene is moved to the eye first; how far a
hit is away is then measured in double precision, on the plane of the triangle Embree names.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.errors import MissingExtraError
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, cross, dot
from quiltcli.viewer.viewer import Viewer

MISS, UNSURE = -1, -2
_STEP = 1e-6  # share of the distance by which a ray passes a surface that is not drawn
_MOST_STEPS = 1000


@dataclass(frozen=True)
class Target:
    """The scene as rays from one eye meet it.

    Attributes:
        viewer: near, far, what they cut, and how depth is measured.
        corners: (V, 3) world minus eye, metres.
        triangles: (T, 3) indices into `corners`.
        plane: (T, 4) normal n (of no particular length) and n·p for points p of the triangle's plane.
        drawn: (T,) triangles that are drawn at all.
        embree: Embree's scene of some of the triangles.
        named: (K,) the triangle each of Embree's is.
    """

    viewer: Viewer
    corners: FloatArray
    triangles: Int32Array
    plane: FloatArray
    drawn: BoolArray
    embree: Any
    named: IntArray


def aim(
    vertices: FloatArray,
    triangles: Int32Array,
    viewer: Viewer,
    backface_culling: bool,
    *,
    one_sided: BoolArray | None = None,
    invisible: BoolArray | None = None,
    beside: float = 0.0,
) -> Target:
    """Make a target of a scene.

    Args:
        vertices: (V, 3) world metres.
        triangles: (T, 3).
        viewer: the viewer.
        backface_culling: leave out triangles whose winding is clockwise as seen from the eye.
        one_sided: (T,) the only ones that are left out then, without `backface_culling`; None for none.
        invisible: (T,) triangles that hold up no light; None for none.
        beside: how far from the eye rays may begin, metres.

    Raises:
        MissingExtraError: there is no Embree on this machine.
    """
    corners = vertices - viewer.eye
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    normal = cross(b - a, c - a)
    offset = dot(normal, a)
    drawn = np.asarray(normal.any(axis=1))
    if backface_culling:
        drawn &= offset < 0
    elif one_sided is not None:
        drawn &= ~one_sided | (offset < 0)
    if invisible is not None:
        drawn &= ~invisible
    farthest = viewer.reach_of(corners.T)[triangles].max(axis=1)
    # What ends before near begins would only have to be stepped through.
    named = np.flatnonzero(drawn & (farthest >= viewer.near * (1 - 1e-6) - beside))
    plane = np.concatenate((normal, offset[:, None]), axis=1)
    demand_embree()
    embree = embree_scene(corners, triangles[named])
    return Target(viewer, corners, triangles, plane, drawn, embree, named)


def has_embree() -> bool:
    """Whether there is an Embree on this machine."""
    return _embree() is not None


def embree_scene(corners: FloatArray, triangles: Int32Array) -> Any:
    """Embree's scene of triangles (T, 3) of corners (V, 3); None where there is no Embree."""
    embree = _embree()
    if embree is None:
        return None
    make_scene, make_mesh = embree
    scene = make_scene()
    if len(triangles):
        # Embree looks at 32 bits an index and does not check them.
        make_mesh(scene, corners.astype(np.float32), np.ascontiguousarray(triangles, dtype=np.int32))
    return scene


def demand_embree(words: str = "rays are cast with Embree") -> None:
    """Raise where there is no Embree on this machine.

    Args:
        words: what it is needed for, for the message.

    Raises:
        MissingExtraError: there is none.
    """
    if not has_embree():
        raise MissingExtraError(f"{words}, but embreex is not installed (not every kind of machine has it)")


def is_hidden(scene: Any, origin: Float32Array, direction: Float32Array, far: Float32Array) -> BoolArray:
    """Whether something lies between origins and ends.

    Args:
        scene: from `embree_scene`.
        origin: (N, 3) where rays start.
        direction: (N, 3) where they go, of any length.
        far: (N,) multiples of the direction at which they end.
    """
    # Of the triangles this query names the first, whichever is in the way.
    answer: Int32Array = scene.run(origin, direction, dists=far, query="OCCLUDED")
    hidden: BoolArray = answer == 0
    return hidden


def _embree() -> tuple[Any, Any] | None:
    """What makes scenes and what makes meshes; this is the one place that imports Embree."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError:
        return None
    return EmbreeScene, TriangleMesh


def measure_along(viewer: Viewer, directions: FloatArray) -> FloatArray:
    """Depth (...,) gained for each unit of t along `directions` (..., 3)."""
    if viewer.depth == "radial":
        return np.asarray(np.sqrt(dot(directions, directions)))
    return dot(directions, viewer.look)


def reach_along(viewer: Viewer, directions: FloatArray) -> FloatArray:
    """What near and far cut (...,), for each unit of t along `directions` (..., 3)."""
    return viewer.reach_of(np.moveaxis(directions, -1, 0))


def plane_distance(
    target: Target, triangle: IntArray, directions: FloatArray, origin: FloatArray | None = None
) -> FloatArray:
    """Multiples t (N,) at which rays o + t·d (N, 3) meet triangles' planes; infinite where they run along.

    `origin` o is minus the eye; None for the eye itself.
    """
    plane = target.plane[triangle]
    slope = dot(plane[:, :3], directions)
    offset = plane[:, 3] if origin is None else plane[:, 3] - dot(plane[:, :3], origin)
    result: FloatArray = np.divide(offset, slope, out=np.full(slope.shape, np.inf), where=slope != 0)
    return result


def plane_depth(
    target: Target, triangle: IntArray, directions: FloatArray, origin: FloatArray | None = None
) -> FloatArray:
    """Depth (N,) of the planes of triangles (N,) along rays (N, 3) from the eye, or from origins, metres."""
    with np.errstate(invalid="ignore"):  # infinity times 0
        return np.asarray(
            plane_distance(target, triangle, directions, origin) * measure_along(target.viewer, directions)
        )


def cast(
    target: Target,
    directions: FloatArray,
    beyond: FloatArray | None = None,
    origin: FloatArray | None = None,
) -> IntArray:
    """The first triangle that is drawn along each ray.

    Surfaces nearer than near are passed; nothing is seen beyond far.

    Args:
        target: the scene.
        directions: (N, 3) unit directions from the eye.
        beyond: (N,) distances from the eye at which rays start, metres; the eye itself when None.
        origin: (N, 3) eyes of their own, minus the target's, metres; None where all have that.

    Returns:
        (N,) triangles; MISS, or UNSURE where a surface lies on the near or far limit itself.
    """
    found = np.full(len(directions), MISS, dtype=np.int64)
    if not target.named.size:
        return found
    # Rays that are still on their way; one that meets something before near goes on from there.
    gain = reach_along(target.viewer, directions)
    live = np.flatnonzero(gain > 0)
    start = np.zeros(len(directions)) if beyond is None else beyond.copy()
    for _ in range(_MOST_STEPS):
        if not live.size:
            return found
        ray = directions[live]
        own = None if origin is None else origin[live]
        begin = start[live, None] * ray if own is None else own + start[live, None] * ray
        met = target.embree.run(begin.astype(np.float32), ray.astype(np.float32)).astype(np.int64)
        live, ray, met = live[met >= 0], ray[met >= 0], met[met >= 0]
        triangle = target.named[met]
        distance = plane_distance(target, triangle, ray, None if origin is None else origin[live])
        verdict = _in_range(target.viewer, distance * gain[live])
        found[live] = np.where(verdict == 0, triangle, np.where(verdict == UNSURE, UNSURE, MISS))
        passed = verdict < UNSURE
        live, distance = live[passed], distance[passed]
        start[live] = np.maximum(distance, start[live]) * (1 + _STEP) + _STEP * 1e-3
    found[live] = UNSURE
    return found


def _in_range(viewer: Viewer, reach: FloatArray) -> IntArray:
    """0 inside near and far, UNSURE on a limit, −3 before near, 1 beyond far."""
    verdict = np.where(reach < viewer.near, -3, np.where(reach > viewer.far, 1, 0))
    on_limit = np.minimum(np.abs(reach - viewer.near) / viewer.near, np.abs(reach - viewer.far) / viewer.far)
    return np.where(on_limit <= 1e-6, UNSURE, verdict).astype(np.int64)
