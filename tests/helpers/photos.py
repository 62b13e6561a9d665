"""Photos of a display, ray by ray: a camera with distortion in front of facets that show a pattern."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from quiltcli.calibration.markers import MarkerSet, draw_markers
from quiltcli.calibration.panels.camera import Camera, projected
from quiltcli.calibration.panels.start import middles_of
from quiltcli.display import Facets


@dataclass(frozen=True)
class Pose:
    """Where a photo is taken from: before the lens x runs right, y down, z ahead."""

    eye: np.ndarray
    axes: np.ndarray

    @property
    def shift(self) -> np.ndarray:
        """What is added to turned points."""
        return -self.axes @ self.eye


def looking(eye: Sequence[float], at: Sequence[float], roll: float = 0.0) -> Pose:
    """A pose from an eye towards a point, with the world's Y up, then rolled by radians."""
    eye = np.asarray(eye, float)
    ahead = np.asarray(at, float) - eye
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right = right / np.linalg.norm(right)
    axes = np.stack((right, np.cross(ahead, right), ahead))
    return Pose(eye, Rotation.from_rotvec((0, 0, roll)).as_matrix() @ axes)


def camera(width: int = 1600, height: int = 1200, focal: float = 0.8) -> Camera:
    """A camera with a lens like those of phones: a little of everything."""
    terms = np.array((-0.09, 0.03, 0.0006, -0.0004, 0.0))
    return Camera(
        (width, height),
        np.repeat(focal * width, 2),
        np.array((width / 2 + 0.006 * width, height / 2 - 0.008 * height)),
        terms,
    )


def moved(facets: Facets, turns: np.ndarray, shifts: np.ndarray) -> Facets:
    """A display with facets turned by rotation vectors (F, 3) about their middles, and shifted (F, 3)."""
    matrices = Rotation.from_rotvec(turns).as_matrix()
    middles = middles_of(facets.corners, facets.corner_start)
    row = np.repeat(np.arange(facets.count), np.diff(facets.corner_start))

    def carried(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
        return (matrices[rows] @ points[..., None])[..., 0]

    every = np.arange(facets.count)
    return replace(
        facets,
        corners=carried(facets.corners - middles[row], row) + (middles + shifts)[row],
        origin=carried(facets.origin - middles, every) + middles + shifts,
        du=carried(facets.du, every),
        dv=carried(facets.dv, every),
        normal=carried(facets.normal, every),
    )


def photo(facets: Facets, markers: MarkerSet, lens: Camera, pose: Pose, finer: int = 2) -> np.ndarray:
    """A photo's grey values (H, W) uint8 of lit facets with markers, finer² rays a pixel."""
    width, height = lens.size
    x, y = np.meshgrid((np.arange(width * finer) + 0.5) / finer, (np.arange(height * finer) + 0.5) / finer)
    rays = _rays(lens, np.stack((x.ravel(), y.ravel()), axis=1)) @ pose.axes
    nearest = np.full(len(rays), np.inf)
    light = np.full(len(rays), 0.08)
    for row in range(facets.count):
        height_over = facets.normal[row] @ (pose.eye - facets.origin[row])
        if height_over <= 0:
            continue
        image = np.zeros((facets.size[row][1], facets.size[row][0], 3), np.float32)
        draw_markers(markers, row + 1, image)
        down = rays @ facets.normal[row]
        far = -height_over / np.where(np.abs(down) < 1e-12, 1e-12, down)
        local = pose.eye + far[:, None] * rays - facets.origin[row]
        u = local @ facets.du[row] / (facets.du[row] @ facets.du[row])
        v = local @ facets.dv[row] / (facets.dv[row] @ facets.dv[row])
        hit = (far > 0) & (far < nearest) & (u >= 0) & (v >= 0)
        hit &= (u < facets.size[row][0]) & (v < facets.size[row][1])
        nearest[hit] = far[hit]
        light[hit] = image[v[hit].astype(int), u[hit].astype(int), 0]
    light = light.reshape(height, finer, width, finer).mean(axis=(1, 3))
    return np.rint(255 * np.clip(0.06 + 0.86 * light, 0, 1)).astype(np.uint8)


def save(folder: Path, pictures: Sequence[np.ndarray]) -> list[Path]:
    """The photos as files, in a format that loses nothing."""
    paths = [folder / f"photo_{k:02}.png" for k in range(1, len(pictures) + 1)]
    for path, picture in zip(paths, pictures, strict=True):
        Image.fromarray(picture).save(path)
    return paths


def _rays(lens: Camera, pixels: np.ndarray) -> np.ndarray:
    """Directions before the lens, by Newton from where they would be without distortion."""
    flat = (pixels - lens.centre) / lens.focal
    for _ in range(3):
        points = np.column_stack((flat, np.ones(len(flat))))
        seen, slopes, _ = projected(lens, points)
        (a, b), (c, d) = slopes[:, 0, :2].T, slopes[:, 1, :2].T
        x, y = (pixels - seen).T
        flat = flat + np.column_stack((d * x - b * y, a * y - c * x)) / (a * d - b * c)[:, None]
    return np.column_stack((flat, np.ones(len(flat))))
