from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.sweetspot import Content, Question, content_at, sweet_spot
from quiltcli.analysis.sweetspot.audience import audience_floor, best_eye, served
from quiltcli.analysis.sweetspot.content import default_content, nearness
from quiltcli.analysis.sweetspot.distortion import angles_deg, distortion, show, solid_angles
from quiltcli.analysis.sweetspot.floor import Floor, area_under, contour, default_step, floor_of
from quiltcli.analysis.sweetspot.picture import dashes, sweet_spot_picture
from quiltcli.analysis.sweetspot.plan import CONTENT, Lines, draw_plan
from quiltcli.analysis.sweetspot.report import as_data, lines, reach_rows
from quiltcli.analysis.sweetspot.samples import sample_facets
from quiltcli.analysis.sweetspot.scale import COLOURS, heat, ticks
from quiltcli.cli import main
from quiltcli.errors import JobError, OutputError
from tests.helpers.in_memory import cube, display, panel
from tests.helpers.tiny_job import write_tiny_job

CORNER = display(
    [(-2, 0, -2), (0, 0, 0), (0, 3, 0), (-2, 3, -2), (2, 0, -2), (2, 3, -2)], [[0, 1, 2, 3], [1, 4, 5, 2]], 50
)  # two walls that meet at the corner of a building, mirror images in x = 0
EYE = np.array([0.0, 1.6, 4.0])
FAR = Content("distance", math.inf)
DEEP = Content("depth", 1.5)
CENTRE = Content("plane", point=(0, 1.5, -1))


def ask(**how):
    return Question(
        **{"eye": EYE, "content": CENTRE, "samples": 60, "area": (-2, 2, 2, 6), "step": 0.5, **how}
    )


# The closed form: one facet, content on a plane parallel to it.


@pytest.mark.parametrize("behind", [0.1, 1.0, 30.0, -0.5])
def test_straight_ahead_content_lies_beside_its_place_by_the_closed_form(behind):
    h, s = 2.0, 0.3  # the viewer stands s to the right of the eye and looks at the point before him
    samples = replace(sample_facets(panel(), 4), point=np.array([[s, 0, 0]]), normal=np.array([[0.0, 0, 1]]))
    eye, place = np.array([0, 0, h]), np.array([s, 0, h])
    near = nearness(Content("depth", behind), samples, eye)
    expected = math.degrees(math.atan(abs(behind) * s / (h * (h + behind))))
    assert abs(angles_deg(samples.point[0], near[0], eye, place) - expected) < 1e-12


def test_content_infinitely_far_away_is_a_parallax_of_the_facet():
    samples = sample_facets(panel(), 4)
    place = np.array([0.4, 0.1, 2.5])
    angles = angles_deg(samples.point.T, nearness(FAR, samples, EYE), EYE[:, None], place[:, None])
    for point, angle in zip(samples.point, angles, strict=True):
        u, v = point - place, point - EYE
        cosine = u @ v / np.linalg.norm(u) / np.linalg.norm(v)
        assert abs(math.degrees(math.acos(cosine)) - angle) < 1e-6


# Brute force: know the 3D point, find the pixel that shows it, look at both from somewhere else.


def brute_force_deg(content_point, facet_point, place):
    a = [x - v for x, v in zip(facet_point, place, strict=True)]
    b = [x - v for x, v in zip(content_point, place, strict=True)]
    cosine = sum(x * y for x, y in zip(a, b, strict=True)) / math.hypot(*a) / math.hypot(*b)
    chord = math.dist([x / math.hypot(*a) for x in a], [x / math.hypot(*b) for x in b])
    return math.degrees(2 * math.asin(chord / 2) if cosine > 0 else math.acos(cosine))


@pytest.mark.parametrize("seed", range(4))
def test_known_points_seen_from_displaced_eyes_agree_to_a_millionth_of_a_degree(seed):
    rng = np.random.default_rng(seed)
    eye = rng.uniform((-1, 1, 3), (1, 2, 5))
    target = rng.uniform((-0.5, 1, -3), (0.5, 2, -1))
    for content in (Content("plane", point=tuple(target)), Content("distance", 7.0), DEEP):
        for _ in range(30):
            # A 3D point on the content's surface, then where the ray to it meets the first wall.
            normal = np.array([-1.0, 0, 1]) / math.sqrt(2)  # of the wall through the origin
            ray = np.array([rng.uniform(-1.8, -0.1), rng.uniform(0, 3), 0.0])
            ray[2] = ray[0]
            ray = ray - eye
            if content.kind == "plane":
                axis = target - eye
                known = eye + ray * (axis @ axis / (ray @ axis))
            elif content.kind == "distance":
                known = eye + ray / math.sqrt(sum(ray**2)) * 7
            else:
                known = eye + ray * ((-1.5 - eye @ normal) / (ray @ normal))
            pixel = eye + (known - eye) * (-(eye @ normal) / ((known - eye) @ normal))
            samples = replace(sample_facets(panel(), 1), point=pixel[None], normal=normal[None])
            place = eye + rng.uniform(-0.8, 0.8, 3)
            found = angles_deg(pixel, nearness(content, samples, eye)[0], eye, place)
            assert abs(found - brute_force_deg(known, pixel, place)) < 1e-6


def slow_figures(facets, content, eye, places, count):
    """The figures by plain loops over samples."""
    samples = sample_facets(facets, count)
    near = nearness(content, samples, eye)
    rows = []
    for place in places:
        seen, dark = [], 0.0
        for point, normal, area, w in zip(samples.point, samples.normal, samples.area, near, strict=True):
            away = place - point
            weight = area * (away @ normal) / math.hypot(*away) ** 3
            if away @ normal <= 0:
                continue
            if (eye - point) @ normal <= 0 or not w > 0:
                dark += weight
                continue
            seen.append((brute_force_deg(eye + (point - eye) / w, point, place), weight))
        total = sum(weight for _, weight in seen)
        share, p95 = 0.0, math.nan
        for angle, weight in sorted(seen):
            share += weight / total
            if share >= 0.95 and math.isnan(p95):
                p95 = angle
        mean = sum(angle * weight for angle, weight in seen) / total if seen else math.nan
        worst = max((angle for angle, _ in seen), default=math.nan)
        rows.append((mean, p95, worst, dark / (total + dark) if total + dark else math.nan))
    return np.array(rows).T


@pytest.mark.parametrize("content", [CENTRE, DEEP, Content("distance", 3.5)])
def test_maps_agree_with_plain_loops(content):
    places = floor_of((-3.1, -3, 2.9, 5), 2.0, 1.4).places
    found = distortion(show(sample_facets(CORNER, 30), content, EYE), places)
    expected = slow_figures(CORNER, content, EYE, places, 30)
    assert np.isnan(expected[0]).any()
    assert np.allclose((found.mean, found.p95, found.worst, found.dark), expected, 0, 1e-6, equal_nan=True)


def test_sides_of_a_cube_that_only_others_see_are_dark():
    eye, place = np.array([0, 0, 4.0]), np.array([[3.0, 0, 4.0], [3.0, 0, 0], [0, 0, 0]])
    found = distortion(show(sample_facets(cube(), 30), FAR, eye), place)
    assert 0 < found.dark[0] < 1
    assert found.dark[1] == 1
    assert math.isnan(found.mean[1])
    assert math.isnan(found.dark[2])  # inside: no facet is lit inwards


# What must be nothing, and what must be alike.


@pytest.mark.parametrize("content", [CENTRE, DEEP, FAR, Content("distance", 1.0)])
def test_at_the_eye_there_is_no_distortion(content):
    found = distortion(show(sample_facets(CORNER, 60), content, EYE), EYE[None])
    assert [found.mean[0], found.p95[0], found.worst[0], found.dark[0]] == [0, 0, 0, 0]


def test_content_on_the_facets_is_right_for_everyone():
    spot = sweet_spot(CORNER, ask(content=Content("depth", 0.0)))
    assert spot.figures.worst.tolist() == [0.0] * 81
    assert spot.reach["worst"].area == 16
    assert spot.reach["worst"].open == ("left", "right", "forward", "back")


def test_a_symmetric_display_has_a_symmetric_map():
    spot = sweet_spot(CORNER, ask())
    for measure in ("mean", "p95", "worst"):
        values = spot.map(measure)
        assert np.abs(values - values[:, ::-1]).max() < 1e-9
        metres = spot.reach[measure].metres
        assert abs(metres["left"] - metres["right"]) < 1e-6
    assert (np.diff(spot.map("mean")[4, 4:]) > 0).all()


def test_mean_is_at_most_the_worst_and_both_hold_the_95_percent():
    figures = sweet_spot(CORNER, ask()).figures
    assert (figures.mean <= figures.worst).all()
    assert (figures.p95 <= figures.worst).all()


# Samples.


@pytest.mark.parametrize("count", [1, 10, 500])
def test_samples_stand_for_the_whole_area(count):
    samples = sample_facets(cube(), count)
    assert np.allclose(np.bincount(samples.facet, samples.area), 4)
    assert np.allclose(samples.area @ samples.point, 0)


def test_samples_hold_the_corners_and_no_point_twice():
    samples = sample_facets(panel(), 200)
    assert 100 < len(samples.point) < 400
    assert len(np.unique(samples.point, axis=0)) == len(samples.point)
    assert np.abs(samples.point).max(axis=0).tolist() == [1, 1, 0]


def test_many_facets_are_sampled_once_each():
    grid = [(x, y, 0) for y in range(9) for x in range(9)]
    cells = [[9 * y + x, 9 * y + x + 1, 9 * y + x + 10, 9 * y + x + 9] for y in range(8) for x in range(8)]
    samples = sample_facets(display(grid, cells, 10), 32)
    assert samples.facet.tolist() == list(range(64))
    assert np.allclose(samples.area, 1)
    assert samples.point[0].tolist() == [0.5, 0.5, 0]


def test_disabled_facets_have_no_samples():
    half = display([(-1, 0, 0), (0, 0, 0), (0, 1, 0), (-1, 1, 0), (1, 0, 0), (1, 1, 0)],
                   [[0, 1, 2, 3], [1, 4, 5, 2]], 50, facets={1: {"enabled": False}})  # fmt: skip
    assert np.unique(sample_facets(half, 10).facet).tolist() == [1]


def test_solid_angles_of_a_cube_from_outside_add_up():
    # A face of side 2 seen from its axis at distance 2: 4·atan(a·b / (d·sqrt(a² + b² + d²))), a = b = 1.
    found = solid_angles(sample_facets(panel(), 4000), np.array([[0, 0, 2.0], [0, 0, -2.0]])).sum(axis=1)
    assert abs(found[0] - 4 * math.atan(1 / (2 * math.sqrt(6)))) < 1e-3
    assert found[1] == 0


# Where the content is.


def test_content_is_in_the_middle_of_a_solid_display():
    assert default_content(sample_facets(cube(), 10), np.array([0, 0, 5.0])) == Content(
        "plane", point=(0, 0, 0)
    )


@pytest.mark.parametrize(("facets", "eye"), [(cube(viewing_side="back"), (0, 0, 0.5)), (panel(), (1, 1, 2))])
def test_content_is_far_away_for_an_eye_inside_or_a_flat_display(facets, eye):
    assert default_content(sample_facets(facets, 10), np.array(eye)) == FAR


def test_content_behind_the_eye_is_not_shown():
    near = nearness(Content("plane", point=(0, 1.6, 5)), sample_facets(CORNER, 10), EYE)
    assert np.isnan(near).all()
    assert np.isnan(nearness(Content("depth", -9.0), sample_facets(CORNER, 10), EYE)).all()


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (CENTRE, "on the plane through 0, 1.5, -1 that faces the eye"),
        (FAR, "infinitely far away"),
        (Content("depth", math.inf), "infinitely far away"),
        (Content("distance", 3.0), "3 m from the eye"),
        (DEEP, "1.5 m behind the facets"),
        (Content("depth", -0.5), "0.5 m before the facets"),
        (Content("depth"), "on the facets"),
    ],
)
def test_content_says_where_it_is(content, text):
    assert str(content) == text


# Room under the limit.


def plane_floor():
    floor = floor_of((-2, -1, 2, 3), 0.5, 0)
    return floor, floor.places[:, 0].reshape(9, 9)


@pytest.mark.parametrize(("limit", "area"), [(-3, 0), (-1.25, 3), (0, 8), (0.6, 10.4), (2, 16), (9, 16)])
def test_the_area_under_a_linear_map_is_exact(limit, area):
    assert abs(area_under(*plane_floor(), limit) - area) < 1e-12


def test_the_contour_of_a_linear_map_is_a_line():
    floor, values = plane_floor()
    found = contour(floor, values, 0.6)
    assert np.allclose(found[:, :, 0], 0.6)
    assert abs(np.linalg.norm(found[:, 1] - found[:, 0], axis=1).sum() - 4) < 1e-12


def test_unseen_places_are_no_room():
    floor, values = plane_floor()
    values[:, 0] = np.nan
    assert abs(area_under(floor, values, 9) - 14) < 1e-12


def test_one_may_go_to_where_the_limit_is_met():
    spot = sweet_spot(CORNER, ask())
    left = spot.reach["worst"].metres["left"]
    edges = np.array([[-left * (1 - 1e-6), 1.6, 4], [-left * (1 + 1e-6), 1.6, 4]])
    inside, outside = distortion(spot.shown, edges).worst
    assert inside < 2 < outside


def test_from_another_height_nothing_may_be_left():
    spot = sweet_spot(CORNER, ask(height=2.6, limit_deg=0.5))
    assert spot.reach["mean"].metres == {"left": 0, "right": 0, "forward": 0, "back": 0}


@pytest.mark.parametrize(("size", "step"), [(15, 1.0), (10, 0.5), (3, 0.2), (0.6, 0.02)])
def test_steps_are_round(size, step):
    assert abs(default_step(size) - step) < 1e-12


def test_the_map_has_the_eye_in_its_middle():
    floor = sweet_spot(CORNER, ask(area=None, step=None)).floor
    assert abs(floor.x[len(floor.x) // 2]) < 1e-12
    assert abs(floor.z[len(floor.z) // 2] - 4) < 1e-12


# The audience.


@pytest.mark.parametrize("minimise", ["mean", "worst"])
def test_the_best_eye_of_a_symmetric_audience_is_on_the_axis(minimise):
    samples = sample_facets(CORNER, 40)
    found = best_eye(samples, CENTRE, audience_floor((-1, 3, 1, 5), 1.6), minimise)
    assert found.eye[0] == 0
    assert 3 < found.eye[2] < 5


@pytest.mark.parametrize("minimise", ["mean", "worst"])
def test_no_eye_of_a_fine_grid_is_better_than_the_best(minimise):
    samples, people = sample_facets(CORNER, 20), audience_floor((-0.5, 3, 2, 5), 1.6)
    best = best_eye(samples, DEEP, people, minimise)
    x, z = np.meshgrid(np.linspace(-0.5, 2, 16), np.linspace(3, 5, 16))
    eyes = np.stack((x, np.full_like(x, 1.6), z), axis=-1).reshape(-1, 3)
    others = [served(samples, DEEP, eye, people).cost(minimise) for eye in eyes]
    assert best.cost(minimise) <= min(others)


def test_an_eye_that_lights_half_the_facets_is_not_the_best():
    people = audience_floor((-1.5, 1.5, 1.5, 4), 1.6)
    best = best_eye(sample_facets(cube(), 20), FAR, people, "mean")
    assert best.dark < 0.2


def test_without_an_eye_the_map_is_that_of_the_best():
    spot = sweet_spot(CORNER, ask(eye=None, height=1.6, audience=(-1, 3, 1, 5)))
    assert spot.shown.eye.tolist() == spot.best.eye.tolist() == spot.here.eye.tolist()


# Words, data and pictures.


def test_what_is_said():
    spot = sweet_spot(CORNER, ask(limit_deg=10))
    assert lines(spot)[1:] == [
        ("eye", "0, 1.6, 4"),
        ("content", "on the plane through 0, 1.5, -1 that faces the eye"),
        ("map", "x -2 to 2 m, z 2 to 6 m, 9 × 9 places, eyes 1.6 m high"),
    ]
    assert [row[0] for row in reach_rows(spot)] == ["mean", "95 %", "worst"]
    assert reach_rows(spot)[0][5] == "> 2.83 m"


def test_data_is_whole_and_unseen_places_are_none():
    data = as_data(sweet_spot(CORNER, ask(content=FAR, area=(-2, -4, 2, 4), audience=(-1, 3, 1, 5))))
    json.dumps(data, allow_nan=False)
    assert data["content"] == {"kind": "distance", "metres": None}
    assert data["map"]["mean_deg"][0][4] is None
    assert data["map"]["mean_deg"][-1][4] == 0
    assert set(data["audience"]) == {"area", "minimise", "eye", "best"}


def test_pictures_are_drawn_and_are_the_same_every_time(tmp_path):
    spot = sweet_spot(CORNER, ask(audience=(-1, 3, 1, 5), area=(-2, -3, 2, 6)))
    for name in ("a.png", "b.png", "a.svg", "b.svg"):
        sweet_spot_picture(spot, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    texts = [
        element.text for element in ET.parse(tmp_path / "a.svg").getroot() if element.tag.endswith("text")
    ]
    assert {"the eye", "audience", "content", "nothing is seen from here", "0.5° to 1°"} <= set(texts)
    with Image.open(tmp_path / "a.png") as image:
        assert max(image.size) > 800


def test_heat_has_the_colours_of_the_legend():
    floor = Floor(np.array([0.0, 1]), np.array([0.0, 1]), 0)
    low = heat(floor, np.full((2, 2), 0.1), 2, 3, 2)
    high = heat(floor, np.full((2, 2), 100.0), 2, 3, 2)
    assert ["#{:02x}{:02x}{:02x}".format(*pixels[1, 2]) for pixels in (low, high)] == [
        COLOURS[0],
        COLOURS[-1],
    ]


def test_walls_are_lines_from_above_and_all_stays_on_the_picture():
    plan = draw_plan(sweet_spot(CORNER, ask(content=DEEP, limit_deg=30)))
    lines = [item for item in plan.items if isinstance(item, Lines)]
    content = next(item.paths for item in lines if item.color == CONTENT)
    assert [path.shape for path in content] == [(2, 2), (2, 2)]
    points = np.concatenate([path for item in lines for path in item.paths])
    assert points.min() >= 0
    assert (points <= (plan.width, plan.height)).all()


def test_ticks_and_dashes():
    assert ticks(-0.9, 2.1, 4) == [0.0, 1.0, 2.0]
    assert [piece[:, 0].tolist() for piece in dashes(np.array([[0.0, 0], [10, 0]]), (4, 2))] == [
        [0, 4],
        [6, 10],
    ]


def test_another_ending_or_an_unwritable_folder_leaves_nothing(tmp_path):
    spot = sweet_spot(CORNER, ask())
    with pytest.raises(OutputError, match=r"map\.gif: a picture's name must end in \.png or \.svg$"):
        sweet_spot_picture(spot, tmp_path / "map.gif")
    with pytest.raises(OutputError, match="cannot be written: No such file or directory"):
        sweet_spot_picture(spot, tmp_path / "no" / "map.png")
    assert list(tmp_path.iterdir()) == []


# Questions that make no sense.

NO_EXTENT = "has no extent, expected x0,z0,x1,z1 with x0 < x1 and z0 < z1"


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"limit_deg": 0.0}, "--limit-deg is 0, expected a number above 0"),
        ({"step": -1.0}, "--step is -1, expected a number above 0"),
        ({"step": math.nan}, "--step is nan, expected a number above 0"),
        ({"height": math.nan}, "--height is nan, expected metres"),
        ({"minimise": "p95"}, "--minimise is 'p95', expected one of mean, worst"),
        (
            {"eye": None},
            "there is no eye: give --eye x,y,z or --job JOB.yaml, or an --audience to find it for",
        ),
        (
            {"eye": None, "audience": (0, 0, 1, 1)},
            "how high are the eyes of the --audience? give --height, metres, or --eye x,y,z",
        ),
        (
            {"area": (1, 0, 1, 2)},
            "--area 1,0,1,2 has no extent, expected x0,z0,x1,z1 with x0 < x1 and z0 < z1",
        ),
        ({"audience": (0, 2, 1, 1)}, f"--audience 0,2,1,1 {NO_EXTENT}"),
        (
            {"step": 0.001},
            "a step of 0.001 m makes 16,008,001 places, more than 250,000"
            " (a larger --step or a smaller --area makes fewer)",
        ),
        ({"eye": np.array([0.0, 1, -9])}, "no facet is lit towards the eye at 0,1,-9"),
        (
            {"content": Content("distance", 1.0), "audience": (-1, -9, 1, -8)},
            "nobody in the --audience sees a facet that is lit towards one of them",
        ),
        (
            {"content": Content("depth", -9.0)},
            "content 9 m before the facets is beside or behind the eye at 0,1.6,4: no facet shows it",
        ),
    ],
)
def test_questions_that_make_no_sense(how, message):
    with pytest.raises(JobError) as caught:
        sweet_spot(CORNER, ask(**how))
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((1.0, 2.0, None), "content is said more than once: give one of --depth, --distance and --at"),
        ((math.nan, None, None), "--depth is nan, expected metres behind the facets, negative before them"),
        ((None, 0.0, None), "--distance is 0, expected metres from the eye, above 0"),
    ],
)
def test_content_that_makes_no_sense(options, message):
    with pytest.raises(JobError) as caught:
        content_at(*options)
    assert str(caught.value) == message


def test_no_facet_enabled():
    with pytest.raises(JobError, match="no facet of this display is enabled"):
        sweet_spot(replace(panel(), enabled=np.array([False])), ask())


# The command.


def run(*arguments):
    return CliRunner().invoke(main, ["sweetspot", *map(str, arguments)])


SMALL = ("--samples", 20, "--area=-1,1,1,3", "--step", 0.5)


def test_the_command_answers_in_words_and_draws(tmp_path):
    write_tiny_job(tmp_path)
    picture = tmp_path / "map.png"
    asked = (tmp_path / "display.yaml", "--job", tmp_path / "job.yaml", "--depth", 1, "--audience=-1,2,0,3")
    result = run(*asked, *SMALL, "--picture", picture)
    assert result.exit_code == 0, result.output
    assert "eye      0, 0, 2\ncontent  1 m behind the facets\n" in result.output
    assert "drawn for the best eye" in result.output
    assert picture.stat().st_size > 10_000


def test_the_command_takes_the_eye_of_a_frame_and_answers_in_json(tmp_path):
    write_tiny_job(tmp_path)
    result = run(tmp_path / "display.yaml", "--job", tmp_path / "job.yaml", "-f", 4, *SMALL, "--json")
    data = json.loads(result.stdout)
    assert data["eye"] == [-0.5, 0.2, 3]
    assert np.shape(data["map"]["p95_deg"]) == (5, 5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--eye", "0,0,2", "--job", "job.yaml"),
            "there are two eyes: give --eye or --job, not both",
        ),
        (("--frame", "2"), "--frame needs the --job it is a frame of"),
        (
            ("--eye", "0,0,2", "--picture", "a.gif"),
            "a.gif: a picture's name must end in .png or .svg",
        ),
    ],
)
def test_the_command_refuses_what_makes_no_sense(tmp_path, options, message):
    write_tiny_job(tmp_path)
    result = run(tmp_path / "display.yaml", *options)
    assert (result.exit_code, result.stderr) == (2, f"error: {message}\n")


def test_the_command_says_what_an_area_is(tmp_path):
    write_tiny_job(tmp_path)
    result = run(tmp_path / "display.yaml", "--eye", "0,0,2", "--area", "1,2,3")
    assert result.exit_code == 2
    assert "expected an area x0,z0,x1,z1 in metres, such as -2,1,2,4, got '1,2,3'" in result.stderr
