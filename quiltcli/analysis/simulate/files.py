"""The pictures of a simulation as files, and the lines that tell of them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from quiltcli.analysis.simulate import PictureOptions, Simulation, simulate
from quiltcli.analysis.simulate.compare import figures, heat_map, heat_scale
from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.formats.video import coding_of, film
from quiltcli.formats.whole import make_folder
from quiltcli.images.preview import Look, display_values, write_bytes, write_png
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
    """

    picture: Path | None = None
    direct: Path | None = None
    heat_map: Path | None = None
    view: str = "aces"
    exposure: float = 0.0
    video: Path | None = None


def write_pictures(
    job: JobFile, frames: Sequence[int], options: PictureOptions, pictures: Pictures
) -> Iterator[str]:
    """Take and write pictures; yields what there is to say, line by line.

    Raises:
        QuiltError: bad input, or a file that cannot be written.
    """
    _check(frames, options, pictures)
    with ExitStack() as ends:
        show = ends.enter_context(film(pictures.video, job.fps)) if pictures.video else None
        for result in simulate(job, frames, options):
            if show and pictures.video:
                look = Look(pictures.view, pictures.exposure, coding_of(pictures.video).depth)
                show(display_values(result.picture, look))
            yield from _write_picture(result, pictures)
            yield from _write_comparison(result, pictures)
    if pictures.video:
        yield f"{'film':<24}{pictures.video} ({len(frames)} frames, {job.fps} a second)"


def _write_picture(result: Simulation, pictures: Pictures) -> Iterator[str]:
    """Write what is seen of the display, and say where from."""
    if pictures.picture is None:
        yield f"{'frame':<24}{result.frame}, {result.source}"
        return
    written = numbered(pictures.picture, result.frame)
    make_folder(written.parent)
    write_png(written, result.picture, pictures.view, pictures.exposure)
    yield f"{'picture':<24}{written}"
    yield f"{'images':<24}{result.source}"


def _check(frames: Sequence[int], options: PictureOptions, pictures: Pictures) -> None:
    """Find what cannot work before anything is drawn."""
    if pictures.video is not None:
        coding_of(pictures.video)
    names = [path for path in (pictures.picture, pictures.direct, pictures.heat_map) if path is not None]
    for path in names:
        if path.suffix.lower() != ".png":
            raise OutputError(Problem("a picture's name must end in .png", file=str(path)))
        if len(frames) > 1 and not _NUMBER.search(path.name):
            wrong = f"is one name for {len(frames)} frames (put #### where the frame number goes)"
            raise OutputError(Problem(wrong, file=str(path)))
    if names != [pictures.picture] * len(names) and (
        options.place is not None or options.third_person or not options.compare
    ):
        raise JobError("--direct and --heat-map need a comparison, which there is only from the viewer's eye")


def numbered(path: Path, frame: int) -> Path:
    """The path with the frame number in place of a run of `#` in its name."""
    return path.with_name(_NUMBER.sub(frame_text(frame), path.name))


def _write_comparison(result: Simulation, pictures: Pictures) -> Iterator[str]:
    """Write what is held against the picture, and say how far off it is."""
    if result.comparison is None or result.direct is None:
        return
    if pictures.direct is not None:
        path = numbered(pictures.direct, result.frame)
        make_folder(path.parent)
        write_png(path, result.direct, pictures.view, pictures.exposure)
        yield f"{'direct picture':<24}{path}"
    if pictures.heat_map is not None:
        path = numbered(pictures.heat_map, result.frame)
        make_folder(path.parent)
        scale = heat_scale(result.comparison.error)
        write_bytes(path, heat_map(result.comparison.error, scale))
        yield f"{'heat map':<24}{path} (white at {scale:g})"
    for label, value in figures(result.comparison):
        yield f"{label:<24}{value}"
