"""What the viewer sees of each method's images, and the spot where depth goes most wrong."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.simulate.compare import Comparison, seam_pixels
from quiltcli.analysis.simulate.compare import compare as compare_pictures
from quiltcli.analysis.simulate.lookup import Shown, nearest_pixels
from quiltcli.analysis.simulate.picture import (
    Camera,
    direct_light,
    displayed_light,
    displayed_places,
    picture_rays,
    visible_triangles,
)
from quiltcli.analysis.simulate.skin import Skin, skin_of
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.images.preview import Bytes, block_means, tone_map
from quiltcli.projection.camera import aimed, camera_display, frame_display
from quiltcli.render.buffers import Buffers
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer

SIZE = (720, 540)
CROP = (300, 225)
_SAMPLES = 2
_CLOSER = 0.16  # of the whole picture's angle
_SPOT = 24  # samples around a place that are counted to find the worst


@dataclass(frozen=True)
class EyeView:
    """A camera at the viewer's eye.

    Attributes:
        camera: it may look elsewhere than the viewer, from the same place.
        through: its pixels.
        size: width and height in pixels, of which each is `samples` rays across and down.
        samples: see there.
        facet: (P,) facet that every ray meets, −1 for none.
        lit: (F,) facets that are drawn.
        skin: the display as triangles.
        triangle: (P,) which of those every ray meets, −1 for none.
    """

    camera: Viewer
    through: Camera
    size: tuple[int, int]
    samples: int
    facet: Int32Array
    lit: BoolArray
    skin: Skin
    triangle: Int32Array

    def shown(self, stage: Stage, buffers: Buffers) -> Shown:
        """The display with these images on."""
        return Shown(stage.facets, stage.layout, self.lit, buffers, stage.owners, self.camera.eye)

    def light(self, stage: Stage, buffers: Buffers, how: str) -> tuple[Float32Array, BoolArray]:
        """Light (3, P) of all rays, and which of them meet an image, by a filter of `lookup.FILTERS`."""
        shown = self.shown(stage, buffers)
        return displayed_light(shown, self.camera, self.through, self.facet, how, self.skin, self.triangle)

    def image(self, light: Float32Array) -> Float32Array:
        """Light (3, P) of all rays as a picture (H, W, 3)."""
        rows = light.reshape(3, -1, self.size[0] * self.samples).transpose(1, 2, 0)
        return block_means(rows, self.samples)

    def addresses(self, stage: Stage) -> IntArray:
        """Flat quilt address (P,) that each ray meets, −1 for none."""
        shown = self.shown(stage, {})
        met, bright, place = displayed_places(
            shown, self.camera, self.through, self.facet, self.skin, self.triangle
        )
        result = np.full(self.facet.size, -1)
        result[met[bright]] = nearest_pixels(shown, self.facet[met[bright]], place)
        return result


def whole_view(stage: Stage, viewer: Viewer, lit: BoolArray, threads: int) -> EyeView:
    """The view of the whole display."""
    corners = skin_of(stage.facets, viewer).vertices if stage.facets.charts else stage.facets.corners
    camera, fov = frame_display(viewer, corners, SIZE[0] / SIZE[1], turn=True)
    return _view(stage, camera, fov, SIZE, _SAMPLES, lit, threads)


def close_view(stage: Stage, whole: EyeView, wrong: BoolArray, threads: int) -> EyeView:
    """The view of where most pixels are wrong; of the middle where none is.

    Args:
        stage: the stage.
        whole: the view of the whole display.
        wrong: (pixels,) of the quilt.
        threads: as for `draw_frame`.
    """
    address = whole.addresses(stage)
    hit = (address >= 0) & wrong[np.maximum(address, 0)]
    width = whole.size[0] * whole.samples
    row, column = _densest(hit.reshape(-1, width))
    ray = picture_rays(whole.camera, whole.through, np.array([row * width + column]))[:, 0]
    fov = 2 * float(np.degrees(np.arctan(_CLOSER * _half_height(whole))))
    return _view(stage, aimed(whole.camera, ray), fov, CROP, 1, whole.lit, threads)


def _half_height(view: EyeView) -> float:
    """Slope from the middle of a view to its top."""
    facets, _ = view.through
    dv = facets.dv[0]
    return float(np.sqrt(dv @ dv)) * int(facets.size[0, 1]) / 2


def _densest(hit: BoolArray) -> tuple[int, int]:
    """Row and column around which most of an image (H, W) is true; the middle where nothing is."""
    if not hit.any():
        return hit.shape[0] // 2, hit.shape[1] // 2
    sums: FloatArray = np.pad(hit.astype(np.float64), _SPOT)
    for axis in (0, 1):
        total = np.cumsum(sums, axis=axis)
        length = total.shape[axis] - 2 * _SPOT
        sums = np.take(total, np.arange(length) + 2 * _SPOT, axis) - np.take(total, np.arange(length), axis)
    row, column = np.unravel_index(int(sums.argmax()), sums.shape)
    return int(row), int(column)


def _view(
    stage: Stage,
    camera: Viewer,
    fov: float,
    size: tuple[int, int],
    samples: int,
    lit: BoolArray,
    threads: int,
) -> EyeView:
    through = camera_display(camera, size[0] * samples, size[1] * samples, fov)
    skin = skin_of(stage.facets, camera)
    triangle = visible_triangles(stage, camera, through, threads, skin)
    return EyeView(camera, through, size, samples, skin.facet_of(triangle), lit, skin, triangle)


def direct_picture(stage: Stage, viewer: Viewer, view: EyeView, threads: int) -> Float32Array:
    """The scene without a display (H, W, 3)."""
    return view.image(direct_light(stage, viewer, view.through, threads))


def seen_against(stage: Stage, view: EyeView, buffers: Buffers, direct: Float32Array) -> Comparison:
    """What the viewer sees of images, against the direct picture."""
    light, lit = view.light(stage, buffers, "linear")
    on_lit = np.where(lit, view.facet, -1).reshape(-1, view.size[0] * view.samples).astype(np.int32)
    covered = block_means((on_lit >= 0)[..., None], view.samples)[..., 0] == 1
    return compare_pictures(view.image(light), direct, covered, seam_pixels(on_lit, view.samples))


def crop(stage: Stage, view: EyeView, buffers: Buffers) -> Bytes:
    """What the viewer sees in a close view, at exact pixels: display values (H, W, 3)."""
    light, _ = view.light(stage, buffers, "nearest")
    return tone_map(view.image(light))


def marked(view: EyeView, address: IntArray, picture: Bytes, wrong: BoolArray) -> Bytes:
    """A close view greyed, with what is wrong in red."""
    hit = ((address >= 0) & wrong[np.maximum(address, 0)]).reshape(picture.shape[:2])
    grey = (picture.mean(axis=-1, keepdims=True) * 0.6).astype(np.uint8)
    result: Bytes = np.where(hit[..., None], np.array([255, 48, 32], np.uint8), np.repeat(grey, 3, axis=-1))
    return result
