"""What a user should know of a render: once before it begins, and of frames that show little or nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from quiltcli.display import Facets
from quiltcli.display.notices import display_notices
from quiltcli.geometry import BoolArray
from quiltcli.job import JobFile, PackSpec
from quiltcli.job.frames import format_frames
from quiltcli.layout import Layout
from quiltcli.projection.camera import WIDEST, beyond_frustum
from quiltcli.render.corrections import correction_notices
from quiltcli.render.needs import disk_warnings, number_warnings, page_warnings
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import behind_words, their_lit_facets
from quiltcli.viewer.edge_on import edge_on_notices
from quiltcli.viewer.recorded.head import take_notices
from quiltcli.viewer.view import viewers_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.embree import has_embree


def frame_warnings(stage: Stage, viewer: Viewer, lit: BoolArray, pairs: int, visible: int) -> Iterator[str]:
    """What a user should know of a frame that shows little or nothing."""
    if not lit.any():
        yield "the eye is behind every facet: nothing is lit"
    elif not pairs:
        yield "no triangle of the scene shows on any facet"
    elif not visible:
        yield "no pixel shows the scene"
    if words := behind_words(stage.facets, [viewer]):
        yield words


def stage_warnings(stage: Stage, frames: Sequence[int] | None = None) -> Iterator[str]:
    """What is worth a second look before frames (the job's by default) are drawn, scene apart."""
    yield from job_warnings(stage.job, stage.facets, stage.layout, frames)


def job_warnings(
    job: JobFile, facets: Facets, layout: Layout, frames: Sequence[int] | None = None
) -> Iterator[str]:
    """The same of a job of which nothing is set up yet but its display and its layout."""
    yield from display_notices(facets)
    placed = layout.page[layout.page >= 0].tolist()
    if job.render.bleed > layout.padding and len(set(placed)) < len(placed):
        bleed, padding = job.render.bleed, layout.padding
        wider = f"set layout.padding to {bleed}" if isinstance(job.layout, PackSpec) else ""
        wider = f"pack it with --padding {bleed}" if isinstance(job.layout, Path) else wider
        yield (
            f"the bleed of {bleed} pixels is wider than the layout's padding of {padding}: neighbours share"
            f" what lies between them ({f'{wider}, or ' * bool(wider)}set render.bleed to {padding})"
        )
    viewers = viewers_of(job, job.frames[:1])
    if job.render.depth == "planar" and not all(viewer.aimed for viewer in viewers):
        yield (
            "the path does not say where the head looks, on which no picture for one eye depends; depth is"
            " measured along the line to the display's middle (render.depth: radial measures the distance)"
        )
    if job.render.method == "twopass":
        yield from _narrow_pictures(facets, viewers_of(job, job.frames if frames is None else frames))
    yield from correction_notices(job, facets, job.frames if frames is None else frames)
    yield from edge_on_notices(facets, viewers_of(job, job.frames if frames is None else frames))
    for spec in job.people.values():
        if spec.path.recorded is not None:
            yield from take_notices(spec.path.recorded)
    others = sorted(set(frames or ()) - set(job.frames))
    if others:
        known = format_frames(job.frames)
        words = f"frame {others[0]} is" if len(others) == 1 else f"frames {format_frames(others)} are"
        yield f"{words} not among the job's frames {known} (the viewer is where its path goes on to)"
    yield from page_warnings(layout)
    yield from number_warnings(job, frames)
    yield from disk_warnings(job, layout, frames)
    if not has_embree():
        yield "embreex is not installed: triangles are sorted to facets without it, which takes longer"


def _narrow_pictures(facets: Facets, viewers: Iterable[Viewer]) -> Iterator[str]:
    """Frames in which the picture of a render in two passes does not hold all lit facets."""
    frames = [v.frame for v in viewers if beyond_frustum(v, facets, their_lit_facets(facets, v))]
    if frames:
        which = format_frames(sorted(set(frames)))
        yield (
            f"render.method twopass draws {WIDEST:.0f} degrees about the look direction: in frames"
            f" {which} lit facets reach beyond, and their pixels there stay empty (every other method draws"
            " all around)"
        )
