"""Values of a JSON document, each asked for by its kind and knowing where it stands.

Nothing in a file from elsewhere can be trusted to be what the format says. Whoever reads a value
names the kind it must be of, and an error names the file and the path of the value
(`meshes[0].primitives[2].indices`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from quiltcli.errors import MeshError, Problem

MOST_JSON_BYTES = 2**28
_LARGEST = 1e300


def parse_json(data: bytes, file: str) -> tuple[Json, tuple[str, ...]]:
    """The JSON text `data`, and the keys that stand twice in one object (the last one counts).

    NaN and Infinity, which are no JSON but are met, count as numbers that nobody may use.

    Raises:
        MeshError: it is no JSON text in UTF-8, or larger or nested deeper than any honest file.
    """
    if len(data) > MOST_JSON_BYTES:
        raise _broken(file, f"its JSON text has {len(data):,} bytes (expected at most {MOST_JSON_BYTES:,})")
    repeated: dict[str, None] = {}

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [key for key, _ in pairs]
            repeated.update({name: None for name in names if names.count(name) > 1})
        return found

    try:
        value = json.loads(data.decode("utf-8-sig"), object_pairs_hook=unique)
    except UnicodeDecodeError as error:
        raise _broken(file, f"is not UTF-8 text: byte 0x{data[error.start]:02x} at {error.start}") from None
    except RecursionError:
        raise _broken(file, "its JSON text is nested too deeply") from None
    except json.JSONDecodeError as error:
        message = f"is not JSON: {error.msg[:1].lower()}{error.msg[1:]}"
        raise MeshError(Problem(message, file, error.lineno, error.colno)) from None
    except ValueError:
        raise _broken(file, "its JSON text holds a number of thousands of digits") from None
    return Json(value, "", file), tuple(repeated)


def _broken(file: str, message: str) -> MeshError:
    return MeshError(Problem(message, file))


@dataclass(slots=True)  # not frozen: there are millions of them, and freezing triples their cost
class Json:
    """A value, the path it stands at and the file it comes from; never changed.

    The value of a key that is absent is None; asked for without a default it is an error.
    """

    value: Any
    path: str
    file: str

    def error(self, message: str) -> MeshError:
        """The error that something is wrong with this value."""
        return MeshError(Problem(message, self.file, key=self.path))

    def expected(self, what: str) -> MeshError:
        """The error that something else was expected here."""
        if self.value is None:
            return self.error(f"is missing (expected {what})")
        return self.error(f"expected {what}, got {_described(self.value)}")

    def __getitem__(self, key: str) -> Json:
        """A member of this object; of an absent object every member is absent."""
        if self.value is None:
            members: dict[str, Any] = {}
        elif isinstance(self.value, dict):
            members = self.value
        else:
            raise self.expected("an object")
        return Json(members.get(key), f"{self.path}.{key}" if self.path else key, self.file)

    def __bool__(self) -> bool:
        """Whether the value is there."""
        return self.value is not None

    def has(self, key: str) -> bool:
        """Whether this object has a member, told without a look at what it is."""
        if not isinstance(self.value, dict):
            raise self.expected("an object")
        return self.value.get(key) is not None

    def names(self) -> list[str]:
        """Names of this object's members."""
        if self.value is not None and not isinstance(self.value, dict):
            raise self.expected("an object")
        return list(self.value or ())

    def items(self) -> Iterator[Json]:
        """The values of this list; none where it is absent."""
        for index in range(self.length()):
            yield self.at(index)

    def length(self) -> int:
        """Number of values in this list."""
        if self.value is not None and not isinstance(self.value, list):
            raise self.expected("a list")
        return len(self.value or ())

    def at(self, index: int) -> Json:
        """A value of this list."""
        return Json(self.value[index], f"{self.path}[{index}]", self.file)

    def extension(self, name: str) -> Json:
        """What an extension adds to this object."""
        return self["extensions"][name]

    def text(self, default: str | None = None) -> str:
        """A text."""
        if self.value is None and default is not None:
            return default
        if not isinstance(self.value, str):
            raise self.expected("a text")
        return self.value

    def one_of(self, names: Sequence[str], default: str | None = None) -> str:
        """One of some words."""
        word = self.text(default)
        if word not in names:
            raise self.expected(f"{', '.join(names[:-1])} or {names[-1]}")
        return word

    def flag(self, default: bool = False) -> bool:
        """True or false."""
        if self.value is None:
            return default
        if not isinstance(self.value, bool):
            raise self.expected("true or false")
        return self.value

    def number(self, default: float | None = None, low: float = -_LARGEST, high: float = _LARGEST) -> float:
        """A finite number from `low` to `high`."""
        if self.value is None and default is not None:
            return default
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.expected("a number")
        if not low <= value <= high:
            raise self.expected("a finite number" if high == _LARGEST and low == -high else _span(low, high))
        return float(value)

    def whole(self, default: int | None = None, low: int = 0, high: int = 2**53) -> int:
        """A whole number from `low` to `high`; 3.0 is one."""
        if self.value is None and default is not None:
            return default
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.expected("a whole number")
        if not low <= value <= high or value != math.floor(value):  # NaN is in no span
            raise self.expected(f"a whole number{_span(low, high, start=' ')}")
        return int(value)

    def index(self, count: int, what: str) -> int:
        """The index of one of `count` things."""
        if not count:
            raise self.error(f"names {what} {_described(self.value)}, but there are none")
        try:
            return self.whole(high=count - 1)
        except MeshError:
            raise self.expected(f"{what}, 0 to {count - 1}") from None

    def numbers(self, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
        """A list of `count` finite numbers."""
        if self.value is None and default is not None:
            return tuple(map(float, default))
        if not isinstance(self.value, list) or len(self.value) != count:
            raise self.expected(f"a list of {count} numbers")
        return tuple(item.number() for item in self.items())


def _span(low: float, high: float, start: str = "a number ") -> str:
    return f"{start}from {low:,}" + (f" to {high:,}" if high < 2**53 else "")


def _described(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) >= 2**64:
        return "a number beyond 64 bits"
    text = repr(value)
    return text if len(text) <= 40 else text[:39] + "…"
