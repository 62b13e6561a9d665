"""From pydantic's errors to sentences that name file, line, column, key and what was expected."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from quiltcli.errors import Problem
from quiltcli.formats.yaml.source import Key, Source, shorten
from quiltcli.job.model import describe, either, suggest


def problems_of(error: ValidationError, model: type[BaseModel], source: Source) -> list[Problem]:
    """Every problem pydantic found, in the order of the file."""
    found: list[Problem] = []
    for details in error.errors(include_url=False):
        key = tuple(part for part in details["loc"] if not _is_tag(part))
        if (
            key
            and key[:1] not in source.marks
            and (getattr(model, "copied", {}).get(key[0]),) in source.marks
        ):
            continue  # what is wrong with the value is told where it stands
        if details["type"] == "quilt":
            ctx = details["ctx"]
            found += [source.problem(key + tuple(at), text) for at, text in ctx["found"]]
        elif details["type"] in ("extra_forbidden", "invalid_key"):
            text = _unknown(key, _models_at(model, details["loc"]), model)
            found.append(source.problem(key, text, on_key=True))
        elif details["loc"][-1:] == ("[key]",):
            text = f"expected a whole number from 1 as key, got {describe(key[-1])}"
            found.append(source.problem(key, text, on_key=True))
        elif details["type"] == "missing":
            found.append(source.problem(key, _missing(key, _models_at(model, details["loc"]))))
        else:
            found.append(source.problem(key, _sentence(details)))
    return found


def _is_tag(part: str | int) -> bool:
    """Parts of pydantic's location that stand for a choice, not for a key of the file."""
    return isinstance(part, str) and (part.startswith("<") or part == "[key]")


def _missing(key: Key, siblings: Sequence[type[BaseModel]]) -> str:
    """Missing key, and what it is for."""
    about = [m.model_fields[str(key[-1])].description for m in siblings if key[-1] in m.model_fields]
    text = (about[0] if about and about[0] else "").rstrip(".")
    if text[1:2].islower():
        text = text[0].lower() + text[1:]
    return f"missing key ({text})" if text else "missing key"


def _unknown(key: Key, siblings: Sequence[type[BaseModel]], root: type[BaseModel]) -> str:
    """Unknown key: the nearest known one, or where it belongs, or what there is."""
    if key == ("$schema",):
        return "unknown key (name the schema in a first line '# yaml-language-server: $schema=FILE')"
    names = [field.alias or name for model in siblings for name, field in model.model_fields.items()]
    elsewhere = [path for path in _all_keys(root) if path.rpartition(".")[2] == key[-1]]
    # What is part of a part of another key's is meant less often.
    least = min((path.count(".") for path in elsewhere), default=0)
    elsewhere = [path for path in elsewhere if path.count(".") <= max(least, 1)]
    if len(elsewhere) == 1:
        return f"unknown key here (did you mean {elsewhere[0]!r}?)"
    near = suggest(key[-1], names)
    if near:
        return f"unknown key (did you mean {near!r}?)"
    return f"unknown key (known: {', '.join(names)})"


def _models_at(model: type[BaseModel], loc: Sequence[str | int]) -> list[type[BaseModel]]:
    """Models whose key the last part of `loc` would be."""
    models, named = [model], False
    for part in loc[:-1]:
        if isinstance(part, str) and part.startswith("<"):
            models = [m for m in models if m.__name__ == part[1:-1]]
        elif named:  # the user's own name of a mapping's entry
            named = False
        elif isinstance(part, str) and part != "[key]":
            fields = [m.model_fields[part].annotation for m in models if part in m.model_fields]
            models = [inner for field in fields for inner in _models_in(field)]
            named = any("dict[str" in str(field) for field in fields)
    return models


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models named anywhere in a type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)


def _all_keys(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Dotted path of every key that is not inside a list or an id mapping."""
    for name, field in model.model_fields.items():
        yield prefix + name
        if "tuple" not in str(field.annotation) and "dict" not in str(field.annotation):
            for inner in _models_in(field.annotation):
                yield from _all_keys(inner, f"{prefix}{name}.")


def _sentence(details: ErrorDetails) -> str:
    """What was expected, and what was found."""
    write = _SENTENCES.get(details["type"])
    if write is None:
        return f"{details['msg'][:1].lower()}{details['msg'][1:]}, got {describe(details['input'])}"
    return write(details["input"], details.get("ctx", {}))


def _number(value: Any, ctx: dict[str, Any]) -> str:
    words = f"expected a number, got {describe(value)}"
    if isinstance(value, str):
        words += _number_hint(value)
    return words


def _whole(value: Any, ctx: dict[str, Any]) -> str:
    words = f"expected a whole number, got {describe(value)}"
    return words + _number_hint(value) if isinstance(value, str) else words


def _number_hint(text: str) -> str:
    """Help for text that was meant as a number."""
    plain = text.replace("_", "").replace(" ", "")
    quoted = (text, " without quotes") if "_" not in text else (plain, "")
    for candidate, hint in (quoted, (plain, ""), (text.replace(",", "."), "")):
        try:
            float(candidate)
        except ValueError:
            continue
        return f" (write {shorten(candidate.strip())}{hint})"
    return ""


def _text(value: Any, ctx: dict[str, Any]) -> str:
    quoted = f" (write '{value}' in quotes)" if isinstance(value, (int, float)) else ""
    return f"expected text, got {describe(value)}{quoted.lower() if isinstance(value, bool) else quoted}"


def _boolean(value: Any, ctx: dict[str, Any]) -> str:
    hint = ""
    if isinstance(value, str):
        word = value.lower()
        hint = (
            " (write true)"
            if word in ("yes", "on", "y")
            else " (write false)"
            if word in ("no", "off", "n")
            else ""
        )
    return f"expected true or false, got {describe(value)}{hint}"


def _listing(value: Any, ctx: dict[str, Any]) -> str:
    return f"expected a list, got {describe(value)}"


def _mapping(value: Any, ctx: dict[str, Any]) -> str:
    return f"expected a mapping (key: value), got {describe(value)}"


def _limit(words: str, name: str) -> Callable[[Any, dict[str, Any]], str]:
    return lambda value, ctx: f"must be {words} {_plain(ctx[name])}, got {describe(value)}"


def _plain(limit: float) -> str:
    """A limit as it would be typed."""
    return f"{limit:.0f}" if abs(limit) < 1e13 and limit == int(limit) else f"{limit:g}"


def _literal(value: Any, ctx: dict[str, Any]) -> str:
    return f"expected {str(ctx['expected']).lower()}, got {describe(value)}"


def _short(value: Any, ctx: dict[str, Any]) -> str:
    least = ctx["min_length"]
    return f"expected at least {least} item{'s' * (least > 1)}, got {ctx['actual_length'] or 'none'}"


_SENTENCES: dict[str, Callable[[Any, dict[str, Any]], str]] = {
    "float_type": _number,
    "int_type": _whole,
    "int_from_float": _whole,
    "string_type": _text,
    "bool_type": _boolean,
    "tuple_type": _listing,
    "list_type": _listing,
    "model_type": _mapping,
    "model_attributes_type": _mapping,
    "dict_type": _mapping,
    "literal_error": _literal,
    "too_short": _short,
    "finite_number": lambda value, ctx: f"expected a finite number, got {value}",
    "greater_than": _limit("greater than", "gt"),
    "greater_than_equal": _limit("at least", "ge"),
    "less_than": _limit("less than", "lt"),
    "less_than_equal": _limit("at most", "le"),
    "string_pattern_mismatch": lambda value, ctx: f"expected 64 hexadecimal digits, got {describe(value)}",
}


def version_problem(data: dict[Any, Any], kind: str, source: Source) -> Problem | None:
    """What is wrong with the key that says which kind of file this is, and which version."""
    if kind not in data:
        others = [key for key in data if key in KINDS]
        if others:
            words = f"this is a {others[0]} file (a {kind} file was expected)"
            return source.problem((others[0],), words, on_key=True)
        for key in data:
            if suggest(key, [kind]):
                return source.problem((key,), f"unknown key (did you mean {kind!r}?)", on_key=True)
        return source.problem((), f"expected '{kind}: 1' as the first key")
    version = data[kind]
    if isinstance(version, int) and not isinstance(version, bool) and version > 1:
        return source.problem((kind,), f"version {version} is newer than this program reads (expected 1)")
    if version != 1 or isinstance(version, (bool, float)):
        return source.problem((kind,), f"expected the version, 1, got {describe(version)}")
    return None


KINDS = (
    *("quilt_display", "quilt_layout", "quilt_scene", "quilt_job"),
    *("quilt_lightfield", "quilt_calibration", "quilt_camera"),
)
NO_KIND = f"this is no file of quilt's (expected {either([f'{kind}: 1' for kind in KINDS])} as the first key)"
