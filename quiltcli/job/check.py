"""Every problem of a YAML file of any kind, and of those it names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from quiltcli.errors import JobError, Problem
from quiltcli.job.job import JobFile
from quiltcli.job.layout import LayoutFile
from quiltcli.job.layout_table import read_layout_table
from quiltcli.job.load import (
    file_kind,
    load_any_display,
    load_calibration_file,
    load_camera_file,
    load_job,
    load_lightfield_file,
    load_scene_file,
    tried,
)


def check_file(path: Path | str) -> list[Problem]:
    """Every problem of a YAML file, and of the YAML files a job names; none when all is well."""
    try:
        kind = file_kind(path)
    except JobError as error:
        return list(error.problems)
    if kind != JobFile.kind:
        return tried(_LOAD[kind], Path(path))[0]
    problems, job = tried(load_job, Path(path))
    if job is not None and isinstance(job.layout, Path):
        problems += tried(read_layout_table, job.layout)[0]
    return problems


_LOAD: dict[str, Callable[[Path], object]] = {
    "quilt_camera": load_camera_file,
    "quilt_display": load_any_display,
    LayoutFile.kind: read_layout_table,
    "quilt_scene": load_scene_file,
    "quilt_lightfield": load_lightfield_file,
    "quilt_calibration": load_calibration_file,
}
