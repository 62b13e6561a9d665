"""Simulation: the display as a lit object, seen from the viewer's eye or from anywhere else.

The picture is drawn by the program's own rasterizer through a camera that is a display of one facet;
its scene is the display's mesh. What a ray meets there it looks up in the facets' images. From the
viewer's eye the result must be the picture that one would get of the scene without a display.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.analysis.simulate.compare import Comparison, compare, figures, heat_map, heat_scale, seam_pixels
from quiltcli.analysis.simulate.images import shown_images
from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.analysis.simulate.overlaps import all_light
from quiltcli.analysis.simulate.picture import (
    direct_light,
    displayed_light,
    exact_images,
    first_triangles,
    outlined,
    seen_from,
    with_channels,
)
from quiltcli.analysis.simulate.reference import resampled_light
from quiltcli.analysis.simulate.skin import skin_of
from quiltcli.analysis.simulate.thirdperson import third_person_camera, third_person_light
from quiltcli.analysis.simulate.unfolded import unfold
from quiltcli.errors import JobError
from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.images.preview import block_means
from quiltcli.job import JobFile, job_sha256
from quiltcli.projection.camera import aimed, camera_display, frame_display
from quiltcli.render.corrections import corrects
from quiltcli.render.crew import default_threads
from quiltcli.render.notices import stage_warnings
from quiltcli.render.setup import Stage, set_stage
from quiltcli.render.unseen import unseen_in
from quiltcli.scene.bare import bare_scene
from quiltcli.viewer.view import views_of
from quiltcli.viewer.viewer import Viewer

__all__ = [
    "Comparison",
    "PictureOptions",
    "Simulation",
    "camera_display",
    "figures",
    "heat_map",
    "heat_scale",
    "simulate",
]


_GAP = 8  # pixels between the parts of a triptych


@dataclass(frozen=True)
class PictureOptions:
    """What kind of picture is taken.

    Attributes:
        size: width and height, pixels.
        place: where the camera stands, world metres; None for the viewer's eye.
        look_at: what it looks at, world metres; None for the middle of the display.
        fov: degrees from top to bottom; None shows the whole display.
        filter: `nearest` shows the pixel that is met, `linear` goes between the four around.
        samples: rays a pixel, across and down.
        compare: hold the picture against a direct one of the scene; from the eye only.
        resampled: say too what resampling alone costs, which takes some more direct pictures.
        third_person: show the viewer too, who looks at the display; there is nothing to compare then.
        scene: how a third person sees the scene, a name of `thirdperson.SCENES`.
        edges: draw a line along the edges of the facets; what is compared is the picture without.
        threads: batches drawn at a time; 0 takes every core.
        eye: `left` or `right` of two eyes; empty for both.
        triptych: beside each other the scene without a display, the display from the eye, and unfolded; each
            has the size of a picture.
        head: draw the viewer's head too, as a third person sees it.
        corrected: whether images make up for the panels, as far as the job wants that.
    """

    size: tuple[int, int] = (1200, 900)
    place: tuple[float, float, float] | None = None
    look_at: tuple[float, float, float] | None = None
    fov: float | None = None
    filter: str = "linear"
    samples: int = 2
    compare: bool = True
    resampled: bool = False
    third_person: bool = False
    scene: str = "ghost"
    edges: bool = False
    threads: int = 0
    eye: str = ""
    triptych: bool = False
    head: bool = False
    corrected: bool = True


@dataclass(frozen=True)
class Simulation:
    """One picture.

    Attributes:
        frame: frame number.
        picture: (H, W, 3) linear light.
        direct: (H, W, 3) the scene without a display, None where there is nothing to compare with.
        comparison: the figures, None likewise.
        source: where the facets' images came from, in words.
        eye: whose picture it is where there are several: viewer, and eye of two (`ann.left`).
    """

    frame: int
    picture: Float32Array
    direct: Float32Array | None
    comparison: Comparison | None
    source: str
    eye: str = ""


def simulate(
    job: JobFile,
    frames: Sequence[int],
    options: PictureOptions | None = None,
    say: Callable[[str], None] = lambda notice: None,
) -> Iterator[Simulation]:
    """Look at the display with its images on, in some frames of a job.

    The images are those a render of the job has left, where there are any, else drawn in memory.
    What a render would `say` of the job is said first.

    Raises:
        QuiltError: bad input, or images that cannot be read.
    """
    options = options or PictureOptions()
    if not options.corrected:
        update = {"render": job.render.model_copy(update={"corrections": False})}
        job = job.model_copy(update=update)
    views_of(job, frames)  # what is wrong with the path is said before anything is loaded
    sha = job_sha256(job)
    stage = set_stage(with_channels(job, ("rgba",)))
    for notice in (*stage.scene.notices, *stage_warnings(stage, frames)):
        say(notice)
    if job.render.shutter and options.compare:
        say("the shutter is open: the images have motion blur, the direct picture beside them has none")
    threads = options.threads or default_threads()
    views = [view for view in stage.views(frames) if options.eye in ("", view.eye)]
    if not views:
        raise JobError(f"--eye {options.eye}: the job has one eye (viewer.stereo gives it two)")
    for notice in unseen_in(stage, views):
        say(notice)
    # Frame by frame and viewer by viewer, the left eye before the right.
    seen = [(view, number) for view in views for number in range(len(view.viewers))]
    eyes = np.array([view.viewers[number].eye for view, number in seen])
    unfolded = unfold(stage.facets, stage.layout, options.size) if options.triptych else None
    for view, number in sorted(seen, key=lambda item: (item[0].frame, item[1])):
        now, viewer = stage.at(view.time), view.viewers[number]
        shown, source = shown_images(now, view, job.output.directory, sha, threads, viewer)
        whose = ".".join(filter(None, (viewer.name, view.eye)))
        result = take_picture(now, viewer, shown, options, eyes)
        if unfolded is not None:
            result = replace(
                result, picture=beside(result, unfolded.picture(shown, options.filter, edges=options.edges))
            )
        yield replace(result, source=source, eye=whose)


def beside(result: Simulation, unfolded: Float32Array) -> Float32Array:
    """The scene without a display, the display from the eye, and unfolded, beside each other (H, …, 3)."""
    assert result.direct is not None
    gap = np.zeros((len(unfolded), _GAP, 3), dtype=np.float32)
    parts = (result.direct.astype(np.float32), gap, result.picture, gap, unfolded)
    return np.concatenate(parts, axis=1)


def take_picture(
    stage: Stage,
    viewer: Viewer,
    shown: Shown,
    options: PictureOptions,
    eyes: FloatArray | None = None,
) -> Simulation:
    """One picture of a display with its images on, with its figures where it is taken from the eye.

    Args:
        stage: display and scene.
        viewer: whose display it is.
        shown: its images.
        options: what kind of picture.
        eyes: (N, 3) all the places of a film's eyes: a third person sees them all, and stands still.
    """
    if options.third_person:
        return _third_person(stage, viewer, shown, options, eyes)
    skin = skin_of(stage.facets, viewer)
    camera, fov = _camera(viewer, skin.vertices, options)
    width, height = (options.samples * side for side in options.size)
    through = camera_display(camera, width, height, fov)
    threads = options.threads or default_threads()
    bare = bare_scene(skin.vertices, skin.triangles)
    triangle, depth = first_triangles(stage, camera, through, bare, threads)
    facet = skin.facet_of(triangle)
    seen = seen_from(stage, shown, camera.eye, threads)
    light, lit = all_light(
        stage, seen, camera, through, facet, options.filter, skin, triangle, depth, threads
    )
    picture = plain = block_means(_image(light, width), options.samples)
    if options.edges:
        picture = block_means(_image(outlined(light, facet, width), width), options.samples)
    if options.place is not None or not (options.compare or options.triptych):
        return Simulation(viewer.frame, picture, None, None, "")
    # A display that is to show a share of its light is held against that share of the scene's.
    response = corrects(stage)
    level = np.float32(1.0 if response is None else response.level)
    whole = direct_light(stage, viewer, through, threads)
    direct = block_means(_image(level * whole, width), options.samples)
    if not options.compare:
        return Simulation(viewer.frame, picture, direct, None, "")
    on_lit = np.where(lit, facet, -1).reshape(height, width).astype(np.int32)
    covered = block_means((on_lit >= 0)[..., None], options.samples)[..., 0] == 1
    coarse = None
    if options.resampled and stage.facets.charts:
        again = replace(shown, buffers=exact_images(stage, viewer, threads))
        coarse, _ = displayed_light(again, camera, through, facet, options.filter, skin, triangle)
    elif options.resampled:
        coarse = resampled_light(stage, viewer, shown, camera, through, facet, threads, options.filter)
    once = None if coarse is None else block_means(_image(level * coarse, width), options.samples)
    comparison = compare(plain, direct, covered, seam_pixels(on_lit, options.samples), once)
    return Simulation(viewer.frame, picture, direct, comparison, "")


def _third_person(
    stage: Stage, viewer: Viewer, shown: Shown, options: PictureOptions, eyes: FloatArray | None
) -> Simulation:
    """A picture of the viewer before the display."""
    place, look_at = (
        None if point is None else np.asarray(point, dtype=np.float64)
        for point in (options.place, options.look_at)
    )
    aspect = options.size[0] / options.size[1]
    camera, fov = third_person_camera(viewer, stage.facets, place, look_at, aspect, eyes, head=options.head)
    width, height = (options.samples * side for side in options.size)
    through = camera_display(camera, width, height, options.fov or fov)
    threads = options.threads or default_threads()
    seen = seen_from(stage, shown, camera.eye, threads)
    light, facet = third_person_light(
        stage, viewer, seen, camera, through, options.filter, options.scene, threads, head=options.head
    )
    if options.edges:
        light = outlined(light, facet, width)
    return Simulation(viewer.frame, block_means(_image(light, width), options.samples), None, None, "")


def _image(light: Float32Array, width: int) -> Float32Array:
    """Flat light (3, P) as an image (H, W, 3)."""
    return light.reshape(3, -1, width).transpose(1, 2, 0)


def _camera(viewer: Viewer, points: FloatArray, options: PictureOptions) -> tuple[Viewer, float]:
    """The picture's camera and its field of view, degrees from top to bottom, before points of a display."""
    camera = viewer
    if options.place is not None:
        camera = replace(
            viewer, eye=np.asarray(options.place, dtype=np.float64), up=np.array([0.0, 1.0, 0.0])
        )
    if options.look_at is not None:
        camera = aimed(camera, np.asarray(options.look_at, dtype=np.float64) - camera.eye)
    aspect = options.size[0] / options.size[1]
    framed, fov = frame_display(camera, points, aspect, turn=options.look_at is None)
    return (framed, fov) if options.fov is None else (framed, options.fov)
