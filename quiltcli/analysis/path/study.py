"""What a take is: how often and how well somebody was seen, before and after filtering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from quiltcli.analysis.path.error import PictureError, picture_error
from quiltcli.display import load_display
from quiltcli.errors import JobError, Problem
from quiltcli.formats.yaml.source import Source
from quiltcli.geometry import BoolArray, FloatArray, dot
from quiltcli.job import JobFile, RecordedSpec, ViewerSpec, load_display_file, load_job
from quiltcli.job.messages import problems_of
from quiltcli.job.model import YAMLS, attach
from quiltcli.job.overrides import apply_sets
from quiltcli.viewer.recorded.clean import Cleaned, Run
from quiltcli.viewer.recorded.filters import change_mm
from quiltcli.viewer.recorded.head import Head, read_head
from quiltcli.viewer.recorded.take import Take
from quiltcli.viewer.view import views_of


@dataclass(frozen=True)
class PathStudy:
    """A take and what is to be said of it.

    Attributes:
        file: what was asked about.
        head: the take, its runs of good samples, and the same filtered.
        filter: its filter's kind.
        moved_mm: (n,) how far each good sample was moved by the filter.
        speed: (m,) speeds from one good sample to the next, m/s.
        error: what the measured noise does to a job's pictures; None where no job was asked about, or
            no noise was measured.
        seconds: first and last second that the job's frames show, or None.
        outlines: polygons (n, 3) of the job's display.
    """

    file: Path
    head: Head
    filter: str
    moved_mm: FloatArray
    speed: FloatArray
    error: PictureError | None = None
    seconds: tuple[float, float] | None = None
    outlines: tuple[FloatArray, ...] = ()

    @property
    def places(self) -> FloatArray:
        """Good samples (n, 3), metres."""
        return np.concatenate([run.positions for run in self.head.cleaned.runs])


def study_path(path: Path, sets: Sequence[str] = (), viewer: str | None = None) -> PathStudy:
    """What a take, or the path of a job's viewer, is.

    Args:
        path: a take, or a job.
        sets: settings `KEY=VALUE` of the job, or what is to be said of a take beside its file.
        viewer: whose path, in a job with several viewers.

    Raises:
        QuiltError: the file cannot be read, or is not what is said of it.
    """
    if path.suffix.lower() in YAMLS:
        return _job_study(path, sets, viewer)
    spec = stated_spec(path, sets)
    return _study(path, read_head(spec), spec.filter.kind)


def _study(path: Path, head: Head, kind: str) -> PathStudy:
    moved = [change_mm(*pair) for pair in zip(head.cleaned.runs, head.runs, strict=True)]
    speeds = [_speeds(run) for run in head.cleaned.runs]
    return PathStudy(path, head, kind, np.concatenate(moved), np.concatenate(speeds))


def _speeds(run: Run) -> FloatArray:
    way = np.diff(run.positions, axis=0)
    return np.asarray(np.sqrt(dot(way, way)) / np.diff(run.times))


def _job_study(path: Path, sets: Sequence[str], name: str | None) -> PathStudy:
    job = load_job(path, sets)
    person, spec = _person(job, path, name)
    facets = load_display(load_display_file(job.display))
    views = views_of(job, job.frames)
    viewers = [viewer for view in views for viewer in view.viewers if viewer.name == person]
    recorded = spec.path.recorded
    if recorded is not None:
        head, kind = read_head(recorded), recorded.filter.kind
        seconds = [recorded.start + (f - recorded.start_frame) / float(job.fps) for f in job.frames]
    else:
        seconds = [(f - job.frames[0]) / float(job.fps) for f in job.frames]
        one_a_frame = viewers[:: len(viewers) // len(seconds)]
        eyes = np.stack([v.eye if v.head is None else v.head for v in one_a_frame])
        head, kind = _still_head(np.array(seconds), eyes, path), "none"
    found = _study(path, head, kind)
    noise = head.cleaned.noise
    return PathStudy(
        file=path,
        head=head,
        filter=kind,
        moved_mm=found.moved_mm,
        speed=found.speed,
        error=picture_error(facets, viewers, noise) if noise > 0 else None,
        seconds=(min(seconds), max(seconds)),
        outlines=tuple(facets.corners[a:b] for a, b in pairwise(facets.corner_start.tolist())),
    )


def _person(job: JobFile, path: Path, name: str | None) -> tuple[str, ViewerSpec]:
    """The viewer asked for, or the only one."""
    people = job.people
    if name is None and len(people) == 1:
        return next(iter(people.items()))
    if name not in people:
        words = f"expected one of the viewers {', '.join(people)}" if len(people) > 1 else "has one viewer"
        raise JobError(Problem(f"{words}, got {name!r}" if name else f"{words} (--viewer)", str(path)))
    return str(name), people[str(name)]


def _still_head(times: FloatArray, places: FloatArray, path: Path) -> Head:
    """Poses that a job's frames show, as a take."""
    order = np.argsort(times)
    times, places = times[order], places[order]
    lost: BoolArray = np.zeros(len(times), dtype=np.bool_)
    run = Run(times, places, None)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    cleaned = Cleaned((run,), (), (), step, 0, 0, np.empty(0), 0.0, None)
    return Head(Take(times, places, None, lost, "viewer", path, is_curve=True), cleaned, (run,))


def stated_spec(path: Path, sets: Sequence[str] = ()) -> RecordedSpec:
    """A take with what is said of it as a job would say it, by settings `KEY=VALUE`.

    Raises:
        JobError: something of it is impossible, or the file is not there.
    """
    data: dict[str, object] = {"file": str(path)}
    source = apply_sets(data, Source(), sets)
    try:
        spec = RecordedSpec.model_validate(data, context={"base": Path()})
    except ValidationError as error:
        raise JobError(problems_of(error, RecordedSpec, source)) from None
    attach(spec, source)
    return spec
