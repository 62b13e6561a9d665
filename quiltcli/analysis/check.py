"""Find every problem of files at once: in the YAML, in what it names, and between the two.

A stage that fails keeps only those from running that need what it would have made: a broken mesh
does not hide a viewer that looks along up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError

from quiltcli.analysis.delivery import delivery_problems
from quiltcli.analysis.parallax import stereo_notices
from quiltcli.display import Facets, load_display
from quiltcli.display.check import called
from quiltcli.display.clicks import calibrate
from quiltcli.display.notices import display_notices, surface_notices
from quiltcli.errors import Problem, QuiltError
from quiltcli.formats.inputs import is_regular
from quiltcli.formats.mesh.read import SUFFIXES
from quiltcli.formats.yaml.source import parse_yaml
from quiltcli.images.names import layout_path, names_problems
from quiltcli.job import (
    JobFile,
    PackSpec,
    SceneFile,
    check_file,
    file_kind,
    load_calibration_file,
    load_camera_file,
    load_display_file,
    load_job,
    load_lightfield_file,
    load_scene_file,
)
from quiltcli.job.layout_table import LayoutTable, read_layout_table
from quiltcli.job.load import load_mirror_file
from quiltcli.job.mirror import is_mirror
from quiltcli.job.model import attach
from quiltcli.layout import Layout, align, read_layout
from quiltcli.layout.from_job import layout_for
from quiltcli.lightfield import load_field
from quiltcli.render.crew import default_threads
from quiltcli.render.memory import estimate_text
from quiltcli.render.needs import demand_memory, method_problems, view_count
from quiltcli.render.notices import job_warnings
from quiltcli.render.ring.setup import notices as ring_notices
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.setup import facets_and_layout, texture_limits
from quiltcli.render.unseen import unseen_notices
from quiltcli.ring.build import rig_of
from quiltcli.scene import Scene, load_scene
from quiltcli.scene.motion import load_moving_scene
from quiltcli.scene.source import SceneSource
from quiltcli.scene.textures.pool import check_textures
from quiltcli.shading.lights import demand_shadows
from quiltcli.viewer.clip import settled_clip, their_lit_facets
from quiltcli.viewer.view import View, facet_problems, view_problems, viewers_of, views_of

T = TypeVar("T")
_MOST_FRAMES = 1000  # looked at for facets that are always dark


def check_files(
    paths: Iterable[Path],
    say: Callable[[str], None] = lambda notice: None,
    target: str = "",
    plan: Callable[[str], None] = lambda words: None,
) -> list[Problem]:
    """Every problem of jobs, displays, layouts, scenes and meshes, each once, file by file.

    Args:
        paths: the files.
        say: told once each what is no problem but good to know: what of a scene is not drawn.
        target: who will play a job's images, a name of `delivery.TARGETS`; empty for nobody known.
        plan: told what each job would take of the machine.
    """
    findings = _Findings(target)
    for path in paths:
        findings.check(Path(path))
    for notice in dict.fromkeys(findings.notices):
        say(notice)
    for words in dict.fromkeys(findings.plans):
        plan(words)
    return list(dict.fromkeys(findings.problems))


class _Findings:
    """The problems and notices found so far, and the displays that were built on the way."""

    def __init__(self, target: str = "") -> None:
        self.target = target
        self.problems: list[Problem] = []
        self.notices: list[str] = []
        self.plans: list[str] = []
        self.displays: dict[Path, Facets | None] = {}
        self.seen: set[Path] = set()

    def run(self, stage: Callable[..., T], *given: Any) -> T | None:
        """What a stage makes, or None with its problems noted; not run without all it is given."""
        if any(value is None for value in given):
            return None
        try:
            return stage(*given)
        except QuiltError as error:
            self.problems += error.problems
            return None

    def check(self, path: Path) -> None:
        """Check one file of any kind, and the files it names."""
        if path in self.seen:
            return
        self.seen.add(path)
        if path.suffix.lower() in SUFFIXES:
            self.scene(path, path)
            return
        problems = check_file(path)
        self.problems += problems
        kind = self.run(file_kind, path)
        if kind is not None and (kind == JobFile.kind or not problems):
            CHECKS[kind](self, path)

    def named_in(self, path: Path) -> None:
        """What can be said of the files that a wrong job names."""
        data = parse_yaml(path).data
        for key in ("display", "layout", "scene"):
            name = data.get(key)
            if isinstance(name, str) and is_regular(path.parent / name):
                self.check(path.parent / name)

    def scene(
        self, path: Path, spec: SceneFile | Path | None, job: JobFile | None = None
    ) -> tuple[Scene | None, SceneSource | None]:
        """Load a scene, and note what it has to say, and what it lacks in a job's frames."""
        source = None
        if job is None or not isinstance(spec, SceneFile):
            scene = self.run(load_scene, spec)
        else:
            scene, source = self.run(load_moving_scene, spec, float(job.fps)) or (None, None)
            lacking = list(source.problems(job.frames)) if source is not None else []
            self.problems += lacking
            source = None if lacking else source
            if scene is not None:
                drawn = (texture for textures in scene.materials.textures for texture in textures)
                self.run(check_textures, drawn, texture_limits(job))
            if scene is not None and job.render.shadows:
                self.run(demand_shadows, scene)
        if scene is not None:
            self.notices += [f"{path}: {notice}" for notice in scene.notices]
        return scene, source

    def facets(self, path: Path) -> Facets | None:
        """The facets of a display file, built once."""
        if path not in self.displays:
            found = self.run(load_display, self.run(load_display_file, path))
            self.displays[path] = found
            if found is not None:
                self.notices += [*display_notices(found), *surface_notices(found)]
        return self.displays[path]


def _check_display(findings: _Findings, path: Path) -> None:
    if is_mirror(parse_yaml(path).data):
        display = load_mirror_file(path)
        findings.run(rig_of, display)
        findings.notices += [f"{path}: {notice}" for notice in display.timing.notices()]
        return
    facets = findings.facets(path)
    own = load_display_file(path).layout
    if own is not None:
        findings.run(layout_for, own, facets)


def _check_scene(findings: _Findings, path: Path) -> None:
    findings.scene(path, load_scene_file(path))


def _check_layout(findings: _Findings, path: Path) -> None:
    layout = findings.run(read_layout, path)
    facets = _display_of(findings, read_layout_table(path))
    findings.run(align, layout, facets)


def _display_of(findings: _Findings, layout: LayoutTable) -> Facets | None:
    """The display a layout says it was made for, if it says so."""
    display = layout.head.display
    if display is None:
        return None
    if is_regular(display):
        return findings.facets(display)
    what = "is a directory (expected a display file)" if display.is_dir() else "no such file"
    findings.problems.append(layout.source.problem(["display"], f"{what}: {display}"))
    return None


def _check_job(findings: _Findings, path: Path) -> None:
    job = _job_alone(path)
    if job is None:
        findings.named_in(path)
        return
    if job.ring is not None:
        _check_ring(findings, path)
        return
    found = view_problems(job, job.frames)
    findings.problems += found
    facets = findings.facets(job.display)
    choice = job.layout or (load_display_file(job.display).layout if facets else None) or PackSpec()
    if facets is not None and job.render.scale != 1:
        facets, choice = facets_and_layout(job)
    placed = findings.run(layout_for, choice, facets, layout_path(job.output.directory))
    if placed is not None:
        findings.run(demand_memory, job, placed)
        findings.problems += names_problems(job, len(placed.pages), placed.facet.size)
        if findings.target and facets is not None:
            findings.problems += delivery_problems(job, facets.names, placed, findings.target)
        if facets is not None and not found:
            findings.notices += job_warnings(job, facets, placed)
    if facets is None and isinstance(choice, Path):
        findings.run(read_layout, choice)
    if facets is not None:
        findings.problems += facet_problems(job, facets.count) + method_problems(job, facets)
    before = len(findings.problems)
    scene, source = findings.scene(job.scene, findings.run(load_scene_file, job.scene), job)
    if placed is not None and scene is not None:
        words = estimate_text(job, placed, view_count(job), len(scene.triangles), default_threads())
        findings.plans.append(f"{path}: {words}")
    if facets is None or found:
        return
    findings.notices += stereo_notices(job, facets, scene)
    if len(findings.problems) == before:
        views = views_of(job, job.frames, settled_clip(job, facets))
        at = None if scene is None else source.scene_at if source is not None else lambda frame: scene
        unseen = findings.run(lambda: list(_unseen(job, views, facets, placed, at)))
        findings.notices += unseen or []
        if not any("stays dark" in notice for notice in unseen or ()):
            findings.notices += dark_notices(job, facets)


def _unseen(
    job: JobFile,
    views: list[View],
    facets: Facets,
    layout: Layout | None,
    scene_at: Callable[[float], Scene] | None,
) -> Iterator[str]:
    """Why views of a job show nothing, as far as it can be said of what is there."""
    how = job.render
    yield from unseen_notices(views, facets, layout, scene_at, bleed=how.bleed, culling=how.backface_culling)


def dark_notices(job: JobFile, facets: Facets) -> Iterator[str]:
    """A sentence for facets that face away from whoever looks at them in every frame; none if all do."""
    seen = np.zeros(facets.count, dtype=np.bool_)
    for viewer in viewers_of(job, job.frames[:: -(-len(job.frames) // _MOST_FRAMES)]):
        seen |= their_lit_facets(facets, viewer)
    dark = np.flatnonzero(facets.enabled & ~seen).tolist()
    if dark and seen.any():
        named = ", ".join(called(k, facets.names).removeprefix("facet ") for k in dark[:5])
        more = f" and {len(dark) - 5} more" if len(dark) > 5 else ""
        words = "faces away from the viewer" if len(dark) == 1 else "face away from the viewer"
        yield f"facet{'s' * (len(dark) > 1)} {named}{more} {words} in every frame: dark"


def _check_ring(findings: _Findings, path: Path) -> None:
    """A job of a display with a spinning mirror: all that a render looks at before it begins."""
    stage = findings.run(set_ring_stage, findings.run(load_job, path))
    if stage is not None:
        own = (f"{stage.job.scene}: {notice}" for notice in stage.scene.notices)
        findings.notices += [*own, *ring_notices(stage)]


def _check_calibration(findings: _Findings, path: Path) -> None:
    findings.run(calibrate, findings.run(load_calibration_file, path))


def _check_camera(findings: _Findings, path: Path) -> None:
    findings.run(load_camera_file, path)


def _check_lightfield(findings: _Findings, path: Path) -> None:
    file = findings.run(load_lightfield_file, path)
    # Of what moves, the job says the frames.
    frames = () if file is not None and file.is_animated else (1,)
    findings.run(load_field, file, frames)


def _job_alone(path: Path) -> JobFile | None:
    """A job whose own file is right, whatever may be wrong with the files it names."""
    found = parse_yaml(path)
    try:
        job = JobFile.model_validate(found.data, context={"base": path.parent})
    except ValidationError:
        return None
    attach(job, found.source)
    return job


CHECKS: dict[str, Callable[[_Findings, Path], None]] = {
    "quilt_display": _check_display,
    "quilt_layout": _check_layout,
    "quilt_scene": _check_scene,
    "quilt_job": _check_job,
    "quilt_lightfield": _check_lightfield,
    "quilt_calibration": _check_calibration,
    "quilt_camera": _check_camera,
}
