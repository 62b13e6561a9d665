"""From the light of a mirror position to tones: how much of the time each pixel is on.

A mirror chip's mean over time is linear, and so are tones. A single mirror shows luminance; the planes of a
tent with filters of their own show the nearest mixture of these; three chips show red, green and blue.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.halftone.light import dwell, expose, luminance, mixed, white_gain
from quiltcli.job.halftone import HalftoneSpec
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.picture import Picture
from quiltcli.ring.rig import Pose, Rig


@dataclass(frozen=True)
class Tones:
    """What a position's picture of one bit is made of.

    Attributes:
        values: (C, H, W) float16, 0 to 1, 0 where nothing is lit; an image for each of the rig's streams.
        inside: (H, W) pixels that light the mirror.
        clipped: share of these that were brighter than white, in the stream that has the most.
    """

    values: NDArray[np.float16]
    inside: BoolArray
    clipped: float


def tones_of(rig: Rig, pictures: Sequence[Picture], spec: HalftoneSpec, shortest: float = 1.0) -> Tones:
    """The tones of one mirror position.

    Args:
        rig: projector and mirror.
        pictures: of all its sides.
        spec: exposure, and whether dwelling is made up for.
        shortest: `shortest_dwell` of the rig, where it is.
    """
    filters = np.array([side.filter for side in rig.sides])
    plain = bool((filters == filters[0]).all())
    shape = (rig.size[1], rig.size[0])
    values, inside = np.zeros((len(rig.streams), *shape), dtype=np.float32), np.zeros(shape, dtype=np.bool_)
    for number, picture in enumerate(pictures):
        rgb = picture.rgb()
        if len(rig.streams) > 1:
            np.copyto(values, np.moveaxis(rgb, -1, 0), where=picture.lit)
        elif plain:
            np.copyto(values[0], luminance(rgb), where=picture.lit)
        else:
            shares = mixed(rgb[picture.lit], filters)[:, number]
            values[0, picture.lit] = shares * np.float32(white_gain(filters))
        inside |= picture.lit
    time, exposure = None, spec.exposure
    if spec.compensate == "dwell":
        time = np.ones(shape)
        for picture in pictures:
            time[picture.lit] = dwell_times(picture.pose, picture.lit)
        # As the whole turn has it, so that a position does not depend on which others are drawn.
        exposure *= shortest / float(time[inside].min(initial=np.inf))
    found = expose(values, inside, exposure, time)
    return Tones(found.tones.astype(np.float16), inside, float(found.clipped.max()))


def dwell_times(pose: Pose, lit: BoolArray) -> FloatArray:
    """How long lit pixels (N,) dwell on a viewer, relative to the middle's, as for an ideal projector."""
    row, column = np.nonzero(lit)
    inverse = np.linalg.inv(pose.projector[:, :3])
    ray = [part[0] * (column + 0.5) + part[1] * (row + 0.5) + part[2] for part in inverse]
    e, f, _ = pose.axes
    along = (e[0] * ray[0] + e[2] * ray[2]) / -ray[1]
    across = (f[0] * ray[0] + f[2] * ray[2]) / -ray[1]
    return dwell(along, across)


def shortest_dwell(rig: Rig) -> float:
    """The least of `dwell_times` over four angles of the mirror; what is beyond is cut at white."""
    least = np.inf
    for quarter in range(4):
        for side in range(len(rig.sides)):
            pose = rig.at(quarter * np.pi / 2, side)
            lit = lit_pixels(rig, pose)
            least = min(least, float(dwell_times(pose, lit).min(initial=np.inf)))
    return least
