"""JSON Schemas of the kinds of file, for editors that check YAML while it is typed.

`python -m quiltcli.job.schema docs/schema` writes them. A YAML file names its schema in a comment,
`# yaml-language-server: $schema=FILE`, which editors with that language server read; files that come
with quilt do.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from quiltcli.job.load import MODELS


def schemas() -> dict[str, str]:
    """Text of every schema by file name, `job.schema.json` and so on."""
    return {f"{kind.removeprefix('quilt_')}.schema.json": _text(kind) for kind in MODELS}


def schema_text(name: str) -> str:
    """Text of the schema of a kind of file: `job`, `display` and so on."""
    return _text(f"quilt_{name}")


def write_schemas(directory: Path) -> None:
    """Write every schema into a folder."""
    directory.mkdir(parents=True, exist_ok=True)
    for name, text in schemas().items():
        (directory / name).write_text(text, encoding="utf-8")


def schema_of(kind: str) -> dict[str, Any]:
    """The JSON Schema of a kind of file, such as `quilt_job`."""
    model = MODELS[kind]
    schema: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    schema.update(model.model_json_schema(by_alias=True))
    # Python code may leave the version out; a file must not.
    schema["required"] = [model.kind, *schema.get("required", [])]
    schema["title"] = f"{kind} file"
    return schema


def _text(kind: str) -> str:
    return json.dumps(schema_of(kind), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    write_schemas(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/schema"))
