"""What a layout may be asked to be: aspects, limits, pins, and what is said when it cannot."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.display import Facets, load_display
from quiltcli.errors import JobError, QuiltError
from quiltcli.job import load_display_file, read_aspect
from quiltcli.layout import check_layout, read_layout, write_layout
from quiltcli.layout.packing import METHODS
from tests.helpers.flat_displays import PITCH, flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import MODELS, collisions, pack

SHARDS = flat_display(random_polygons(30, 10, 60, seed=21))
WHOLE = [method for method in METHODS if method != "net"]


def display(*sizes: tuple[int, int], **more: object) -> Facets:
    return flat_display([rectangle(*size) for size in sizes], **more)


def said(facets: Facets, *arguments: object, **more: object) -> list[str]:
    with pytest.raises(QuiltError) as caught:
        pack(facets, *arguments, **more)
    return str(caught.value).splitlines()


@pytest.mark.parametrize("text", ["16:9", "16x9", "16/9", "32:18"])
def test_aspects_are_read(text):
    assert read_aspect(text) == Fraction(16, 9)
    assert read_aspect("1.85") == Fraction(185, 100)


@pytest.mark.parametrize("text", ["", "wide", "0", "1:0", "16:9:4", "1000", "-1"])
def test_other_aspects_are_refused(text):
    with pytest.raises(JobError, match=r"^expected an aspect such as 16:9 or 1\.85, got "):
        read_aspect(text)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("aspect", [Fraction(16, 9), Fraction(1, 2)])
def test_a_page_has_the_aspect_asked_for(method, aspect):
    layout = pack(SHARDS, method, aspect=aspect, seconds=0.2)
    check_layout(layout)
    ((width, height),) = layout.pages.tolist()
    assert width % 16 == 0
    assert height == 2 * np.ceil(width / aspect / 2)


def test_the_page_of_an_aspect_is_the_smallest_that_rows_take():
    # Nine squares in rows of three take 96 × 96 pixels; a page one step narrower takes two to a row.
    layout = pack(display(*[(32, 32)] * 9), "rows", padding=0, aspect=Fraction(1))
    assert layout.pages.tolist() == [[96, 96]]


@pytest.mark.parametrize("method", METHODS)
def test_limits_of_a_page(method):
    facets = display(*[(10, 8)] * 7)
    layout = pack(facets, method, (64, 64), page_facets=3, seconds=0.1)
    assert np.bincount(layout.page).tolist() == [3, 3, 1]
    layout = pack(facets, method, (64, 64), page_pixels=170, seconds=0.1)
    assert layout.page.tolist() == [0, 0, 1, 1, 2, 2, 3]
    assert layout.pages.tolist() == [[64, 64]] * 4


def test_limits_that_cannot_be_kept():
    facets = display((10, 8), (10, 10), names=["", "top"])
    assert said(facets, "rows", (64, 64), page_pixels=90) == [
        "flat.yaml: facet 2 (top) has 100 pixels, more than the 90 of a page"
    ]
    assert said(facets, "rows", (64, 64), max_pages=1, page_facets=1) == [
        "flat.yaml: 2 facets take 2 pages of 64×64 pixels within the limits of a page,"
        " but at most 1 may be used"
    ]


def test_wishes_at_odds():
    assert said(SHARDS, "net", align=2, page_facets=3) == [
        "page_facets: limits of a page need a page size",
        "align: the method net lays facets at any angle, so it can neither align nor mirror them",
    ]
    pins = pack(SHARDS, "rows")
    assert said(SHARDS, "rows", (99, 99), aspect="1:1", page_pixels=9, pins=pins) == [
        "aspect: a page size and an aspect: give one, since the size has an aspect",
        "page_pixels: limits of a page and pins cannot be combined",
    ]


@pytest.mark.parametrize("method", METHODS)
def test_what_is_missing_and_what_would_do(method):
    facets = display(*[(10, 10)] * 5)
    lines = said(facets, method, (20, 20), padding=0, max_pages=1, seconds=0.1)
    # Rasters of 6.01 pixels are 7 wide, but what is inside them may share the seventh.
    density = "60" if method in ("rows", "rects") else "60.1"
    assert lines == [
        f"flat.yaml: 5 facets take 2 pages of 20×20 pixels by the method {method}, but at most 1 may be used;"
        f" 100 pixels of 1 facet find no place; a density of at most {density} % of the present one would"
        " do, or pages of 30×30 would"
    ]


@pytest.mark.parametrize("method", METHODS)
def test_the_density_and_the_size_that_are_named_do(method):
    (line,) = said(SHARDS, method, (150, 150), max_pages=1, seconds=0.5)
    share = float(line.split("at most ")[2].split(" %")[0]) / 100
    sparse = flat_display([polygon * share for polygon in random_polygons(30, 10, 60, seed=21)])
    assert len(pack(sparse, method, (150, 150), max_pages=1, seconds=0.5).pages) == 1
    width, height = map(int, line.split("pages of ")[-1].split(" ")[0].split("×"))
    assert len(pack(SHARDS, method, (width, height), max_pages=1, seconds=0.5).pages) == 1


def only(facets: Facets, rows: list[int]) -> Facets:
    enabled = np.zeros(facets.count, dtype=np.bool_)
    enabled[rows] = True
    return replace(facets, enabled=enabled)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("first", ["nest", "net"])
def test_pinned_facets_stay_and_nothing_meets_them(method, first, tmp_path):
    write_layout(pack(only(SHARDS, [3, 4, 5, 9, 20]), first, (100, 90), seconds=0.1), tmp_path / "pins.yaml")
    pins = read_layout(tmp_path / "pins.yaml")
    layout = pack(SHARDS, method, pins=pins, padding=2, seconds=0.2)
    check_layout(layout)
    assert layout.facet.tolist() == list(range(1, 31))
    kept = np.isin(layout.facet, pins.facet)
    for name in ("page", "size", "quilt_from_facet", "origin", "du", "dv"):
        assert getattr(layout, name)[kept].tolist() == getattr(pins, name).tolist()
    assert layout.pages.tolist()[0] == [100, 90]
    assert collisions(layout, 0 if "net" in (method, first) else 2) == 0
    # Rows never go back to a room that the next facet by id does not fit.
    assert method == "rows" or (layout.page[~kept] == 0).any()


PLACED = """quilt_display: 1
mesh: {mesh}
resolution: {{pixels_per_metre: 500}}
facets:
  1: {{name: front, place: {{at: [100, 50], rotate: 90}}}}
  3: {{place: {{page: 2, at: [0, 8], mirror: true}}}}
"""


def placed_cube(folder: Path, old: str = "", new: str = "") -> Facets:
    path = folder / "placed.yaml"
    path.write_text(PLACED.format(mesh=MODELS / "cube5.obj").replace(old, new))
    return load_display(load_display_file(path))


@pytest.mark.parametrize("method", METHODS)
def test_facets_stay_where_the_display_file_has_them(method, tmp_path):
    facets = placed_cube(tmp_path)
    layout = pack(facets, method, (700, 500), seconds=0.1)
    check_layout(layout)
    assert facets.size[0].tolist() == [266, 150]
    # A quarter turn clockwise takes facet pixel (0, 150), the lower left corner, to the place's own.
    assert layout.quilt_from_facet[0].tolist() == [[0, -1, 250], [1, 0, 50]]
    assert layout.quilt_from_facet[2].tolist() == [[-1, 0, 266], [0, 1, 8]]
    assert layout.page[[0, 2]].tolist() == [0, 1]
    assert collisions(layout, 0 if method == "net" else 2) == 0
    assert (layout.page[[1, 3, 4]] < 2).all()


def test_the_layout_of_the_pins_comes_before_the_display_file(tmp_path):
    facets = placed_cube(tmp_path)
    pins = pack(only(replace(facets, places=None), [0, 1]), "rows", (600, 500))
    layout = pack(facets, pins=pins, seconds=0.1)
    assert layout.quilt_from_facet[:2].tolist() == pins.quilt_from_facet.tolist()
    assert layout.quilt_from_facet[2].tolist() == [[-1, 0, 266], [0, 1, 8]]
    assert layout.pages.tolist() == [[600, 500]] * 2


@pytest.mark.parametrize(
    ("old", "new", "wishes", "message"),
    [
        ("", "", {"size": None}, "5:27: facets.1.place: a facet with a place needs a page of a"),
        ("page: 2, at: [0, 8]", "at: [200, 60]", {}, "6:14: facets.3.place: facets 1 and 3 overlap in 74"),
        (
            "[0, 8]",
            "[500, 8]",
            {},
            "6:14: facets.3.place: facet 3: corner 1 at (766, 157.445) lies",
        ),
        ("", "", {"align": 8}, "5:27: facets.1.place: pixel (100, 50) is no multiple of the alignment to 8"),
        (
            "",
            "",
            {"page_facets": 2},
            "5:27: facets.1.place: a facet with a place and limits of a page cannot",
        ),
    ],
)
def test_places_that_cannot_be(old, new, wishes, message, tmp_path):
    facets = placed_cube(tmp_path, old, new)
    (line,) = said(facets, "rects", **{"size": (700, 500), **wishes})
    assert line.startswith(f"{tmp_path / 'placed.yaml'}:{message}")


def test_pins_may_be_all_there_is():
    pins = pack(SHARDS, "rows", (100, 100))
    layout = pack(SHARDS, "nest", pins=pins)
    assert layout.quilt_from_facet.tolist() == pins.quilt_from_facet.tolist()


def test_pins_of_another_display_are_refused():
    pins = pack(display((4, 3), (5, 5)), "rows", (16, 16))
    (line,) = said(display((4, 3)), "rows", pins=pins)
    assert line.endswith("pins.yaml:17:7: facets[1].id: facet 2 is not in flat.yaml, which has facets 1 to 1")
    (line,) = said(display((4, 3), (5, 6)), "rows", pins=pins)
    assert line.endswith(
        f"facets[1].origin: facet 2: corner 3 lies {PITCH:.6g} m from where flat.yaml has it; origin, du, dv"
        " and polygon must agree with the display"
    )


@pytest.mark.parametrize("method", WHOLE)
def test_corners_lie_at_multiples(method):
    layout = pack(SHARDS, method, (131, 127), align=8, padding=3, seconds=0.1)
    low = np.minimum(layout.quilt_from_facet[:, :, :2] * layout.size[:, None], 0).sum(axis=2)
    assert ((low + layout.quilt_from_facet[:, :, 2]) % 8 == 0).all()
    assert collisions(layout, 3) == 0


def test_more_seconds_are_never_worse():
    pages = [pack(SHARDS, seconds=seconds).pages[0].prod() for seconds in (0.05, 0.5, 3)]
    assert pages[0] >= pages[1] >= pages[2]


def test_effort_does_not_depend_on_the_clock(monkeypatch):
    layout = pack(SHARDS, seconds=0.5)
    for clock in ("time", "perf_counter", "process_time", "monotonic"):
        monkeypatch.setattr(f"time.{clock}", None)
    assert pack(SHARDS, seconds=0.5).quilt_from_facet.tolist() == layout.quilt_from_facet.tolist()


def run(*arguments: object) -> list[str]:
    result = CliRunner().invoke(main, ["pack", *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return result.output.splitlines()


def test_the_command_packs_canvases_aspects_and_around_pins(tmp_path):
    first, second = tmp_path / "a.yaml", tmp_path / "b.yaml"
    cube = MODELS / "cube5.yaml"
    assert run(cube, "-o", first, "--size", "uhd") == ["fill 72.2 %", "pages 2 of 3840×2160 pixels"]
    assert run(cube, "-o", second, "--pins", first) == ["fill 72.2 %", "pages 2 of 3840×2160 pixels"]
    lines = run(cube, "-o", second, "--aspect", "16:9", "--method", "rects", "--picture", tmp_path / "p.svg")
    assert lines == ["fill 74.6 %", "pages 1 of 5344×3006 pixels"]
    # The display beside the pages: its five facets once more.
    assert (tmp_path / "p.svg").read_text().count("<polygon") > 5 + 5 + 5
