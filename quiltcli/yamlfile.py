"""YAML read strictly, every value remembering where in the file it stands.

Scalars follow the YAML 1.2 core schema, whatever PyYAML does by default: `1e3` is a number, only
`true` and `false` are booleans, `1:30` and `2024-01-01` are text. Nothing is ever constructed but
dicts, lists, text, numbers, booleans and null.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import yaml
from yaml.composer import Composer
from yaml.parser import Parser
from yaml.reader import Reader, ReaderError
from yaml.resolver import BaseResolver
from yaml.scanner import Scanner

from quiltcli.errors import JobError, Problem

Key: TypeAlias = tuple[str | int, ...]
_CORE = "tag:yaml.org,2002:"
_MAX_VALUES = 5_000_000


class CoreResolver(BaseResolver):
    """Plain scalars become what YAML 1.2's core schema says (https://yaml.org/spec/1.2.2/#103-core-schema)."""


for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
    ("merge", r"<<", ["<"]),
):
    CoreResolver.add_implicit_resolver(_CORE + _tag, re.compile(rf"(?:{_pattern})\Z"), _first)


class _Loader(Reader, Scanner, Parser, Composer, CoreResolver):
    """The reader in Python, whose error messages are the same everywhere."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        CoreResolver.__init__(self)


@dataclass(frozen=True)
class Mark:
    """Where a value and its key stand, 1-based (line, column); a list item has no key."""

    value: tuple[int, int]
    key: tuple[int, int]
    in_list: bool = False


@dataclass(frozen=True)
class Source:
    """Where a model was written, to point into the file when something turns out wrong later.

    Two sources always compare equal: where a value was written is no part of what it says.

    Attributes:
        path: the file as the user named it.
        marks: place of every value by its key path from the top of the file.
        origins: key paths that came from the command line, with the text to blame.
        prefix: key path of the part this source belongs to.
    """

    path: Path | None = field(default=None, compare=False)
    marks: Mapping[Key, Mark] = field(default_factory=dict, compare=False, repr=False)
    origins: Mapping[Key, str] = field(default_factory=dict, compare=False)
    prefix: Key = field(default=(), compare=False)

    def at(self, *key: str | int) -> Source:
        """The source of a part, whose keys start below `key`."""
        return replace(self, prefix=self.prefix + key)

    def problem(self, key: Sequence[str | int] | str, message: str, *, on_key: bool = False) -> Problem:
        """A problem with the value at `key` (a path below this source; one name may stand alone).

        A value that is not in the file is blamed on the nearest one around it that is. With
        `on_key` the place is the key itself, not its value.
        """
        full = self.prefix + ((key,) if isinstance(key, str) else tuple(key))
        for size in range(len(full), -1, -1):
            if full[:size] in self.origins:
                return Problem(message, file=self.origins[full[:size]], key=self.dotted(full))
            if full[:size] in self.marks:
                mark = self.marks[full[:size]]
                line, column = mark.key if on_key or size < len(full) else mark.value
                return Problem(message, str(self.path or ""), line, column, self.dotted(full))
        return Problem(message, str(self.path or ""), key=self.dotted(full))

    def dotted(self, key: Key) -> str:
        """Key path as text: `viewer.path.keyframes[2].position`; ids of a mapping stay `facets.3`."""
        text = ""
        for end, part in enumerate(key, 1):
            mark = self.marks.get(key[:end])
            if isinstance(part, int) and (mark is None or mark.in_list):
                text += f"[{part}]"
            else:
                text += f".{part}" if text else str(part)
        return text


@dataclass
class YamlFile:
    """What `parse_yaml` found: plain data, where it stood, and what was wrong besides."""

    data: Any
    source: Source
    problems: list[Problem]


def read_yaml(path: Path | str) -> tuple[Any, Source]:
    """Read a YAML file into plain data and the places of its values.

    Raises:
        JobError: the file cannot be read, is not YAML, repeats a key, or is no mapping at the top.
    """
    found = parse_yaml(path)
    if found.problems:
        raise JobError(found.problems)
    return found.data, found.source


def parse_yaml(path: Path | str) -> YamlFile:
    """As `read_yaml`, but handing back the problems that leave the rest of the file readable.

    Raises:
        JobError: nothing useful can be read from the file.
    """
    path = Path(path)
    root = _compose(read_text(path), path)
    if root is None:
        raise JobError(Problem("the file is empty (expected 'key: value' lines)", str(path)))
    if not isinstance(root, yaml.MappingNode):
        line, column = _place(root.start_mark)
        kind = "a list" if isinstance(root, yaml.SequenceNode) else f"the text {shorten(root.value)!r}"
        raise JobError(Problem(f"expected 'key: value' lines, got {kind}", str(path), line, column))
    walker = _Walker(str(path))
    try:
        data = walker.value(root, (), None)
    except RecursionError:
        raise JobError(Problem("the values are nested too deeply", str(path))) from None
    return YamlFile(data, Source(path, walker.marks), walker.problems)


def parse_value(text: str) -> Any:
    """A value in YAML notation, as `--set KEY=VALUE` gives it.

    Raises:
        JobError: the text is not YAML.
    """
    root = _compose(text, Path())
    walker = _Walker("")
    data = None if root is None else walker.value(root, (), None)
    if walker.problems:
        raise JobError(walker.problems)
    return data


def read_text(path: Path) -> str:
    """Text of a UTF-8 file.

    Raises:
        JobError: the file is missing, a directory, unreadable or not UTF-8.
    """
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise JobError(Problem("no such file", str(path))) from None
    except IsADirectoryError:
        raise JobError(Problem("is a directory (a file was expected)", str(path))) from None
    except OSError as error:
        raise JobError(Problem(f"cannot be read: {error.strerror or error}", str(path))) from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-8", "replace")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        text = (
            f"not UTF-8 text: byte 0x{raw[error.start]:02x} at offset {error.start} (save the file as UTF-8)"
        )
        raise JobError(Problem(text, str(path), line, column)) from None


def shorten(text: str, length: int = 40) -> str:
    """Text cut to what fits in a message."""
    return text if len(text) <= length else text[: length - 1] + "…"


def _compose(text: str, path: Path) -> yaml.Node | None:
    """Node tree of a single document, by libyaml where there is one."""
    try:
        return _fast_compose(text)
    except yaml.YAMLError:
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
    from quiltcli.yamlfast import FastLoader

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
    line, column = _place(mark)
    if text[mark.index : mark.index + 1] == "\t":
        return Problem("a tab cannot indent in YAML (use spaces)", file, line, column)
    words = _HINTS.get(str(problem)) or f"not YAML: {problem}"
    start = getattr(error, "context_mark", None)
    if context and start is not None and str(problem) not in _HINTS:
        words += f" ({context} that starts in line {start.line + 1})"
    return Problem(words, file, line, column)


_HINTS = {
    "mapping values are not allowed here": "a second ': ' in one line (quote the text, or indent it well)",
    "could not find expected ':'": "expected 'key: value', found no ':'",
    "but found another document": "a second document starts here (one file holds one)",
    "found unexpected end of stream": "the file ends inside a quoted text",
}


def _place(mark: Any) -> tuple[int, int]:
    """1-based line and column of a PyYAML mark."""
    return mark.line + 1, mark.column + 1


class _Walker:
    """Turns nodes into plain data and notes where each value stands."""

    parsers: ClassVar[dict[str, Any]] = {
        "str": str,
        "null": lambda text: None,
        "bool": lambda text: text.lower() == "true",
        "int": lambda text: int(text, 0 if text[:2] in ("0o", "0x") else 10),
        "float": lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    }

    def __init__(self, file: str) -> None:
        self.file = file
        self.marks: dict[Key, Mark] = {}
        self.problems: list[Problem] = []
        self.open: set[int] = set()

    def value(self, node: yaml.Node, path: Key, key: yaml.Node | None, *, in_list: bool = False) -> Any:
        """Plain data of a node; a value that cannot be had is a problem and becomes None."""
        self.marks[path] = self._mark(node, key, in_list)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, path)
        if id(node) in self.open or len(self.marks) > _MAX_VALUES:
            inside = "an alias refers to itself" if id(node) in self.open else "aliases expand without end"
            raise JobError(Problem(inside, self.file, *self.marks[path].value))
        self.open.add(id(node))
        try:
            if isinstance(node, yaml.SequenceNode):
                return [self.value(item, (*path, i), None, in_list=True) for i, item in enumerate(node.value)]
            return self._mapping(node, path) if isinstance(node, yaml.MappingNode) else None
        finally:
            self.open.discard(id(node))

    def _mark(self, node: yaml.Node, key: yaml.Node | None, in_list: bool) -> Mark:
        """Place to point at: a block or an empty value is best shown by its key."""
        value = _place(node.start_mark)
        at_key = value if key is None else _place(key.start_mark)
        block = isinstance(node, yaml.CollectionNode) and not node.flow_style
        empty = isinstance(node, yaml.ScalarNode) and not node.value and not node.style
        return Mark(at_key if block or empty else value, at_key, in_list)

    def _scalar(self, node: yaml.ScalarNode, path: Key) -> Any:
        parse = self.parsers.get(node.tag.removeprefix(_CORE)) if node.tag.startswith(_CORE) else None
        try:
            if parse is not None:
                return parse(node.value)
            words = f"the tag {node.tag.replace(_CORE, '!!')!r} is not understood (write a plain value)"
        except ValueError:
            words = f"{shorten(node.value)!r} is no {node.tag.removeprefix(_CORE)}"
        self._problem(node, path, words)
        return None

    def _mapping(self, node: yaml.MappingNode, path: Key) -> dict[Any, Any]:
        data: dict[Any, Any] = {}
        merged: list[yaml.Node] = []
        lines: dict[Any, int] = {}
        for key_node, value_node in node.value:
            if key_node.tag == _CORE + "merge":
                merged.append(value_node)
                continue
            if not isinstance(key_node, yaml.ScalarNode):
                self._problem(key_node, path, "a key must be text or a number")
                continue
            key = self._scalar(key_node, path)
            if key in lines:
                words = f"duplicate key (first given in line {lines[key]})"
                self._problem(key_node, (*path, key), words)
                continue
            lines[key] = key_node.start_mark.line + 1
            data[key] = self.value(value_node, (*path, key), key_node)
        for value_node in merged:
            self._merge(data, value_node, path)
        return data

    def _merge(self, data: dict[Any, Any], node: yaml.Node, path: Key) -> None:
        """`<<: *base`: keys of the mapping itself win, then those of the first mapping merged."""
        for part in node.value if isinstance(node, yaml.SequenceNode) else [node]:
            if not isinstance(part, yaml.MappingNode):
                self._problem(part, path, "'<<' merges mappings only")
                continue
            marks, self.marks = self.marks, {}
            extra = self.value(part, path, None)
            found, self.marks = self.marks, marks
            fresh = {key: value for key, value in extra.items() if key not in data}
            data.update(fresh)
            below = len(path)
            self.marks.update({at: m for at, m in found.items() if len(at) > below and at[below] in fresh})

    def _problem(self, node: yaml.Node, path: Key, words: str) -> None:
        key = Source(marks=self.marks).dotted(path)
        self.problems.append(Problem(words, self.file, *_place(node.start_mark), key))
