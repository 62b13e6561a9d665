"""The page: one file that needs no other, and may load none."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

_SCRIPTS = ("display.js", "around.js", "main.js")
_SLOT = re.compile("@([A-Z]+)@")


def packed(values: NDArray[Any]) -> str:
    """An array as text for the page: its bytes, little-endian, in base64."""
    little = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return base64.b64encode(little.tobytes()).decode()


def json_text(data: Mapping[str, Any]) -> str:
    """JSON that can stand inside a script element whatever its strings hold."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    # No string can end the element or open a comment: neither `</script` nor `<!--` is left.
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def page(title: str, data: Mapping[str, Any]) -> str:
    """The whole page as HTML.

    A policy inside allows the two scripts by their hashes and pictures that are part of the page;
    a browser refuses everything else, networks above all.
    """
    library = _text("vendor/three.bundle.js")
    script = "\n".join(_text(f"page/{name}") for name in _SCRIPTS)
    parts = {
        "TITLE": html.escape(title),
        "POLICY": f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
        f"script-src {_hash(library)} {_hash(script)}",
        "STYLE": _text("page/page.css"),
        "DATA": json_text(data),
        "LIBRARY": library,
        "SCRIPT": script,
    }
    # In one pass, so that nothing that was put in is looked at again.
    return _SLOT.sub(lambda slot: parts[slot[1]], _text("page/page.html"))


def turning_page(title: str, data: Mapping[str, Any]) -> str:
    """The page to walk around a display with a spinning mirror; as strict as the other one."""
    script = _text("page/turning.js")
    parts = {
        "TITLE": html.escape(title),
        "POLICY": f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {_hash(script)}",
        "STYLE": _text("page/turning.css"),
        "DATA": json_text(data),
        "SCRIPT": script,
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], _text("page/turning.html"))


def _text(name: str) -> str:
    return (files("quiltcli.exchange.web") / name).read_text(encoding="utf-8")


def _hash(script: str) -> str:
    """The source expression that allows one script (Content Security Policy level 2)."""
    digest = hashlib.sha256(script.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
