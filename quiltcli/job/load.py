"""Read the four kinds of file into their models, with every problem of a file in one error."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from quiltcli.errors import JobError, Problem
from quiltcli.formats.inputs import check_input
from quiltcli.formats.yaml.source import Source, YamlFile, parse_text, parse_yaml
from quiltcli.formats.yaml.syntax import read_text
from quiltcli.job.display import DisplayFile
from quiltcli.job.job import JobFile
from quiltcli.job.layout import LayoutFile, PackSpec
from quiltcli.job.messages import KINDS, NO_KIND, problems_of, version_problem
from quiltcli.job.model import MESHES, YAMLS, FileModel, attach
from quiltcli.job.overrides import apply_sets
from quiltcli.job.scene import ObjectSpec, SceneFile

M = TypeVar("M", bound=FileModel)
T = TypeVar("T")
_FIRST_KEY = re.compile(r"(?:[ \t]*(?:#[^\n]*)?\n)*(\w+):")
MODELS: dict[str, type[FileModel]] = {m.kind: m for m in (DisplayFile, LayoutFile, SceneFile, JobFile)}


def load_display_file(path: Path | str) -> DisplayFile:
    """Read a display file.

    Raises:
        JobError: with every problem of the file.
    """
    return _load(DisplayFile, parse_yaml(path))


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
    problems, display = tried(load_display_file, job.display)
    problems += tried(load_scene_file, job.scene)[0] if job.scene.suffix.lower() in YAMLS else []
    if problems or display is None:
        raise JobError(problems)
    if job.layout is None:
        job = job.model_copy(update={"layout": display.layout or PackSpec()})
        attach(job, found.source)
    return job


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
    """Which kind of file this is: `quilt_display`, `quilt_layout`, `quilt_scene` or `quilt_job`.

    Raises:
        JobError: it is none of them.
    """
    text = read_text(Path(path))
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
