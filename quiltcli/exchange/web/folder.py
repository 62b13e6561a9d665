"""A job's output folder, opened to be looked at: the job, its display, and which frames are there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.analysis.simulate.picture import with_channels
from quiltcli.display import lit_facets
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.image import read_header
from quiltcli.images.metadata import is_complete
from quiltcli.job import load_job
from quiltcli.job.frames import format_frames
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.view import views_at


@dataclass(frozen=True)
class Folder:
    """An output folder.

    Attributes:
        path: the folder.
        stage: display, layout and scene of its job, for colours alone.
        frames: numbers of the frames of which there are images, ascending.
    """

    path: Path
    stage: Stage
    frames: tuple[int, ...]


def open_folder(path: Path) -> Folder:
    """Read the settings a render has left in a folder, and look which frames there are.

    Raises:
        OutputError: it is no output folder, or has no images.
        QuiltError: what its job names cannot be read any more.
    """
    if not (path / "job.yaml").is_file():
        what = "has no job.yaml" if path.is_dir() else "is no folder"
        wrong = f"{what} (expected the folder that quilt render has written to)"
        raise OutputError(Problem(wrong, file=str(path)))
    job = load_job(path / "job.yaml")
    stage = set_stage(with_channels(job, ("rgba",)))
    frames = tuple(sorted({name.frame for name, _ in stage.names.found(path)}))
    if not frames:
        raise OutputError(Problem("has no images of frames (run quilt render first)", file=str(path)))
    return Folder(path, stage, frames)


def chosen_frames(folder: Folder, wanted: Sequence[int] | None, most: int) -> tuple[int, ...]:
    """The frames to show: those that are wanted, or at most `most` of all there are, evenly apart.

    Raises:
        OutputError: a wanted frame is not there, not whole, or of another job.
    """
    if wanted is not None:
        frames = tuple(dict.fromkeys(wanted))
    else:
        count = min(most, len(folder.frames))
        last = len(folder.frames) - 1
        frames = tuple(folder.frames[round(i * last / max(count - 1, 1))] for i in range(count))
    for frame in frames:
        images_sha(folder, frame)
    return frames


def images_sha(folder: Folder, frame: int) -> str:
    """The hash of the job that made a frame's images, quilts or else facets: all carry the same.

    It need not be that of the job.yaml beside them, which another version of the program may hash
    otherwise; but the viewer must be where the images were made for.

    Raises:
        OutputError: the frame is not there, not whole, or was made for another place of the eye.
    """
    layout, names = folder.stage.layout, folder.stage.names
    view = views_at(folder.stage.job, frame)[0]  # of two eyes the left
    pages = [names.page(folder.path, page + 1, *view.file_key) for page in range(len(layout.pages))]
    eye = view.viewer.eye
    lit = lit_facets(folder.stage.facets, eye) & (layout.page >= 0)  # a render may leave the others out
    facets = [names.facet(folder.path, facet, *view.file_key) for facet in layout.facet[lit].tolist()]
    found = [paths for paths in (pages, facets) if paths and paths[0].is_file()]
    if not found:
        wrong = f"has no images of frame {frame} (it has {format_frames(folder.frames)})"
        raise OutputError(Problem(wrong, file=str(folder.path)))
    for paths in found:
        first = read_header(paths[0]).attributes
        sha = str(first.get("quilt:job"))
        if all(is_complete(path, sha, frame) for path in paths):
            _check_eye(folder, frame, first, paths[0])
            return sha
    wrong = f"images of frame {frame} are missing, damaged or of several jobs (run quilt render --resume)"
    raise OutputError(Problem(wrong, file=str(folder.path)))


def _check_eye(folder: Folder, frame: int, attributes: Mapping[str, object], path: Path) -> None:
    eye = views_at(folder.stage.job, frame)[0].viewer.eye
    drawn = np.asarray(attributes.get("quilt:eye", np.full(3, np.nan)), dtype=np.float64)
    if not np.abs(eye - drawn).max() <= 1e-6 * max(1.0, float(np.abs(eye).max())):
        wrong = f"was drawn for another eye than that of {folder.path / 'job.yaml'} (render it again)"
        raise OutputError(Problem(wrong, file=str(path)))
