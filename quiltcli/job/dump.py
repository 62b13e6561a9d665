"""A job as it was resolved, every default written out, as YAML that loads again to the same job."""

from __future__ import annotations

import os
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import yaml
from yaml.emitter import Emitter
from yaml.representer import SafeRepresenter
from yaml.serializer import Serializer

from quiltcli.formats.yaml.core import CoreResolver
from quiltcli.job.frames import format_frames
from quiltcli.job.job import JobFile
from quiltcli.job.model import Model


class _Dumper(Emitter, Serializer, SafeRepresenter, CoreResolver):
    """Quotes what this program's reader, not PyYAML's, would take for a number."""

    def __init__(self, stream: Any, **options: Any) -> None:
        Emitter.__init__(self, stream, width=options.get("width"), allow_unicode=True)
        Serializer.__init__(self)
        # None puts lists of plain values in one line and all else in blocks.
        SafeRepresenter.__init__(self, default_flow_style=None, sort_keys=False)  # type: ignore[arg-type]
        CoreResolver.__init__(self)

    def ignore_aliases(self, data: Any) -> bool:
        """Write every value out: anchors made by chance would only puzzle."""
        return True


def dump_job(job: JobFile, directory: Path | None = None) -> str:
    """The whole job as YAML.

    Args:
        job: a job as `load_job` gives it.
        directory: folder the text will be written to; file names become relative to it, so that
            the same job gives the same text wherever it lies. Absolute when None.

    Returns:
        Text that `load_job` reads back to an equal job.
    """
    data = plain(job, lambda path: _relative(path, directory))
    data["frames"] = format_frames(job.frames)
    return dump_yaml(data)


def dump_yaml(data: Any) -> str:
    """Plain data as YAML 1.2, short lists in one line, keys in the order given."""
    return str(yaml.dump(data, Dumper=_Dumper, width=110))


def plain(value: Any, path_text: Callable[[Path], Any]) -> Any:
    """Plain data of a model: keys that hold nothing left out, file names through `path_text`."""
    if isinstance(value, Model):
        fields = type(value).model_fields
        items = ((field.alias or name, getattr(value, name)) for name, field in fields.items())
        return {name: plain(item, path_text) for name, item in items if item is not None}
    if isinstance(value, dict):
        return {key: plain(value[key], path_text) for key in sorted(value)}
    if isinstance(value, tuple):
        return [plain(item, path_text) for item in value]
    if isinstance(value, Path):
        return path_text(value)
    if isinstance(value, Fraction):
        return int(value) if value.denominator == 1 else f"{value.numerator}/{value.denominator}"
    return value


def _relative(path: Path, directory: Path | None) -> str:
    """File name as a file in `directory` would give it, with forward slashes."""
    if directory is None:
        return path.absolute().as_posix()
    return Path(os.path.relpath(path, directory)).as_posix()
