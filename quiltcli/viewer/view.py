"""A view: what is drawn, named, attributed, reported and farmed out at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from quiltcli.errors import Problem, QuiltError, ViewerError, raise_all
from quiltcli.job import JobFile
from quiltcli.viewer.viewer import Viewer, viewer_at


@dataclass(frozen=True)
class View:
    """One frame for one eye: what one set of pages holds.

    Attributes:
        frame: frame number.
        eye: `left` or `right`, empty where there is one eye; it stands in the files' names.
        viewers: whoever looks, each at facets of their own.
    """

    frame: int
    eye: str
    viewers: tuple[Viewer, ...]

    @property
    def viewer(self) -> Viewer:
        """The first viewer, whose attributes pages carry."""
        return self.viewers[0]

    def viewer_of(self, facet: int) -> Viewer:
        """The viewer a facet (1-based id) belongs to; the first where it belongs to none."""
        theirs = (viewer for viewer in self.viewers if viewer.facets is None or facet in viewer.facets)
        return next(theirs, self.viewer)

    @property
    def name(self) -> str:
        """Frame, and eye where there are two, in words."""
        return f"{self.frame} ({self.eye})" if self.eye else str(self.frame)

    @property
    def key(self) -> tuple[int, str]:
        """What tells the view from all others of its job."""
        return self.frame, self.eye


def views_at(job: JobFile, frame: int, clip: str | None = None) -> tuple[View, ...]:
    """The views of a frame, in the order in which they are drawn; the frame number alone decides.

    Args:
        job: the job.
        frame: frame number.
        clip: what near and far cut, `planar` or `distance`, where that has been settled.

    Raises:
        ViewerError: a path gives no usable pose at this frame.
    """
    viewer = replace(viewer_at(job.viewer, frame, job.render.depth), clip=clip)
    return (View(frame, "", (viewer,)),)


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
