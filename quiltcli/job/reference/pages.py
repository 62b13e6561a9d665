"""The pages: for a kind of file, a table of its keys and one of each mapping in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from quiltcli.formats.whole import write_text
from quiltcli.job.load import MODELS
from quiltcli.job.reference.types import choices, default_of, target, type_of
from quiltcli.job.reference.words import EXAMPLES, INTRODUCTIONS, NOTE
from quiltcli.job.schema import schema_of

UNITS_OF_MEASURE = ("metres", "pixels", "degrees", "seconds", "frames", "pixels a metre", "linear")
_HEAD = "| key | type | default | unit | meaning |\n| --- | --- | --- | --- | --- |"


def pages() -> dict[str, str]:
    """Text of every page by file name, `job.md` and so on."""
    return {f"{kind.removeprefix('quilt_')}.md": _page(kind) for kind in MODELS}


def write_pages(directory: Path) -> None:
    """Write every page into a folder."""
    directory.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        write_text(directory / name, text)


def keys(kind: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of a kind of file as a dotted path, with its JSON Schema; `[]` is any item of a list."""
    schema = schema_of(kind)
    for path, model in _sections(schema):
        for key, value in model.get("properties", {}).items():
            yield f"{path}.{key}".lstrip("."), value


def split_unit(text: str) -> tuple[str, str]:
    """A meaning and its unit, which is empty where the first sentence does not end with one."""
    first, full_stop, rest = text.partition(".")
    words, comma, unit = first.rpartition(", ")
    if comma and full_stop and unit in UNITS_OF_MEASURE:
        return words + full_stop + rest, unit
    return text, ""


def _page(kind: str) -> str:
    """One page: introduction, example, and a table for the file and each mapping in it."""
    name, schema = kind.removeprefix("quilt_"), schema_of(kind)
    sections = list(_sections(schema))
    places = _links(sections)
    parts = [f"# The {name} file", INTRODUCTIONS[name], f"```yaml\n{EXAMPLES[name]}```", NOTE]
    for path, model in sections:
        if path:
            parts += [f"## {_heading(path, model)}", model["description"]]
        parts.append("\n".join([_HEAD, *_rows(schema, model, places)]))
    return "\n\n".join(parts) + "\n"


def _rows(schema: dict[str, Any], model: dict[str, Any], places: dict[int, str]) -> Iterator[str]:
    """The keys of one mapping as rows of its table."""
    for key, value in model.get("properties", {}).items():
        text = value.get("description") or target(schema, value)["description"]
        meaning, unit = split_unit(text)
        unit = "degrees" if key.endswith("_deg") and not unit else unit
        required = key in model.get("required", ()) or "const" in value
        default = "**required**" if required else default_of(value)
        cells = (f"`{key}`", type_of(schema, value, places), default, unit, meaning)
        yield "| " + " | ".join(cell.replace("\n", " ").replace("|", "\\|") for cell in cells) + " |"


def _heading(path: str, model: dict[str, Any]) -> str:
    """What stands over a section; mappings that may stand at one place say what tells them apart."""
    told = ((key, model["properties"].get(key, {}).get("const")) for key in ("type", "kind"))
    return f"`{path}`" + "".join(f", `{key}: {constant}`" for key, constant in told if constant)


def _links(sections: list[tuple[str, dict[str, Any]]]) -> dict[int, str]:
    """Links to the sections by the identity of their mappings, as web pages make them of headings."""
    links: dict[int, str] = {}
    count: Counter[str] = Counter()
    for path, model in sections:
        letters = _heading(path, model).lower().replace(" ", "-")
        anchor = "".join(letter for letter in letters if letter.isalnum() or letter in "_-")
        links[id(model)] = anchor + (f"-{count[anchor]}" if count[anchor] else "")
        count[anchor] += 1
    return links


def _sections(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The file and each kind of mapping in it, at the first path that leads there, as one reads."""
    seen: set[int] = set()

    def visit(path: str, node: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
        if "$ref" in node:
            node = target(schema, node)
        if "properties" in node:
            if id(node) in seen:
                return
            seen.add(id(node))
            yield path, node
        for key, value in node.get("properties", {}).items():
            yield from visit(f"{path}.{key}".lstrip("."), value)
        for choice in choices(node):
            yield from visit(path, choice)
        if isinstance(node.get("items"), dict):
            yield from visit(f"{path}[]", node["items"])
        if isinstance(node.get("additionalProperties"), dict):
            yield from visit(f"{path}.ID", node["additionalProperties"])

    yield from visit("", schema)
