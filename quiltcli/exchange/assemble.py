"""Pictures of facets that another renderer has made through exported cameras, put into pages.

What another program has drawn of a facet is the facet's own raster, pixel by pixel: nothing is resampled.
It is cut at the polygon; its last pixels are repeated in the bleed. Channels beside colours, which the job
wants and the first picture has, come along, and all pictures must have them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display.check import called
from quiltcli.errors import JobError, OutputError, Problem, QuiltError, raise_all
from quiltcli.exchange.elsewhere import Made, MadeOptions, half, prepare_made, write_made
from quiltcli.exchange.layers import layers_of, read_layers
from quiltcli.formats.pictures import SUFFIXES, picture_size, read_picture
from quiltcli.images.facets import lay_facet
from quiltcli.images.names import fit_names
from quiltcli.job import JobFile
from quiltcli.job.names import Template, read_pattern
from quiltcli.render.buffers import Buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.outputs import view_lit
from quiltcli.render.report import FrameRecord
from quiltcli.render.sequence import Listener, Prepared
from quiltcli.render.setup import Stage
from quiltcli.viewer.view import View

PATTERN = "{name}{.eye}.{frame:04}"
_MOST = 20  # problems that are told one by one


@dataclass(frozen=True)
class Source:
    """Where the pictures are.

    Attributes:
        folder: the folder.
        pattern: their names in it; without an ending any that is known.
        cameras: the file of the cameras; pictures that are older are refused.
        colorspace: as for `read_picture`.
        lenient: leave what is missing dark.
        depth: what depth of the pictures measures, as for `read_layers`.
    """

    folder: Path
    pattern: str = PATTERN
    cameras: Path | None = None
    colorspace: str = "auto"
    lenient: bool = False
    depth: str | None = None


def assemble(
    job: JobFile, source: Source, options: MadeOptions, listener: Listener | None = None
) -> list[FrameRecord]:
    """Put pictures of facets into the pages of a job, and write these and the facets' images.

    Raises:
        JobError: the pattern makes no sense.
        OutputError: a picture is missing, of a wrong size, older than the cameras, or cannot be read.
        QuiltError: as for a render.
    """
    pattern = _pattern(source.pattern, job)
    if not source.folder.is_dir():
        raise OutputError(Problem("is no folder (expected one with pictures of facets)", str(source.folder)))

    def beside(stage: Stage, views: Sequence[View]) -> tuple[str, ...]:
        return Pictures(stage, source, pattern).channels(views, job.output.channels)

    ready = prepare_made(job, options, "assemble", beside)
    pictures = Pictures(ready.stage, source, pattern)
    raise_all(OutputError, _all_problems(ready, pictures, options.threads or default_threads()))
    threads = options.threads or default_threads()
    with ThreadPoolExecutor(threads) as pool:
        return write_made(ready, partial(_fill, pictures, pool), threads, listener)


def _pattern(text: str, job: JobFile) -> Template:
    try:
        pattern = read_pattern(text, "facet")
    except ValueError as error:
        raise JobError(f"--pattern: {error}") from None
    lacks = None
    if not pattern.fields & {"facet", "name"}:
        lacks = "{name} or {facet:04}"
    elif job.is_stereo and "eye" not in pattern.fields:
        lacks = "{.eye} or {eye}: there are two eyes"
    if lacks:
        raise JobError(f"--pattern: {text!r} lacks {lacks}")
    return pattern


class Pictures:
    """The pictures of facets in a folder."""

    def __init__(self, stage: Stage, source: Source, pattern: Template) -> None:
        self.stage = stage
        self.source = source
        self.names = fit_names(stage.facets.names)
        self._pattern = pattern
        self._endings = ("",) if Path(source.pattern).suffix.lower() in SUFFIXES else SUFFIXES

    def path(self, view: View, row: int) -> Path:
        """The picture of a facet, by its row in the layout: the first there is of several endings."""
        facet = int(self.stage.layout.facet[row])
        values: dict[str, int | str] = {"facet": facet, "name": self.names[facet - 1]}
        name = self._pattern.filled({**values, "frame": view.frame, "eye": view.eye})
        paths = [self.source.folder / (name + ending) for ending in self._endings]
        return next((path for path in paths if path.is_file()), paths[0])

    def channels(self, views: Sequence[View], wanted: Sequence[str]) -> tuple[str, ...]:
        """Those of the channels `wanted` beside colours that the first picture has."""
        paths = (self.path(view, row) for view in views for row in self.wanted(view))
        first = next((path for path in paths if path.is_file()), None)
        try:
            return () if first is None else layers_of(first, wanted)
        except OutputError:  # told with all that is wrong with the pictures
            return ()

    def wanted(self, view: View) -> list[int]:
        """Rows of the facets that are lit in a view."""
        lit = view_lit(self.stage, view) & (self.stage.layout.page >= 0)
        return [int(row) for row in np.flatnonzero(lit)]

    def problem(self, view: View, row: int) -> Problem | None:
        """What is wrong with the picture of a facet, by its header."""
        path = self.path(view, row)
        size = tuple(self.stage.layout.size[row].tolist())
        named = called(int(self.stage.layout.facet[row]) - 1, self.stage.facets.names)
        if not path.is_file():
            words = f"no such picture of {named}, frame {view.name}"
            return None if self.source.lenient else Problem(words, file=str(path))
        cameras = self.source.cameras
        if cameras is not None and path.stat().st_mtime < cameras.stat().st_mtime:
            return Problem(f"is older than {cameras} (render it through these cameras)", file=str(path))
        try:
            found = picture_size(path)
        except QuiltError as error:
            return error.problems[0]
        if found != size:
            words = f"is {found[0]}×{found[1]} pixels, {named} is {size[0]}×{size[1]}"
            return Problem(words, file=str(path))
        asked = self.stage.job.output.channels[1:]
        if lacking := sorted(set(asked) - set(layers_of(path, asked))):
            words = f"lacks {', '.join(lacking)}, which the first picture has"
            return Problem(f"{words} (--set output.channels=[rgba] does without)", file=str(path))
        return None


def _all_problems(ready: Prepared, pictures: Pictures, threads: int) -> Sequence[Problem]:
    if pictures.source.cameras is not None and not pictures.source.cameras.is_file():
        return [Problem("no such file of cameras", file=str(pictures.source.cameras))]
    asked = [(view, row) for view in ready.views for row in pictures.wanted(view)]
    with ThreadPoolExecutor(threads) as pool:
        found = [problem for problem in pool.map(lambda one: pictures.problem(*one), asked) if problem]
    if len(found) == len(asked) and asked and not any(pictures.path(*one).is_file() for one in asked):
        words = f"has no picture called {pictures.path(*asked[0]).name} (--pattern says how they are called)"
        return [Problem(words, file=str(pictures.source.folder))]
    return [*found[:_MOST], *_more(len(found) - _MOST, pictures.source.folder)]


def _more(count: int, folder: Path) -> Iterator[Problem]:
    if count > 0:
        yield Problem(f"and {count} pictures more are missing or wrong", file=str(folder))


def _fill(pictures: Pictures, pool: ThreadPoolExecutor, view: View, buffers: Buffers) -> Made:
    """Put the pictures of a view into its buffers."""
    stage = pictures.stage
    rows = pictures.wanted(view)
    missing = [row for row in rows if not pictures.path(view, row).is_file()]
    there = sorted(set(rows) - set(missing))
    shown = list(pool.map(partial(_lay, pictures, view, buffers), there))
    warnings = []
    if missing:
        named = called(int(stage.layout.facet[missing[0]]) - 1, stage.facets.names)
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        warnings.append(f"there is no picture of {named}{more}: dark")
    return Made(sum(shown), tuple(warnings))


def _lay(pictures: Pictures, view: View, buffers: Buffers, row: int) -> int:
    """Put the picture of a facet into the buffers; how many of its pixels show something."""
    stage = pictures.stage
    light = read_picture(pictures.path(view, row), pictures.source.colorspace)
    light[..., :3] += (1 - light[..., 3:]) * np.asarray(stage.scene.background, dtype=np.float32)
    values = half(light)
    channels: dict[str, Any] = {name: values[..., c] for c, name in enumerate("RGBA")}
    if layers := stage.job.output.channels[1:]:
        viewer = view.viewer_of(int(stage.layout.facet[row]))
        path, depth = pictures.path(view, row), pictures.source.depth
        channels |= read_layers(path, layers, stage.layout, row, viewer, depth)
    lay_facet(buffers, channels, stage.layout, row, stage.owners, stage.job.render.bleed)
    return int(np.count_nonzero(values[..., 3] > 0))
