"""Jobs as render farms take them: an Open Job Description template, or an outline of OpenCue.

Both hand out frames, and eyes and facets if wanted, and call `quilt render --resume`, so a task that is given
out twice, or again after its machine died, does no harm: what is finished is kept, and the pixels do not
depend on who drew them.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display import load_display
from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.images.names import fit_names
from quiltcli.job import JobFile, load_display_file
from quiltcli.job.dump import dump_yaml
from quiltcli.job.frames import format_frames
from quiltcli.viewer.view import EYES


@dataclass(frozen=True)
class FarmOptions:
    """How a job is handed out.

    Attributes:
        chunk: frames a task.
        command: how quilt is called there.
        threads: of a task; None for every core.
        by: what is handed out beside frames, names of `DIMENSIONS`.
        sets: values of the job's keys that the command line changes, `KEY=VALUE`.
    """

    chunk: int = 10
    command: str = "quilt"
    threads: int | None = None
    by: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()


@dataclass(frozen=True)
class Places:
    """Where things lie: the folder of the farm's file, the job, and its output folder."""

    folder: Path
    job: Path
    out: Path

    def beside(self, path: Path) -> str:
        """A path from the farm's file, with forward slashes."""
        return Path(os.path.relpath(path, self.folder)).as_posix()


DIMENSIONS = ("eyes", "facets")


@dataclass(frozen=True)
class Handed:
    """What is handed out beside frames.

    Attributes:
        eyes: each one's name, or nothing where both are drawn at once.
        facets: id and name of each, or nothing where all are drawn at once.
    """

    eyes: tuple[str, ...] = ()
    facets: tuple[tuple[int, str], ...] = ()


def handed_out(job: JobFile, by: Sequence[str]) -> Handed:
    """Eyes and facets of a job that are to be tasks of their own.

    Raises:
        JobError: several of them share a file.
    """
    eyes: tuple[str, ...] = ()
    facets: tuple[tuple[int, str], ...] = ()
    if "eyes" in by:
        if not job.is_stereo:
            raise JobError("--by eyes: the job has one eye (viewer.stereo gives it two)")
        if job.output.stereo == "parts":
            raise JobError("--by eyes: both eyes are parts of one file (output.stereo: files makes two)")
        eyes = EYES
    if "facets" in by:
        if job.output.quilts:
            words = "--by facets: the pages of a quilt hold facets together, and are drawn whole"
            raise JobError(
                f"{words} (--set output.quilts=false writes facets alone; quilt assemble makes pages)"
            )
        found = load_display(load_display_file(job.display))
        names = fit_names(found.names)
        facets = tuple((k + 1, names[k]) for k in np.flatnonzero(found.enabled).tolist())
    return Handed(eyes, facets)


def write_farm_job(path: Path, job_path: Path, job: JobFile, options: FarmOptions) -> None:
    """Write the file a farm takes; its name's ending says which.

    Raises:
        OutputError: the name ends otherwise, the file is there already, or cannot be written.
    """
    form = next((form for ending, form in FORMS.items() if path.name.lower().endswith(ending)), None)
    if form is None:
        words = f"expected a name that ends in {' or '.join(FORMS)}"
        raise OutputError(Problem(words, file=str(path)))
    if path.exists():
        raise OutputError(Problem("exists already (remove it, or choose another name)", file=str(path)))
    make_folder(path.parent)
    write_text(path, form(Places(path.parent, job_path, job.output.directory), job, options))


def openjd_text(places: Places, job: JobFile, options: FarmOptions) -> str:
    """A template by the schema of 2023-09 with the extension for chunks; frames and folders are parameters.

    See https://github.com/OpenJobDescription/openjd-specifications. Its step is a colon: 1-9:2, and paths
    are as from the template.
    """
    args = ["render", "{{Param.Job}}", "--frames", "{{Task.Param.Frame}}", "--output", "{{Param.OutputDir}}"]
    args += ["--resume", "--progress", "openjd"]
    args += _more(options)
    handed = handed_out(job, options.by)
    frame: dict[str, Any] = {
        "name": "Frame",
        "type": "CHUNK[INT]",
        "range": "{{Param.Frames}}",
        "chunks": {"defaultTaskCount": "{{Param.ChunkSize}}", "rangeConstraint": "CONTIGUOUS"},
    }
    space = [frame]
    if handed.eyes:
        args += ["--eye", "{{Task.Param.Eye}}"]
        space.append({"name": "Eye", "type": "STRING", "range": list(handed.eyes)})
    if handed.facets:
        args += ["--facets", "{{Task.Param.Facet}}"]
        ids = [facet for facet, _ in handed.facets]
        space.append({"name": "Facet", "type": "INT", "range": format_frames(ids).replace("x", ":")})
    action = {
        "command": "{{Param.Quilt}}",
        "args": args,
        "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 120},
    }
    file = {"type": "PATH", "objectType": "FILE", "dataFlow": "IN", "default": places.beside(places.job)}
    folder = places.beside(places.out)
    out = {"type": "PATH", "objectType": "DIRECTORY", "dataFlow": "OUT", "default": folder}
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": _name(places.job),
        "parameterDefinitions": [
            {"name": "Job", **file, "description": "The job file of quilt."},
            {"name": "OutputDir", **out, "description": "Where images go; all machines see it."},
            {"name": "Frames", "type": "STRING", "default": format_frames(job.frames).replace("x", ":")},
            {"name": "ChunkSize", "type": "INT", "default": options.chunk, "minValue": 1},
            {"name": "Quilt", "type": "STRING", "default": options.command},
        ],
        "steps": [
            {
                "name": "Render",
                "parameterSpace": {"taskParameterDefinitions": space},
                "script": {"actions": {"onRun": action}},
            }
        ],
    }
    return dump_yaml(template)


_OUTLINE = '''"""A job for OpenCue, made by quilt. Run it where PyOutline is installed: python THIS.py"""

import os

from outline import Outline, cuerun
from outline.modules.shell import Shell

outline = Outline(
    @NAME@,
    shot=os.environ.get("SHOT", "shot"),
    show=os.environ.get("SHOW", "testing"),
    user=os.environ.get("USER", "quilt"),
)
for name, command in @LAYERS@:
    outline.add_layer(Shell(name, command=command, range=@FRAMES@, chunk=1))

if __name__ == "__main__":
    cuerun.launch(outline)
'''


def outline_text(places: Places, job: JobFile, options: FarmOptions) -> str:
    """A script for PyOutline with a layer of one frame a task; #IFRAME# becomes the frame's number there.

    Eyes and facets that are handed out have a layer each.
    """
    command = [options.command, "render", places.job.absolute().as_posix(), "--frames", "#IFRAME#"]
    command += ["--output", places.out.absolute().as_posix(), "--resume", *_more(options)]
    handed = handed_out(job, options.by)
    layers = []
    for eye in handed.eyes or ("",):
        for facet, name in handed.facets or ((0, ""),):
            also = ["--eye", eye] if eye else []
            also += ["--facets", str(facet)] if facet else []
            word = "_".join(filter(None, ("render", eye, re.sub(r"\W", "_", name))))
            layers.append([word, command + also])
    text = _OUTLINE.replace("@LAYERS@", json.dumps(layers, indent=4))
    text = text.replace("@NAME@", json.dumps(_name(places.job)))
    return text.replace("@FRAMES@", json.dumps(format_frames(job.frames)))


def _more(options: FarmOptions) -> list[str]:
    """Options of every task."""
    threads = ["--threads", str(options.threads)] if options.threads else []
    return [*threads, *(word for one in options.sets for word in ("--set", one))]


def _name(job_path: Path) -> str:
    """A name for the job that has no signs that templates give a meaning."""
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in job_path.stem) or "quilt"


FORMS: dict[str, Callable[[Places, JobFile, FarmOptions], str]] = {
    ".openjd.yaml": openjd_text,
    ".outline.py": outline_text,
}
"""What a farm takes, by the ending of the file's name."""
