"""A view: what is drawn, named, attributed, reported and farmed out at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from quiltcli.display import display_points, load_display
from quiltcli.errors import Problem, QuiltError, ViewerError, raise_all
from quiltcli.geometry import FloatArray
from quiltcli.job import JobFile, ViewerSpec, load_display_file
from quiltcli.viewer.viewer import Viewer, viewer_at

EYES = ("left", "right")


@dataclass(frozen=True)
class View:
    """One frame for one eye: what one set of pages holds.

    Attributes:
        frame: frame number.
        eye: `left` or `right`, empty where there is one eye; it stands in the files' names.
        viewers: whoever looks, each at facets of their own.
        time: when they look, in frames: later than `frame` where the right eye looks later.
        in_parts: whether both eyes' images are parts of one file, which is not named for an eye then.
    """

    frame: int
    eye: str
    viewers: tuple[Viewer, ...]
    time: float
    in_parts: bool = False

    @property
    def viewer(self) -> Viewer:
        """The first viewer, whose attributes pages carry."""
        return self.viewers[0]

    def viewer_of(self, facet: int) -> Viewer:
        """The viewer a facet (1-based id) belongs to; the first where it belongs to none."""
        theirs = (viewer for viewer in self.viewers if viewer.sees(facet))
        return next(theirs, self.viewer)

    @property
    def name(self) -> str:
        """Frame, and eye where there are two, in words."""
        return f"{self.frame} ({self.eye})" if self.eye else str(self.frame)

    @property
    def file_key(self) -> tuple[int, str]:
        """Frame and eye as the names of its files have them."""
        return self.frame, "" if self.in_parts else self.eye

    @property
    def part(self) -> str:
        """The part of its files that is this view's; empty where they have one part."""
        return self.eye if self.in_parts else ""


def views_at(job: JobFile, frame: int, clip: str | None = None, later: float = 0.0) -> tuple[View, ...]:
    """The views of a frame, in the order in which they are drawn; the frame number alone decides.

    Args:
        job: the job.
        frame: frame number.
        clip: what near and far cut, `planar` or `distance`, where that has been settled.
        later: how much later they look, in frames.

    Raises:
        ViewerError: a path gives no usable pose at this time.
    """
    if not job.is_stereo:
        heads = (_head(job, name, frame + later, clip) for name in job.people)
        return (View(frame, "", tuple(heads), frame + later),)
    views = []
    for eye in EYES:
        own = any(_eye_time(spec) == "own" for spec in job.people.values())
        late = later + 0.5 * (own and eye == "right")
        viewers = (_one_eye(job, name, frame, eye, clip, later) for name in job.people)
        views.append(View(frame, eye, tuple(viewers), frame + late, job.output.stereo == "parts"))
    return tuple(views)


def _head(job: JobFile, name: str, time: float, clip: str | None) -> Viewer:
    """One viewer at a time in frames, with one eye at the head's place."""
    spec = job.people[name]
    # Where each eye is depends on how the head is turned; what one eye sees does not.
    middle = None if spec.stereo else partial(_middle_of, job)
    head = viewer_at(spec, time, job.render.depth, float(job.fps), middle)
    return replace(head, clip=clip, name=name, facets=spec.facets)


def _one_eye(job: JobFile, name: str, frame: int, eye: str, clip: str | None, later: float) -> Viewer:
    """One eye of a viewer: half the separation from the head's place, along the head's right axis."""
    spec = job.people[name]
    assert spec.stereo is not None
    head = _head(job, name, frame + later + 0.5 * (eye == "right" and _eye_time(spec) == "own"), clip)
    right = head.camera_from_world[0]
    side = spec.stereo.separation / 2 * (1 if eye == "right" else -1)
    return replace(head, frame=frame, eye=head.eye + side * right, head=head.eye)


def _middle_of(job: JobFile) -> FloatArray:
    """The middle (3,) of the box around the job's display, world metres."""
    return display_middle(job.display, job.display.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def display_middle(path: Path, changed: int) -> FloatArray:
    """The middle (3,) of the box around a display, world metres."""
    corners = display_points(load_display(load_display_file(path)))
    return np.asarray((corners.min(axis=0) + corners.max(axis=0)) / 2)


def _eye_time(spec: ViewerSpec) -> str:
    return spec.stereo.eye_time if spec.stereo else "same"


def views_of(job: JobFile, frames: Iterable[int], clip: str | None = None) -> list[View]:
    """The views of some frames; for `clip` see `views_at`.

    Raises:
        ViewerError: with the problems of the paths, each said once, twenty at most.
    """
    views: list[View] = []
    problems: dict[Problem, None] = {}
    for frame in frames:
        try:
            views += views_at(job, frame, clip)
        except QuiltError as error:
            problems |= dict.fromkeys(error.problems)
            if len(problems) >= 20:
                break
    raise_all(ViewerError, list(problems))
    return views


def facet_problems(job: JobFile, count: int) -> list[Problem]:
    """What is wrong with the facets that viewers are given, on a display of so many."""
    return [
        spec.source.problem("facets", f"there is no facet {max(spec.facets)} (the display has 1 to {count})")
        for spec in job.people.values()
        if spec.facets and max(spec.facets) > count
    ]


def by_file(views: Iterable[View]) -> list[tuple[View, ...]]:
    """The views in groups that share their files: both eyes where they are parts, else each alone."""
    groups: dict[tuple[int, str], list[View]] = {}
    for view in views:
        groups.setdefault(view.file_key, []).append(view)
    return [tuple(group) for group in groups.values()]


def viewers_of(job: JobFile, frames: Iterable[int]) -> list[Viewer]:
    """Everybody who looks in some frames, eye by eye; errors as for `views_of`."""
    return [viewer for view in views_of(job, frames) for viewer in view.viewers]


def view_problems(job: JobFile, frames: Iterable[int]) -> list[Problem]:
    """Problems of the paths over some frames, each said once."""
    try:
        views_of(job, frames)
    except ViewerError as error:
        return list(error.problems)
    return []
