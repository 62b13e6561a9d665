"""What the mirror would show by other maps than the exact one, and what is there without a display.

Both other maps give a whole picture one centre of projection, as if everybody stood where the middle of the
fan goes: plain perspective, shown upright as it is, and perspective that is right on a mirror that scatters
light everywhere (Jones et al., figure 7).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, cross, dot, normalized
from quiltcli.lightfield import Field, Rays, rebin
from quiltcli.ring.cast import Lines, Target, cast, lines_of
from quiltcli.ring.curve import Curve
from quiltcli.ring.hits import EYE
from quiltcli.ring.maps import backward
from quiltcli.ring.picture import Show
from quiltcli.ring.raster import Limits
from quiltcli.ring.rig import Pose
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import light_at_points
from quiltcli.visibility.resolve.footprints import PointEdges
from quiltcli.visibility.resolve.hits import point_hits
from quiltcli.visibility.setup.planes import LATTICE

CONTENTS = ("mcop", "perspective", "diffuse")
_CHUNK = 1 << 15


def content_lines(kind: str, pose: Pose, curve: Curve, x: FloatArray, y: FloatArray) -> Lines:
    """The rays of the scene that pixels (N,) show by one of `CONTENTS`, in the world."""
    if kind == "mcop":
        return lines_of(pose, curve, x, y)
    eye = curve.points(np.array([pose.angle]))[0]
    if kind == "diffuse":
        through = pose.to_world(backward(pose, curve, x, y).mirror.T)
    else:
        through = upright(pose, eye, x, y)
    return Lines(np.broadcast_to(eye, through.shape), normalized(through - eye))


def upright(pose: Pose, eye: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Points (N, 3) of the picture plane of a plain perspective, at pixels.

    It stands across the look direction at the world's origin; what the projector's pixels cover at the
    origin's height is its scale, and away from the viewer is up.
    """
    inverse = np.linalg.inv(pose.projector[:, :3])
    ray = np.stack([row[0] * x + row[1] * y + row[2] for row in inverse], axis=-1)
    place = pose.eye + ray * (-pose.eye[1] / ray[:, 1])[:, None]
    look = normalized(-eye)
    up = normalized(np.array([0.0, 1.0, 0.0]) - look[1] * look)
    right = cross(look, up)
    e, f, _ = pose.axes
    return np.asarray((place @ f)[:, None] * right - (place @ e)[:, None] * up)


def light_along(show: Show, target: Target, lines: Lines) -> Float32Array:
    """Light (N, 3) that comes along rays of the scene, or of the light field in its place."""
    if show.field is not None:
        return _photographed(show.field, lines, show.frame)
    scene = show.scene
    found = np.tile(scene.background.astype(np.float32), (len(lines.eye), 1))
    for start in range(0, len(found), _CHUNK):
        part = slice(start, start + _CHUNK)
        some = Lines(lines.eye[part], lines.along[part])
        triangle = cast(target, some, show.backface_culling, Limits(0.0, math.inf))
        row = np.flatnonzero(triangle >= 0)
        if row.size:
            found[row + start] = _shaded(scene, target, Lines(some.eye[row], some.along[row]), triangle[row])
    return found


def _photographed(field: Field, lines: Lines, frame: int) -> Float32Array:
    """Light (N, 3) of a light field along rays, which are looked up where they pass the axis."""
    x, z, ex, ez = lines.along[:, 0], lines.along[:, 2], lines.eye[:, 0], lines.eye[:, 2]
    reach = -(ex * x + ez * z) / (x * x + z * z)
    place = lines.eye + reach[:, None] * lines.along
    return rebin(field, Rays(lines.eye, place, lines.eye.mean(axis=0)), frame)


def _shaded(scene: Scene, target: Target, lines: Lines, triangle: np.ndarray) -> Float32Array:
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    normal = target.normal[triangle]
    distance = dot(normal, a - lines.eye) / dot(normal, lines.along)
    position = lines.eye + distance[:, None] * lines.along
    area = dot(normal, normal)
    weights = np.stack(
        (dot(normal, cross(position - a, c - a)) / area, dot(normal, cross(b - a, position - a)) / area)
    )
    hits = point_hits(
        first=np.arange(triangle.size),
        facet=np.zeros(triangle.size, dtype=np.int32),
        triangle=triangle.astype(np.int32),
        position=np.ascontiguousarray((position - lines.eye).T),
        weights=weights,
        depth=distance,
        normals=scene.corner_normals,
        inside=triangle.size,
        # Of a line alone nobody knows how far the next one is: textures are not filtered.
        slopes=None if scene.textures is None else np.zeros((2, 2, triangle.size)),
    )
    # Without slopes textures are as sharp as they are.
    edges = PointEdges(triangle.astype(np.int32), weights, np.zeros((2, 2, triangle.size)))
    hits = replace(hits, position=np.ascontiguousarray(position.T)[:, :, None], edges=edges)
    light = light_at_points("rgba", Shaded(scene, EYE, hits))
    return np.stack([np.broadcast_to(part, (triangle.size, 1))[:, 0] for part in light], axis=-1)


def centres(size: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Samples of all pixels of a picture."""
    y, x = np.mgrid[: size[1], : size[0]]
    return x.reshape(-1) + (0.5 + LATTICE[0]), y.reshape(-1) + (0.5 + LATTICE[1])
