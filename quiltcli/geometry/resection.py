"""A projector or camera from points of the world and where they appear in its image.

First the direct linear transformation (Abdel-Aziz and Karara, 1971), normalized as Hartley proposes (*In
defense of the eight-point algorithm*, 1997); then least squares of the distances in the image by the method
of Levenberg and Marquardt. Hartley and Zisserman, *Multiple View Geometry* (2nd edition), chapter 7.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.geometry.quaternions import exponential, matrices

UNKNOWNS = 9
"""Focal length, centre (2), rotation (3) and position (3)."""
DETERMINED = 1e-6
"""Below this share of the largest, a singular value says that something is left open."""
_STEPS = 300


@dataclass(frozen=True)
class Pinhole:
    """A projector or camera with square pixels.

    Attributes:
        focal: focal length, pixels.
        centre: (2,) where the axis meets the image, pixels.
        rotation: (3, 3) rows are the image's x, its y and the axis ahead, a proper rotation.
        position: (3,) world metres.
        mirrored: whether the image is mirrored left to right.
    """

    focal: float
    centre: FloatArray
    rotation: FloatArray
    position: FloatArray
    mirrored: bool = False

    @property
    def intrinsics(self) -> FloatArray:
        """K (3, 3): the image from directions; its first number is negative where the image is mirrored."""
        across = -self.focal if self.mirrored else self.focal
        return np.array([[across, 0, self.centre[0]], [0, self.focal, self.centre[1]], [0, 0, 1]])

    @property
    def matrix(self) -> FloatArray:
        """K R [1 | −P] (3, 4): homogeneous pixels from the world; the third number is the depth in metres."""
        turned = self.intrinsics @ self.rotation
        return np.hstack((turned, -(turned @ self.position)[:, None]))

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (N, 2) of points (N, 3); NaN for those that are not ahead."""
        seen = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(seen[:, 2:] > 0, seen[:, :2] / seen[:, 2:], np.nan)


def dlt(points: FloatArray, pixels: FloatArray) -> tuple[FloatArray, float]:
    """The matrix (3, 4) that maps points to pixels with the least algebraic error.

    Args:
        points: (N, 3), six at least.
        pixels: (N, 2).

    Returns:
        The matrix, whose scale means nothing, and how well it is determined: the second smallest singular
        value over the largest, which is 0 for points in a plane.
    """
    world, image = _normalizing(points), _normalizing(pixels)
    x, u = _homogeneous(points) @ world.T, _homogeneous(pixels) @ image.T
    zero = np.zeros_like(x)
    rows = np.vstack((np.hstack((x, zero, -u[:, :1] * x)), np.hstack((zero, x, -u[:, 1:2] * x))))
    _, singular, axes = np.linalg.svd(rows)
    matrix = np.linalg.inv(image) @ axes[-1].reshape(3, 4) @ world
    return matrix, float(singular[-2] / singular[0])


def lie_in_plane(points: FloatArray) -> bool:
    """Whether points (N, 3) lie in a plane, which leaves a projector open that lights them."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[2] < DETERMINED * spread[0])


def resected(points: FloatArray, pixels: FloatArray) -> Refined | None:
    """The pinhole that fits points and pixels best, wherever they are; None where several do.

    Args:
        points: (N, 3), six at least, not all in a plane.
        pixels: (N, 2).
    """
    middle = points.mean(axis=0)
    direct, determined = dlt(points - middle, pixels)
    if determined < DETERMINED:
        return None
    # `decomposed` takes what is ahead from the origin, which lies among the points.
    start = decomposed(direct)[1]
    start = replace(start, position=start.position + middle)
    return refine(start, points, pixels, np.ones(UNKNOWNS, dtype=np.bool_))


def decomposed(matrix: FloatArray) -> tuple[FloatArray, Pinhole]:
    """The intrinsics (3, 3) of a matrix (3, 4), and the pinhole with square pixels nearest to it.

    Whether the image is mirrored follows from the matrix if one knows on which side of the projector the
    points are: the origin of the world lies ahead.
    """
    if matrix[2, 3] < 0:
        matrix = -matrix
    flip = np.eye(3)[::-1]
    # RQ from QR: turned upside down and transposed, an upper triangle is one again.
    q, r = np.linalg.qr((flip @ matrix[:, :3]).T)
    intrinsics, rotation = flip @ r.T @ flip, flip @ q.T
    signs = np.sign(np.diag(intrinsics))
    intrinsics, rotation = intrinsics * signs, rotation * signs[:, None]
    intrinsics /= intrinsics[2, 2]
    position = np.asarray(-np.linalg.solve(matrix[:, :3], matrix[:, 3]), dtype=np.float64)
    mirrored = bool(np.linalg.det(rotation) < 0)
    if mirrored:
        rotation = rotation * np.array([[-1.0], [1.0], [1.0]])
        intrinsics = intrinsics * np.array([-1.0, 1.0, 1.0])
    focal = float((abs(intrinsics[0, 0]) + intrinsics[1, 1]) / 2)
    return intrinsics, Pinhole(focal, intrinsics[:2, 2].copy(), rotation, position, mirrored)


@dataclass(frozen=True)
class Refined:
    """A pinhole that fits best.

    Attributes:
        pinhole: the projector or camera.
        errors: (N, 2) by how much points appear elsewhere than where they were seen, pixels.
        deviation: (9,) standard deviations of focal length and centre (pixels), rotation (radians) and
            position (metres), from the errors and how much they say; 0 for what was fixed.
    """

    pinhole: Pinhole
    errors: FloatArray
    deviation: FloatArray


def refine(start: Pinhole, points: FloatArray, pixels: FloatArray, free: BoolArray) -> Refined:
    """The pinhole with the least sum of squared distances in the image.

    Args:
        start: where to begin; what is fixed stays as it is here.
        points: (N, 3).
        pixels: (N, 2) where they were seen.
        free: (9,) whether focal length, centre x, y, rotation (3) and position (3) may change.
    """
    best, damping = start, 1e-3
    cost = _cost(best, points, pixels)
    for _ in range(_STEPS):
        slopes, errors = _linear(best, points, pixels, free)
        weights = np.linalg.norm(slopes, axis=0) + 1e-300
        rows = np.vstack((slopes, np.diag(np.sqrt(damping) * weights)))
        step = np.zeros(UNKNOWNS)
        wanted = np.concatenate((-errors, np.zeros(len(weights))))
        step[free] = np.linalg.lstsq(rows / weights, wanted, rcond=None)[0] / weights
        moved = _moved(best, step)
        found = _cost(moved, points, pixels)
        if found < cost:
            best, cost, damping = moved, found, damping / 10
        else:
            damping *= 10
        if damping > 1e12 or cost == 0:
            break
    slopes, errors = _linear(best, points, pixels, free)
    return Refined(best, errors.reshape(-1, 2), _deviation(slopes, errors, free))


def _deviation(slopes: FloatArray, errors: FloatArray, free: BoolArray) -> FloatArray:
    spare = len(errors) - int(free.sum())
    variance = float(errors @ errors) / spare if spare > 0 else 0.0
    deviation = np.zeros(UNKNOWNS)
    weights = np.linalg.norm(slopes, axis=0)  # pixels a metre and a pixel are far apart
    spread = np.linalg.pinv(slopes / weights)
    deviation[free] = np.sqrt(np.sum(spread**2, axis=1) * variance) / weights
    return deviation


def _moved(pinhole: Pinhole, step: FloatArray) -> Pinhole:
    turn = matrices(exponential(step[None, 3:6]))[0]
    return replace(
        pinhole,
        focal=float(pinhole.focal + step[0]),
        centre=pinhole.centre + step[1:3],
        rotation=turn @ pinhole.rotation,
        position=pinhole.position + step[6:],
    )


def _cost(pinhole: Pinhole, points: FloatArray, pixels: FloatArray) -> float:
    """Sum of squared errors; infinite where a point is not ahead."""
    errors = pinhole.project(points) - pixels
    total = float(np.sum(errors * errors))
    return total if np.isfinite(total) and pinhole.focal > 0 else np.inf


def _linear(
    pinhole: Pinhole, points: FloatArray, pixels: FloatArray, free: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Slopes (2N, free ones) and values (2N,) of the errors."""
    q = (points - pinhole.position) @ pinhole.rotation.T
    x, y, z = q.T
    sign = -1.0 if pinhole.mirrored else 1.0
    # What a step of the point in the frame of the image does to its pixel: (N, 2, 3).
    steps = np.zeros((len(points), 2, 3))
    steps[:, 0, 0] = sign * pinhole.focal / z
    steps[:, 0, 2] = -sign * pinhole.focal * x / z**2
    steps[:, 1, 1] = pinhole.focal / z
    steps[:, 1, 2] = -pinhole.focal * y / z**2
    slopes = np.zeros((len(points), 2, UNKNOWNS))
    slopes[:, 0, 0], slopes[:, 1, 0] = sign * x / z, y / z
    slopes[:, 0, 1] = slopes[:, 1, 2] = 1
    turning = np.zeros((len(points), 3, 3))  # columns e_k × q
    turning[:, 0, 1], turning[:, 0, 2] = z, -y
    turning[:, 1, 0], turning[:, 1, 2] = -z, x
    turning[:, 2, 0], turning[:, 2, 1] = y, -x
    slopes[:, :, 3:6] = steps @ turning
    slopes[:, :, 6:] = -steps @ pinhole.rotation
    errors = pinhole.project(points) - pixels
    return slopes[..., free].reshape(2 * len(points), -1), errors.ravel()


def _normalizing(points: FloatArray) -> FloatArray:
    """The map that moves the mean of points (N, d) to 0 and makes their rms distance from it √d."""
    size = points.shape[1]
    mean = points.mean(axis=0)
    spread = np.sqrt(np.mean((points - mean) ** 2))
    matrix = np.eye(size + 1)
    matrix[:size, :size] /= spread or 1.0
    matrix[:size, size] = -mean / (spread or 1.0)
    return matrix


def _homogeneous(points: FloatArray) -> FloatArray:
    return np.hstack((points, np.ones((len(points), 1))))
