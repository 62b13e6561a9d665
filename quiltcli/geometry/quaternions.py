"""Rotations as unit quaternions x, y, z, w on the last axis of arrays; they turn local into world.

Formulas are those of K. Shoemake, Animating Rotation with Quaternion Curves, SIGGRAPH 1985, with the
products of Hamilton.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, cross, dot

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
_TINY = 1e-12


def unit(q: FloatArray) -> FloatArray:
    """Quaternions (..., 4) of length 1; not a number where the length is nothing."""
    length = np.sqrt((q * q).sum(axis=-1, keepdims=True))
    return np.asarray(np.divide(q, length, out=np.full_like(q, np.nan), where=length > _TINY))


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """The rotation (..., 4) that turns by `b`, then by `a`."""
    va, vb, wa, wb = a[..., :3], b[..., :3], a[..., 3:], b[..., 3:]
    va, vb = np.broadcast_arrays(va, vb)
    vector = wa * vb + wb * va + cross(va, vb)
    return np.concatenate((vector, wa * wb - dot(va, vb)[..., None]), axis=-1)


def inverse(q: FloatArray) -> FloatArray:
    """The rotations (..., 4) that undo unit quaternions."""
    return np.asarray(q * np.array([-1.0, -1.0, -1.0, 1.0]))


def rotated(q: FloatArray, v: FloatArray) -> FloatArray:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    axis, v = np.broadcast_arrays(q[..., :3], v)
    t = 2 * cross(axis, v)
    return np.asarray(v + q[..., 3:] * t + cross(axis, t))


def logarithm(q: FloatArray) -> FloatArray:
    """Rotation vectors (..., 3), axis times angle in radians, of the shorter way round."""
    q = np.where(q[..., 3:] < 0, -q, q)
    length = np.sqrt(dot(q[..., :3], q[..., :3]))[..., None]
    angle = 2 * np.arctan2(length, q[..., 3:])
    # Near no turn at all, angle / length tends to 2 / w.
    ratio = np.divide(angle, length, out=2 / np.maximum(q[..., 3:], 0.5), where=length > _TINY)
    return np.asarray(q[..., :3] * ratio)


def exponential(v: FloatArray) -> FloatArray:
    """Unit quaternions (..., 4) of rotation vectors (..., 3)."""
    half = np.sqrt(dot(v, v))[..., None] / 2
    # sin(half) / (2 half); np.sinc has π inside.
    return np.concatenate((v * np.sinc(half / np.pi) / 2, np.cos(half)), axis=-1)


def slerp(a: FloatArray, b: FloatArray, share: FloatArray | float) -> FloatArray:
    """Rotations a share (...) of the shorter way from `a` to `b` (..., 4)."""
    way = logarithm(product(inverse(a), b))
    return product(a, exponential(way * np.asarray(share)[..., None]))


def continuous(q: FloatArray) -> FloatArray:
    """The same rotations (N, 4), with signs such that neighbours lie on one side."""
    flips = np.where((q[1:] * q[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    return q * np.concatenate(([1.0], np.cumprod(flips)))[:, None]


def from_euler(angles: FloatArray, order: str) -> FloatArray:
    """Rotations (..., 4) by three angles (..., 3) in radians, given in the order of the letters.

    Args:
        angles: one about each axis of `order`, first to last.
        order: fixed axes that are turned about, first to last: `xyz` is Rz·Ry·Rx. The same angles
            about axes that turn along are those of the order reversed.
    """
    result = np.broadcast_to(IDENTITY, (*angles.shape[:-1], 4))
    for place, name in enumerate(order):
        vector = np.zeros_like(angles)
        vector[..., "xyz".index(name)] = angles[..., place]
        result = product(exponential(vector), result)
    return result


def from_matrices(m: FloatArray) -> FloatArray:
    """Rotations (..., 4) of orthogonal matrices (..., 3, 3) by the largest of the four components.

    S. W. Shepperd, Quaternion from rotation matrix, Journal of Guidance and Control, 1978.
    """
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    xy, xz, yz = m[..., 1, 0] + m[..., 0, 1], m[..., 2, 0] + m[..., 0, 2], m[..., 2, 1] + m[..., 1, 2]
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    rows = np.stack(
        [
            np.stack((1 + xx - yy - zz, xy, xz, wx), axis=-1),
            np.stack((xy, 1 - xx + yy - zz, yz, wy), axis=-1),
            np.stack((xz, yz, 1 - xx - yy + zz, wz), axis=-1),
            np.stack((wx, wy, wz, 1 + xx + yy + zz), axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    return unit(np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :])


def matrices(q: FloatArray) -> FloatArray:
    """Matrices (..., 3, 3) of unit quaternions (..., 4)."""
    return np.stack([rotated(q, axis) for axis in np.eye(3)], axis=-1)
