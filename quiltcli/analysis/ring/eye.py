"""What an eye or a camera sees of the spinning mirror: integration over mirror positions.

A ray of the camera meets the mirror at M while it stands at θ. Light that comes from P′ goes on in the plane
of P′ and M, spread to the sides by the diffuser's lobe: it reaches the eye as far as that plane leads there.
The sum over all positions, divided by the sum of the weights, is what is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, cross, dot, normalized
from quiltcli.ring.curve import wrapped
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.rig import Pose, Rig
from quiltcli.ring.seen import half_turn

_SHOWS = 0.5


@dataclass(frozen=True)
class Camera:
    """A pinhole camera that looks at the mirror's middle.

    Attributes:
        eye: (3,) world metres.
        along: (H, W, 3) unit directions of the pixels.
        right: (3,) unit vector to the right.
        up: (3,) unit vector upward.
        look: (3,) unit vector to the middle.
    """

    eye: FloatArray
    along: FloatArray
    right: FloatArray
    up: FloatArray
    look: FloatArray

    def sheared(self, eye: FloatArray, focus: float) -> Camera:
        """The camera at another place of an aperture: rays meet where they did at a distance `focus`."""
        depth = focus / dot(self.along, self.look)
        points = self.eye + depth[..., None] * self.along
        return Camera(eye, normalized(points - eye), self.right, self.up, self.look)


@dataclass(frozen=True)
class Image:
    """What a side of the mirror shows at an angle.

    Attributes:
        values: (H, W, C) linear light.
        lit: (H, W) pixels that light the mirror.
    """

    values: FloatArray
    lit: BoolArray


@dataclass(frozen=True)
class Seen:
    """A picture of the display.

    Attributes:
        light: (H, W, C) weighted means.
        weight: (H, W) sums of the weights, over those of one position in full view.
        positions: numbers of the mirror positions of which some of the picture gets more than half.
        images: (H, W) how many positions are mixed in a pixel.
    """

    light: FloatArray
    weight: FloatArray
    positions: tuple[int, ...]
    images: FloatArray


def camera_at(eye: FloatArray, radius: float, size: tuple[int, int]) -> Camera:
    """A camera that holds a ball of a radius about the world's origin.

    Args:
        eye: (3,) world metres.
        radius: metres.
        size: width and height, pixels.
    """
    look = normalized(-eye)
    right = normalized(cross(look, np.array([0.0, 1.0, 0.0])))
    up = cross(right, look)
    distance = float(np.sqrt(dot(eye, eye)))
    half = radius / np.sqrt(distance**2 - radius**2) if distance > radius else 1.0
    width, height = size
    scale = half / (min(width, height) / 2)
    x = (np.arange(width) + 0.5 - width / 2) * scale
    y = (height / 2 - np.arange(height) - 0.5) * scale
    along = look + x[None, :, None] * right + y[:, None, None] * up
    return Camera(eye, normalized(along), right, up, look)


def positions_seen(rig: Rig, eye: FloatArray) -> Iterator[int]:
    """Mirror positions, from 0, that may light some of the mirror for an eye, and their neighbours."""
    azimuth, distance = np.arctan2(eye[2], eye[0]), float(np.hypot(eye[0], eye[2]))
    most = half_turn(rig, distance) + rig.lobe + 2 * abs(rig.step)
    for position in range(rig.positions):
        for side in rig.sides:
            apart = wrapped(rig.angle(position) + side.azimuth - azimuth)
            if abs(float(apart)) <= most:
                yield position
                break


def look(
    rig: Rig,
    camera: Camera,
    image_of: Callable[[int, int], Image],
    *,
    sub: int = 1,
    photometric: bool = False,
    nearest: bool = False,
) -> Seen:
    """What a camera sees.

    Args:
        rig: projector and mirror.
        camera: the camera.
        image_of: what is shown at a position, from 0, on a side.
        sub: angles of the mirror within the exposure of each picture.
        photometric: do not divide by the weights: what is seen through gaps is dark.
        nearest: take the nearest pixel, not the mean of four.
    """
    shape = camera.along.shape[:2]
    total, weight = None, np.zeros(shape)
    images = np.zeros(shape)
    used = []
    for position in positions_seen(rig, camera.eye):
        touched, most = np.zeros(shape, dtype=np.bool_), 0.0
        for side in range(len(rig.sides)):
            image = None
            for part in range(sub):
                turn = rig.angle(position) + rig.step * ((part + 0.5) / sub - 0.5)
                pose = rig.at(turn, side)
                x, y, share = light_path(rig, pose, camera)
                rows = np.nonzero(share > 0)
                if not rows[0].size:
                    continue
                lit_now = lit_pixels(rig, pose)
                inside = _inside(lit_now, x[rows], y[rows])
                rows = (rows[0][inside], rows[1][inside])
                if not rows[0].size:
                    continue
                if image is None:
                    image = image_of(position, side)
                values = _sampled(image, x[rows], y[rows], nearest)
                if total is None:
                    total = np.zeros((*shape, image.values.shape[2]))
                total[rows] += share[rows][:, None] * values
                weight[rows] += share[rows]
                touched[rows] = True
                most = max(most, float(share[rows].max()))
        images += touched
        if most > _SHOWS:
            used.append(position)
    if total is None:
        total = np.zeros((*shape, 1))
    weight /= sub
    total /= sub
    if not photometric:
        total = np.divide(total, weight[..., None], out=total, where=weight[..., None] > 0)
    return Seen(total, weight, tuple(used), images)


def light_path(rig: Rig, pose: Pose, camera: Camera) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Pixels x, y (H, W) whose light a camera's rays meet on a mirror, and how much of it reaches the eye."""
    eye = pose.from_world(camera.eye)
    along = camera.along @ pose.axes.T
    slope = pose.slope
    towards = along[..., 0] * slope[0] + along[..., 2] * slope[2]
    away = pose.lift - (eye[0] * slope[0] + eye[2] * slope[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        t = away / towards
        mirror = eye + t[..., None] * along
        h = mirror @ pose.pixel_from_ray.T
        x, y = h[..., 0] / h[..., 2], h[..., 1] / h[..., 2]
        off = turned_aside(pose, eye, mirror)
    share = np.maximum(1 - np.abs(off) / rig.lobe, 0)
    share[~((towards < 0) & (t > 0) & (mirror[..., 0] > 0))] = 0
    return x, y, share


def turned_aside(pose: Pose, eye: FloatArray, mirror: FloatArray) -> FloatArray:
    """Angle (...) between where light from P′ goes on behind points M (..., 3) and the eye (3,), sideways."""
    out = eye - mirror
    if pose.cone:
        length_out, length_in = np.sqrt(dot(out, out)), np.sqrt(dot(mirror, mirror))
        return np.asarray(np.arcsin(out[..., 1] / length_out) - np.arcsin(mirror[..., 1] / length_in))
    across = mirror[..., 0] * out[..., 1] - mirror[..., 1] * out[..., 0]
    return np.asarray(np.arctan2(across, mirror[..., 0] * out[..., 0] + mirror[..., 1] * out[..., 1]))


def _inside(lit: BoolArray, x: FloatArray, y: FloatArray) -> BoolArray:
    """Which places (N,) lie in lit pixels."""
    height, width = lit.shape
    column, row = np.floor(x), np.floor(y)
    found: BoolArray = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    found[found] = lit[row[found].astype(np.int64), column[found].astype(np.int64)]
    return found


def _sampled(image: Image, x: FloatArray, y: FloatArray, nearest: bool) -> FloatArray:
    """Values (N, C) at places; between pixels the mean of four, of those that are lit."""
    height, width = image.lit.shape
    if nearest:
        column, row = (
            np.clip(np.floor(part), 0, size - 1).astype(np.int64) for part, size in ((x, width), (y, height))
        )
        return np.asarray(image.values[row, column], dtype=np.float64)
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    fx, fy = x - 0.5 - left, y - 0.5 - top
    total = np.zeros((x.size, image.values.shape[2]))
    weight = np.zeros(x.size)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column = np.clip(left + dx, 0, width - 1).astype(np.int64)
        row = np.clip(top + dy, 0, height - 1).astype(np.int64)
        share = (fx if dx else 1 - fx) * (fy if dy else 1 - fy) * image.lit[row, column]
        total += share[:, None] * image.values[row, column]
        weight += share
    return np.divide(total, weight[:, None], out=total, where=weight[:, None] > 0)


def best_angle(rig: Rig, eye: FloatArray, along: FloatArray, side: int = 0) -> FloatArray:
    """The mirror angles (N,) at which a single ray each (N, 3) is served best, by secants.

    For a projector on the axis and a plane through it it is ψ − asin(q / p), of the ray's azimuth ψ back to
    the eye and its signed distance q from the axis (the start of the search).
    """
    back = -along
    psi = np.arctan2(back[:, 2], back[:, 0])
    q = eye[0] * -np.sin(psi) + eye[2] * np.cos(psi)
    pose = rig.at(0.0, side)
    reach = float(np.hypot(pose.origin[0], pose.origin[1]))
    before = psi - np.arcsin(np.clip(q / reach, -1, 1))
    now = before + 1e-5
    value, here = (_off(rig, angle, eye, along, side) for angle in (before, now))
    for _ in range(12):
        rise = here - value
        step = np.divide(here * (now - before), rise, out=np.zeros_like(rise), where=rise != 0)
        before, value, now = now, here, now - step
        here = _off(rig, now, eye, along, side)
    return np.asarray(now)


def _off(rig: Rig, angles: FloatArray, eye: FloatArray, along: FloatArray, side: int) -> FloatArray:
    """`turned_aside` of rays (N, 3), each with the mirror at an angle of its own."""
    found = np.empty(angles.size)
    for k, angle in enumerate(angles):
        pose = rig.at(float(angle) - rig.sides[side].azimuth, side)
        mirror = on_plane(pose, pose.from_world(eye), pose.axes @ along[k])
        found[k] = turned_aside(pose, pose.from_world(eye), mirror)
    return found


def on_plane(pose: Pose, eye: FloatArray, along: FloatArray) -> FloatArray:
    """Where a ray (3,) of the frame meets the mirror's plane."""
    slope = pose.slope
    away = pose.lift - (eye[0] * slope[0] + eye[2] * slope[2])
    return np.asarray(eye + away / (along[0] * slope[0] + along[2] * slope[2]) * along)
