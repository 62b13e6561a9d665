"""What light passes along rays: whether a surface is there at all where a ray meets it.

The pictures that cut surfaces out are looked up as pixels do it, from weights and slopes in double
precision. Where that is too near to call, by the roundings of the picture's filter, the answer is that
nobody knows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.scene import Scene
from quiltcli.shading.opacity import MASK, OPAQUE, alpha_of
from quiltcli.visibility.rays.embree import UNSURE, Target, cast, plane_distance
from quiltcli.visibility.rays.pixels import Places
from quiltcli.visibility.rays.weights import barycentric, weight_slopes
from quiltcli.visibility.resolve.footprints import PointEdges
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import PointVectors

ABSENT, THERE, DOUBTFUL = 0, 1, 2
_PAST = 1e-6  # share of a distance by which a ray that goes on begins behind it
_MASKED = 1e-4  # about a cutoff, within which alpha is too near to call
_BLENDED = 1e-6  # below which it may be rounded to 0


def presence(
    scene: Scene,
    target: Target,
    pixels: Places,
    triangle: IntArray,
    offset: tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.uint8]:
    """Whether triangles (P,) are there where the rays of P pixels meet them: ABSENT, THERE or DOUBTFUL.

    Args:
        scene: the scene.
        target: the same from an eye.
        pixels: the pixels.
        triangle: (P,) triangles.
        offset: how far beside the pixels' centres rays go through, in pixels.
    """
    result = np.full(triangle.size, THERE, dtype=np.uint8)
    if scene.soft is None:
        return result
    matrix, ray = pixels.ray, pixels.rays(*offset)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        distance = plane_distance(target, triangle, ray, pixels.origin)
    some = np.flatnonzero(scene.soft[triangle] & np.isfinite(distance) & (distance > 0))
    if not some.size:
        return result
    triangle, matrix, ray, begin = triangle[some], matrix[some], ray[some], pixels.from_eye(some)
    seen_from = ray * distance[some, None]
    position = seen_from if begin is None else begin + seen_from
    weights = np.stack(barycentric(target, triangle, position))
    slopes = weight_slopes(target, triangle, matrix, ray, seen_from)
    number = triangle.astype(np.int32)
    seen = Points(
        triangle=number[:, None],
        ray=PointVectors(seen_from.T.astype(np.float32)[:, :, None]),
        normal=None,
        weights=weights.astype(np.float32)[:, :, None],
        position=None,
        edges=PointEdges(number, weights, slopes),
    )
    alpha, means, cutoff = (values.reshape(-1) for values in alpha_of(scene, seen))
    masked = np.where(np.abs(alpha - cutoff) < _MASKED, DOUBTFUL, np.where(alpha >= cutoff, THERE, ABSENT))
    blended = np.where(alpha <= 0, ABSENT, np.where(alpha < _BLENDED, DOUBTFUL, THERE))
    result[some] = np.where(means == MASK, masked, np.where(means == OPAQUE, THERE, blended))
    return result


def cast_on(
    scene: Scene,
    target: Target,
    pixels: Places,
    offset: tuple[float, float] = (0.0, 0.0),
    beyond: FloatArray | None = None,
) -> IntArray:
    """The first triangle (P,) that is there along each pixel's ray; see `embree.cast`.

    Args:
        scene: the scene.
        target: the same from an eye.
        pixels: the pixels.
        offset: how far beside their centres rays go through, in pixels.
        beyond: (P,) distances from the eye at which rays start, metres; the eye itself when None.

    Returns:
        (P,) triangles; MISS, or UNSURE where a surface lies on the near or far limit or may not be there.
    """
    directions = pixels.directions(*offset)
    found = cast(target, directions, beyond, pixels.origin)
    if scene.soft is None:
        return found
    start = np.zeros(found.size) if beyond is None else beyond.copy()
    live = np.flatnonzero(_passable(scene, found))
    while live.size:
        there = presence(scene, target, pixels.take(live), found[live], offset)
        distance = plane_distance(target, found[live], directions[live], pixels.from_eye(live))
        found[live[there == DOUBTFUL]] = UNSURE
        gone = there == ABSENT
        live, distance = live[gone], distance[gone]
        start[live] = np.maximum(distance, start[live]) * (1 + _PAST) + _PAST * 1e-3
        found[live] = cast(target, directions[live], start[live], pixels.from_eye(live))
        live = live[_passable(scene, found[live])]
    return found


def _passable(scene: Scene, triangle: IntArray) -> BoolArray:
    """Which of triangles (P,), negative for none, light may pass."""
    assert scene.soft is not None
    return np.asarray((triangle >= 0) & scene.soft[triangle])
