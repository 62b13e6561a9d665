"""What resampling alone costs: direct pictures as dense as the display, resampled once.

A display of finite pixels can at best show what a plain picture of as many pixels shows, and both have
to be resampled to be looked at. That picture's error is the measure of the display's. No display is
equally dense everywhere, so there are several pictures, and each ray takes the one that is as dense as
the display where it meets it.
"""

from __future__ import annotations

import math

import numpy as np

from quiltcli.camera import camera_display
from quiltcli.display import lit_facets
from quiltcli.draw import Stage
from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.homography import eye_from_quilt
from quiltcli.simulate.lookup import Shown, quilt_places
from quiltcli.simulate.picture import Camera, direct_light, picture_rays
from quiltcli.viewer import Viewer

_STEPS = 2  # densities to an octave
_MOST = 1 << 25
"""Pixels a direct picture has at most; a display that is denser shows no error of resampling."""


def resampled_light(
    stage: Stage,
    viewer: Viewer,
    shown: Shown,
    camera: Viewer,
    through: Camera,
    facet: Int32Array,
    threads: int,
) -> Float32Array | None:
    """Direct pictures as dense as the display, resampled once, linearly, to a picture's rays.

    Args:
        stage: its scene is drawn.
        viewer: whose near and far hold.
        shown: the display and its layout.
        camera: the picture's camera.
        through: its display of one facet.
        facet: (P,) facet each ray meets, −1 for none.
        threads: batches drawn at a time.

    Returns:
        (3, P) linear light, black where no lit facet is met; None where none is, or the display is
        too dense.
    """
    facing = lit_facets(shown.facets, camera.eye) & shown.lit
    met = np.flatnonzero(facet >= 0)
    met = met[facing[facet[met]]]
    if not met.size:
        return None
    octave = np.log2(pixel_pitch(shown, camera, through, facet, met))
    level = np.rint(_STEPS * octave).astype(np.int64)
    light = np.zeros((3, facet.size), dtype=np.float32)
    for each in np.unique(level).tolist():
        # Not the level's own density but that of the rays it stands for, in the mean.
        mine = level == each
        coarse = _coarse_light(stage, viewer, camera, through, float(2 ** octave[mine].mean()), threads)
        if coarse is None:
            return None
        light[:, met[mine]] = coarse[:, met[mine]]
    return light


def pixel_pitch(
    shown: Shown, camera: Viewer, through: Camera, facet: Int32Array, met: IntArray
) -> FloatArray:
    """Size (M,) of the display's pixels where rays meet it, as a multiple of the rays' distance.

    What a picture gets wrong it gets wrong at edges, in proportion to its pixels' extent across them.
    A pixel that the display turns and slants is an ellipse to the eye: the mean of its axes is taken,
    half the sum of the singular values of rays by pixels.

    Args:
        shown: the display and its layout.
        camera: the picture's camera.
        through: its display of one facet.
        facet: (P,) facet each ray meets.
        met: (M,) rays that meet lit facets.
    """
    facing = lit_facets(shown.facets, camera.eye) & shown.lit
    rays = picture_rays(camera, through, met)
    step = eye_from_quilt(*through, camera.eye)[0, :, :2]
    here, right, below = (
        quilt_places(shown, facet[met], rays + move, camera.eye, facing)
        for move in (np.zeros((3, 1)), 0.5 * step[:, :1], 0.5 * step[:, 1:])
    )
    (a, c), (b, d) = 2 * (right - here), 2 * (below - here)
    # For a 2 × 2 matrix the sum squared is the sum of all squares and twice the determinant.
    determinant = np.maximum(np.abs(a * d - b * c), 1e-12)
    result: FloatArray = np.sqrt(a * a + b * b + c * c + d * d + 2 * determinant) / (2 * determinant)
    return result


def _coarse_light(
    stage: Stage, viewer: Viewer, camera: Viewer, through: Camera, pitch: float, threads: int
) -> Float32Array | None:
    """A direct picture of pixels of one size, at all rays (3, P); None where it would be too large."""
    facets, layout = through
    width, height = layout.pages[0].tolist()
    wide, high = (max(round(side / pitch), 1) for side in (width, height))
    if wide * high > _MOST:
        return None
    fov = 2 * math.degrees(math.atan(height / 2 * float(np.linalg.norm(facets.dv[0]))))
    light = direct_light(stage, viewer, camera_display(camera, wide, high, fov), threads)
    rows = _between(height, high, high / height)
    columns = _between(width, wide, high / height)
    return _resampled(light.reshape(3, high, wide), rows, columns).reshape(3, -1)


def _between(count: int, pixels: int, scale: float) -> FloatArray:
    """Places (count,) of rays, in pixels whose centres are whole numbers, between the first and the last."""
    centre = (np.arange(count) + 0.5 - count / 2) * scale + pixels / 2 - 0.5
    return np.clip(centre, 0, pixels - 1)


def _resampled(image: Float32Array, rows: FloatArray, columns: FloatArray) -> Float32Array:
    """An image (C, H, W) between its pixels, at all rows and columns."""
    for axis, places in ((1, rows), (2, columns)):
        low = np.minimum(places.astype(np.int64), max(image.shape[axis] - 2, 0))
        high = np.minimum(low + 1, image.shape[axis] - 1)
        shape = [1, 1, 1]
        shape[axis] = -1
        share = (places - low).astype(np.float32).reshape(shape)
        image = image.take(low, axis=axis) * (1 - share) + image.take(high, axis=axis) * share
    return image
