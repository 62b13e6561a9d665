"""The stage and the view of a frame as they are drawn, and where everything is a frame later."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from quiltcli.errors import SceneError, ViewerError
from quiltcli.render.setup import Stage
from quiltcli.scene.following import followed
from quiltcli.viewer.view import View, views_at


@dataclass(frozen=True)
class Moment:
    """What is drawn of a view.

    Attributes:
        stage: with the scene of its time.
        view: the view.
        warnings: sentences for the user.
    """

    stage: Stage
    view: View
    warnings: tuple[str, ...] = ()


def moment(stage: Stage, view: View) -> Moment:
    """A view at its time; scene and viewers know where they are a frame later if the job shows motion.

    A viewer or a scene that is nowhere then is taken to rest.
    """
    now = stage.at(view.time)
    if "motion" not in stage.job.output.channels:
        return Moment(now, view)
    warnings = []
    try:
        then = next(
            other for other in views_at(stage.job, view.frame + 1, stage.clip) if other.eye == view.eye
        )
        viewers = [replace(a, then=b.eye) for a, b in zip(view.viewers, then.viewers, strict=True)]
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
    return Moment(now, view, tuple(warnings))


def _lost(names: tuple[str, ...]) -> Iterator[str]:
    if names:
        others = f" and {len(names) - 1} more" if len(names) > 1 else ""
        yield f"{names[0]}{others}: the triangles of the next frame are others, motion is 0 there"
