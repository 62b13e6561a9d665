"""Pictures made for the viewpoint, on the facets: held against functions of direction."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import JobError, OutputError
from quiltcli.exchange.elsewhere import MadeOptions
from quiltcli.exchange.project.lenses import (
    FACES,
    Cube,
    Equirect,
    Fisheye,
    Pinhole,
    axes_of,
    faces_of,
    in_face,
    turned,
)
from quiltcli.exchange.project.master import Master
from quiltcli.exchange.project.project import project
from quiltcli.exchange.project.texels import cubic_weights, texels
from quiltcli.exchange.project.tiles import TILE, Window, tile_light
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.job import load_job
from quiltcli.layout import read_layout
from quiltcli.viewer.view import views_at
from tests.helpers.tiny_job import replaced

AXES = axes_of(0.3, 0.2)
LENSES = {
    "pinhole": Pinhole(AXES, (-1.2, 0.9, -0.8, 1.1), (640, 480)),
    "equirect": Equirect(AXES, (640, 320)),
    "fisheye": Fisheye(AXES, 3.9, (500, 500)),
    "cubemap": Cube(AXES, 200),
}


DIM = np.float32([0.5, 0.5, 0.5, 1])


def smooth(d):
    """Light (..., 4) that changes slowly with direction (3, ...), unlike in all octants."""
    x, y, z = d / np.linalg.norm(d, axis=0)
    colours = (
        0.5 + 0.3 * x + 0.1 * y * z,
        0.5 + 0.3 * y - 0.1 * x * x,
        0.5 + 0.3 * z + 0.1 * x * y,
        1 + 0 * x,
    )
    return np.stack(colours, axis=-1)


def directions_of(lens):
    """Directions (3, H, W) of the texels of a lens, written down from what the lens is; of a cube six."""
    width, height = (lens.side, lens.side) if isinstance(lens, Cube) else lens.size
    x, y = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    if isinstance(lens, Pinhole):
        left, right, bottom, top = lens.window
        local = [
            (
                left + (right - left) * x / width + 0 * y,
                top - (top - bottom) * y / height + 0 * x,
                0 * x * y + 1,
            )
        ]
    elif isinstance(lens, Equirect):
        lon, lat = (x / width - 0.5) * 2 * np.pi, (0.5 - y / height) * np.pi
        local = [(np.cos(lat) * np.sin(lon), np.sin(lat) + 0 * x, np.cos(lat) * np.cos(lon))]
    elif isinstance(lens, Fisheye):
        u, v = x - width / 2 + 0 * y, height / 2 - y + 0 * x
        off = np.hypot(u, v)
        angle = off * lens.aperture / min(width, height)
        local = [(np.sin(angle) * u / off, np.sin(angle) * v / off, np.cos(angle))]
    else:
        a, b = x / width * 2 - 1 + 0 * y, 1 - y / height * 2 + 0 * x
        one = np.ones_like(a)
        # Who turns right, left, up, down, not at all, and right round.
        local = [(one, b, -a), (-one, b, a), (a, one, -b), (a, -one, b), (a, b, one), (-a, b, -one)]
    return [np.einsum("ij,i...->j...", lens.axes, np.stack(one)) for one in local]


def pictures_of(lens, light):
    return [light(d).astype(np.float32) for d in directions_of(lens)]


def wall(axes, size):
    """Rays (3, 3) of a page that is a window of 90° before somebody."""
    right, up, ahead = axes
    return np.stack((right * 2 / size, -up * 2 / size, ahead - right + up), axis=1)


WALLS = [axes_of(yaw, pitch) for yaw, pitch in ((0, 0), (1.9, 0.4), (3.1, 0.1), (0.3, 1.57), (1, -1.4))]


@pytest.mark.parametrize("kind", LENSES)
@pytest.mark.parametrize("size", [40, 300])
def test_a_smooth_function_of_direction_comes_back(kind, size):
    lens = LENSES[kind]
    picture = texels(pictures_of(lens, smooth), lens)
    shown = 0
    for axes in WALLS:
        rays = wall(axes, size)
        light = tile_light(Window(0, 0, size, size), rays, lens, picture)
        x, y = np.arange(size) + 0.5, (np.arange(size) + 0.5)[:, None]
        d = np.stack([row[0] * x + row[1] * y + row[2] for row in rays])
        inside = light[..., 3] > 0.999
        if kind in ("equirect", "cubemap"):
            assert inside.all()
        # A large pixel sees the mean of a place, not its middle: of second order, and small here.
        limit = 1e-3 if size == 300 else 4e-3
        assert np.abs(light - smooth(d))[inside].max(initial=0) < limit
        shown += np.count_nonzero(inside)
    assert shown > 0.2 * size * size


@pytest.mark.parametrize("kind", LENSES)
def test_derivatives_are_those_of_the_place(kind):
    """Against central differences."""
    lens, rng = LENSES[kind], np.random.default_rng(3)
    d = np.einsum("ij,i...->j...", AXES, rng.uniform(-1, 1, (3, 400)) + np.array([[0], [0], [1.2]]))
    step = np.array([0.3, -0.5, 0.2])
    if kind == "cubemap":  # well within a face
        a = np.abs(turned(lens.axes, d))
        d = d[:, np.sort(a, axis=0)[2] > 1.01 * np.sort(a, axis=0)[1]]
    found, eps = lens.steps(d, step), 1e-6
    before, after = lens.place(d - eps * step[:, None]), lens.place(d + eps * step[:, None])
    for one, low, high in zip(found, (before.x, before.y), (after.x, after.y), strict=True):
        fits = np.abs((high - low) / (2 * eps) - one) < 1e-4 * (1 + np.abs(one))
        assert fits[np.abs(high - low) < 1].all()


def test_faces_are_upright_for_who_turns_to_them():
    looks = {
        "front": (0, 0),
        "right": (-90, 0),
        "back": (180, 0),
        "left": (90, 0),
        "up": (0, 90),
        "down": (0, -90),
    }
    for face, (yaw, pitch) in looks.items():
        right, up, ahead = axes_of(np.radians(yaw), np.radians(pitch))
        d = ahead + 0.25 * right + 0.5 * up
        local = turned(axes_of(0, 0), d)
        number = faces_of(*local)
        assert FACES[int(number)] == face
        across, down, deep = in_face(number, *local)
        np.testing.assert_allclose((across / deep, down / deep), (0.25, -0.5), atol=1e-12)


def test_a_dome_master_has_its_front_below():
    """Who looks straight up, with the front before the feet, sees it at the lower edge; right is right."""
    lens = Fisheye(axes_of(0, np.pi / 2), np.pi, (100, 100))
    place = lens.place(np.array([[0, 0, 1.0], [1, 0, 0], [0, -1.0, 0]]))  # up, ahead, right
    np.testing.assert_allclose(place.x, [50, 50, 100], atol=1e-9)
    np.testing.assert_allclose(place.y, [50, 100, 50], atol=1e-9)


@pytest.mark.parametrize("b", [0, 0.2, 0.5])
def test_cubics_sum_to_one_keep_lines_and_blur_as_said(b):
    t = np.linspace(0, 1, 11)
    weights = np.stack(cubic_weights(t, b))
    places = np.arange(-1, 3)[:, None] - t
    np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-12)
    np.testing.assert_allclose((weights * places).sum(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose((weights * places**2).sum(axis=0).mean(), b / 3, atol=1e-2)


def test_a_zone_plate_does_not_alias_at_twice_the_size():
    """Rings finer than pixels are grey, as 64 samples a pixel have them."""
    side, size = 1024, 512
    lens = Pinhole(axes_of(0, 0), (-1, 1, -1, 1), (side, side))
    x = (np.arange(side) + 0.5) / side * 2 - 1
    # At the corners of the square a period is of two texels.
    plate = 0.5 + 0.5 * np.cos(np.pi * side / 8 * (x * x + x[:, None] ** 2))
    picture = np.stack([plate] * 4, axis=-1).astype(np.float32)
    picture[..., 3] = 1
    light = tiles_of(size, wall(axes_of(0, 0), size), lens, texels([picture], lens))
    fine = (np.arange(8 * size) + 0.5) / (8 * size) * 2 - 1
    truth = np.zeros((size, size))
    for row in range(0, 8 * size, 512):
        part = 0.5 + 0.5 * np.cos(np.pi * side / 8 * (fine * fine + fine[row : row + 512, None] ** 2))
        truth[row // 8 : row // 8 + 64] = part.reshape(64, 8, size, 8).mean(axis=(1, 3))
    error = light[..., 0] - truth
    plain = picture[::2, ::2, 0] - truth
    assert np.sqrt((error**2).mean()) < 0.03
    assert np.sqrt((plain**2).mean()) > 0.2  # what a single texel a pixel does


def tiles_of(size, rays, lens, picture):
    light = np.zeros((size, size, 4), np.float32)
    for tile in Window(0, 0, size, size).tiles(*TILE):
        light[tile.y0 : tile.y1, tile.x0 : tile.x1] = tile_light(tile, rays, lens, picture)
    return light


FILES = {
    "box.obj": "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n"
    "g front\nf 5 6 7 8\ng left\nf 1 5 8 4\ng right\nf 6 2 3 7\ng floor\nf 1 2 6 5\n",
    "display.yaml": "quilt_display: 1\nmesh: box.obj\nresolution: {pixels_per_metre: 40}\n",
    "dot.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "job.yaml": "quilt_job: 1\ndisplay: display.yaml\nscene: dot.obj\nframes: 1-2\n"
    "layout: {size: [256, 256]}\n"
    "viewer:\n  near: 0.01\n  far: 50\n  path:\n    keyframes:\n"
    "    - {frame: 1, position: [0.1, 0.2, -0.1], look_at: [0, 0, -1]}\n",
}


@pytest.fixture
def job(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path / "job.yaml"


def put(path, light):
    write_exr(path, {c: np.ascontiguousarray(light[..., k], np.float32) for k, c in enumerate("RGBA")}, {})


def function_error(folder, eye=(0.1, 0.2, -0.1), light=smooth, name=""):
    """The largest error of all facets' pixels, and the share that shows the picture."""
    layout = read_layout(folder / "layout.yaml")
    worst, shown = 0.0, []
    for row, facet in enumerate(layout.facet.tolist()):
        image = read_exr(facet_path(folder, facet, 1, name)).channels
        width, height = layout.size[row]
        x, y = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
        frame = zip(layout.origin[row], layout.du[row], layout.dv[row], np.asarray(eye), strict=True)
        d = np.stack([o + du * x + dv * y - e for o, du, dv, e in frame])
        seen = image["A"] > 0.999
        got = np.stack([image[c] for c in "RGBA"], axis=-1).astype(np.float64)
        worst = max(worst, np.abs(got - light(d))[seen].max(initial=0))
        shown.append(seen.mean())
    return worst, float(np.mean(shown))


@pytest.mark.parametrize("kind", ["equirect", "cubemap", "fisheye", "pinhole"])
def test_every_kind_of_picture_on_a_display(job, tmp_path, kind):
    yaw = 0 if kind == "pinhole" else 25
    axes = axes_of(np.radians(yaw), 0)
    lens = {
        "equirect": Equirect(axes, (800, 400)),
        "cubemap": Cube(axes, 256),
        "fisheye": Fisheye(axes_of(np.radians(yaw), np.radians(60)), np.radians(200), (600, 600)),
        "pinhole": Pinhole(axes, (-2, 2, -1, 1), (800, 400)),
    }[kind]
    options = {
        "fisheye": {"yaw": 25, "aperture": 200, "tilt": 30},
        "pinhole": {"camera": tmp_path / "camera.json"},
    }.get(kind, {"yaw": yaw})
    record = dict(zip(("right", "up", "forward"), axes.tolist(), strict=True))
    record["window"] = {"left": -2, "right": 2, "bottom": -1, "top": 1}
    (tmp_path / "camera.json").write_text(json.dumps(record))
    name = "m.exr"
    if kind == "cubemap":
        name = "m_{face}.exr"
        for face, light in zip(FACES, pictures_of(lens, smooth), strict=True):
            put(tmp_path / f"m_{face}.exr", light)
    else:
        put(tmp_path / name, pictures_of(lens, smooth)[0])
    master = Master(tmp_path / name, kind, **options)
    made = project(load_job(job), master, MadeOptions(tmp_path / "out", (1,)))
    worst, shown = function_error(tmp_path / "out")
    assert worst < 1e-3
    expected = {"equirect": 1, "cubemap": 1, "fisheye": 0.45, "pinhole": 0.3}[kind]
    assert shown == pytest.approx(expected, abs=0.13)
    assert bool(made[0].warnings) == (kind in ("fisheye", "pinhole"))
    image = read_exr(quilt_path(tmp_path / "out", 1, 1))
    assert image.attributes["quilt:made"] == f"project {kind}"


@pytest.mark.parametrize("form", ["cross", "tall", "strip", "column"])
def test_cubes_are_unfolded(job, tmp_path, form):
    faces = dict(zip(FACES, pictures_of(Cube(axes_of(0, 0), 64), smooth), strict=True))
    none = np.zeros_like(faces["up"])
    rows = {
        "cross": [". up . .", "left front right back", ". down . ."],
        "tall": [". up .", "left front right", ". down .", ". turned ."],
        "strip": [" ".join(FACES)],
        "column": list(FACES),
    }[form]
    faces["turned"] = faces["back"][::-1, ::-1]
    rows = [np.concatenate([faces.get(name, none) for name in row.split()], axis=1) for row in rows]
    put(tmp_path / "m.exr", np.concatenate(rows))
    project(load_job(job), Master(tmp_path / "m.exr", "cubemap"), MadeOptions(tmp_path / "out", [1]))
    assert function_error(tmp_path / "out")[0] < 2e-3


@pytest.mark.parametrize("stereo", ["side-by-side", "top-bottom"])
def test_halves_are_for_eyes(job, tmp_path, stereo):
    replaced(tmp_path, "job.yaml", "  near: 0.01", "  near: 0.01\n  stereo: {separation: 0.2}")
    picture = pictures_of(Equirect(axes_of(0, 0), (400, 200)), smooth)[0]
    put(
        tmp_path / "m.exr",
        np.concatenate((picture, picture * DIM), axis=1 if stereo == "side-by-side" else 0),
    )
    master = Master(tmp_path / "m.exr", "equirect", stereo=stereo)
    project(load_job(job), master, MadeOptions(tmp_path / "out", [1]))
    for view, light in zip(views_at(load_job(job), 1), (smooth, lambda d: smooth(d) * DIM), strict=True):
        assert function_error(tmp_path / "out", view.viewer.eye, light, view.eye)[0] < 1e-3


def test_st_maps_lead_to_the_picture(job, tmp_path):
    lens = Pinhole(axes_of(0, 0), (-1, 1, -0.5, 0.5), (400, 200))
    put(tmp_path / "m.exr", pictures_of(lens, smooth)[0])
    words = [
        "project",
        job,
        "--picture",
        tmp_path / "m.exr",
        "--as",
        "pinhole",
        "--fov-deg",
        "90",
        "--st-map",
    ]
    done = CliRunner().invoke(main, [*map(str, words), "-o", str(tmp_path / "out"), "-f", "1"])
    assert done.exit_code == 0, done.output
    st = read_exr(tmp_path / "out/st_map/page_01.0001.exr").channels
    page = read_exr(quilt_path(tmp_path / "out", 1, 1)).channels
    seen = st["A"] == 1
    assert 0.02 < seen.mean() < 0.9
    x, y = st["R"] * 2 - 1, st["G"] - 0.5
    light = smooth(np.stack((x, y, -np.ones_like(x))))
    assert np.abs(light[..., 0] - page["R"])[seen & (page["A"] == 1)].max() < 1.5e-3


def test_sequences_and_workers(job, tmp_path):
    for frame in (1, 2):
        put(tmp_path / f"m.{frame:04}.exr", np.full((20, 40, 4), frame / 4, np.float32))
    master = Master(tmp_path / "m.####.exr", "equirect")
    for threads in (1, 3):
        project(load_job(job), master, MadeOptions(tmp_path / f"out{threads}", threads=threads))
    for frame in (1, 2):
        images = [quilt_path(tmp_path / f"out{threads}", 1, frame) for threads in (1, 3)]
        assert images[0].read_bytes() == images[1].read_bytes()
        assert read_exr(facet_path(tmp_path / "out1", 1, frame)).channels["G"].max() == frame / 4


def test_what_makes_no_sense_is_told(job, tmp_path):
    loaded, options = load_job(job), MadeOptions(tmp_path / "out", [1])
    put(tmp_path / "m.exr", np.zeros((20, 50, 4), np.float32))
    for words, master in (
        (r"a pinhole needs its angle or its camera", Master(tmp_path / "m.exr", "pinhole")),
        (r"--fov-deg must be between 0 and 180, got 200", Master(tmp_path / "m.exr", "pinhole", fov=200)),
        (r"--fov-deg and --camera are a pinhole's", Master(tmp_path / "m.exr", "equirect", fov=60)),
        (r"--aperture-deg must be above 0", Master(tmp_path / "m.exr", "fisheye", aperture=0)),
        (r"\{face\} in a name is for --as cubemap", Master(tmp_path / "m_{face}.exr", "fisheye")),
        (r"--stereo is for two eyes", Master(tmp_path / "m.exr", "equirect", stereo="top-bottom")),
        (r"no\.json: no such file", Master(tmp_path / "m.exr", "pinhole", camera=tmp_path / "no.json")),
    ):
        with pytest.raises(JobError, match=words):
            project(loaded, master, options)
    for words, master in (
        (r"m\.0001\.exr: no such picture", Master(tmp_path / "m.####.exr", "equirect")),
        (r"is 50×20 pixels, which is no cross", Master(tmp_path / "m.exr", "cubemap")),
    ):
        with pytest.raises(OutputError, match=words):
            project(loaded, master, options)
    (tmp_path / "bad.json").write_text('{"right": [1, 0, 0]}')
    with pytest.raises(JobError, match=r"bad\.json: is no camera"):
        project(loaded, Master(tmp_path / "m.exr", "pinhole", camera=tmp_path / "bad.json"), options)


def test_no_number_and_too_bright_a_one_stay_where_they_are():
    lens = Pinhole(axes_of(0, 0), (-1, 1, -1, 1), (8, 8))
    picture = np.ones((8, 8, 4), np.float32)
    picture[2, 2, :3], picture[5, 5, :3] = np.nan, np.inf
    light = tile_light(Window(0, 0, 16, 16), wall(axes_of(0, 0), 16), lens, texels([picture], lens))
    assert np.isfinite(light.astype(np.float16)).all()
    assert light.min() >= 0
    assert light[10, 10, 0] > 1000
    assert (light[:, 15, 0] == 1).all()


@pytest.mark.parametrize(
    ("kind", "stereo", "size", "said"),
    [
        ("equirect", "", (40, 20), ""),
        ("equirect", "", (40, 16), "has 40×16 pixels, and one of all directions is twice as wide as high"),
        ("equirect", "", (20, 20), "(is it two eyes', --stereo top-bottom?)"),
        ("equirect", "side-by-side", (20, 20), ""),
        ("equirect", "top-bottom", (40, 10), ""),
        ("equirect", "top-bottom", (40, 20), ""),
        ("equirect", "top-bottom", (40, 13), "twice as wide as high"),
        ("fisheye", "", (40, 16), ""),
        ("pinhole", "", (20, 20), ""),
    ],
)
def test_pictures_of_an_odd_shape_are_doubted(kind, stereo, size, said, tmp_path):
    doubt = Master(tmp_path / "m.exr", kind, stereo=stereo).doubt(size)
    assert said in doubt
    assert bool(doubt) == bool(said)


def test_a_panorama_of_an_odd_shape_is_told_of(job, tmp_path):
    put(tmp_path / "m.exr", np.zeros((20, 50, 4), np.float32))
    (record,) = project(
        load_job(job), Master(tmp_path / "m.exr", "equirect"), MadeOptions(tmp_path / "o", [1])
    )
    assert "the picture has 50×20 pixels" in " ".join(record.warnings)
