"""A light field on a display with a spinning mirror: the light of the rays that its pixels show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.halftone import halftone
from quiltcli.halftone.light import expose, luminance
from quiltcli.job.halftone import HalftoneSpec
from quiltcli.lightfield import Field, Rays, rebin
from quiltcli.lightfield.pictures import Pictures, read_picture
from quiltcli.ring.curve import Curve
from quiltcli.ring.maps import backward
from quiltcli.ring.rig import Pose


def rays_of(pose: Pose, curve: Curve, x: FloatArray, y: FloatArray) -> Rays:
    """The rays that pixels (P,) of one side of the mirror show, in the world."""
    shown = backward(pose, curve, x, y)
    served = curve.points(np.array(pose.angle))
    viewer, mirror = (_in_world(pose, places) for places in (shown.viewer, shown.mirror))
    return Rays(viewer, mirror, served)


def as_bits(field: Field, spec: HalftoneSpec, colours: bool) -> Field:
    """The light field with photographs that are on or off, each halftoned by itself, whose pixels are copied.

    As Jones et al. (2007), section 6, rearrange pictures that are dithered already.

    Args:
        field: the light field.
        spec: how tones become bits, and their exposure.
        colours: whether red, green and blue are bits of their own; else luminance is.
    """

    def read(path: Path) -> Float32Array:
        values = read_picture(path)
        light = field.curve.take(values) if values.dtype == np.uint8 else values
        tones = np.moveaxis(light, -1, 0) if colours else luminance(light)[None]
        inside = np.ones(tones.shape, dtype=np.bool_)
        exposed = expose(np.ascontiguousarray(tones), inside, spec.exposure)
        bits = np.stack([halftone(one[None], inside[:1], spec)[0] for one in exposed.tones], axis=-1)
        return np.broadcast_to(bits, (*bits.shape[:2], 3)).astype(np.float32)

    return replace(field, pictures=Pictures(field.cameras.lens.size, read), copied=True)


def _in_world(pose: Pose, places: FloatArray) -> FloatArray:
    """Places (3, P) of the frame in the world, (P, 3), with sums in the same order on every machine."""
    e, f, y = (place + start for place, start in zip(places, pose.origin.tolist(), strict=True))
    axes = pose.axes.tolist()
    return np.stack([e * axes[0][k] + f * axes[1][k] + y * axes[2][k] for k in range(3)], axis=-1)


def rebinned(field: Field, pose: Pose, curve: Curve, lit: BoolArray, frame: int = 1) -> Float32Array:
    """Light (H, W, 3) of one side of the mirror at one angle; 0 where it is not lit.

    Args:
        field: the light field.
        pose: the mirror.
        curve: the viewers.
        lit: (H, W) pixels that light this side.
        frame: of an animated field.

    Raises:
        JobError: a picture of the field cannot be read.
    """
    row, column = np.nonzero(lit)
    light = np.zeros((*lit.shape, 3), dtype=np.float32)
    x, y = (np.asarray(index + 0.5, dtype=np.float64) for index in (column, row))
    light[row, column] = rebin(field, rays_of(pose, curve, x, y), frame)
    return light
