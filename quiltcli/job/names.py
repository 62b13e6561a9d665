"""Templates of file names: `facets/{name}/{name}{.eye}.{frame:04}.exr`.

A template is read both ways: it makes the name of an image, and it finds an image's page or facet, frame
and eye in a name. So numbers stand apart from other digits, and no two fields touch.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, TypeAlias

from pydantic import AfterValidator, Field

from quiltcli.job.model import Complaint, Model, complaint, either, suggest

_FIELD = re.compile(r"\{([^{}]*)\}")
_HASHES = re.compile(r"#{1,9}")
_DIGITS = re.compile(r"0[1-9]")
_FORBIDDEN = re.compile(r'[\\:*?"<>|\x00-\x1f\x7f]')
NUMBERS = ("page", "facet", "frame")
EYES = ("eye", ".eye")
_KNOWN = {"page": ("page", "frame", *EYES), "facet": ("facet", "name", "frame", *EYES)}
_ENDING = ".exr"
PAGE = "quilt/page_{page:02}{.eye}.{frame:04}.exr"
FACET = "facets/facet_{facet:04}{.eye}.{frame:04}.exr"


@dataclass(frozen=True)
class Slot:
    """A field of a template: what stands there, and how many digits a number has at least."""

    field: str
    digits: int = 1


@dataclass(frozen=True)
class Template:
    """A template, read.

    Attributes:
        parts: texts and fields in their order.
    """

    parts: tuple[str | Slot, ...]

    @cached_property
    def fields(self) -> frozenset[str]:
        """Names of the fields; an eye is `eye` in either form."""
        return frozenset(part.field.lstrip(".") for part in self.parts if isinstance(part, Slot))

    def filled(self, values: Mapping[str, int | str]) -> str:
        """The name for values by field; an empty `eye` is no eye, or `center` where it has no dot."""
        return "".join(part if isinstance(part, str) else _shown(part, values) for part in self.parts)

    def values_in(self, name: str) -> dict[str, int | str] | None:
        """The values that a name was made of, None of another template's."""
        match = self._pattern.fullmatch(name)
        if match is None:
            return None
        values: dict[str, int | str] = {}
        for field, text in match.groupdict().items():
            values[field] = int(text) if field in NUMBERS else text or ""
        if values.get("eye") == "center":
            values["eye"] = ""
        values.setdefault("eye", "")
        return values if self.filled(values) == name else None

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        seen: set[str] = set()
        text = ""
        for part in self.parts:
            text += re.escape(part) if isinstance(part, str) else _pattern_of(part, seen)
        return re.compile(text)


def _shown(slot: Slot, values: Mapping[str, int | str]) -> str:
    if slot.field in NUMBERS:
        number = int(values[slot.field])
        return f"{'-' if number < 0 else ''}{abs(number):0{slot.digits}d}"
    if slot.field == "name":
        return str(values["name"])
    eye = str(values.get("eye", ""))
    return eye or "center" if slot.field == "eye" else f".{eye}" * bool(eye)


def _pattern_of(slot: Slot, seen: set[str]) -> str:
    """Pattern of a field; one that has been met before must have the same value again."""
    field = slot.field.lstrip(".")
    again = field in seen
    seen.add(field)
    if again:  # another form of it is told apart by making the name anew
        return r"(?:\.\w+)?" if slot.field == ".eye" else r"-?[\w-]+"
    if field in NUMBERS:
        return rf"(?P<{field}>-?\d{{{slot.digits},9}})"
    if field == "name":
        return r"(?P<name>[\w-]+)"
    return r"(?P<eye>left|right|center)" if slot.field == "eye" else r"(?:\.(?P<eye>left|right))?"


def read_template(text: str, kind: str) -> Template:
    """Read the template for images of a kind, `page` or `facet`.

    Raises:
        PydanticCustomError: it makes no sense, in words.
    """
    parts = _parts(text, kind)
    for wrong in _faults(text, parts):
        raise complaint(wrong)
    return Template(tuple(parts))


def read_pattern(text: str, kind: str) -> Template:
    """Read a pattern of names that others have given; it need not be told back what a name was made of.

    A run of # stands for the frame number, too.

    Raises:
        PydanticCustomError: it holds a field that there is not.
    """
    return Template(tuple(_parts(_HASHES.sub(lambda run: f"{{frame:0{len(run[0])}}}", text), kind)))


def _parts(text: str, kind: str) -> list[str | Slot]:
    """Texts and fields in their order."""
    parts: list[str | Slot] = []
    at = 0
    for match in _FIELD.finditer(text):
        parts += [text[at : match.start()]] * (match.start() > at) + [_slot(match[1], kind)]
        at = match.end()
    return parts + [text[at:]] * (at < len(text))


def _slot(text: str, kind: str) -> Slot:
    field, colon, digits = text.partition(":")
    known = _KNOWN[kind]
    if field not in known:
        near = suggest(field, known)
        hint = f" (did you mean {{{near}}}?)" if near else ""
        expected = either([f"{{{name}}}" for name in known])
        raise complaint(f"there is no field {{{field}}} of a {kind} (expected {expected}){hint}")
    if colon and (field not in NUMBERS or not _DIGITS.fullmatch(digits)):
        raise complaint(f"cannot read {{{text}}} (expected digits of a number, such as {{frame:04}})")
    return Slot(field, int(digits or 1))


def _faults(text: str, parts: list[str | Slot]) -> Iterator[str]:
    """What keeps a text from being a template, the gravest first."""
    plain = "".join(part for part in parts if isinstance(part, str))
    if "{" in plain or "}" in plain:
        yield f"has a brace without its other half: {text!r}"
    if bad := _FORBIDDEN.search(plain):
        yield f"file names on some systems cannot hold {bad[0]!r} (folders are parted by /)"
    for folder in text.split("/"):
        if not folder or {folder[0], folder[-1]} & set(". ") or folder.startswith("{.eye}"):
            yield (
                "expected names below the output folder, parted by /, that neither begin nor end with a"
                f" dot or a space, got {text!r}"
            )
    if not text.endswith(_ENDING):
        yield f"must end in {_ENDING}, got {text!r}"
    frames = [part for part in parts if isinstance(part, Slot) and part.field == "frame"]
    if not frames:
        yield f"lacks {{frame:04}}: all frames would have one name, {text!r}"
    if len(frames) > 1 or parts[-2:-1] != frames or parts[-1] != _ENDING:
        yield f"the frame number must be the last thing before {_ENDING}, and there alone, got {text!r}"
    yield from _unclear(parts)


def _unclear(parts: list[str | Slot]) -> Iterator[str]:
    """Fields that could not be told apart in a name."""
    for before, after in pairwise(parts):
        if isinstance(before, Slot) and isinstance(after, Slot) and after.field != ".eye":
            yield f"{{{before.field}}} and {{{after.field}}} need something between them"
        for slot, neighbour, end in ((before, after, 0), (after, before, -1)):
            if slot == Slot(".eye") and end == -1:
                continue  # it brings its own dot
            if isinstance(slot, Slot) and isinstance(neighbour, str) and _runs_on(slot, neighbour[end]):
                yield f"{{{slot.field}}} cannot stand beside {neighbour[end]!r}: they would run together"


def _runs_on(slot: Slot, neighbour: str) -> bool:
    return neighbour.isalnum() and (neighbour.isdigit() or slot.field not in NUMBERS)


def _for(kind: str) -> AfterValidator:
    def check(text: str) -> str:
        read_template(text, kind)
        return text

    return AfterValidator(check)


PageName: TypeAlias = Annotated[str, Field(max_length=500), _for("page")]
FacetName: TypeAlias = Annotated[str, Field(max_length=500), _for("facet")]


class NamesSpec(Model):
    """Names of the images below the output folder, with fields in braces."""

    page: PageName = PAGE
    """Of a page: {page:02}, {frame:04}, {.eye} (nothing, .left or .right), {eye} (center, left or right)."""
    facet: FacetName = FACET
    """Of a facet's image: {facet:04} or {name}, and the same."""

    def lacking_eyes(self, kinds: list[str]) -> Iterator[Complaint]:
        """Complain of names that two eyes would share."""
        for kind in kinds:
            if "eye" not in read_template(getattr(self, kind), kind).fields:
                yield (
                    ("output", "names", kind),
                    "lacks {.eye}: both eyes' images would have one name (or stereo: parts)",
                )
