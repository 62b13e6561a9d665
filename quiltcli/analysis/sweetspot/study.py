"""How far may a person stand from the eye the content was made for? The whole answer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.sweetspot.audience import MINIMISED, Served, audience_floor, best_eye, served
from quiltcli.analysis.sweetspot.content import Content, Point, content_at, default_content
from quiltcli.analysis.sweetspot.distortion import Figures, Show, distortion, lit_points, show
from quiltcli.analysis.sweetspot.floor import (
    Area,
    Floor,
    Reach,
    area_about,
    area_under,
    default_step,
    floor_of,
    reaches,
)
from quiltcli.analysis.sweetspot.samples import sample_facets
from quiltcli.display import Facets, demand_place, load_display
from quiltcli.errors import JobError, Problem
from quiltcli.geometry import FloatArray
from quiltcli.job import load_display_file, load_job
from quiltcli.viewer.view import views_at

_SEARCH_SAMPLES = 400
_ROOM = 3  # times as far as one may go, on a map of the default size


@dataclass(frozen=True)
class Question:
    """What is asked.

    Attributes:
        eye: (3,) the eye the content is drawn for; None takes the best one for the audience.
        content: where the content is; None takes the middle of the display.
        height: of the eyes on the map, metres; None takes the eye's.
        area: of the map, (x0, z0, x1, z1) metres; None takes a square about the eye.
        step: between places of the map, metres; None takes a thirtieth to a seventieth of the map.
        limit_deg: distortion that is borne.
        audience: area of an audience to find the best eye for.
        minimise: `mean` or `worst` distortion of the audience.
        samples: points on the facets, about.
    """

    eye: FloatArray | None
    content: Content | None = None
    height: float | None = None
    area: Area | None = None
    step: float | None = None
    limit_deg: float = 2.0
    audience: Area | None = None
    minimise: str = "mean"
    samples: int = 2000


@dataclass(frozen=True)
class SweetSpot:
    """The answer.

    Attributes:
        display: the display.
        shown: what the eye is shown.
        content: where the content is.
        floor: the places of the map.
        figures: distortion there, (nz·nx,) arrays.
        limit_deg: distortion that is borne.
        reach: room under the limit, by measure.
        audience: area of the audience, or None.
        here: how the eye serves the audience, or None.
        best: the eye that serves it best, or None.
        minimise: what is smallest for it.
    """

    display: Facets
    shown: Show
    content: Content
    floor: Floor
    figures: Figures
    limit_deg: float
    reach: dict[str, Reach]
    audience: Area | None
    here: Served | None
    best: Served | None
    minimise: str

    def map(self, measure: str) -> FloatArray:
        """Distortion (nz, nx), degrees, by `mean`, `p95`, `worst`, or the share that is `dark`."""
        values: FloatArray = getattr(self.figures, measure)
        return values.reshape(len(self.floor.z), len(self.floor.x))


def ask(
    display: Path,
    job: Path | None = None,
    frame: int | None = None,
    *,
    eye: Point | None = None,
    depth: float | None = None,
    distance: float | None = None,
    at: Point | None = None,
    **how: Any,
) -> tuple[Facets, Question]:
    """Read what a question names.

    Args:
        display: a display file.
        job: a job file whose eye is taken.
        frame: at this frame; the job's first by default.
        eye: the eye itself.
        depth: of the content, as in `content_at`.
        distance: of the content.
        at: a point of the content.
        how: the other fields of `Question`.

    Raises:
        JobError: a file cannot be read, or options contradict one another.
    """
    content = content_at(depth, distance, at)
    if job is not None and eye is not None:
        raise JobError("there are two eyes: give --eye or --job, not both")
    if job is None and frame is not None:
        raise JobError("--frame needs the --job it is a frame of")
    place = None if eye is None else np.array(eye, dtype=np.float64)
    if job is not None:
        spec = load_job(job)
        place = views_at(spec, spec.frames[0] if frame is None else frame)[0].viewer.eye
    facets = load_display(load_display_file(display))
    demand_place(facets, "quilt sweetspot")
    return facets, Question(place, content, **how)


def sweet_spot(facets: Facets, asked: Question) -> SweetSpot:
    """Find from where the content of a display may be looked at.

    Raises:
        JobError: the question makes no sense, or nothing is to be seen.
    """
    height = _checked_height(facets, asked)
    samples = sample_facets(facets, asked.samples)
    people = None if asked.audience is None else audience_floor(asked.audience, height)
    content = asked.content or default_content(samples, _someone(asked, height))
    best = None
    if people is not None:
        few = sample_facets(facets, min(_SEARCH_SAMPLES, asked.samples))
        found = best_eye(few, content, people, asked.minimise)
        best = served(samples, content, found.eye, people)
    eye = asked.eye if asked.eye is not None else best.eye if best is not None else np.zeros(3)
    shown = show(samples, content, eye)
    if not shown.shown.any():
        raise JobError(_nothing(shown, content))
    floor = _floor(shown, height, asked)
    figures = distortion(shown, floor.places)
    return SweetSpot(
        display=facets,
        shown=shown,
        content=content,
        floor=floor,
        figures=figures,
        limit_deg=asked.limit_deg,
        reach=_reaches(shown, floor, figures, asked.limit_deg),
        audience=asked.audience,
        here=None if people is None else served(samples, content, eye, people),
        best=best,
        minimise=asked.minimise,
    )


def _checked_height(facets: Facets, asked: Question) -> float:
    """Height of the eyes on the map, when the question makes sense."""
    numbers = {"--limit-deg": asked.limit_deg, "--step": asked.step, "--samples": asked.samples}
    for option, value in numbers.items():
        if value is not None and not 0 < value < math.inf:
            raise JobError(f"{option} is {value:g}, expected a number above 0")
    if asked.height is not None and not math.isfinite(asked.height):
        raise JobError(f"--height is {asked.height:g}, expected metres")
    if asked.minimise not in MINIMISED:
        raise JobError(f"--minimise is {asked.minimise!r}, expected one of {', '.join(MINIMISED)}")
    if not facets.enabled.any():
        raise JobError(Problem("no facet of this display is enabled", file=facets.path))
    if asked.eye is not None:
        return float(asked.eye[1]) if asked.height is None else asked.height
    if asked.audience is None:
        raise JobError("there is no eye: give --eye x,y,z or --job JOB.yaml, or an --audience to find it for")
    if asked.height is None:
        raise JobError("how high are the eyes of the --audience? give --height, metres, or --eye x,y,z")
    return asked.height


def _someone(asked: Question, height: float) -> FloatArray:
    """The eye, or one in the middle of the audience."""
    if asked.eye is not None or asked.audience is None:
        return np.zeros(3) if asked.eye is None else asked.eye
    x0, z0, x1, z1 = asked.audience
    return np.array([(x0 + x1) / 2, height, (z0 + z1) / 2])


def _nothing(shown: Show, content: Content) -> str:
    """Why the eye sees nothing."""
    eye = ",".join(f"{value:g}" for value in shown.eye)
    if lit_points(shown.samples, shown.eye).any():
        return f"content {content} is beside or behind the eye at {eye}: no facet shows it"
    return f"no facet is lit towards the eye at {eye}"


def _floor(shown: Show, height: float, asked: Question) -> Floor:
    """The map that is asked for, or one about the eye: of the display's size, or less that shows it all."""
    if asked.area is not None:
        x0, z0, x1, z1 = asked.area
        return floor_of(asked.area, asked.step or default_step(max(x1 - x0, z1 - z0, 1e-9) / 2), height)
    size = float(np.ptp(shown.samples.point, axis=0).max())
    wide = floor_of(area_about(shown.eye, size, size / 20), size / 20, height)
    metres, free = reaches(shown, wide, asked.limit_deg)["p95"]
    if not free:
        size = min(size, max(_ROOM * max(metres.values()), size / 20))
    step = asked.step or default_step(size)
    return floor_of(area_about(shown.eye, size, step), step, height)


def _reaches(shown: Show, floor: Floor, figures: Figures, limit: float) -> dict[str, Reach]:
    """Room under the limit, by measure."""
    found = {}
    for measure, (metres, free) in reaches(shown, floor, limit).items():
        values = getattr(figures, measure).reshape(len(floor.z), len(floor.x))
        found[measure] = Reach(area_under(floor, values, limit), metres, free)
    return found
