"""Packing real displays: nothing meets, nothing is resampled, targets are reached."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from quiltcli.display import corner_pixels
from quiltcli.images.facets import facet_image, quilt_buffers
from quiltcli.layout import Layout, check_layout, fill, layout_text, pixel_owners, quilt_polygons, whole_pixel
from quiltcli.layout.packing import METHODS
from quiltcli.layout.packing.model import used_height
from quiltcli.layout.packing.outlines.nest import nest_attempts
from tests.helpers.flat_displays import flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import MODELS, collisions, model, pack, wanted_of

NAMES = sorted(path.stem for path in MODELS.glob("*.yaml") if "\nkind:" not in path.read_text())
WHOLE = [method for method in METHODS if method != "net"]


def unchanged(layout: Layout) -> bool:
    """Whether noise cut into facet images and put back is the same at every pixel of a facet."""
    owners = pixel_owners(layout)
    noise = np.random.default_rng(7).random(owners.size).astype(np.float32)
    images = {row: facet_image({"R": noise}, layout, row, owners) for row in range(layout.facet.size)}
    back = quilt_buffers(images, layout, owners)["R"]
    return bool((back[owners > 0] == noise[owners > 0]).all())


@pytest.mark.parametrize("name", ["cave5", "icosahedron", "dodecahedron", "cylinder216", "desk816"])
@pytest.mark.parametrize("method", ["nest", "net"])
def test_no_facets_of_a_display_meet(name, method):
    layout = pack(model(name), method, seconds=0.3)
    check_layout(layout)
    assert whole_pixel(layout).all()
    assert collisions(layout, 0 if method == "net" else 2) == 0


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("method", METHODS)
def test_no_facets_of_any_display_meet(name, method):
    facets = model(name)
    layout = pack(facets, method)
    check_layout(layout)
    assert collisions(layout, 0 if method == "net" else 2) == 0
    assert unchanged(layout)
    layout = pack(facets, method, padding=5, align=1 if method == "net" else 4, seconds=1)
    check_layout(layout)
    assert collisions(layout, 0 if method == "net" else 5) == 0


@pytest.mark.parametrize("method", METHODS)
def test_noise_survives_the_way_out_and_back(method):
    facets = flat_display(random_polygons(40, 6, 40, seed=9))
    layout = pack(facets, method, (70, 60), seconds=0.1, mirror=method != "net")
    assert unchanged(layout)
    if method in ("nest", "auto"):
        linear = layout.quilt_from_facet[:, :, :2].reshape(-1, 4)
        assert len(np.unique(linear, axis=0)) == 8  # every turn, mirrored and not


@pytest.mark.parametrize("method", WHOLE)
def test_rasters_stay_the_displays(method):
    facets = model("icosahedron")
    layout = pack(facets, method, seconds=0.1)
    for name in ("size", "origin", "du", "dv"):
        assert getattr(layout, name).tolist() == getattr(facets, name).tolist()
    assert layout.polygon.tolist() == corner_pixels(facets).tolist()


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS)
def test_the_same_display_gives_the_same_file(method):
    one, other = (layout_text(pack(model("teapot1024"), method)) for _ in range(2))
    assert one == other


@pytest.mark.parametrize(
    ("name", "least"),
    [("cylinder216", 0.95), ("desk816", 0.88), ("icosahedron", 0.75), ("spring902", 0.82), ("cube5", 0.97)],
)
def test_auto_fills_the_page(name, least):
    assert fill(pack(model(name), seconds=1)) >= least


def test_neighbours_stay_neighbours_in_a_net():
    layout = pack(model("cylinder216"), "net", seconds=0.1)
    assert layout.pages.tolist() == [[1440, 3760]]
    corners = np.round(quilt_polygons(layout), 3)
    # A cylinder of 24 × 9 panels unrolls to one sheet, which has 25 × 10 corners.
    assert len(np.unique(corners, axis=0)) == 250
    assert fill(layout) > 0.999


def test_a_net_takes_its_rasters_from_the_quilt():
    layout = pack(model("icosahedron"), "net", seconds=0.1)
    steps = np.linalg.norm(layout.du, axis=1)
    assert np.ptp(steps) < 1e-9
    assert abs(float((layout.du * layout.dv).sum(axis=1).max())) < 1e-12


@pytest.mark.long
def test_five_thousand_polygons():
    rng = np.random.default_rng(11)
    polygons = []
    for _ in range(5000):
        n = int(rng.integers(3, 9))
        angle = np.sort((np.arange(n) + rng.uniform(-0.35, 0.35, n)) * 2 * np.pi / n)
        polygon = np.column_stack((np.cos(angle), np.sin(angle))) * rng.uniform(20, 90)
        polygons.append(polygon - polygon.min(axis=0))
    start = time.process_time()
    layout = pack(flat_display(polygons))
    assert time.process_time() - start < 60
    check_layout(layout)
    assert collisions(layout, 2) == 0
    assert fill(layout) > 0.745


@pytest.mark.parametrize(
    ("padding", "align", "mirror", "size"),
    [(2, 1, False, None), (0, 1, True, (300, 200)), (3, 4, False, (280, 260))],
)
def test_a_pile_of_unlike_facets_is_valid_and_denser_than_rows(padding, align, mirror, size):
    facets = flat_display(random_polygons(140, 12, 60, seed=padding))
    wanted = wanted_of(facets, (512, 4096), padding, align, mirror=mirror)
    pile, *shelves = nest_attempts(wanted, 10)[:4]
    assert pile.family == "pile"
    lowest = min(used_height(wanted, shelf.run(wanted)) for shelf in shelves)
    assert used_height(wanted, pile.run(wanted)) < 0.95 * lowest
    layout = pack(facets, "nest", size, padding, align=align, mirror=mirror, seconds=0.1)
    check_layout(layout)
    assert collisions(layout, padding) == 0
    assert unchanged(layout)


def test_a_pile_goes_around_pins():
    polygons = random_polygons(140, 12, 60, seed=8)
    facets = flat_display(polygons)
    first = replace(facets, enabled=np.arange(140) % 7 == 0)
    pins = pack(first, "rows", (300, 240))
    layout = pack(facets, "nest", pins=pins, seconds=0.1)
    assert collisions(layout, 2) == 0
    assert len(layout.pages) > 1
    assert (layout.page[np.arange(140) % 7 > 0] == 0).any()


def test_concave_facets_interlock():
    notched = [[0, 0], [60, 0], [60, 20], [20, 20], [20, 60], [0, 60]]
    facets = flat_display([notched, rectangle(36, 36)] * 4)
    layout = pack(facets, "nest", padding=2, seconds=1)
    assert collisions(layout, 2) == 0
    assert fill(layout) > fill(pack(facets, "rects", padding=2)) + 0.1
