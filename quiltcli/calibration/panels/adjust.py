"""Bundle adjustment: the camera, where it stood, and where the facets are, from all markers at once.

A facet is rigid. Its motion turns it about its own middle c and shifts it: X → R(w)(X − c) + c + t, so that
w and t are what is wrong with it, and zero where the display is as its file says. A photo's pose takes
the world before the lens: X → R(w)X + t.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from quiltcli.calibration.panels.camera import FREE, Camera, projected
from quiltcli.geometry import BoolArray, FloatArray, IntArray

_STEPS = (30.0, 5.0, 1.0)
"""Pixels beyond which a corner counts less, one after the other: at first everything is far off."""
_OUTLIER = 4.0
"""A corner is left out where it is so many times the usual error away."""
_LEAST_SCALE = 0.02
_ABOUT, _ENOUGH = 1e-4, 1e-10
"""Relative change of a step, or of the sum of squares, after which a fit goes on to the next, or ends."""
_DENSE = 1500


@dataclass(frozen=True)
class Corners:
    """n corners of markers in photos.

    Attributes:
        photo: (n,) 0-based photo.
        facet: (n,) row of the facet among those that are sought.
        world: (n, 3) where the display's file has it, metres.
        pixel: (n, 2) where the photo shows it.
    """

    photo: IntArray
    facet: IntArray
    world: FloatArray
    pixel: FloatArray

    def kept(self, some: BoolArray) -> Corners:
        """Some of them."""
        return Corners(self.photo[some], self.facet[some], self.world[some], self.pixel[some])


@dataclass(frozen=True)
class Bundle:
    """All that is sought.

    Attributes:
        camera: the camera.
        photos: (P, 6) rotation vectors and shifts of the photos' poses.
        facets: (K, 6) rotation vectors and shifts of the facets' motions.
        middles: (K, 3) the points that facets turn about, world metres.
        anchor: row of the facet that stays where it is.
        free: whether the camera is sought as well.
    """

    camera: Camera
    photos: FloatArray
    facets: FloatArray
    middles: FloatArray
    anchor: int
    free: bool

    @property
    def numbers(self) -> FloatArray:
        """What is sought, one after the other; lengths and angles in their units."""
        moving = np.delete(self.facets, self.anchor, axis=0)
        camera = self.camera.numbers if self.free else np.empty(0)
        return np.concatenate((camera, self.photos.reshape(-1), moving.reshape(-1)))

    def with_numbers(self, numbers: FloatArray) -> Bundle:
        """The same with other values."""
        camera = self.camera
        if self.free:
            camera, numbers = camera.with_numbers(numbers[:FREE]), numbers[FREE:]
        at = self.photos.size
        moving = numbers[at:].reshape(-1, 6)
        facets = np.insert(moving, self.anchor, self.facets[self.anchor], axis=0)
        return replace(self, camera=camera, photos=numbers[:at].reshape(-1, 6), facets=facets)


@dataclass(frozen=True)
class Adjusted:
    """A bundle that fits the photos.

    Attributes:
        bundle: what was sought.
        residual: (n, 2) what the photos show less what they should, pixels.
        used: (n,) corners that agree with the others.
        deviation: standard deviation of a used corner's coordinate, pixels.
        covariance: (K, 6, 6) of the facets' motions, rotation first; zero at the anchor.
        camera_deviation: (7,) of the camera's numbers; zero where it was given.
    """

    bundle: Bundle
    residual: FloatArray
    used: BoolArray
    deviation: float
    covariance: FloatArray
    camera_deviation: FloatArray


def adjust(bundle: Bundle, corners: Corners) -> Adjusted:
    """Fit a bundle to corners, robustly; those that cannot be right are left out in the end."""
    for scale in _STEPS:
        bundle = _fit(bundle, corners, scale)
    residual = residuals(bundle, corners)
    used = np.ones(len(residual), np.bool_)
    # The usual error is that of the middle one, until nothing more is left out or comes back.
    for _ in range(5):
        size = np.sqrt((residual * residual).sum(axis=1))
        usual = max(float(np.median(size[used])) / 1.1774, _LEAST_SCALE)  # the median of Rayleigh's
        good = size <= _OUTLIER * usual
        if (good == used).all():
            break
        used = good
        bundle = _fit(bundle, corners.kept(used), None)
        residual = residuals(bundle, corners)
    else:
        bundle = _fit(bundle, corners.kept(used), None)
        residual = residuals(bundle, corners)
    return _told(bundle, corners, residual, used)


def residuals(bundle: Bundle, corners: Corners) -> FloatArray:
    """What the photos show less what they should (n, 2), pixels."""
    moved, _, _ = _moved(bundle.facets, bundle.middles, corners)
    seen, _, _ = _seen(bundle.photos, corners.photo, moved)
    pixels, _, _ = projected(bundle.camera, seen)
    result: FloatArray = corners.pixel - pixels
    return result


def _fit(bundle: Bundle, corners: Corners, scale: float | None) -> Bundle:
    """The bundle that fits best, with errors over `scale` pixels damped."""
    start = bundle.numbers
    dense = start.size <= _DENSE

    def errors(numbers: FloatArray) -> FloatArray:
        return residuals(bundle.with_numbers(numbers), corners).reshape(-1)

    def slopes(numbers: FloatArray) -> FloatArray | sparse.csr_matrix:
        matrix = _slopes(bundle.with_numbers(numbers), corners)
        return matrix.toarray() if dense else matrix

    found = least_squares(
        errors,
        start,
        jac=slopes,
        loss="linear" if scale is None else "soft_l1",
        f_scale=scale or 1.0,
        x_scale="jac",
        tr_solver="exact" if dense else "lsmr",
        xtol=_ENOUGH if scale is None else _ABOUT,
        ftol=_ENOUGH if scale is None else _ABOUT,
        gtol=None,
        max_nfev=100,
    )
    return bundle.with_numbers(found.x)


def _told(bundle: Bundle, corners: Corners, residual: FloatArray, used: BoolArray) -> Adjusted:
    """The bundle with how sure it is, from the curvature of the sum of squares at its least."""
    slopes = _slopes(bundle, corners.kept(used))
    freedom = max(2 * int(used.sum()) - slopes.shape[1], 1)
    squares = float((residual[used] ** 2).sum())
    deviation = float(np.sqrt(squares / freedom))
    normal = (slopes.T @ slopes).toarray()
    scale = 1 / np.sqrt(np.maximum(normal.diagonal(), 1e-300))
    covariance = np.linalg.pinv(normal * scale * scale[:, None], hermitian=True)
    covariance *= scale * scale[:, None] * deviation**2
    first = FREE if bundle.free else 0
    at = first + bundle.photos.size
    moving = [covariance[k : k + 6, k : k + 6] for k in range(at, covariance.shape[0], 6)]
    each = np.insert(np.array(moving).reshape(-1, 6, 6), bundle.anchor, 0.0, axis=0)
    camera = np.sqrt(np.maximum(covariance.diagonal()[:first], 0)) if bundle.free else np.zeros(FREE)
    return Adjusted(bundle, residual, used, deviation, each, camera)


def _slopes(bundle: Bundle, corners: Corners) -> sparse.csr_matrix:
    """Derivatives of all residuals (2n) by all that is sought."""
    moved, by_facet_turn, _ = _moved(bundle.facets, bundle.middles, corners)
    seen, by_photo_turn, turn = _seen(bundle.photos, corners.photo, moved)
    _, by_point, by_camera = projected(bundle.camera, seen)
    photo = np.concatenate((by_point @ by_photo_turn, by_point), axis=2)
    through = by_point @ turn
    facet = np.concatenate((through @ by_facet_turn, through), axis=2)
    first = FREE if bundle.free else 0
    at = first + bundle.photos.size
    column = corners.facet - (corners.facet > bundle.anchor)
    parts = [(photo, first + 6 * corners.photo), (facet, at + 6 * column)]
    if bundle.free:
        parts.append((by_camera, np.zeros(len(seen), np.int64)))
    rows, columns, values = [], [], []
    for block, begin in parts:
        width = block.shape[2]
        moves = np.ones(len(seen), np.bool_) if block is not facet else corners.facet != bundle.anchor
        values.append(-block[moves].reshape(-1))
        rows.append(np.repeat(2 * np.flatnonzero(moves)[:, None] + np.arange(2), width, axis=1).reshape(-1))
        columns.append(np.repeat(begin[moves][:, None] + np.arange(width), 2, axis=0).reshape(-1))
    shape = (2 * len(seen), at + bundle.facets.size - 6)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_matrix(entries, shape=shape)


def _moved(
    facets: FloatArray, middles: FloatArray, corners: Corners
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Corners (n, 3) on moved facets, their derivatives by the facets' turns (n, 3, 3), and the turns."""
    local = corners.world - middles[corners.facet]
    points, slopes, turns = _turned(facets[:, :3], corners.facet, local)
    return points + (middles + facets[:, 3:])[corners.facet], slopes, turns


def _seen(
    photos: FloatArray, photo: IntArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same for points before the lenses of their photos."""
    seen, slopes, turns = _turned(photos[:, :3], photo, points)
    return seen + photos[photo, 3:], slopes, turns


def _turned(
    vectors: FloatArray, row: IntArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (n, 3) turned by rotation vectors (m, 3), a row each; derivatives (n, 3, 3), matrices (n, 3, 3).

    d(R(w)x)/dw = −R [x]× J(w), J = 1 − (1 − cos θ)/θ² [w]× + (θ − sin θ)/θ³ [w]×² (Rodrigues).
    """
    turns = Rotation.from_rotvec(vectors).as_matrix()
    angle = np.sqrt((vectors * vectors).sum(axis=1))
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    skew = _skew(vectors)
    inner = np.eye(3) - first[:, None, None] * skew + second[:, None, None] * (skew @ skew)
    matrices = turns[row]
    slopes: FloatArray = -matrices @ _skew(points) @ inner[row]
    return (matrices @ points[..., None])[..., 0], slopes, matrices


def _skew(vectors: FloatArray) -> FloatArray:
    """Matrices (n, 3, 3) whose product with a vector is the cross product with these (n, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack((zero, -z, y, z, zero, -x, -y, x, zero), axis=1).reshape(-1, 3, 3)
