"""A layout file read as lines is what it is read as YAML, and what is wrong is told as always."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import JobError
from quiltcli.job import layout_table as module
from quiltcli.job import load_layout_file
from quiltcli.job.layout_table import LayoutLines, places_sha256, read_layout_table, table_of
from quiltcli.layout import write_layout
from quiltcli.layout.layout import Packed
from tests.helpers.flat_displays import flat_display, random_polygons
from tests.helpers.packed_layouts import pack

SHARDS = flat_display(random_polygons(9, 3, 20, seed=5))
PACKED = Packed("a" * 64, "b" * 64, "c" * 64)
LAYOUTS = {method: replace(pack(SHARDS, method, seconds=0.1), packed=PACKED) for method in ("rows", "net")}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_layout(LAYOUTS["rows"], tmp_path / "layout.yaml")
    return tmp_path / "layout.yaml"


def edited(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.fixture
def lines_alone(monkeypatch):
    """Nothing but lines is read now."""
    monkeypatch.setattr(module, "load_layout_file", None)


@pytest.mark.usefixtures("lines_alone")
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_lines_say_what_yaml_says_bit_for_bit(layout, path):
    write_layout(layout, path)
    read, known = read_layout_table(path), table_of(load_layout_file(path))
    assert len(read.head.facets) == 1
    assert read.head.packed == known.head.packed is not None
    for field in fields(read):
        one, other = getattr(read, field.name), getattr(known, field.name)
        if isinstance(one, np.ndarray):
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  page: 1\n", "  page: 1  # the only one\n"),
        ("\n  page: 1\n", "\n  page: 0x1\n"),
        ("facets:\n", "facets:\n# all of them\n"),
        ("\npacked:", "\n\npacked:"),
        ("  du:", "  du :"),
        ("- id: 1\n", "- id: 1\r\n"),
    ],
)
def test_other_ways_to_write_the_same_are_read_as_yaml(path, old, new):
    before = places_sha256(read_layout_table(path))
    edited(path, old, new)
    table = read_layout_table(path)
    assert len(table.head.facets) == 9
    assert places_sha256(table) == before


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("- id: 2\n", "- id: 1\n", "facets[1].id: facet 1 already has a place, at facets[0]"),
        ("- id: 2\n", "- id: 0\n", "facets[1].id: must be at least 1, got 0"),
        ("- id: 2\n", "- id: 2.0\n", "facets[1].id: expected a whole number, got 2.0"),
        (
            "- id: 2\n  page: 1",
            "- id: 2\n  page: 7",
            "facets[1].page: there is no page 7 (the layout has 1 page)",
        ),
        ("- id: 2\n  page: 1", "- id: 2\n  page: true", "facets[1].page: expected a whole number, got true"),
        (
            "- id: 2\n  page: 1",
            "- id: 2\n  page: 1, 1",
            "facets[1].page: expected a whole number, got the text '1, 1'",
        ),
        ("dv: [0, ", "dv: [.inf, ", "facets[0].dv[0]: expected a finite number, got inf"),
        ("dv: [0, ", "dv: [0, 0, 0]\n  dw: [", "facets[0].dw: unknown key (known: id, page,"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(path, old, new, message):
    edited(path, old, new)
    with pytest.raises(JobError) as caught:
        read_layout_table(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}:")


def test_a_line_is_found_when_a_later_stage_has_something_to_say(path):
    problem = read_layout_table(path).source.problem(["facets", 1, "du"], "no")
    text = path.read_text().splitlines()
    assert text[problem.line - 1].startswith("  du: ")
    assert str(problem) == f"{path}:22:7: facets[1].du: no"
    path.unlink()
    assert str(LayoutLines(path).problem(["pages"], "no")) == f"{path}: no"
