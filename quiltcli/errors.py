"""Every error a user can cause, in one small family.

A `QuiltError` carries one or more `Problem`s; its text is one line a problem, each with the place
(`FILE:LINE:COLUMN`) and the key it is about. The command line prints the text and leaves with
`exit_code`; nothing else in the program decides how an error looks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, and where.

    Attributes:
        message: what is wrong and what was expected, one sentence without a full stop.
        file: the file's path as the user gave it, empty when no file is at fault.
        line: 1-based line, 0 when unknown.
        column: 1-based column, 0 when unknown.
        key: dotted path of the key (`viewer.path.keyframes[2].position`), empty when none.
    """

    message: str
    file: str = ""
    line: int = 0
    column: int = 0
    key: str = ""

    def __str__(self) -> str:
        """`FILE:LINE:COLUMN: key.path: message`, leaving out what is unknown."""
        place = self.file
        if self.line:
            place += f":{self.line}" + (f":{self.column}" if self.column else "")
        return ": ".join(part for part in (place, self.key, self.message) if part)


class QuiltError(Exception):
    """Base of all errors that are the user's to mend, not the program's.

    Args:
        message: a sentence, a `Problem`, or several problems found together.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, message: str | Problem | Sequence[Problem]) -> None:
        if isinstance(message, str):
            message = Problem(message)
        self.problems: tuple[Problem, ...] = (message,) if isinstance(message, Problem) else tuple(message)
        super().__init__("\n".join(map(str, self.problems)))


def first_of(problems: Sequence[Problem], most: int, file: str) -> list[Problem]:
    """The first problems, and one that counts the rest."""
    more = len(problems) - most
    rest = [Problem(f"and {more} problems more", file)] if more > 0 else []
    return [*problems[:most], *rest]


class JobError(QuiltError, ValueError):
    """A YAML file that cannot be read, or says something impossible."""


class MeshError(QuiltError, ValueError):
    """A mesh file that cannot be read."""


class DisplayError(QuiltError, ValueError):
    """A display whose facets cannot be built."""


class LayoutError(QuiltError, ValueError):
    """A layout that is broken or does not belong to its display."""


class SceneError(QuiltError, ValueError):
    """A scene that cannot be loaded."""


class ViewerError(QuiltError, ValueError):
    """A viewer path that gives no usable pose."""


class OutputError(QuiltError, OSError):
    """Files that cannot be written, or must not be overwritten."""


class CheckFailedError(QuiltError):
    """The input was good, but a check or a frame failed."""

    exit_code = 1


class MissingExtraError(QuiltError, ImportError):
    """A feature needs an optional package that is not installed."""


def missing_extra(what: str, package: str, extra: str) -> MissingExtraError:
    """The error of something that needs an optional package, with the command that brings it.

    Args:
        what: what needs it, as the start of a sentence.
        package: its name.
        extra: the name under which this program's own list of dependencies has it.
    """
    how = f"in the folder of quilt's sources: pip install -e '.[{extra}]'"
    return MissingExtraError(f"{what} needs {package}, which is not installed ({how})")


def raise_all(kind: type[QuiltError], problems: Iterable[Problem]) -> None:
    """Raise one `kind` that holds all `problems`; do nothing when there are none."""
    found = tuple(problems)
    if found:
        raise kind(found)


def counted(count: int, noun: str) -> str:
    """`1 page`, `2 pages`, in a message."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
