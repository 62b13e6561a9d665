"""YAML text to nodes, with syntax errors in words that help."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.parser import Parser
from yaml.reader import Reader, ReaderError
from yaml.scanner import Scanner

from quiltcli.errors import JobError, Problem
from quiltcli.formats.inputs import foreign_fault, read_input
from quiltcli.formats.yaml.core import CoreResolver

_MESHES = (".obj", ".ply", ".off", ".stl", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
_PICTURES = (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg", ".hdr", ".pfm", ".dpx", ".mp4", ".mov")
_NO_YAML = frozenset((*_MESHES, *_PICTURES))


class _Loader(Reader, Scanner, Parser, Composer, CoreResolver):
    """The reader in Python, whose error messages are the same everywhere."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        CoreResolver.__init__(self)


def read_text(path: Path) -> str:
    """Text of a UTF-8 file.

    Raises:
        JobError: the file is missing, no regular file, unreadable or not UTF-8.
    """
    raw = read_input(path, JobError)
    if fault := foreign_fault(path):
        raise JobError(Problem(fault, str(path)))
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-8", "replace")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        text = (
            f"not UTF-8 text: byte 0x{raw[error.start]:02x} at offset {error.start} (save the file as UTF-8)"
        )
        raise JobError(Problem(text, str(path), line, column)) from None


def read_yaml_text(path: Path) -> str:
    """As `read_text`, of a file that is not by its name a mesh or a picture.

    Raises:
        JobError: it is one, or cannot be read as text.
    """
    if path.suffix.lower() in _NO_YAML and path.is_file():
        raise JobError(Problem(f"is a {path.suffix.lower()} file (expected a YAML file)", str(path)))
    return read_text(path)


def compose(text: str, path: Path) -> yaml.Node | None:
    """Node tree of a single document, by libyaml where there is one."""
    try:
        return _fast_compose(text)
    except (yaml.YAMLError, RecursionError):
        pass
    try:
        return _Loader(text).get_single_node()
    except RecursionError:
        raise JobError(Problem("the values are nested too deeply", str(path))) from None
    except yaml.YAMLError as error:
        raise JobError(_syntax_problem(error, text, str(path) if path.name else "")) from None


def _fast_compose(text: str) -> yaml.Node | None:
    """The same nodes some four times faster; its error messages are not ours."""
    if not yaml.__with_libyaml__ or _is_deep(text):
        return _Loader(text).get_single_node()
    from quiltcli.formats.yaml.fast import FastLoader

    return FastLoader(text).get_single_node()


def _is_deep(text: str) -> bool:
    """Whether nesting may be so deep that libyaml, which recurses in C, would run out of stack."""
    depth = deepest = 0
    for bracket in re.findall(r"[\[{\]}]", text):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        deepest = max(deepest, depth)
    return deepest > 200 or re.search(r"^[ ?-]{400}", text, re.MULTILINE) is not None


def _syntax_problem(error: yaml.YAMLError, text: str, file: str) -> Problem:
    """What PyYAML stumbled over, in words that help."""
    if isinstance(error, ReaderError):
        before = text[: error.position]
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        return Problem(
            f"character U+{ord(text[error.position]):04X} is not allowed in YAML", file, line, column
        )
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    problem, context = getattr(error, "problem", None), getattr(error, "context", None)
    if mark is None:
        return Problem(f"not YAML: {error}", file)
    if str(problem) in _AT_START:
        mark = getattr(error, "context_mark", None) or mark
    line, column = place(mark)
    if text[mark.index : mark.index + 1] == "\t":
        return Problem("a tab cannot indent in YAML (use spaces)", file, line, column)
    start = getattr(error, "context_mark", None)
    return Problem(_words(str(problem), context, start), file, line, column)


def _words(problem: str, context: str | None, start: Any) -> str:
    """PyYAML's problem, in the words of people who write YAML and do not parse it."""
    if problem in _HINTS:
        return _HINTS[problem]
    if problem.startswith(("expected escape sequence", "found unknown escape character")):
        return r"a \ in double quotes starts an escape (write the text in single quotes, or a path with /)"
    if problem.startswith("expected <block end>"):
        return "this does not fit what stands before it (check the indentation and the quotes)"
    first = re.match(r"found character (.+) that cannot start any token", problem)
    if first is not None:
        return f"a value cannot start with {first[1]} (put it in quotes)"
    words = f"not YAML: {problem}"
    if context and start is not None:
        words += f" ({context} that starts in line {start.line + 1})"
    for theirs, ours in _WORDS:
        words = words.replace(theirs, ours)
    return words


_HINTS = {
    "mapping values are not allowed here": "a second ': ' in one line (quote the text, or indent it well)",
    "could not find expected ':'": "expected 'key: value', found no ':'",
    "but found another document": "a second document starts here (one file holds one)",
    "found unexpected end of stream": "this quoted text never ends",
}
# PyYAML notices these at the end of what is wrong; the start is where to mend it.
_AT_START = ("could not find expected ':'", "found unexpected end of stream")
_WORDS = (
    ("'<stream end>'", "the end of the file"),
    ("a flow sequence", "a list in [ ]"),
    ("a flow mapping", "a mapping in { }"),
    ("a flow node", "a value"),
    ("undefined alias", "no anchor for the alias"),
)


def place(mark: Any) -> tuple[int, int]:
    """1-based line and column of a PyYAML mark."""
    return mark.line + 1, mark.column + 1
