"""What comes with quilt: found in a clone and in a wheel, and good to the schema it names."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
import yaml

from quiltcli.errors import QuiltError
from quiltcli.job import file_kind, shipped
from quiltcli.job.mirror import KIND, is_mirror

ROOT = Path(__file__).parents[2]
FILES = sorted(path for folder in ("display_models", "scenes") for path in (ROOT / folder).glob("*.yaml"))
LINE = "# yaml-language-server: $schema="


def test_a_clone_has_everything_beside_the_package() -> None:
    assert [shipped.shipped(folder) for folder in shipped.FOLDERS] == [ROOT / f for f in shipped.FOLDERS]


def test_a_wheel_has_everything_inside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site-packages" / "quiltcli"
    monkeypatch.setattr(shipped, "PACKAGE", package)
    with pytest.raises(QuiltError, match=r"^scenes did not come with this installation \(expected it in "):
        shipped.shipped("scenes")
    for folder in shipped.FOLDERS:
        (package / "data" / folder).mkdir(parents=True)
        assert shipped.shipped(folder) == package / "data" / folder


def test_the_build_puts_every_folder_where_it_is_looked_for() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]
    assert build["wheel"]["sources"] == {folder: f"quiltcli/data/{folder}" for folder in shipped.FOLDERS}
    assert set(build["wheel"]["only-include"]) == {"quiltcli", *shipped.FOLDERS}
    assert {"/docs", "/scenes", "/display_models", "/quiltcli"} <= set(build["sdist"]["include"])
    assert (ROOT / "quiltcli" / "py.typed").is_file()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_file_names_its_schema_and_is_good_to_it(path: Path) -> None:
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    assert first.startswith(LINE), f"the first line names no schema: {first}"
    schema = (path.parent / first.removeprefix(LINE)).resolve()
    mirror = file_kind(path) == "quilt_display" and is_mirror(yaml.safe_load(path.read_text()))
    kind = KIND if mirror else file_kind(path).removeprefix("quilt_")
    assert schema == ROOT / "docs" / "schema" / f"{kind}.schema.json"
    validators = pytest.importorskip("jsonschema")
    data = json.loads(json.dumps(yaml.safe_load(path.read_text(encoding="utf-8"))))
    validators.validate(data, json.loads(schema.read_text(encoding="utf-8")))
