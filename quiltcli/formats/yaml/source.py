"""YAML read strictly, every value remembering where in the file it stands.

Nothing is ever constructed but dicts, lists, text, numbers, booleans and null; a repeated key is an
error, and so is a tag that would ask for anything else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import yaml

from quiltcli.errors import JobError, Problem
from quiltcli.formats.yaml.core import CORE
from quiltcli.formats.yaml.syntax import compose, place, read_yaml_text

Key: TypeAlias = tuple[str | int, ...]
# Values that may come from aliases and merges, over a whole file; what is written out may be any number.
_MAX_ALIASED = 100_000
_MAX_DIGITS = 300


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
        typed = [text for key_set, text in self.origins.items() if key_set[: len(full)] == full]
        if typed and full not in self.marks:
            return Problem(message, file=typed[0], key=self.dotted(full))
        for size in range(len(full), -1, -1):
            if full[:size] in self.origins:
                return Problem(message, file=self.origins[full[:size]], key=self.dotted(full))
            if full[:size] in self.marks:
                mark = self.marks[full[:size]]
                line, column = mark.key if on_key and size == len(full) else mark.value
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
    return parse_text(read_yaml_text(Path(path)), Path(path))


def parse_text(text: str, path: Path) -> YamlFile:
    """As `parse_yaml`, of text that stands in a file of this name (JobError)."""
    root = compose(text, path)
    if root is None:
        raise JobError(Problem("the file is empty (expected 'key: value' lines)", str(path)))
    if not isinstance(root, yaml.MappingNode):
        line, column = place(root.start_mark)
        kind = "a list" if isinstance(root, yaml.SequenceNode) else f"the text {shorten(root.value)!r}"
        raise JobError(Problem(f"expected 'key: value' lines, got {kind}", str(path), line, column))
    walker = _Walker(str(path))
    data = walker.whole(root)
    return YamlFile(data, Source(path, walker.marks), walker.problems)


def parse_value(text: str) -> Any:
    """A value in YAML notation, as `--set KEY=VALUE` gives it.

    Raises:
        JobError: the text is not YAML.
    """
    root = compose(text, Path())
    walker = _Walker("")
    data = None if root is None else walker.whole(root)
    if walker.problems:
        raise JobError(walker.problems)
    return data


def shorten(text: str, length: int = 40) -> str:
    """Text cut to what fits in a message."""
    return text if len(text) <= length else text[: length - 1] + "…"


def _whole_number(text: str) -> int:
    """An int of a plausible size: Python itself refuses to write out numbers of thousands of digits."""
    if len(text) > _MAX_DIGITS:
        raise ValueError
    return int(text, 0 if text[:2] in ("0o", "0x") else 10)


class _Walker:
    """Turns nodes into plain data and notes where each value stands."""

    parsers: ClassVar[dict[str, Any]] = {
        "str": str,
        "null": lambda text: None,
        "bool": lambda text: text.lower() == "true",
        "int": _whole_number,
        "float": lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    }

    def __init__(self, file: str) -> None:
        self.file = file
        self.marks: dict[Key, Mark] = {}
        self.problems: list[Problem] = []
        self.open: set[int] = set()
        self.seen: set[int] = set()
        self.aliased = 0

    def whole(self, root: yaml.Node) -> Any:
        """Plain data of a document (JobError when it is too deep, or its aliases too many)."""
        try:
            return self.value(root, (), None)
        except RecursionError:
            raise JobError(Problem("the values are nested too deeply", self.file)) from None

    def value(self, node: yaml.Node, path: Key, key: yaml.Node | None, *, in_list: bool = False) -> Any:
        """Plain data of a node; a value that cannot be had is a problem and becomes None."""
        self.marks[path] = self._mark(node, key, in_list)
        self._count(node)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, path)
        if id(node) in self.open:
            raise JobError(Problem("an alias refers to itself", self.file, *self.marks[path].value))
        self.open.add(id(node))
        try:
            if isinstance(node, yaml.SequenceNode):
                return [self.value(item, (*path, i), None, in_list=True) for i, item in enumerate(node.value)]
            return self._mapping(node, path) if isinstance(node, yaml.MappingNode) else None
        finally:
            self.open.discard(id(node))

    def _count(self, node: yaml.Node) -> None:
        """Count a value met again: a file of a few hundred bytes can stand for more than memory holds."""
        if id(node) not in self.seen:
            self.seen.add(id(node))
            return
        self.aliased += 1
        if self.aliased > _MAX_ALIASED:
            words = f"aliases stand for more than {_MAX_ALIASED:,} values (write them out, or use fewer)"
            raise JobError(Problem(words, self.file, *place(node.start_mark)))

    def _mark(self, node: yaml.Node, key: yaml.Node | None, in_list: bool) -> Mark:
        """Place to point at: a block or an empty value is best shown by its key."""
        value = place(node.start_mark)
        at_key = value if key is None else place(key.start_mark)
        block = isinstance(node, yaml.CollectionNode) and not node.flow_style
        empty = isinstance(node, yaml.ScalarNode) and not node.value and not node.style
        return Mark(at_key if block or empty else value, at_key, in_list)

    def _scalar(self, node: yaml.ScalarNode, path: Key) -> Any:
        parse = self.parsers.get(node.tag.removeprefix(CORE)) if node.tag.startswith(CORE) else None
        try:
            if parse is not None:
                return parse(node.value)
            words = f"the tag {node.tag.replace(CORE, '!!')!r} is not understood (write a plain value)"
        except ValueError:
            words = f"{shorten(node.value)!r} is no {node.tag.removeprefix(CORE)}"
            if node.tag == CORE + "int" and len(node.value) > _MAX_DIGITS:
                words = f"{shorten(node.value)!r} has too many digits for a number"
        self._problem(node, path, words)
        return None

    def _mapping(self, node: yaml.MappingNode, path: Key) -> dict[Any, Any]:
        data: dict[Any, Any] = {}
        merged: list[yaml.Node] = []
        lines: dict[Any, int] = {}
        for key_node, value_node in node.value:
            if key_node.tag == CORE + "merge":
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
        self.problems.append(Problem(words, self.file, *place(node.start_mark), key))
