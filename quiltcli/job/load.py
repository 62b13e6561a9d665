"""Read every kind of file into its model, with every problem of a file in one error."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from quiltcli.errors import JobError, Problem
from quiltcli.formats.inputs import check_input
from quiltcli.formats.yaml.source import Source, YamlFile, parse_text, parse_yaml
from quiltcli.formats.yaml.syntax import read_yaml_text
from quiltcli.job.calibration import CalibrationFile
from quiltcli.job.camera import CameraFile
from quiltcli.job.display import DisplayFile
from quiltcli.job.job import RING_METHODS, JobFile
from quiltcli.job.layout import LayoutFile, PackSpec, UvLayoutSpec
from quiltcli.job.lightfield import LightfieldFile
from quiltcli.job.messages import KINDS, NO_KIND, problems_of, version_problem
from quiltcli.job.mirror import KIND, MirrorDisplayFile, is_mirror
from quiltcli.job.model import MESHES, YAMLS, FileModel, attach
from quiltcli.job.overrides import apply_sets
from quiltcli.job.scene import ObjectSpec, SceneFile

M = TypeVar("M", bound=FileModel)
T = TypeVar("T")
_FIRST_KEY = re.compile(r"(?:[ \t]*(?:#[^\n]*)?\n)*(\w+):")
MODELS: dict[str, type[FileModel]] = {
    **{m.kind: m for m in (DisplayFile, LayoutFile, SceneFile, JobFile, LightfieldFile, CalibrationFile)},
    CameraFile.kind: CameraFile,
    "quilt_lightfield360": MirrorDisplayFile,
}


def load_display_file(path: Path | str) -> DisplayFile:
    """Read a display file.

    Raises:
        JobError: with every problem of the file.
    """
    found = parse_yaml(path)
    if is_mirror(found.data):
        words = f"is {KIND}, a display without facets (expected one of facets)"
        raise JobError(found.source.problem(("kind",), words))
    return _load(DisplayFile, found)


def load_mirror_file(path: Path | str) -> MirrorDisplayFile:
    """Read the display file of a 360° light field display.

    Raises:
        JobError: with every problem of the file.
    """
    found = parse_yaml(path)
    if not is_mirror(found.data) and "kind" not in found.data and DisplayFile.kind in found.data:
        raise JobError(found.source.problem((), f"is a display of facets (expected kind: {KIND})"))
    return _load(MirrorDisplayFile, found)


def is_mirror_file(path: Path | str) -> bool:
    """Whether a YAML file is a 360° light field display (JobError: it cannot be read)."""
    return is_mirror(parse_yaml(path).data)


def load_any_display(path: Path | str) -> DisplayFile | MirrorDisplayFile:
    """Read a display file of any kind.

    Raises:
        JobError: with every problem of the file.
    """
    return load_mirror_file(path) if "kind" in parse_yaml(path).data else load_display_file(path)


def load_camera_file(path: Path | str) -> CameraFile:
    """Read a camera file.

    Raises:
        JobError: with every problem of the file.
    """
    return _load(CameraFile, parse_yaml(path))


def load_layout_file(path: Path | str) -> LayoutFile:
    """Read a layout file.

    Raises:
        JobError: with every problem of the file.
    """
    return layout_of(parse_yaml(path))


def layout_of(found: YamlFile) -> LayoutFile:
    """As `load_layout_file`, of what has been parsed."""
    return _load(LayoutFile, found)


def load_scene_file(path: Path | str) -> SceneFile:
    """Read a scene file; a mesh file becomes a scene of that one object.

    Raises:
        JobError: with every problem of the file.
    """
    path = Path(path)
    if path.suffix.lower() in MESHES:
        check_input(path, JobError, "a mesh")
        scene = SceneFile(objects=(ObjectSpec(mesh=path),))
        attach(scene, Source(path))
        return scene
    return _load(SceneFile, parse_yaml(path))


def load_lightfield_file(path: Path | str) -> LightfieldFile:
    """Read a light field file.

    Raises:
        JobError: with every problem of the file.
    """
    return _load(LightfieldFile, parse_yaml(path))


def load_calibration_file(path: Path | str) -> CalibrationFile:
    """Read a calibration file.

    Raises:
        JobError: with every problem of the file.
    """
    return _load(CalibrationFile, parse_yaml(path))


def load_job(path: Path | str, sets: Sequence[str] = ()) -> JobFile:
    """Read a job file, and look through the display and scene files it names.

    Args:
        path: the job file.
        sets: settings `KEY=VALUE` of the command line, that change the file's values.

    Returns:
        The job, defaults included: `layout` is never None, for an absent one is the display's own
        or the packing defaults.

    Raises:
        JobError: with every problem of the job, or of the files it names.
    """
    found = parse_yaml(path)
    found.source = apply_sets(found.data, found.source, sets)
    output = found.data.setdefault("output", {})
    if isinstance(output, dict):
        # A default directory, too, is relative to the job and not to where quilt was started.
        output.setdefault("directory", "out")
    job = _load(JobFile, found)
    problems, display = tried(load_any_display, job.display)
    if job.scene.suffix.lower() in YAMLS:
        problems += tried(load_scene_file if job.lightfield is None else load_lightfield_file, job.scene)[0]
    if problems or display is None:
        raise JobError(problems)
    _fits(job, display)
    if job.ring is not None and job.render.method not in RING_METHODS:
        # The default is another display's: what is written down shall be what was done.
        render = job.render.model_copy(update={"method": RING_METHODS[0]})
        job = job.model_copy(update={"render": render})
        attach(job, found.source)
    if job.layout is None and isinstance(display, DisplayFile):
        job = job.model_copy(update={"layout": _default_layout(display)})
        attach(job, found.source)
    projection = display.projection if isinstance(display, DisplayFile) else None
    if projection is not None and "depth" not in job.render.model_fields_set:
        # All around the eye, a plane's depth would draw nothing behind it.
        render = job.render.model_copy(update={"depth": "radial"})
        job = job.model_copy(update={"render": render})
        attach(job, found.source)
    return job


def _fits(job: JobFile, display: DisplayFile | MirrorDisplayFile) -> None:
    """Viewers all around belong to a spinning mirror, and to nothing else (JobError)."""
    if isinstance(display, MirrorDisplayFile) and job.ring is None:
        key = "viewer" if job.viewer is not None else "viewers"
        words = f"{job.display} is {KIND}: expected ring, the viewers all around, instead"
        raise JobError(job.source.problem((key,), words))
    if isinstance(display, DisplayFile) and job.ring is not None:
        words = f"belongs to {KIND}, but {job.display} is a display of facets (expected viewer)"
        raise JobError(job.source.problem(("ring",), words))


def _default_layout(display: DisplayFile) -> PackSpec | UvLayoutSpec:
    """What an absent layout means: the display's own, a projection's picture alone, or packing."""
    if display.projection is not None and display.projection.place is None:
        return PackSpec(size=display.projection.pixels, padding=0)
    return display.layout or PackSpec()


def pack_spec(**wishes: Any) -> PackSpec:
    """How to pack, from values that stand in no file; `PackSpec` has their names, meanings and defaults.

    Raises:
        JobError: with everything that makes no sense.
    """
    try:
        return PackSpec.model_validate(wishes)
    except ValidationError as error:
        raise JobError(problems_of(error, PackSpec, Source())) from None


def file_kind(path: Path | str) -> str:
    """Which kind of file this is: `quilt_display`, `quilt_job` and so on.

    Raises:
        JobError: it is none of them.
    """
    text = read_yaml_text(Path(path))
    # A layout may be long: its first line is enough, for whoever reads it finds what is wrong.
    if (first := _FIRST_KEY.match(text)) and first[1] == LayoutFile.kind:
        return LayoutFile.kind
    found = parse_text(text, Path(path))
    kinds = [key for key in found.data if key in KINDS]
    if not kinds:
        raise JobError(found.source.problem((), NO_KIND))
    return str(kinds[0])


def tried(load: Callable[[Path], T], path: Path) -> tuple[list[Problem], T | None]:
    """Problems of loading a file, and what was loaded."""
    try:
        return [], load(path)
    except JobError as error:
        return list(error.problems), None


def _load(model: type[M], found: YamlFile) -> M:
    """Validate the data of a file, and tell the model where it was written."""
    source, problems = found.source, list(found.problems)
    version = version_problem(found.data, model.kind, source)
    if version is not None:
        raise JobError(_in_order([*problems, version]))
    base = (source.path or Path()).parent
    try:
        loaded = model.model_validate(found.data, context={"base": base})
    except ValidationError as error:
        # A value that could not be read is None by now: what that leads to need not be said.
        known = {(problem.key, problem.line, problem.column) for problem in problems}
        more = problems_of(error, model, source)
        problems += [p for p in more if not p.line or (p.key, p.line, p.column) not in known]
        raise JobError(_in_order(problems)) from None
    if problems:
        raise JobError(problems)
    attach(loaded, source)
    return loaded


def _in_order(problems: list[Problem]) -> list[Problem]:
    """Problems as one reads the file; those of the command line, which have no line, come first."""
    return sorted(dict.fromkeys(problems), key=lambda problem: (problem.line, problem.column))
