"""JSON Schema of a value in words: what it may be, and what it is when it is absent."""

from __future__ import annotations

import json
from typing import Any

_WORDS = {"string": "text", "integer": "whole number", "number": "number", "boolean": "`true` or `false`"}


def target(schema: dict[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """What a reference refers to."""
    found = schema["$defs"][node["$ref"].rpartition("/")[2]]
    assert isinstance(found, dict)
    return found


def choices(node: dict[str, Any]) -> list[dict[str, Any]]:
    """The alternatives of a value, but for none at all."""
    found = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    return [choice for choice in found if choice.get("type") != "null"]


def default_of(value: dict[str, Any]) -> str:
    """A default as one would write it in YAML; mappings have defaults of their own."""
    default = value.get("default")
    if default is None or default in ("", []) or isinstance(default, dict):
        return "–"
    if isinstance(default, float) and default.is_integer():
        default = int(default)
    if isinstance(default, list):
        default = [int(x) if isinstance(x, float) and x.is_integer() else x for x in default]
        return f"`{json.dumps(default, ensure_ascii=False)}`".replace('"', "")
    return f"`{default}`" if isinstance(default, str) else f"`{json.dumps(default)}`"


def type_of(schema: dict[str, Any], node: dict[str, Any], places: dict[int, str]) -> str:
    """What a value may be, in words."""
    if "$ref" in node:
        return f"[mapping](#{places[id(target(schema, node))]})"
    if several := choices(node):
        return " or ".join(dict.fromkeys(type_of(schema, choice, places) for choice in several))
    if "const" in node:
        return f"`{json.dumps(node['const'])}`".replace('"', "")
    if "enum" in node:
        return ", ".join(f"`{word}`" for word in dict.fromkeys(str(x) for x in node["enum"] if x is not None))
    kind = node.get("type")
    if kind == "array":
        return _list_type(schema, node, places)
    if kind == "object":
        return f"{type_of(schema, node['additionalProperties'], places)} by id or name"
    if isinstance(kind, list):
        return " or ".join(_WORDS[word] for word in kind if word != "null")
    if node.get("minimum", 0) == node.get("maximum"):
        return f"`{node['maximum']}`"
    if isinstance(kind, str):
        return "path" if node.get("format") == "path" else _WORDS[kind] + _range(node)
    return "any"


def _list_type(schema: dict[str, Any], node: dict[str, Any], places: dict[int, str]) -> str:
    """A list in words: of how many of what."""
    if "prefixItems" in node:
        return _so_many(schema, len(node["prefixItems"]), node["prefixItems"][0], places)
    if "minItems" in node and node["minItems"] == node.get("maxItems"):
        return _so_many(schema, node["minItems"], node["items"], places)
    return f"list of {type_of(schema, node['items'], places)}"


def _so_many(schema: dict[str, Any], count: int, item: dict[str, Any], places: dict[int, str]) -> str:
    """`3 numbers`, `2 rows of 3 numbers`."""
    if item.get("type") == "array":
        return f"{count} rows of {_list_type(schema, item, places)}"
    if item.get("type") in ("integer", "number"):
        return f"{count} {_WORDS[item['type']]}s{_range(item)}"
    return f"{count} of {type_of(schema, item, places)}"


def _range(node: dict[str, Any]) -> str:
    """Bounds of a number."""
    low, high = node.get("minimum"), node.get("maximum")
    if low is not None and high is not None:
        return f" {low:,} to {high:,}"
    if low is not None:
        return f" ≥ {low:,}"
    if "exclusiveMinimum" in node:
        return f" > {node['exclusiveMinimum']:,}"
    return ""
