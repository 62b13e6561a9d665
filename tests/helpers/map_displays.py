"""Displays, layouts and comparisons the tests of pixel maps share."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from quiltcli.display import load_display
from quiltcli.exchange.pixelmaps import FORMATS
from quiltcli.job import ResolutionSpec, load_display_file
from quiltcli.layout import pixel_owners
from tests.helpers.packed_layouts import pack
from tests.helpers.turned_layout import turned_display, turned_layout

MODELS = Path(__file__).parents[2] / "display_models"
PLACES = ("facet", "page", "size", "corner_start", "pages")
MEASURES = ("quilt_from_facet", "origin", "du", "dv", "polygon")
BOTH_WAYS = [name for name, entry in FORMATS.items() if entry.read]


def model(name, density):
    spec = load_display_file(MODELS / f"{name}.yaml")
    own = {facet: choice.model_copy(update={"facet_pixels": None}) for facet, choice in spec.facets.items()}
    resolution = ResolutionSpec(pixels_per_metre=density)
    return load_display(spec.model_copy(update={"resolution": resolution, "facets": own}))


@cache
def cube():
    facets = model("cube5", 60)
    return facets, pack(facets, "rows", size=(40, 40))


@cache
def cave():
    facets = model("cave5", 12)
    return facets, pack(facets, "rows")


@cache
def sphere():
    facets = model("sphere840", 200)
    return facets, pack(facets, "rows", size=(300, 200))


@cache
def turned():
    return turned_display(), turned_layout()


CASES = [cube, cave, sphere, turned]


def suffixed(path, name):
    return path / f"map{FORMATS[name].suffix}"


def assert_same_places(expected, actual, tolerance):
    for key in PLACES:
        np.testing.assert_array_equal(getattr(expected, key), getattr(actual, key), err_msg=key)
    for key in MEASURES:
        np.testing.assert_allclose(
            getattr(actual, key), getattr(expected, key), rtol=0, atol=tolerance, err_msg=key
        )


def world_of_pixels(layout):
    """Facet, and world position (P, 3), of every owned quilt pixel."""
    owners = pixel_owners(layout)
    address = np.flatnonzero(owners)
    facet = owners[address]
    row = np.searchsorted(layout.facet, facet)
    page = layout.page[row]
    local = address - layout.page_offset[page]
    xy = np.stack((local % layout.pages[page, 0] + 0.5, local // layout.pages[page, 0] + 0.5), axis=1)
    linear, shift = layout.quilt_from_facet[row, :, :2], layout.quilt_from_facet[row, :, 2]
    ij = np.linalg.solve(linear, (xy - shift)[:, :, None])[:, :, 0]
    return address, facet, layout.origin[row] + ij[:, :1] * layout.du[row] + ij[:, 1:] * layout.dv[row]
