"""Convex polygons cut by planes, all at once."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray


def cut_polygons(polygons: FloatArray, counts: IntArray, side: FloatArray) -> tuple[FloatArray, IntArray]:
    """Cut away from convex polygons what lies on the outer side of one plane each.

    The way of Sutherland & Hodgman.

    Args:
        polygons: (N, n, 3); short ones may hold anything after their last corner.
        counts: (N,) corners.
        side: (N, n) how far each corner lies on the inner side; 0 or less is cut away.

    Returns:
        polygons (N, m, 3), short ones repeating their last corner, and their corner counts (N,);
        fewer than three corners are none.
    """
    ahead_of = np.roll(np.arange(polygons.shape[1]), -1)
    valid = np.arange(polygons.shape[1]) < counts[:, None]
    ahead = np.where(np.arange(polygons.shape[1]) == counts[:, None] - 1, 0, ahead_of)
    next_side = np.take_along_axis(side, ahead, axis=1)
    crosses = valid & ((side > 0) != (next_side > 0))
    share = np.divide(side, side - next_side, out=np.zeros_like(side), where=crosses)[..., None]
    cut = polygons + share * (np.take_along_axis(polygons, ahead[..., None], axis=1) - polygons)
    points = np.stack((polygons, cut), axis=2).reshape(len(polygons), -1, 3)
    kept = np.stack((valid & (side > 0), crosses), axis=2).reshape(len(polygons), -1)
    left = kept.sum(axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")
    width = max(int(left.max(initial=1)), 1)
    rank = np.minimum(np.arange(width), np.maximum(left - 1, 0)[:, None])
    result = np.take_along_axis(points, np.take_along_axis(order, rank, axis=1)[..., None], axis=1)
    return result, np.where(left >= 3, left, 0)
