from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quiltcli.errors import LayoutError
from quiltcli.geometry import cross, dot, segments
from quiltcli.layout import layout_from_uv, pixel_owners, quilt_polygons, whole_pixel
from tests.helpers.flat_displays import PITCH, flat_display, random_polygons, rectangle, shifted
from tests.helpers.packed_layouts import pack

PAGE = (32, 20)


def with_quilt(facets, quilt, size=PAGE):
    """The display with texture coordinates that put its corners at these quilt pixels."""
    quilt = np.asarray(quilt, dtype=np.float64)
    return replace(facets, uv=np.stack((quilt[:, 0] / size[0], 1 - quilt[:, 1] / size[1]), axis=1))


def one(quilt, polygon=None):
    """Layout of a single facet whose corners lie at these quilt pixels."""
    return layout_from_uv(with_quilt(flat_display([polygon or rectangle(4, 3)]), quilt), PAGE)


def said(facets, size=PAGE):
    with pytest.raises(LayoutError) as caught:
        layout_from_uv(facets, size)
    return str(caught.value).splitlines()


def test_upright_facet_keeps_the_displays_raster():
    layout = one(shifted(rectangle(4, 3), 5, 2))
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 5], [0, 1, 2]]]
    assert layout.size.tolist() == [[4, 3]]
    assert np.allclose(layout.du, [[PITCH, 0, 0]], rtol=0, atol=1e-15)
    assert np.allclose(layout.dv, [[0, -PITCH, 0]], rtol=0, atol=1e-15)
    assert np.allclose(layout.origin, 0, rtol=0, atol=1e-15)
    assert np.allclose(layout.polygon, rectangle(4, 3), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("linear", "expected"),
    [
        ([[0, -1], [1, 0]], [[0, -1, 8], [1, 0, 5]]),
        ([[-1, 0], [0, -1]], [[-1, 0, 8], [0, -1, 8]]),
        ([[0, 1], [-1, 0]], [[0, 1, 5], [-1, 0, 8]]),
        ([[-1, 0], [0, 1]], [[-1, 0, 8], [0, 1, 5]]),
        ([[1, 0], [0, -1]], [[1, 0, 5], [0, -1, 8]]),
        ([[0, 1], [1, 0]], [[0, 1, 5], [1, 0, 5]]),
        ([[0, -1], [-1, 0]], [[0, -1, 8], [-1, 0, 8]]),
    ],
)
def test_turned_and_mirrored_facets_keep_the_displays_raster(linear, expected):
    quilt = np.array(rectangle(3, 3)) @ np.array(linear).T
    layout = one(quilt - quilt.min(axis=0) + 5, rectangle(3, 3))
    assert layout.quilt_from_facet.tolist() == [expected]
    assert np.allclose(layout.du, [[PITCH, 0, 0]], rtol=0, atol=1e-15)
    assert np.allclose(layout.dv, [[0, -PITCH, 0]], rtol=0, atol=1e-15)
    assert np.allclose(layout.polygon, rectangle(3, 3), rtol=0, atol=1e-12)


def test_stretched_facet_has_the_quilts_pixels():
    layout = one(shifted(rectangle(8, 9), 1, 1))
    assert layout.size.tolist() == [[8, 9]]
    assert np.allclose(layout.du, [[PITCH / 2, 0, 0]], rtol=0, atol=1e-15)
    assert np.allclose(layout.dv, [[0, -PITCH / 3, 0]], rtol=0, atol=1e-15)


def test_slanted_facet_gets_the_box_around_it():
    quilt = [[4, 2.5], [9, 5], [6.5, 10], [1.5, 7.5]]
    layout = one(quilt, rectangle(5, 5))
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 1], [0, 1, 2]]]
    assert layout.size.tolist() == [[8, 8]]
    assert np.allclose(layout.polygon, np.array(quilt) - [1, 2], rtol=0, atol=1e-12)
    # One pixel of the quilt is 2/√5 of the display's in size; the square stands 26.6° to the right.
    assert np.allclose(layout.du[0], [0.8 * PITCH, 0.4 * PITCH, 0], rtol=0, atol=1e-15)
    assert np.allclose(layout.dv[0], [0.4 * PITCH, -0.8 * PITCH, 0], rtol=0, atol=1e-15)


def test_many_facets_take_no_more_steps_of_python_than_few():
    def steps(count):
        polygons = [shifted(rectangle(3, 3), 4 * (k % 40), 4 * (k // 40)) for k in range(count)]
        facets = with_quilt(flat_display(polygons), np.concatenate(polygons), (400, 400))
        taken = 0

        def watch(frame, event, what):
            nonlocal taken
            taken += event == "call"

        sys.setprofile(watch)
        try:
            layout_from_uv(facets, (400, 400))
        finally:
            sys.setprofile(None)
        return taken

    assert steps(800) < steps(80) + 100


def test_narrow_facets_far_from_the_corner_keep_their_place():
    quilt = np.array(shifted(rectangle(0.25, 9000), 8000.125, 3))
    layout = layout_from_uv(
        with_quilt(flat_display([rectangle(1, 9000)]), quilt, (16384, 16384)), (16384, 16384)
    )
    assert np.allclose(
        world(layout), np.array([*rectangle(1, 9000)]) @ [[PITCH, 0, 0], [0, -PITCH, 0]], atol=1e-12
    )
    assert np.allclose(layout.du, [[4 * PITCH, 0, 0]], rtol=1e-12, atol=0)


def world(layout):
    """World positions of all corners by the layout's rasters."""
    row, _ = segments(layout.corner_start)
    i, j = layout.polygon[:, :1], layout.polygon[:, 1:]
    return layout.origin[row] + i * layout.du[row] + j * layout.dv[row]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_any_affine_place_keeps_corners_in_the_world_and_pixels_whole(seed):
    rng = np.random.default_rng(seed)
    facets = flat_display(random_polygons(3, 40, 90, seed))
    row, _ = segments(facets.corner_start)
    turn = rng.uniform(0, 2 * np.pi, 3)
    linear = np.stack((np.cos(turn), -np.sin(turn), np.sin(turn), np.cos(turn)), axis=1).reshape(3, 2, 2)
    linear *= rng.choice([-1, 1], (3, 1, 2)) * rng.uniform(0.5, 1.5, (3, 1, 1))
    pixels = facets.corners[:, :2] / PITCH * [1, -1]
    quilt = np.einsum("cij,cj->ci", linear[row], pixels)
    for k in range(3):
        quilt[row == k] += [200 + 300 * k, 200] - quilt[row == k].mean(axis=0)
    layout = layout_from_uv(with_quilt(facets, quilt, (1000, 400)), (1000, 400))
    assert whole_pixel(layout).all()
    assert np.allclose(quilt, quilt_polygons(layout), rtol=0, atol=1e-9)
    assert np.allclose(facets.corners, world(layout), rtol=0, atol=1e-12)
    seen = cross(layout.dv, layout.du)
    assert ((dot(seen, facets.normal) < 0) == facets.mirrored).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), method=st.sampled_from(["rows", "rects"]))
def test_layout_to_texture_coordinates_and_back(seed, method):
    facets = flat_display(random_polygons(6, 5, 30, seed))
    layout = pack(facets, method, (128, 128), max_pages=1)
    back = layout_from_uv(with_quilt(facets, quilt_polygons(layout), (128, 128)), (128, 128), padding=2)
    assert back.quilt_from_facet.tolist() == layout.quilt_from_facet.tolist()
    assert back.size.tolist() == layout.size.tolist()
    for key in ("origin", "du", "dv"):
        assert np.allclose(getattr(layout, key), getattr(back, key), rtol=0, atol=1e-12)
    assert np.allclose(layout.polygon, back.polygon, rtol=0, atol=1e-9)
    assert pixel_owners(back, 2).tolist() == pixel_owners(layout, 2).tolist()


def test_six_digits_are_enough_on_a_large_canvas():
    facets = with_quilt(
        flat_display([rectangle(1280, 720)]), shifted(rectangle(1280, 720), 1280, 360), (8192, 4320)
    )
    layout = layout_from_uv(replace(facets, uv=np.round(facets.uv, 6)), (8192, 4320))
    assert layout.size.tolist() == [[1280, 720]]
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 1280], [0, 1, 360]]]


def test_neighbours_in_a_net_share_every_pixel_between_them():
    # Two triangles of a slanted square: the quilt's corners are shared, the rasters are not.
    facets = flat_display([[[0, 0], [10, 0], [10, 10]], [[0, 0], [10, 10], [0, 10]]])
    place = np.array([[9, 1.5], [16.5, 9], [9, 16.5], [9, 1.5], [9, 16.5], [1.5, 9]])
    both = layout_from_uv(with_quilt(facets, place), PAGE)
    square = layout_from_uv(with_quilt(flat_display([rectangle(10, 10)]), place[[0, 1, 2, 5]]), PAGE)
    assert (pixel_owners(both) > 0).tolist() == (pixel_owners(square) > 0).tolist()


def test_disabled_facets_need_no_texture_coordinates():
    facets = flat_display([rectangle(4, 3)] * 2, enabled=[True, False])
    uv = with_quilt(facets, rectangle(4, 3) * 2).uv
    uv[4:] = np.nan
    assert layout_from_uv(replace(facets, uv=uv), PAGE).facet.tolist() == [1]


def test_mesh_without_texture_coordinates():
    message = "flat.yaml: the mesh has no texture coordinates, which from_uv reads the layout from"
    assert said(flat_display([rectangle(4, 3)])) == [message]


def test_bent_squeezed_and_missing_coordinates_are_told_together():
    facets = flat_display([rectangle(4, 3)] * 3, names=["a", "", "c"])
    bent = [[0, 0], [8, 0], [9, 6], [0, 6]]
    line = [[0, 10], [4, 10], [8, 10], [4, 10]]
    gone = [[0, np.nan], [4, 0], [4, 3], [0, 3]]
    assert said(with_quilt(facets, [*bent, *line, *gone])) == [
        "flat.yaml: facet 1 (a): corner 1 is 0.25 pixels from where an affine map would have it;"
        " texture coordinates must not bend a facet (at most 0.01 pixel)",
        "flat.yaml: facet 2: its place in the quilt has no area",
        "flat.yaml: facet 3 (c): a corner has no texture coordinate, or one that is not finite",
    ]


def test_overlap_and_places_off_the_canvas():
    facets = flat_display([rectangle(4, 3)] * 2)
    both = np.array(rectangle(4, 3) * 2, dtype=float)
    assert said(with_quilt(facets, both)) == [
        "flat.yaml: facets 1 and 2 overlap in 12 pixels, the first at (0, 0) of page 1"
    ]
    both[4:] += [30, 4]
    assert said(with_quilt(facets, both)) == [
        "flat.yaml: facet 2: corner 2 at (34, 4) lies outside page 1 of 32×20 pixels"
    ]
