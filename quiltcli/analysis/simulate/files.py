"""The pictures of a simulation as files, and the lines that tell of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.analysis.simulate import PictureOptions, Simulation, simulate
from quiltcli.analysis.simulate.compare import figures, heat_map, heat_scale
from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.formats.video import coding_of, film
from quiltcli.formats.whole import make_folder
from quiltcli.images.preview import Look, display_values, write_bytes, write_png
from quiltcli.images.stereo.anaglyph import MATRICES, anaglyph
from quiltcli.job import JobFile
from quiltcli.job.frames import frame_text

_NUMBER = re.compile("#+")


@dataclass(frozen=True)
class Pictures:
    """What is written of each frame; a run of `#` in a name stands for the frame number.

    Attributes:
        picture: what is seen of the display, if wanted.
        direct: the scene without a display, if wanted.
        heat_map: the errors, if wanted.
        view, exposure: as for `preview.write_png`.
        video: a film of what is seen, all frames after one another, if wanted.
        glasses: show both eyes' pictures as an anaglyph of this name; empty for each eye's own.
    """

    picture: Path | None = None
    direct: Path | None = None
    heat_map: Path | None = None
    view: str = "aces"
    exposure: float = 0.0
    video: Path | None = None
    glasses: str = ""


def write_pictures(
    job: JobFile,
    frames: Sequence[int],
    options: PictureOptions,
    pictures: Pictures,
    say: Callable[[str], None] = lambda notice: None,
) -> Iterator[str]:
    """Take and write pictures; yields what there is to say of them, line by line.

    What a render would say of the job goes to `say`.

    Raises:
        QuiltError: bad input, or a file that cannot be written.
    """
    _check(frames, options, pictures)
    if len(job.people) > 1 and pictures.video:
        raise JobError("a film shows one viewer's picture (expected a job with viewer)")
    if job.is_stereo and pictures.video and not (options.eye or pictures.glasses):
        raise JobError("a film shows one picture at a time (choose --eye left, --eye right or --glasses)")
    if pictures.glasses and (not job.is_stereo or options.eye):
        raise JobError("--glasses shows two eyes' pictures (expected a job with viewer.stereo, and no --eye)")
    with ExitStack() as ends:
        show = ends.enter_context(film(pictures.video, job.fps)) if pictures.video else None
        seen = simulate(job, frames, options, say)
        for result in through_glasses(seen, pictures.glasses) if pictures.glasses else seen:
            if show and pictures.video:
                look = Look(pictures.view, pictures.exposure, coding_of(pictures.video).depth)
                show(display_values(result.picture, look))
            yield from _write_picture(result, pictures)
            yield from _write_comparison(result, pictures)
    if pictures.video:
        yield f"{'film':<24}{pictures.video} ({len(frames)} frames, {job.fps} a second)"


def through_glasses(seen: Iterator[Simulation], matrix: str) -> Iterator[Simulation]:
    """Both eyes' pictures as one, coloured for each eye's filter."""
    for left in seen:
        right = next(seen)
        first, second = (np.ascontiguousarray(one.picture.transpose(2, 0, 1)) for one in (left, right))
        mixed = anaglyph(first, second, MATRICES[matrix]).transpose(1, 2, 0)
        whose = left.eye.removesuffix("left").strip(".")
        yield replace(left, picture=mixed, direct=None, comparison=None, eye=whose)


def _write_picture(result: Simulation, pictures: Pictures) -> Iterator[str]:
    """Write what is seen of the display, and say where from."""
    if pictures.picture is None:
        yield f"{'frame':<24}{result.frame}, {result.source}"
        return
    written = numbered(pictures.picture, result.frame, result.eye)
    make_folder(written.parent)
    write_png(written, result.picture, pictures.view, pictures.exposure)
    yield f"{'picture':<24}{written}"
    yield f"{'images':<24}{result.source}"


def _check(frames: Sequence[int], options: PictureOptions, pictures: Pictures) -> None:
    """Find what cannot work before anything is drawn."""
    if pictures.video is not None:
        coding_of(pictures.video)
    names = [path for path in (pictures.picture, pictures.direct, pictures.heat_map) if path is not None]
    check_names(names, len(frames))
    if names != [pictures.picture] * len(names) and (
        options.place is not None or options.third_person or not options.compare
    ):
        raise JobError("--direct and --heat-map need a comparison, which there is only from the viewer's eye")


def check_names(names: Sequence[Path], frames: int) -> None:
    """Raise OutputError where a picture's name is none, or one for several frames."""
    for path in names:
        if path.suffix.lower() != ".png":
            raise OutputError(Problem("a picture's name must end in .png", file=str(path)))
        if frames > 1 and not _NUMBER.search(path.name):
            wrong = f"is one name for {frames} frames (put #### where the frame number goes)"
            raise OutputError(Problem(wrong, file=str(path)))


def numbered(path: Path, frame: int, eye: str = "") -> Path:
    """The path with the frame number for a run of `#` in its name, and the eye before that or at the end."""
    name = path.name
    if eye and (number := _NUMBER.search(name)):
        name = f"{name[: number.start()]}{eye}.{name[number.start() :]}"
    elif eye:
        name = f"{path.stem}.{eye}{path.suffix}"
    return path.with_name(_NUMBER.sub(frame_text(frame), name))


def _write_comparison(result: Simulation, pictures: Pictures) -> Iterator[str]:
    """Write what is held against the picture, and say how far off it is."""
    if result.comparison is None or result.direct is None:
        return
    if pictures.direct is not None:
        path = numbered(pictures.direct, result.frame, result.eye)
        make_folder(path.parent)
        write_png(path, result.direct, pictures.view, pictures.exposure)
        yield f"{'direct picture':<24}{path}"
    if pictures.heat_map is not None:
        path = numbered(pictures.heat_map, result.frame, result.eye)
        make_folder(path.parent)
        scale = heat_scale(result.comparison.error)
        write_bytes(path, heat_map(result.comparison.error, scale))
        yield f"{'heat map':<24}{path} (white at {scale:g})"
    for label, value in figures(result.comparison):
        yield f"{label:<24}{value}"
