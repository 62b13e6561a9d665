from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import OutputError
from quiltcli.formats.drawing.shapes import Label, Shape
from quiltcli.layout.picture.drawing import draw_layout
from quiltcli.layout.picture.picture import layout_picture
from tests.helpers.flat_displays import flat_display, moved, placed, random_polygons, rectangle
from tests.helpers.packed_layouts import pack

TWO = flat_display([rectangle(40, 30)] * 2, names=["left", "top <1>"])
LAYOUT = placed(TWO, [moved(0, 0), [[0, -1, 80], [1, 0, 10]]], (100, 60))


def labels(drawing):
    return [item.text for item in drawing.items if isinstance(item, Label)]


def test_ids_names_and_fill_are_on_it():
    assert labels(draw_layout(LAYOUT, TWO.names)) == [
        "flat.yaml   fill 40.0 %",
        "2 facets on 1 page, 0.00 megapixels used, method manual, padding 0",
        "Page 1:  100 x 60,  40.0 %",
        "1",
        "left",
        "2",
        "top <1>",
    ]


def test_the_triangle_points_to_the_top_of_the_facets_image():
    shapes = [item for item in draw_layout(LAYOUT).items if isinstance(item, Shape)]
    upright, turned = (arrow.points for arrow in shapes if len(arrow.points) == 3)
    assert upright[0, 1] < upright[1:, 1].min()
    assert turned[0, 0] > turned[1:, 0].max()


def test_facets_are_drawn_where_they_lie():
    shapes = [item for item in draw_layout(LAYOUT).items if isinstance(item, Shape)]
    page, first = shapes[0].points, shapes[1].points
    assert np.allclose((first - page[0]) / (page[2] - page[0]), [[0, 0], [0.4, 0], [0.4, 0.5], [0, 0.5]])


@pytest.mark.parametrize("size", [(64, 64), (64, 128), (200, 40)])
def test_it_is_large_but_not_too_large(size):
    drawing = draw_layout(pack(flat_display(random_polygons(30, 8, 40, seed=4)), "rows", size))
    assert 1800 < max(drawing.width, drawing.height) <= 2048
    points = np.concatenate([item.points for item in drawing.items if isinstance(item, Shape)])
    assert points.min() >= 0
    assert (points <= (drawing.width, drawing.height)).all()


def test_png_has_the_colours_of_the_facets(tmp_path):
    path = tmp_path / "layout.png"
    layout_picture(LAYOUT, path)
    drawing = draw_layout(LAYOUT)
    facet = [item for item in drawing.items if isinstance(item, Shape)][1]
    with Image.open(path) as image:
        assert image.size == (drawing.width, drawing.height)
        x, y = facet.points[0] + 12
        assert "#{:02x}{:02x}{:02x}".format(*image.getpixel((int(x), int(y)))) == facet.fill


def test_svg_is_well_formed_and_names_are_escaped(tmp_path):
    path = tmp_path / "layout.svg"
    layout_picture(LAYOUT, path, TWO.names)
    texts = [element.text for element in ET.parse(path).getroot() if element.tag.endswith("text")]
    assert texts[-1] == "top <1>"


def test_pictures_are_the_same_every_time(tmp_path):
    for name in ("a.png", "b.png", "a.svg", "b.svg"):
        layout_picture(LAYOUT, tmp_path / name, TWO.names)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"layout\.gif: a picture's name must end in \.png or \.svg$"):
        layout_picture(LAYOUT, tmp_path / "layout.gif")
    assert list(tmp_path.iterdir()) == []
