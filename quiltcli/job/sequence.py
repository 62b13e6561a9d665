"""Numbered mesh files, one a frame: `boat.####.ply`."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import core_schema as cs

from quiltcli.job.model import MESHES, ExistingFile, located

_HASHES = re.compile(r"#+")


@dataclass(frozen=True)
class MeshOrSequence(ExistingFile):
    """Annotation of a path of a mesh, or of a pattern of numbered meshes, which are looked for later."""

    suffixes: tuple[str, ...] = MESHES
    what: str = "a mesh"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> cs.CoreSchema:
        """A path, located and looked up unless it stands for many."""
        return cs.with_info_before_validator_function(self._check_one_or_many, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: cs.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Text, for editors."""
        return {"type": "string", "format": "path", "minLength": 1}

    def _check_one_or_many(self, value: Any, info: ValidationInfo) -> Path:
        if isinstance(value, (str, Path)) and is_pattern(Path(value)):
            path = located(value, info)
            if path.suffix.lower() in self.suffixes and not path.exists():
                return path
        return self._check(value, info)


def is_pattern(path: Path) -> bool:
    """Whether a file name has a place for a number, a run of #."""
    return "#" in path.name


def numbered(pattern: Path, number: int) -> Path:
    """File of a number, which has at least as many digits as there are #; a minus sign comes before them."""
    sign = "-" if number < 0 else ""
    name = _HASHES.sub(lambda run: f"{sign}{abs(number):0{len(run[0])}d}", pattern.name, count=1)
    return pattern.with_name(name)


@dataclass(frozen=True)
class MeshSequence:
    """Which file is shown at which frame.

    Attributes:
        pattern: of the file names.
        numbers: those there should be, ascending.
        hold: what stands in for a missing one: `nearest`, `last`, or None for nothing.
    """

    pattern: Path
    numbers: Sequence[int]
    hold: str | None

    def files(self) -> Iterator[tuple[int, Path]]:
        """Number and name of all files there should be."""
        for number in self.numbers:
            yield number, numbered(self.pattern, number)

    def there(self) -> tuple[int, ...]:
        """The numbers whose files there are, ascending."""
        return tuple(number for number, path in self.files() if path.is_file())

    def missing(self) -> tuple[int, ...]:
        """The numbers whose files are missed; none where others stand in for them."""
        if self.hold is not None:
            return ()
        return tuple(number for number, path in self.files() if not path.is_file())

    def shown(self, frame: float, there: Sequence[int]) -> int | None:
        """The number shown at a frame, or at a time after it, of those `there` are; None if none is.

        Without `hold` it is the frame's own. `last` is the last one before, or the first of all; `nearest`
        is the nearest, the earlier one of two.
        """
        number = int(frame // 1)
        after = bisect_right(there, number)
        before = there[max(after - 1, 0)]
        if before == number:
            return number
        if self.hold is None:
            return None
        if self.hold == "nearest" and 0 < after < len(there) and there[after] - number < number - before:
            return there[after]
        return before
