"""`quilt export`, `quilt import` and `quilt pattern` as they are typed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.calibration.pattern_files import page_pattern
from quiltcli.cli import main
from quiltcli.layout import pixel_owners, read_layout, write_layout
from tests.helpers.turned_layout import turned_layout

CUBE = str(Path(__file__).parents[2] / "display_models" / "cube5.yaml")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty working folder with a layout in it."""
    monkeypatch.chdir(tmp_path)
    write_layout(turned_layout(), "layout.yaml")
    return tmp_path


def quilt(*arguments, code=0):
    """Output of a command, standard error included."""
    result = CliRunner().invoke(main, [str(word) for word in arguments])
    assert result.exit_code == code, result.output
    return result.output.splitlines()


@pytest.mark.parametrize("name", ["m.csv", "m.json", "m.mpcdi"])
def test_out_and_in_again(folder, name):
    assert quilt("export", "layout.yaml", "-o", name) == [name]
    gone = "the display flat.yaml that the map names is not there: the layout names none"
    told = [gone, "8 facets on 2 pages"] if name == "m.json" else ["8 facets on 2 pages"]
    assert quilt("import", name, "-o", "again.yaml", "--picture", "again.svg") == told
    before, after = read_layout("layout.yaml"), read_layout("again.yaml")
    np.testing.assert_array_equal(before.quilt_from_facet, after.quilt_from_facet)
    np.testing.assert_array_equal(before.origin, after.origin)
    assert Path("again.svg").exists()


def test_names_come_from_the_display_the_layout_names(folder):
    quilt("pack", CUBE, "-o", "cube.yaml", "--method", "rows")
    assert quilt("export", "cube.yaml", "-o", "m.obj") == ["m.obj"]
    assert "o facet_0005_top" in Path("m.obj").read_text().splitlines()
    assert quilt("import", "m.obj", "-o", "again.yaml", "--display", CUBE) == ["5 facets on 1 page"]
    before, after = Path("cube.yaml").read_text(), Path("again.yaml").read_text()
    assert before.partition("pages:")[2] == after.partition("pages:")[2]


def test_many_files_are_counted(folder):
    lines = quilt("export", "layout.yaml", "-o", "m.exr")
    assert lines == ["m_page_01.exr", "m_page_02.exr", *(f"m_facets/facet_000{n}.exr" for n in range(1, 9))]
    assert quilt("export", "layout.yaml", "-o", "m.dat", "--format", "csv") == ["m.dat"]


def test_patterns_of_several_kinds(folder):
    lines = quilt("pattern", "layout.yaml", "-o", "out", "--kind", "grid", "--kind", "id", "--step", 4)
    assert lines == [f"out/{kind}_page_0{page}.png" for kind in ("grid", "id") for page in (1, 2)]
    layout = read_layout("layout.yaml")
    expected = page_pattern(layout, 1, "grid", pixel_owners(layout), step=4, dtype=np.uint8)
    with Image.open("out/grid_page_02.png") as image:
        np.testing.assert_array_equal(np.dstack([expected[c] for c in "RGBA"]), np.asarray(image))
    assert len(quilt("pattern", "layout.yaml", "-o", "all", "--kind", "all", "--format", "exr")) == 14
    (message,) = quilt("pattern", "layout.yaml", "-o", "out", "--kind", "id", code=2)[:1]
    assert message.startswith("out/id_page_01.png: exists already")
    assert len(quilt("pattern", "layout.yaml", "-o", "out", "--overwrite")) == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("export", "layout.yaml", "-o", "m.txt"),
            "error: m.txt: has the suffix '.txt', which names no format",
        ),
        (
            ("import", "m.svg", "-o", "l.yaml"),
            "error: m.svg: holds template drawing, one file a page, a format",
        ),
        (("import", "m.csv", "-o", "l.yaml"), "error: m.csv: no such file"),
        (
            ("pattern", "layout.yaml", "-o", "out", "--kind", "gird"),
            "error: unknown pattern 'gird' (known: id",
        ),
        (("export", "layout.yaml", "-o", "m.csv", "--display", CUBE), "layout.yaml"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_written(folder, words, message):
    assert quilt(*words, code=2)[0].startswith(message)
    assert sorted(path.name for path in folder.iterdir()) == ["layout.yaml"]
