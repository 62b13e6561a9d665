"""Projectors: the points that their pixels light, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.charts.chart import Chart
from quiltcli.display import Facets
from quiltcli.errors import DisplayError, JobError
from quiltcli.formats.exr.image import write_exr
from quiltcli.geometry.resection import Pinhole
from tests.helpers.curved_jobs import write_map
from tests.helpers.projected import LEFT, RIGHT, SPHERE, WALL, projected

LENS = "lens: {at: [0, 0, 3], look_at: [0, 0, 0], throw: 1.5"


def chart_of(facets: Facets, row: int = 0) -> Chart:
    chart = facets.charts[row]
    assert chart is not None
    return chart


def centres(chart: Chart) -> np.ndarray:
    wide, high = chart.size
    return chart.points(np.arange(wide) + 0.5, np.arange(high)[:, None] + 0.5)


def matrix_text(matrix: np.ndarray) -> str:
    return str([[float(number) for number in row] for row in matrix])


def slanted() -> Pinhole:
    """A projector that looks from the right, turned and shifted."""
    a, b = np.radians(25), np.radians(8)
    ahead = np.array([-np.sin(a) * np.cos(b), -np.sin(b), -np.cos(a) * np.cos(b)])
    right = np.cross(ahead, [0, 1, 0])
    right /= np.linalg.norm(right)
    rotation = np.stack((right, np.cross(ahead, right), ahead))
    return Pinhole(140.0, np.array([52.0, 20.0]), rotation, np.array([1.4, 0.5, 2.8]))


def test_a_lens_throws_a_picture_as_wide_as_its_ratio_says(tmp_path):
    chart = chart_of(projected(tmp_path, WALL, f"- {{pixels: [30, 20], {LENS}}}}}\n"))
    x, y = (np.arange(30) + 0.5 - 15) * 2 / 30, -(np.arange(20) + 0.5 - 10) * 2 / 30
    points = centres(chart)
    assert points[0] == pytest.approx(np.broadcast_to(x, (20, 30)), abs=1e-12)
    assert points[1] == pytest.approx(np.broadcast_to(y[:, None], (20, 30)), abs=1e-12)
    assert np.abs(points[2]).max() < 1e-12


def test_a_lens_shifts_its_picture_right_and_up(tmp_path):
    plain = centres(chart_of(projected(tmp_path, WALL, f"- {{pixels: [30, 20], {LENS}}}}}\n")))
    text = f"- {{pixels: [30, 20], {LENS}, shift: [0.1, 0.25]}}}}\n"
    moved = centres(chart_of(projected(tmp_path, WALL, text)))
    # The picture is 2 m wide and 4/3 m high.
    assert moved - plain == pytest.approx(
        np.broadcast_to(np.array([0.2, 1 / 3, 0])[:, None, None], plain.shape)
    )


def test_points_on_a_sphere_are_where_rays_meet_it(tmp_path):
    given = slanted()
    facets = projected(tmp_path, SPHERE, f"- {{pixels: [96, 64], matrix: {matrix_text(given.matrix)}}}\n")
    chart = chart_of(facets)
    points = centres(chart)
    x, y = np.meshgrid(np.arange(96) + 0.5, np.arange(64) + 0.5)
    rays = np.linalg.solve(given.matrix[:, :3], np.stack((x, y, np.ones(x.shape))).reshape(3, -1))
    c = given.position
    aa, ab, bb = (rays * rays).sum(axis=0), c @ rays, c @ c - 1
    under = ab * ab - aa * bb
    hit = (under > 1e-3 * ab * ab).reshape(64, 96)  # the rim, where a net is no sphere, apart
    expected = c[:, None] + rays * ((-ab - np.sqrt(np.maximum(under, 0))) / aa)
    known = np.ones((64, 96), bool) if chart.mask is None else chart.mask
    assert hit.sum() > 500
    assert known[hit].all()
    assert not known[(under < 0).reshape(64, 96)].any()
    assert np.abs(points - expected.reshape(3, 64, 96))[:, hit].max() < 1e-9
    normals = chart.normals(x, y)
    assert np.abs(normals - points)[:, hit].max() < 1e-9  # outwards, where the projector is


def test_a_matrix_counts_whatever_its_scale_and_sign_and_in_the_file_s_units(tmp_path):
    matrix = slanted().matrix
    texts = [f"- {{pixels: [96, 64], matrix: {matrix_text(m)}}}\n" for m in (matrix, -3 * matrix)]
    one, other = (centres(chart_of(projected(tmp_path, WALL, text))) for text in texts)
    assert other == pytest.approx(one, abs=1e-9)
    small = matrix.copy()
    small[:, :3] /= 100  # of points in centimetres
    text = f"- {{pixels: [96, 64], matrix: {matrix_text(small)}}}\n"
    assert centres(chart_of(projected(tmp_path, WALL, text, "units: cm\n"))) == pytest.approx(one, abs=1e-9)


def test_points_and_the_pixels_that_light_them_tell_where_a_projector_stands(tmp_path):
    given = slanted()
    rng = np.random.default_rng(4)
    points = rng.uniform((-0.6, -0.6, -0.5), (0.6, 0.6, 0.5), (9, 3))
    pixels = given.project(points)
    inside = ((pixels >= 0) & (pixels <= (96, 64))).all(axis=1)
    assert inside.sum() >= 6
    rows = "".join(
        f"  - {{world: {list(map(float, p))}, pixel: {list(map(float, q))}}}\n"
        for p, q in zip(points[inside], pixels[inside], strict=True)
    )
    found = projected(tmp_path, WALL, f"- name: a\n  pixels: [96, 64]\n  points:\n{rows}")
    known = projected(tmp_path, WALL, f"- {{pixels: [96, 64], matrix: {matrix_text(given.matrix)}}}\n")
    assert centres(chart_of(found)) == pytest.approx(centres(chart_of(known)), abs=1e-6)


def test_a_ray_ends_at_what_it_meets_first(tmp_path):
    screen = WALL + "- {name: sign, pixels: [8, 8], size: [0.5, 0.5], at: [0, 0, 1]}\n"
    points = centres(chart_of(projected(tmp_path, screen, f"- {{pixels: [30, 20], {LENS}}}}}\n")))
    x, y = np.meshgrid(np.arange(30) + 0.5 - 15, np.arange(20) + 0.5 - 10)
    before = (np.abs(x) * 2 / 30 * 2 / 3 < 0.25) & (np.abs(y) * 2 / 30 * 2 / 3 < 0.25)
    assert 0 < before.sum() < before.size
    assert points[2] == pytest.approx(np.where(before, 1.0, 0.0), abs=1e-12)


def test_a_map_of_points_is_a_projector_without_a_screen(tmp_path):
    wall = projected(tmp_path, WALL, f"- {{pixels: [30, 20], {LENS}}}}}\n")
    points = centres(chart_of(wall))
    points[:, :, 25:] = np.nan
    write_map(tmp_path / "map.exr", points, np.float32)
    (tmp_path / "display.yaml").write_text("quilt_display: 1\nprojectors:\n- {map: map.exr}\n")
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file

    chart = chart_of(load_display(load_display_file(tmp_path / "display.yaml")))
    assert chart.mask is not None
    assert chart.mask.sum(axis=1).tolist() == [25] * 20
    assert centres(chart)[:, chart.mask] == pytest.approx(points[:, chart.mask], abs=1e-6)
    assert chart.normals(np.array([4.5]), np.array([4.5]))[:, 0] == pytest.approx([0, 0, 1], abs=1e-5)


def test_rear_projection_is_seen_from_the_other_side(tmp_path):
    eyes = np.array([0.1, 0.2, 2.0]), np.array([0.1, 0.2, -2.0])
    for side, expected in (("front", [True, False]), ("back", [False, True])):
        chart = chart_of(projected(tmp_path, WALL, f"- {{pixels: [30, 20], lit: {side}, {LENS}}}}}\n"))
        x, y = np.array([3.5, 20.5]), np.array([4.5, 11.5])
        seen = [chart.lit(x, y, chart.points(x, y), eye).all() for eye in eyes]
        assert seen == expected


def test_a_mask_takes_pixels_away(tmp_path):
    bright = np.ones((20, 30), np.float32)
    bright[:5] = 0
    write_exr(tmp_path / "mask.exr", {"Y": bright}, {})
    chart = chart_of(projected(tmp_path, WALL, f"- {{pixels: [30, 20], mask: mask.exr, {LENS}}}}}\n"))
    assert chart.mask is not None
    assert (chart.mask == (bright > 0)).all()


@pytest.mark.parametrize(
    ("projectors", "more", "words"),
    [
        ("- {pixels: [9, 9]}\n", "", "expected lens, matrix, points or map, got none"),
        (f"- {{{LENS}}}}}\n", "", "projectors[0].pixels: missing key"),
        (f"- {{pixels: [9, 9], {LENS}}}}}\n", "units: parsec\n", "units"),
        (
            f"- {{pixels: [9, 9], {LENS}}}}}\n",
            "resolution: {pitch_mm: 3}\n",
            "cannot stand beside projectors",
        ),
        (
            "- {pixels: [9, 9], lens: {at: [0, 0, 3], look_at: [0, 0, 3], throw: 1}}\n",
            "",
            "looks at where it",
        ),
        ("- {pixels: [9, 9], lens: {at: [0, 3, 0], look_at: [0, 0, 0], throw: 1}}\n", "", "looks along up"),
        ("- {pixels: [9, 9], lens: {at: [0, 0, 3], look_at: [0, 0, 9], throw: 1}}\n", "", "meets the screen"),
        (
            "- {pixels: [9, 9], matrix: [[1, 0, 0, 1], [2, 0, 0, 1], [0, 0, 1, 1]]}\n",
            "",
            "first three columns are not independent",
        ),
        (
            "- {pixels: [9, 9], points: [{world: [0, 0, 0], pixel: [1, 1]}]}\n",
            "",
            "expected at least 6 points, got 1",
        ),
        ("- {pixels: [9, 9], map: nothing.exr}\n", "", "no such file"),
        (f"- {{pixels: [9, 9], {LENS}}}}}\n", "blend: {black: 2}\n", "blend.black"),
        (f"- {{pixels: [9, 9], weights: small.exr, {LENS}}}}}\n", "", "needs blend beside projectors"),
        (
            f"- {{pixels: [9, 9], weights: small.exr, {LENS}}}}}\n",
            "blend: {}\n",
            "is 4 × 3 pixels (expected 9 × 9)",
        ),
        (
            f"- {{pixels: [4, 3], weights: small.exr, {LENS}}}}}\n",
            "blend: {}\n",
            "expected shares from 0 to 1",
        ),
        (f"- {{pixels: [9, 9], mask: small.exr, {LENS}}}}}\n", "", "is 4 × 3 pixels (expected 9 × 9)"),
    ],
)
def test_what_cannot_be_is_said_with_its_line_and_key(tmp_path, projectors, more, words):
    write_exr(tmp_path / "small.exr", {"Y": np.full((3, 4), 1.5, np.float32)}, {})
    with pytest.raises((JobError, DisplayError)) as caught:
        projected(tmp_path, WALL, projectors, more)
    assert words in str(caught.value)
    assert "display.yaml:" in str(caught.value)


@pytest.mark.parametrize("kind", ["plane", "mistaken"])
def test_points_that_tell_no_projector_are_refused(tmp_path, kind):
    given = slanted()
    points = np.random.default_rng(2).uniform(-0.4, 0.4, (8, 3))
    if kind == "plane":
        points[:, 2] = 0.1
    pixels = given.project(points).clip((0, 0), (96, 64))
    if kind == "mistaken":
        pixels[3] = (1, 63)
    rows = "".join(
        f"  - {{world: {list(map(float, p))}, pixel: {list(map(float, q))}}}\n"
        for p, q in zip(points, pixels, strict=True)
    )
    words = "all lie in one plane" if kind == "plane" else r"fit no projector: point \d is off by"
    with pytest.raises(DisplayError, match=words):
        projected(tmp_path, WALL, f"- name: a\n  pixels: [96, 64]\n  points:\n{rows}")


def test_a_screen_is_no_display_of_projectors(tmp_path):
    projected(tmp_path, WALL, LEFT)
    (tmp_path / "other.yaml").write_text(
        (tmp_path / "display.yaml").read_text().replace("screen.yaml", "display.yaml")
    )
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file

    with pytest.raises(DisplayError, match="screen: is a display of projectors"):
        load_display(load_display_file(tmp_path / "other.yaml"))


def shares_at(facets: Facets, points: np.ndarray) -> np.ndarray:
    """Shares (n, P) of each projector at points (3, P) of the wall, 0 where it does not light them."""
    assert facets.response is not None
    assert facets.response.blend is not None
    found = []
    for row, share in enumerate(facets.response.blend.shares):
        own = centres(chart_of(facets, row)).reshape(3, -1)
        away = np.linalg.norm(own[:, None] - points[:, :, None], axis=0)
        near = away.argmin(axis=1)
        step = np.abs(np.diff(centres(chart_of(facets, row)), axis=2)).max()
        found.append(np.where(away.min(axis=1) < step, share.reshape(-1)[near], 0.0))
    return np.array(found)


def test_shares_add_up_to_all_of_the_light_and_fade_to_the_borders(tmp_path):
    facets = projected(tmp_path, WALL, LEFT + RIGHT, "blend: {}\n")
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 25), np.linspace(-0.5, 0.5, 9))
    points = np.stack((x, y, np.zeros(x.shape))).reshape(3, -1)
    shares = shares_at(facets, points)
    lit = (shares > 0).sum(axis=0)
    assert (lit == 2).sum() > 50
    assert (lit == 1).sum() > 20
    assert shares[:, lit == 1].max(axis=0) == pytest.approx(1)
    assert shares[:, lit == 2].sum(axis=0) == pytest.approx(1, abs=0.03)  # pixels are 1 cm, points anywhere
    response = facets.response
    assert response is not None
    assert response.blend is not None
    left = response.blend.shares[0]
    assert left[64, -1] < 0.05  # at its right border, amid the picture of the other
    assert left[64, 0] == 1


def test_black_is_lifted_where_fewer_pictures_overlap(tmp_path):
    facets = projected(tmp_path, WALL, LEFT + RIGHT, "blend: {black: 0.01}\n")
    response = facets.response
    assert response is not None
    assert response.blend is not None
    shares, lift = response.blend.shares[0], response.blend.lift[0]
    alone = shares == 1
    assert lift[alone] == pytest.approx(0.01)
    assert (lift[~alone] == 0).all()
    assert response.shown(0, np.zeros((3, 2)), np.ones(2)) == pytest.approx(0.01)


def test_weights_of_a_file_take_the_place_of_those_of_the_geometry(tmp_path):
    weights = np.full((128, 192), 0.5, np.float32)
    write_exr(tmp_path / "weights.exr", {"Y": weights}, {})
    left = LEFT.replace("lens:", "weights: weights.exr, lens:")
    facets = projected(tmp_path, WALL, left + RIGHT, "blend: {weights_gamma: 2}\n")
    assert facets.response is not None
    assert facets.response.blend is not None
    assert facets.response.blend.shares[0] == pytest.approx(0.25)
    assert facets.response.blend.shares[1].max() == 1
