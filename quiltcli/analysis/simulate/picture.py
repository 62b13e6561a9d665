"""What a picture's camera sees: of the display with its images on, or of the scene itself."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown, look_up, quilt_places
from quiltcli.analysis.simulate.skin import Skin, skin_of
from quiltcli.display import Facets, lit_facets
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, dot, normalized
from quiltcli.job import JobFile
from quiltcli.layout import Layout
from quiltcli.projection.planar import eye_from_quilt
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.corrections import on_panels
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods import draw_frame as draw_by_method
from quiltcli.render.setup import Stage, stage_of
from quiltcli.scene import Scene
from quiltcli.scene.bare import bare_scene
from quiltcli.viewer.viewer import Viewer

Camera: TypeAlias = tuple[Facets, Layout]
"""A display of one facet, as `camera_display` makes it."""

_SURROUND = np.array([0.05, 0.052, 0.056], dtype=np.float32)
_DARK = 0.035  # a screen that is off, turned to the camera
_LINE = np.float32(0.28)


def with_channels(job: JobFile, channels: tuple[str, ...]) -> JobFile:
    """The job with other channels."""
    return job.model_copy(update={"output": job.output.model_copy(update={"channels": channels})})


def exact(job: JobFile, **render: object) -> JobFile:
    """The job by the method that is exact, and with other keys of `render`."""
    update = {"method": "homography", "depth_bits": None, **render}
    return job.model_copy(update={"render": job.render.model_copy(update=update)})


def visible_facets(stage: Stage, camera: Viewer, through: Camera, threads: int) -> Int32Array:
    """The facet (P,) that every ray of the picture meets first, from either side; −1 for none."""
    skin = skin_of(stage.facets, camera)
    return skin.facet_of(visible_triangles(stage, camera, through, threads, skin))


def visible_triangles(stage: Stage, camera: Viewer, through: Camera, threads: int, skin: Skin) -> Int32Array:
    """The triangle (P,) of a display that every ray meets first, from either side; −1 for none."""
    return first_triangles(stage, camera, through, bare_scene(skin.vertices, skin.triangles), threads)[0]


def first_triangles(
    stage: Stage, camera: Viewer, through: Camera, scene: Scene, threads: int
) -> tuple[Int32Array, Float32Array]:
    """The triangle of a scene (P,) that every ray meets first, from either side, −1 for none; how far."""
    # Everything from a micrometre on: the viewer's near and far are for the scene, not for the display.
    here = replace(camera, near=1e-6, far=1e6, depth="radial", clip=None)
    job = exact(with_channels(stage.job, ("triangle", "Z")), samples=1, backface_culling=False)
    bare = camera_stage(job, through, scene)
    buffers = new_buffers(bare)
    draw_frame(bare, here, buffers, threads)
    return buffers["triangle"].astype(np.int32) - 1, buffers["Z"]


def camera_stage(job: JobFile, through: Camera, scene: Scene) -> Stage:
    """The stage of a picture: a scene behind the camera's one facet, with exact depth."""
    exact = job.render.model_copy(update={"method": "homography", "depth_bits": None})
    return stage_of(job.model_copy(update={"render": exact}), *through, scene, bleed=0)


def displayed_light(
    shown: Shown,
    camera: Viewer,
    through: Camera,
    facet: Int32Array,
    how: str,
    skin: Skin | None = None,
    triangle: Int32Array | None = None,
) -> tuple[Float32Array, BoolArray]:
    """What the camera sees of the display: (3, P) linear light, and (P,) where it is an image.

    Back sides, and facets that are dark for this viewer, are grey, the darker the more they turn away.

    Args:
        shown: the images.
        camera: the camera.
        through: its display of one facet.
        facet: (P,) facet that each ray meets, −1 for none.
        how: a filter of `lookup.FILTERS`.
        skin: the display's triangles; curved facets need them.
        triangle: (P,) which of them each ray meets.
    """
    light = np.repeat(_SURROUND[:, None], facet.size, axis=1)
    met, bright, place = displayed_places(shown, camera, through, facet, skin, triangle)
    grey = np.abs(dot(shown.facets.normal[facet[met]], normalized(picture_rays(camera, through, met).T)))
    light[:, met] = (_DARK * (0.25 + 0.75 * grey)).astype(np.float32)
    light[:, met[bright]] = look_up(shown, facet[met[bright]], place, how)
    lit = np.zeros(facet.size, dtype=np.bool_)
    lit[met[bright]] = True
    return light, lit


def displayed_places(
    shown: Shown,
    camera: Viewer,
    through: Camera,
    facet: Int32Array,
    skin: Skin | None = None,
    triangle: Int32Array | None = None,
) -> tuple[IntArray, BoolArray, FloatArray]:
    """Where the camera's rays meet images; arguments as of `displayed_light`.

    Returns:
        (M,) rays that meet a facet; (M,) whether an image is there; (2, B) page pixels of those where one is.
    """
    facing = lit_facets(shown.facets, camera.eye) & shown.lit
    met = np.flatnonzero(facet >= 0)
    rays = picture_rays(camera, through, met)
    bright = facing[facet[met]]
    place = quilt_places(shown, facet[met[bright]], rays[:, bright], camera.eye, facing)
    if shown.facets.charts and skin is not None and triangle is not None:
        # A curved facet's places are where rays meet it, and its pixels are lit one by one.
        on = np.flatnonzero(bright)
        bent = np.flatnonzero(shown.facets.curved[facet[met[on]]])
        found = skin.curved_places(triangle[met[on[bent]]], rays[:, on[bent]], camera.eye)
        place[:, bent], shows = curved_pixels(shown, skin, facet[met[on[bent]]], found, camera)
        bright[on[bent[~shows]]] = False
        place = place[:, bright[on]]
    return met, bright, place


def seen_from(stage: Stage, shown: Shown, eye: FloatArray, threads: int) -> Shown:
    """The images as panels of a known response show them to an eye (3,); the same for perfect panels."""
    response = shown.facets.response
    if response is None:
        return shown

    def change(row: int, image: FloatArray, cosine: FloatArray, _: object) -> tuple[FloatArray, None]:
        return response.shown(row, image, cosine), None

    buffers = {name: shown.buffers[name].astype(np.float32) for name in "RGB"}
    rows = np.flatnonzero(shown.lit).tolist()
    leaks = response.blend is not None and response.blend.black > 0
    on_panels(stage, shown.owners, rows, buffers, eye, change, threads, black=leaks)
    return replace(shown, buffers=buffers)


def curved_pixels(
    shown: Shown, skin: Skin, facet: Int32Array, place: FloatArray, camera: Viewer
) -> tuple[FloatArray, BoolArray]:
    """Page pixels (2, P) of facet pixels of curved facets, and which show an image to viewer and camera."""
    result, shows = np.zeros(place.shape), np.zeros(facet.size, dtype=np.bool_)
    for row in np.unique(facet).tolist():
        mine = np.flatnonzero(facet == row)
        chart = shown.facets.charts[row]
        assert chart is not None
        x, y = place[:, mine]
        points = chart.points(x, y)
        shows[mine] = chart.lit(x, y, points, skin.viewer.eye) & chart.lit(x, y, points, camera.eye)
        matrix = shown.layout.quilt_from_facet[row]
        result[:, mine] = matrix[:, :1] * x + matrix[:, 1:2] * y + matrix[:, 2:]
    return result, shows


def picture_rays(camera: Viewer, through: Camera, pixel: IntArray) -> FloatArray:
    """Directions (3, P) from the camera through the centres of picture pixels with these addresses."""
    matrix = eye_from_quilt(through[1], camera.eye)[0]
    row, column = np.divmod(pixel, through[1].pages[0, 0])
    result: FloatArray = matrix[:, :1] * (column + 0.5) + matrix[:, 1:2] * (row + 0.5) + matrix[:, 2:]
    return result


def direct_light(stage: Stage, viewer: Viewer, through: Camera, threads: int) -> Float32Array:
    """The scene without a display (3, P), through the same camera and by the same renderer, exactly."""
    direct = camera_stage(exact(stage.job), through, stage.scene)
    buffers = new_buffers(direct)
    draw_frame(direct, viewer, buffers, threads)
    return np.stack([buffers[name].astype(np.float32) for name in "RGB"])


def exact_images(stage: Stage, viewer: Viewer, threads: int) -> Buffers:
    """The images of a display as the exact method draws them.

    A curved facet's image is as dense as it, and has no seam: looked up, it is a direct picture that is
    resampled once.
    """
    again = replace(stage, job=exact(with_channels(stage.job, ("rgba",))))
    buffers = new_buffers(again)
    draw_by_method(again, viewer, buffers, threads)
    return buffers


def outlined(light: Float32Array, facet: Int32Array, width: int) -> Float32Array:
    """The light (3, P) of a picture with a thin line along all edges of facets.

    Args:
        light: as of `displayed_light`.
        facet: (P,) facet of every ray, −1 for none.
        width: rays in a row.
    """
    rows = facet.reshape(-1, width)
    edge = np.zeros(rows.shape, dtype=np.bool_)
    edge[:, 1:] |= rows[:, 1:] != rows[:, :-1]
    edge[1:] |= rows[1:] != rows[:-1]
    edge[:, :-1] |= edge[:, 1:]
    return np.where(edge.reshape(-1), np.float32(0.4) * light + np.float32(0.6) * _LINE, light)
