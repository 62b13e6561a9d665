"""What a page shows of each frame: images, lit facets, and where they are right to be seen from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.analysis.simulate import PictureOptions, figures, heat_map, heat_scale, take_picture
from quiltcli.analysis.simulate.images import shown_images
from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.analysis.simulate.skin import skin_of
from quiltcli.display import lit_facets
from quiltcli.exchange.web.folder import Folder, images_sha
from quiltcli.exchange.web.textures import Picture, picture
from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.projection.camera import frame_display
from quiltcli.render.crew import default_threads
from quiltcli.viewer.view import views_at
from quiltcli.viewer.viewer import Viewer

ASPECT = 4 / 3
"""Width over height of the view from the eye, for which its angle is chosen."""
_HEAT = (800, 600)  # pixels of a heat map


@dataclass(frozen=True)
class ViewOptions:
    """What a page is to hold.

    Attributes:
        view, exposure: how light becomes colour, as for `preview.tone_map`.
        nearest: whether images are shown as squares, pixel by pixel, when the page opens.
        texture: most pixels a page's picture has across or down.
        ghost: most triangles of the scene's ghost; 0 leaves it out.
        errors: whether to hold every frame against a direct picture, for a heat map.
        size: megabytes the page may have.
        model: whether to write a model as well.
    """

    view: str = "aces"
    exposure: float = 0.0
    nearest: bool = False
    texture: int = 4096
    ghost: int = 20000
    errors: bool = False
    size: float = 8.0
    model: bool = True


@dataclass(frozen=True)
class FrameView:
    """One frame.

    Attributes:
        viewer: the viewer.
        camera: the viewer with its head turned so that it sees the whole display.
        fov: degrees from top to bottom of what it sees, in a picture of `ASPECT`.
        lit: (F,) facets that show images.
        heat: errors as seen through that camera, or None.
        figures: what there is to say of the errors.
    """

    viewer: Viewer
    camera: Viewer
    fov: float
    lit: BoolArray
    heat: Picture | None
    figures: tuple[tuple[str, str], ...]


def frame_images(folder: Folder, frame: int) -> Shown:
    """The images of a frame."""
    stage = folder.stage.at(frame)
    view = stage.views([frame])[0]
    sha = images_sha(folder, frame)
    return shown_images(stage, view, folder.path, sha, default_threads())[0]


def frame_view(folder: Folder, frame: int, errors: bool) -> FrameView:
    """What is seen in a frame, and how far off it is where `errors` are asked for."""
    stage = folder.stage
    viewer = stage.views([frame])[0].viewer
    corners = skin_of(stage.facets, viewer).vertices if stage.facets.charts else stage.facets.corners
    camera, fov = frame_display(viewer, corners, ASPECT, turn=True)
    lit = lit_facets(stage.facets, viewer.eye) & (stage.layout.page >= 0)
    found = FrameView(viewer, camera, fov, lit, None, ())
    return _with_errors(folder, found) if errors else found


def _with_errors(folder: Folder, seen: FrameView) -> FrameView:
    """The frame with the errors that `quilt simulate` finds in it."""
    shown = frame_images(folder, seen.viewer.frame)
    stage = folder.stage.at(seen.viewer.frame)
    comparison = take_picture(stage, seen.viewer, shown, PictureOptions(size=_HEAT)).comparison
    if comparison is None:
        return seen
    scale = heat_scale(comparison.error)
    words = (*figures(comparison), ("heat map", f"white at {scale:g}"))
    return replace(seen, heat=picture(heat_map(comparison.error, scale)), figures=tuple(words))


def eye_path(folder: Folder, most: int = 2000) -> FloatArray:
    """Places (n, 3) of the eye over the job's frames, at most `most` of them, evenly apart."""
    frames = folder.stage.job.frames
    chosen = frames[:: -(-len(frames) // most)]
    return np.stack([views_at(folder.stage.job, frame)[0].viewer.eye for frame in chosen])
