"""What an eye that is not where it is thought to be does to the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import FloatArray, dot, facet_from_world
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.viewer import Viewer

_MOST_VIEWERS = 500


@dataclass(frozen=True)
class PictureError:
    """How far things far behind the facets are from their right pixels.

    Things twice as far as the facet are off by half of it, those in its plane not at all.

    Attributes:
        noise: standard deviation of each coordinate of the eye, metres.
        pixels: root mean square over facets and frames.
        worst: the largest root mean square on a facet in a frame.
        facet: where that is, 1-based.
        frame: and when.
    """

    noise: float
    pixels: float
    worst: float
    facet: int
    frame: int


def picture_error(facets: Facets, viewers: Sequence[Viewer], noise: float) -> PictureError | None:
    """What noise of the eye does in the middles of the facets that face it; None where none does.

    A point p far away is drawn where its ray e + s·w, w = p − e, meets the facet's plane with normal n.
    An eye off by δ moves that place by (I − w nᵀ / (n·w)) δ, which the facet's pixels measure.

    Args:
        facets: the display.
        viewers: who looks, frame by frame.
        noise: standard deviation of each coordinate of the eye, metres.
    """
    middles = np.add.reduceat(facets.corners, facets.corner_start[:-1], axis=0)
    middles /= np.diff(facets.corner_start)[:, None]
    linear = facet_from_world(facets.origin, facets.du, facets.dv)[:, :2, :3]
    total, count, worst = 0.0, 0, (-1.0, 0, 0)
    for viewer in viewers[:: max(len(viewers) // _MOST_VIEWERS, 1)]:
        lit = np.flatnonzero(their_lit_facets(facets, viewer) & ~facets.curved)
        if not lit.size:
            continue
        squares = _squares(linear[lit], facets.normal[lit], middles[lit] - viewer.eye)
        total += float(squares.sum())
        count += lit.size
        most = int(np.argmax(squares))
        if squares[most] > worst[0]:
            worst = (float(squares[most]), int(lit[most]) + 1, viewer.frame)
    if not count:
        return None
    return PictureError(
        noise=noise,
        pixels=noise * float(np.sqrt(total / count)),
        worst=noise * float(np.sqrt(worst[0])),
        facet=worst[1],
        frame=worst[2],
    )


def _squares(linear: FloatArray, normal: FloatArray, way: FloatArray) -> FloatArray:
    """Mean square (F,) of the pixels that a unit of noise moves far things by."""
    slant = np.eye(3) - way[:, :, None] * normal[:, None, :] / dot(normal, way)[:, None, None]
    moved = linear @ slant
    return np.asarray((moved * moved).sum(axis=(1, 2)))
