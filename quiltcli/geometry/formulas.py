"""Formulas of numbers, as YAML files write them: parsed and worked out, never run as a program.

A formula is an expression of Python's grammar of which little is let through: numbers, names that are
told, + − * / **, and a few functions. What it parses to is a tree of numpy's own functions.
"""

from __future__ import annotations

import ast
import difflib
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from quiltcli.geometry import FloatArray

Values: TypeAlias = Mapping[str, FloatArray | float]
Node: TypeAlias = Callable[[Values], Any]

FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "tan": (1, np.tan),
    "sqrt": (1, np.sqrt),
    "exp": (1, np.exp),
    "log": (1, np.log),
    "abs": (1, np.abs),
    "atan2": (2, np.arctan2),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
}
"""Functions by name, and how many values they take."""

_SUMS: dict[type[ast.operator], Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.float_power,
}
_SIGNS: dict[type[ast.unaryop], Callable[..., Any]] = {ast.USub: np.negative, ast.UAdd: np.positive}
_LONGEST = 2000
_DEEPEST = 100


class FormulaError(ValueError):
    """A formula that cannot be read; the message says where and why."""


@dataclass(frozen=True)
class Formula:
    """A formula that has been read.

    Attributes:
        text: as it was written.
        node: works it out from values by name.
    """

    text: str
    node: Node

    def __call__(self, values: Values) -> FloatArray:
        """The formula's values (...), NaN or infinite where it has none."""
        with np.errstate(all="ignore"):
            return np.asarray(self.node(values), dtype=np.float64)


def parse(text: str, names: Collection[str]) -> Formula:
    """Read a formula.

    Args:
        text: the formula.
        names: what it may refer to, beside `pi`.

    Raises:
        FormulaError: a name, a function or a sign that is not known; the message has the column.
    """
    if len(text) > _LONGEST:
        raise FormulaError(f"is {len(text)} characters long (expected {_LONGEST} at most)")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        column = getattr(error, "offset", None)
        where = f" at character {column}" if column else ""
        raise FormulaError(f"cannot be read{where}: {text.strip()[:60]!r}") from None
    return Formula(text, _node(tree.body, frozenset(names), 0))


def _node(node: ast.expr, names: frozenset[str], depth: int) -> Node:
    """What works out one part of a formula."""
    where = f"at character {node.col_offset + 1}"
    if depth > _DEEPEST:
        raise FormulaError(f"is nested more than {_DEEPEST} deep")
    if isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FormulaError(f"{where}: expected a number, got {value!r:.40}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise FormulaError(f"{where}: expected a finite number")
        return lambda values: number
    if isinstance(node, ast.Name):
        return _named(node.id, names, where)
    if isinstance(node, ast.UnaryOp) and type(node.op) in _SIGNS:
        sign, inner = _SIGNS[type(node.op)], _node(node.operand, names, depth + 1)
        return lambda values: sign(inner(values))
    if isinstance(node, ast.BinOp):
        if type(node.op) not in _SUMS:
            raise FormulaError(f"{where}: expected + - * / or **, got {_word(node.op)}")
        return _applied(
            _SUMS[type(node.op)], [_node(part, names, depth + 1) for part in (node.left, node.right)]
        )
    if isinstance(node, ast.Call):
        return _call(node, names, depth, where)
    raise FormulaError(f"{where}: expected numbers, names, + - * / ** and functions, got {_word(node)}")


def _named(name: str, names: frozenset[str], where: str) -> Node:
    """The value of a name."""
    if name in names:
        return lambda values: values[name]
    if name == "pi":
        return lambda values: math.pi
    known = sorted(names | {"pi"})
    near = difflib.get_close_matches(name, [*known, *FUNCTIONS], n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise FormulaError(f"{where}: unknown name {name[:40]!r} (known: {', '.join(known)}{hint})")


def _call(node: ast.Call, names: frozenset[str], depth: int, where: str) -> Node:
    """A function of values."""
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name not in FUNCTIONS:
        found = repr(name[:40]) if name else "something that is no name"
        raise FormulaError(f"{where}: unknown function {found} (known: {', '.join(FUNCTIONS)})")
    count, function = FUNCTIONS[name]
    if node.keywords or any(isinstance(part, ast.Starred) for part in node.args) or len(node.args) != count:
        plural = "value" if count == 1 else "values"
        raise FormulaError(f"{where}: {name} takes {count} {plural}, got {len(node.args)}")
    return _applied(function, [_node(part, names, depth + 1) for part in node.args])


def _applied(function: Callable[..., Any], parts: list[Node]) -> Node:
    """A function of parts."""
    return lambda values: function(*(part(values) for part in parts))


def _word(node: ast.AST) -> str:
    """What a part is called, in messages."""
    return type(node).__name__
