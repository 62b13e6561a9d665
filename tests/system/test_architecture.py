"""Data goes one way: a module imports only modules before it. A folder counts as one module."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "quiltcli"
ORDER = (
    *("ending", "errors", "geometry", "channels", "formats", "job", "charts", "display", "scene", "viewer"),
    *("layout", "projection", "visibility", "shading", "halftone", "lightfield", "images", "ring", "render"),
    *("calibration", "analysis", "exchange", "api", "cli", "__main__"),
)
LIGHT = {"quiltcli.ending", "quiltcli.errors", "quiltcli"}
STANDARD = {
    *("__future__", "collections", "contextlib", "dataclasses", "importlib", "os", "pathlib", "sys", "typing")
}


def files() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def module_of(path: Path) -> str:
    """`quiltcli.display.facets` of its file."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def place(module: str) -> int:
    """Where a module's room stands in the order."""
    name = module.split(".")[1]
    assert name in ORDER, f"{module} has no place in the order of rooms: give it one"
    return ORDER.index(name)


def imports(path: Path, *, top: bool = False) -> Iterator[str]:
    """Modules that a file imports, or imports while it is itself imported; types alone do not count."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    if top:
        nodes = tree.body
    types = {id(node) for test in ast.walk(tree) if for_types(test) for node in ast.walk(test)}
    for node in nodes:
        if id(node) in types:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import hides what it depends on"
            assert node.module is not None
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def own(names: Iterator[str]) -> set[str]:
    """Those of the imported names that are modules of the package."""
    known = {module_of(path) for path in files()}
    return {name for name in names if name in known and name != "quiltcli"}


def test_the_order_names_no_module_twice() -> None:
    assert len(ORDER) == len(set(ORDER))


@pytest.mark.parametrize("path", files(), ids=module_of)
def test_a_module_imports_only_modules_before_it(path: Path) -> None:
    module = module_of(path)
    if module == "quiltcli":
        assert own(imports(path)) == set()
        return
    later = {(module, name) for name in own(imports(path)) if place(name) > place(module)}
    assert later == set()


def test_files_of_a_folder_import_one_another_in_no_circle() -> None:
    needs = {module_of(path): own(imports(path, top=True)) for path in files()}
    while free := [module for module, others in needs.items() if not others & needs.keys() - {module}]:
        for module in free:
            del needs[module]
    assert needs == {}


def test_the_command_line_imports_nothing_heavy_at_its_top() -> None:
    found = {name for path in (PACKAGE / "cli").glob("*.py") for name in imports(path, top=True)}
    assert {name for name in own(found) if not name.startswith("quiltcli.cli")} <= LIGHT
    outside = {name.split(".")[0] for name in found}
    assert outside <= {"quiltcli", "click", *STANDARD}


def test_the_library_never_prints() -> None:
    printing = [
        module_of(path)
        for path in files()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    ]
    assert printing == []


@pytest.mark.parametrize(
    "module",
    [
        "images.diff",
        "images.preview",
        "images.unmap",
        "images.contact",
        "images.stereo.files",
        "analysis.info",
    ],
)
def test_what_looks_at_images_loads_nothing_that_draws_them(module: str) -> None:
    """Nor does saying what a file is, whatever its kind."""
    kinds = (PACKAGE / "analysis/info").glob("[a-z]*.py")
    others = "".join(f", quiltcli.analysis.info.{path.stem}" for path in kinds)
    wanted = f"quiltcli.{module}" + (others if module == "analysis.info" else "")
    drawing = "('quiltcli.visibility', 'quiltcli.shading')"
    code = f"import sys, {wanted}; print([name for name in sys.modules if name.startswith({drawing})])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"
