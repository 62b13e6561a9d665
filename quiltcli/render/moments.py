"""The stage and the view of a frame as they are drawn, while the shutter is open, and a frame later."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

from quiltcli.errors import SceneError, ViewerError
from quiltcli.render.antialiasing import sample_times
from quiltcli.render.crew import Places
from quiltcli.render.frame import Exposure
from quiltcli.render.setup import Stage
from quiltcli.scene.following import followed
from quiltcli.viewer.view import View, views_at


@dataclass(frozen=True)
class Instant:
    """One of the times at which an open shutter looks.

    Attributes:
        view: the view as it is then.
        places: of the samples that look then, in a pixel, from its centre.
    """

    view: View
    places: Places


@dataclass(frozen=True)
class Moment:
    """What is drawn of a view.

    Attributes:
        stage: with the scene of its time.
        view: the view.
        warnings: sentences for the user.
        instants: when the shutter looks; None where it does not open.
    """

    stage: Stage
    view: View
    warnings: tuple[str, ...] = ()
    instants: tuple[Instant, ...] | None = None

    def exposures(self, number: int) -> Iterator[Exposure] | None:
        """What a viewer, by their number, sees while the shutter is open; None where it does not open."""
        if self.instants is None:
            return None
        return (
            Exposure(self.stage.at(one.view.time), one.view.viewers[number], one.places)
            for one in self.instants
        )


def moment(stage: Stage, view: View) -> Moment:
    """A view at its time; scene and viewers know where they are a frame later if the job shows motion.

    A viewer or a scene that is nowhere then is taken to rest.
    """
    now, warnings = stage.at(view.time), []
    instants = tuple(_instants(stage, view)) if stage.job.render.shutter else None
    if "motion" in stage.job.output.channels:
        try:
            then = _same_eye(view, views_at(stage.job, view.frame + 1, stage.clip))
            viewers = [
                replace(a, then=b.eye, then_turn=b.camera_from_world)
                for a, b in zip(view.viewers, then.viewers, strict=True)
            ]
            view = replace(view, viewers=tuple(viewers))
        except ViewerError:
            warnings.append("the path ends here: motion is that of a viewer at rest")
        if stage.source is not None:
            try:
                scene, lost = followed(now.scene, stage.source.scene_at(view.time + 1))
                now = replace(now, scene=scene)
                warnings += _lost(lost)
            except SceneError:
                warnings.append("a sequence ends here: motion is that of a scene at rest")
    return Moment(now, view, tuple(warnings), instants)


def _instants(stage: Stage, view: View) -> Iterator[Instant]:
    """The times at which the shutter looks; a viewer whose path has ended rests where they were last."""
    how = stage.job.render
    for share, places in sample_times(how.samples, how.motion_samples):
        if places:
            with suppress(ViewerError):
                view = _same_eye(view, views_at(stage.job, view.frame, stage.clip, how.shutter * share))
            yield Instant(view, places)


def _same_eye(view: View, views: Iterable[View]) -> View:
    return next(other for other in views if other.eye == view.eye)


def _lost(names: tuple[str, ...]) -> Iterator[str]:
    if names:
        others = f" and {len(names) - 1} more" if len(names) > 1 else ""
        yield f"{names[0]}{others}: the triangles of the next frame are others, motion is 0 there"
