"""The scalars of YAML 1.2, for the readers and the writer.

They follow the core schema, whatever PyYAML does by default: `1e3` is a number, only `true` and
`false` are booleans, `1:30` and `2024-01-01` are text.
"""

from __future__ import annotations

import re

from yaml.resolver import BaseResolver

CORE = "tag:yaml.org,2002:"


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
    CoreResolver.add_implicit_resolver(CORE + _tag, re.compile(rf"(?:{_pattern})\Z"), _first)
