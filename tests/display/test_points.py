"""Lists of points as displays: a pixel each, whose ray goes through the point; and lists that are wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import lit_facets, load_display
from quiltcli.errors import DisplayError, JobError
from quiltcli.job import load_display_file
from quiltcli.layout import align
from quiltcli.layout.packing import pack
from quiltcli.projection.planar import quilt_rays

SQUARE = [[-1, 0, 0], [1, 0, 0], [1, 2, 0], [-1, 2, 0]]


def display_of(tmp_path: Path, points: object, more: str = "", keys: str = ""):
    (tmp_path / "leds.json").write_text(points if isinstance(points, str) else json.dumps(points))
    file = tmp_path / "display.yaml"
    file.write_text(f"quilt_display: 1\npoints: {{file: leds.json{keys}}}\n{more}")
    return load_display(load_display_file(file))


def middles(facets) -> np.ndarray:
    return facets.origin + (facets.du + facets.dv) / 2


def cloud(count: int, seed: int = 2) -> list[list[float]]:
    return np.random.default_rng(seed).normal(size=(count, 3)).tolist()


@pytest.mark.parametrize("wrapped", [False, True])
def test_both_forms_of_a_list_are_the_same_points(tmp_path: Path, wrapped: bool) -> None:
    points = cloud(50)
    facets = display_of(tmp_path, [{"point": p} for p in points] if wrapped else points)
    np.testing.assert_allclose(middles(facets), points, atol=1e-12)
    assert (facets.size == 1).all()
    np.testing.assert_allclose(np.linalg.norm(facets.du, axis=1), 0.005, rtol=1e-9)


def test_every_pixels_ray_goes_through_its_point(tmp_path: Path) -> None:
    points = np.array(cloud(200))
    facets = display_of(tmp_path, points.tolist(), keys=", columns: 16")
    layout = align(pack(facets), facets)
    assert layout.pages.tolist() == [[16, 13]]
    eye = np.array([0.3, -0.2, 4.0])
    lit = lit_facets(facets, eye)
    assert lit.all()
    rays = quilt_rays(layout, lit, eye)
    for k, point in enumerate(points):
        x, y = k % 16 + 0.5, k // 16 + 0.5
        ray = rays.eye_from_quilt[k] @ (x, y, 1)
        assert np.linalg.norm(np.cross(ray / np.linalg.norm(ray), point - eye)) < 1e-12
        assert ray @ (point - eye) > 0


def test_lights_are_seen_from_all_sides(tmp_path: Path) -> None:
    facets = display_of(tmp_path, cloud(100))
    for eye in np.random.default_rng(5).normal(size=(20, 3)) * 5:
        assert lit_facets(facets, eye).all()


@pytest.mark.parametrize(
    ("points", "normal"),
    [
        (SQUARE, (0, 0, 1)),  # in one plane: out of it, not within it
        ([[x, y, 3] for x in range(5) for y in range(3)], (0, 0, 1)),
        ([[0, y, 0] for y in range(9)], (0, 0, 1)),  # a strip: across it
        ([[0, 0, z] for z in range(9)], (1, 0, 0)),
        ([[1, 2, 3]], (0, 0, 1)),
        ([[1, 2, 3], [1, 2, 3]], (0, 0, 1)),
    ],
)
def test_flat_figures_face_out_of_their_plane(tmp_path: Path, points: list, normal: tuple) -> None:
    facets = display_of(tmp_path, points)
    np.testing.assert_allclose(np.abs(facets.normal), np.abs([normal] * len(points)), atol=1e-9)
    np.testing.assert_allclose(middles(facets), points, atol=1e-12)


def test_lights_on_a_ball_face_away_from_its_middle(tmp_path: Path) -> None:
    points = np.array(cloud(400))
    points = np.concatenate((points, -points))
    points /= np.linalg.norm(points, axis=1)[:, None]
    facets = display_of(tmp_path, (points + 7).tolist())
    np.testing.assert_allclose(facets.normal, points, atol=1e-9)


def test_a_light_that_is_not_there_keeps_its_number(tmp_path: Path) -> None:
    facets = display_of(tmp_path, [None, [0, 0, 0], None, [1, 0, 0], None], keys=", columns: 3")
    assert facets.names == ("point_2", "point_4")
    assert facets.places.corner.tolist() == [[1, 0], [0, 1]]
    assert facets.places.page_size == (3, 2)


def test_units_the_vertical_and_a_transform_move_points_and_scale_squares(tmp_path: Path) -> None:
    more = "units: cm\nup_axis: z\ntransform: {translate: [0, 1, 0], scale: 2}\n"
    facets = display_of(tmp_path, [[100, 0, 0], [0, 100, 0], [0, 0, 100]], more, ", size: 10 mm")
    np.testing.assert_allclose(middles(facets), [[2, 1, 0], [0, 1, -2], [0, 3, 0]], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(facets.du, axis=1), 0.02, rtol=1e-9)


@pytest.mark.parametrize(
    ("points", "complaint"),
    [
        ("[[0, 0, 0]", "leds.json:1:11: is no JSON: Expecting ',' delimiter"),
        ('{"points": []}', "expected a list such as [[0, 1, 0], [0, 2, 0]], got a mapping"),
        ("[]", "has no points (expected one or more)"),
        ("[null]", "has no points (expected one or more)"),
        ("[[0, 0]]", "point 1 of 1: expected three numbers, x, y and z, got a list"),
        ('[[0, 0, 0], [0, "1", 0]]', "point 2 of 2: expected three numbers, x, y and z, got a list"),
        ("[[0, 0, true]]", "point 1 of 1: expected three numbers"),
        ("[[0, 0, NaN]]", "point 1 of 1: expected numbers up to 1e+09"),
        ("[[0, 0, 1e300]]", "point 1 of 1: expected numbers up to 1e+09"),
        ('[{"line": [[0, 0, 0], [1, 0, 0]]}]', 'point 1 of 1: expected a key "point" of three numbers'),
        ('["a"]', "point 1 of 1: expected three numbers, x, y and z, got the text 'a'"),
        ("[" * 100_000, "is nested too deeply"),
    ],
)
def test_lists_that_are_wrong_are_told(tmp_path: Path, points: str, complaint: str) -> None:
    with pytest.raises(DisplayError) as caught:
        display_of(tmp_path, points)
    assert complaint in str(caught.value)
    assert "leds.json" in str(caught.value)


def test_all_wrong_points_are_told_up_to_a_number(tmp_path: Path) -> None:
    with pytest.raises(DisplayError) as caught:
        display_of(tmp_path, [[0, 0, 0], *[[0]] * 30])
    lines = str(caught.value).splitlines()
    assert len(lines) == 21
    assert "point 2 of 31" in lines[0]
    assert "and 10 problems more" in lines[-1]


def test_what_is_no_text_is_no_list(tmp_path: Path) -> None:
    file = tmp_path / "display.yaml"
    file.write_text("quilt_display: 1\npoints: {file: leds.json}\n")
    (tmp_path / "leds.json").write_bytes(b"[[0, 0, 0]]\xff")
    with pytest.raises(DisplayError, match=r"is no text in UTF-8 \(byte 11\)"):
        load_display(load_display_file(file))


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        ("resolution: {pitch_mm: 3}\n", "resolution: cannot stand beside points"),
        ("panels: [{pixels: [1, 1], pitch: 1 mm, at: [0, 0, 0]}]\n", "panels: cannot stand beside points"),
        ("viewing_side: back\n", "viewing_side: expected no such key beside points"),
        ("transform: {scale: [-1, 1, 1]}\n", "transform: mirrors the display"),
        ("facets: {1: {name: a}}\n", "facets: cannot stand beside points"),
        (
            "corrections: {brightness: {exponent: 1}}\n",
            "corrections.brightness: belongs to panels",
        ),
    ],
)
def test_points_are_the_whole_display(tmp_path: Path, more: str, complaint: str) -> None:
    with pytest.raises(JobError) as caught:
        display_of(tmp_path, SQUARE, more)
    assert complaint in str(caught.value)


def test_info_says_what_the_display_is(tmp_path: Path) -> None:
    from quiltcli.analysis.info.displays import display_info

    display_of(tmp_path, SQUARE)
    lines = dict(display_info(tmp_path / "display.yaml").lines)
    assert lines["points"].endswith("leds.json")
    assert lines["lit side"] == "all sides"
    assert lines["pixels"] == "4"
