"""A photo's camera: points in front of it to pixels, and how these change with all that is sought.

Brown's model as OpenCV has it: with x = X/Z, y = Y/Z and r² = x² + y², a point is seen at
x(1 + k₁r² + k₂r⁴ + k₃r⁶) + 2p₁xy + p₂(r² + 2x²), the same for y, times the focal length, plus the middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.formats.whole import write_text
from quiltcli.geometry import FloatArray
from quiltcli.job.camera import CameraFile

FREE = 7
"""Numbers of a camera that are sought where it is not known: f, cx, cy, k₁, k₂, p₁, p₂."""


@dataclass(frozen=True)
class Camera:
    """A camera.

    Attributes:
        size: width and height of its photos, pixels.
        focal: (2,) pixels.
        centre: (2,) pixels from the top-left corner.
        distortion: (5,) k₁, k₂, p₁, p₂, k₃.
    """

    size: tuple[int, int]
    focal: FloatArray
    centre: FloatArray
    distortion: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """OpenCV's camera matrix (3, 3), whose pixels are counted from the first one's middle."""
        (fx, fy), (cx, cy) = self.focal, self.centre - 0.5
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])

    @property
    def numbers(self) -> FloatArray:
        """What is sought of it (7,)."""
        return np.concatenate((self.focal[:1], self.centre, self.distortion[:4]))

    def with_numbers(self, numbers: FloatArray) -> Camera:
        """The camera with other numbers (7,), and square pixels."""
        focal, distortion = np.repeat(numbers[:1], 2), np.append(numbers[3:], self.distortion[4])
        return Camera(self.size, focal, numbers[1:3].copy(), distortion)


def camera_of(spec: CameraFile) -> Camera:
    """The camera of a file."""
    focal, centre, distortion = (np.array(row, float) for row in (spec.focal, spec.centre, spec.distortion))
    return Camera(spec.size, focal, centre, distortion)


def write_camera(path: Path, camera: Camera) -> None:
    """Write a camera file (OutputError)."""
    rows = {"focal": camera.focal, "centre": camera.centre, "distortion": camera.distortion}
    lines = [f"{name}: [{', '.join(f'{value:.9g}' for value in row)}]" for name, row in rows.items()]
    width, height = camera.size
    write_text(path, "\n".join(("quilt_camera: 1", f"size: [{width}, {height}]", *lines)) + "\n")


def project(camera: Camera, points: FloatArray) -> FloatArray:
    """Pixels (n, 2), from the photo's top-left corner, of points (n, 3) in front of the camera."""
    return projected(camera, points)[0]


def projected(camera: Camera, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Pixels (n, 2), and their derivatives by the points (n, 2, 3) and by what is sought (n, 2, 7)."""
    depth = points[:, 2]
    depth = np.where(np.abs(depth) < 1e-9, 1e-9, depth)
    x, y = points[:, 0] / depth, points[:, 1] / depth
    k1, k2, p1, p2, k3 = camera.distortion
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2 * k2 + 3 * r2 * k3)  # of the radial factor, by r²
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    # By x and y.
    cross = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
    across = np.stack((radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x, cross), axis=1)
    down = np.stack((cross, radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x), axis=1)
    flat = np.stack((across, down), axis=1) * camera.focal[:, None]
    # By X, Y and Z: x and y fall with the depth.
    by_points = np.empty((len(points), 2, 3))
    by_points[:, :, :2] = flat / depth[:, None, None]
    by_points[:, :, 2] = -(flat[:, :, 0] * x[:, None] + flat[:, :, 1] * y[:, None]) / depth[:, None]
    seen = np.stack((u, v), axis=1)
    by_camera = np.zeros((len(points), 2, FREE))
    by_camera[:, :, 0] = seen
    by_camera[:, 0, 1] = by_camera[:, 1, 2] = 1
    fx, fy = camera.focal
    terms = np.stack((r2, r2 * r2), axis=1)
    by_camera[:, 0, 3:5], by_camera[:, 1, 3:5] = fx * x[:, None] * terms, fy * y[:, None] * terms
    by_camera[:, 0, 5], by_camera[:, 0, 6] = fx * 2 * x * y, fx * (r2 + 2 * x * x)
    by_camera[:, 1, 5], by_camera[:, 1, 6] = fy * (r2 + 2 * y * y), fy * 2 * x * y
    return seen * camera.focal + camera.centre, by_points, by_camera
