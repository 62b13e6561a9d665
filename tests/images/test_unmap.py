import itertools
import math

import numpy as np
import pytest

from quiltcli.errors import OutputError
from quiltcli.formats.exr import image as exr
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.geometry import facet_from_world
from quiltcli.images import facets as unmap
from quiltcli.images.facets import facet_image, quilt_buffers
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.images.unmap import unmap as unmap_files
from quiltcli.layout import Layout, pixel_owners

TURNS = [
    np.array(turn)
    for s, t in itertools.product((1, -1), repeat=2)
    for turn in ([[s, 0], [0, t]], [[0, s], [t, 0]])
]
TURN_NAMES = ["".join(f"{n:+d}" for n in turn.ravel()) for turn in TURNS]


def make_layout(maps, sizes, polygons, pages=((40, 30),), page=None):
    count = len(maps)
    return Layout(
        facet=np.arange(1, count + 1, dtype=np.int32),
        page=np.array(page or [0] * count, dtype=np.int32),
        size=np.array(sizes, dtype=np.int32),
        quilt_from_facet=np.array(maps, dtype=float),
        origin=np.arange(3.0 * count).reshape(count, 3),
        du=np.tile([0.01, 0.0, 0.0], (count, 1)),
        dv=np.tile([0.0, -0.02, 0.0], (count, 1)),
        corner_start=np.cumsum([0, *map(len, polygons)]),
        polygon=np.concatenate(polygons).astype(float),
        pages=np.array(pages, dtype=np.int32),
        padding=0,
        method="manual",
        display="test.yaml",
        display_sha256="",
    )


def rectangle(width, height):
    return np.array([[0, 0], [width, 0], [width, height], [0, height]])


def turned(turn, size, corner):
    """The map (2, 3) that turns a raster of this size and lays its bounds' low corner at `corner`."""
    ends = np.stack(([0, 0], turn @ size))
    return np.column_stack((turn, np.asarray(corner) - ends.min(axis=0)))


def single(turn, polygon=None):
    size = np.array([7, 5])
    polygon = rectangle(*size) if polygon is None else polygon
    return make_layout([turned(turn, size, (11, 4))], [size], [polygon])


def noise(layout, seed=5):
    rng = np.random.default_rng(seed)
    count = int(layout.page_offset[-1])
    return {
        "R": rng.standard_normal(count).astype(np.float16),
        "Z": rng.random(count).astype(np.float32),
        "zv": rng.random(count).astype(np.float32),
        "triangle": rng.integers(0, 2**32, count, dtype=np.uint32),
    }


def assert_same(expected, actual):
    assert sorted(expected) == sorted(actual)
    for name in expected:
        assert expected[name].dtype == actual[name].dtype, name
        np.testing.assert_array_equal(expected[name], actual[name], err_msg=name)


def said(caught):
    return str(caught.value)


# --- one facet ---


def test_a_shifted_facet_is_a_crop():
    layout = single(np.eye(2, dtype=int))
    buffers = noise(layout)
    image = facet_image(buffers, layout, 0, pixel_owners(layout))
    np.testing.assert_array_equal(buffers["R"].reshape(30, 40)[4:9, 11:18], image["R"])


def test_a_quarter_turn_has_its_first_row_in_a_column():
    layout = single(np.array([[0, -1], [1, 0]]))  # x = −j, y = i: clockwise as seen on screen
    buffers = noise(layout)
    image = facet_image(buffers, layout, 0, pixel_owners(layout))
    part = buffers["R"].reshape(30, 40)[4:11, 11:16]
    np.testing.assert_array_equal(part[:, -1], image["R"][0])
    np.testing.assert_array_equal(np.rot90(part), image["R"])


@pytest.mark.parametrize("turn", TURNS, ids=TURN_NAMES)
def test_each_pixel_is_the_one_the_map_says(turn):
    layout = single(turn)
    buffers = noise(layout)
    image = facet_image(buffers, layout, 0, pixel_owners(layout))
    for j, i in np.ndindex(5, 7):
        x, y = np.floor(layout.quilt_from_facet[0] @ [i + 0.5, j + 0.5, 1]).astype(int)
        for name, flat in buffers.items():
            assert flat[y * 40 + x] == image[name][j, i]


@pytest.mark.parametrize("turn", TURNS, ids=TURN_NAMES)
def test_there_and_back_changes_no_bit(turn):
    layout = single(turn, polygon=np.array([[0, 0], [7, 2], [3, 5]]))
    owners, buffers = pixel_owners(layout), noise(layout)
    image = facet_image(buffers, layout, 0, owners)
    again = quilt_buffers({0: image}, layout, owners)
    expected = {
        name: np.where(owners == 1, flat, np.array(unmap.BACKGROUND.get(name, 0), flat.dtype))
        for name, flat in buffers.items()
    }
    assert 0 < np.count_nonzero(owners == 1) < 35
    assert_same(expected, again)
    assert_same(image, facet_image(again, layout, 0, owners))


@pytest.mark.parametrize("turn", TURNS, ids=TURN_NAMES)
def test_copying_and_sampling_agree_where_both_can(turn, monkeypatch):
    layout = single(turn, polygon=np.array([[0, 0], [7, 2], [3, 5]]))
    owners, buffers = pixel_owners(layout), noise(layout)
    image = facet_image(buffers, layout, 0, owners)
    quilt = quilt_buffers({0: image}, layout, owners)
    monkeypatch.setattr(unmap, "_window", lambda layout, row: None)
    assert_same(image, facet_image(buffers, layout, 0, owners))
    assert_same(quilt, quilt_buffers({0: image}, layout, owners))


def test_outside_the_polygon_is_transparent():
    layout = single(np.eye(2, dtype=int), polygon=np.array([[0, 0], [7, 0], [0, 5]]))
    image = facet_image(noise(layout), layout, 0, pixel_owners(layout, bleed=3))
    assert image["R"][4, 6] == 0
    assert image["triangle"][4, 6] == 0
    assert image["Z"][4, 6] == math.inf
    assert image["zv"][4, 6] == math.inf
    assert image["Z"][0, 0] < 1


def test_the_background_may_be_given():
    layout = single(np.eye(2, dtype=int), polygon=np.array([[0, 0], [7, 0], [0, 5]]))
    image = facet_image(noise(layout), layout, 0, pixel_owners(layout), {"R": 0.5})
    assert image["R"][4, 6] == 0.5
    assert image["Z"][4, 6] == 0


def test_arguments_are_left_alone_and_results_are_their_own():
    layout = single(TURNS[3])
    buffers, owners = noise(layout), pixel_owners(layout)
    for flat in (*buffers.values(), owners):
        flat.flags.writeable = False
    image = facet_image(buffers, layout, 0, owners)
    assert all(channel.flags.c_contiguous and channel.flags.owndata for channel in image.values())
    assert all(channel.flags.writeable for channel in image.values())


def test_rounding_noise_in_a_map_is_still_a_copy():
    layout = single(TURNS[1])
    angle = math.radians(90)
    noisy = np.array([[math.cos(angle), 1.0], [1.0, math.cos(angle)]])
    matrix = layout.quilt_from_facet.copy()
    matrix[0, :, :2] = noisy
    assert unmap._window(make_layout(matrix, layout.size, [rectangle(7, 5)]), 0) is not None


@pytest.mark.parametrize(
    "matrix",
    [
        [[2, 0, 3], [0, 2, 3]],
        [[1, 0.5, 3], [0, 1, 3]],
        [[0.8, -0.6, 12], [0.6, 0.8, 3]],
        [[-0.5, 0, 20.25], [0, 1.5, 2.5]],
    ],
    ids=["scaled", "sheared", "turned by 37 degrees", "mirrored and squeezed"],
)
def test_other_maps_take_the_nearest_pixel(matrix):
    layout = make_layout([matrix], [(7, 5)], [rectangle(7, 5)])
    buffers, owners = noise(layout), pixel_owners(layout)
    image = facet_image(buffers, layout, 0, owners)
    taken = 0
    for j, i in np.ndindex(5, 7):
        x, y = np.floor(np.array(matrix) @ [i + 0.5, j + 0.5, 1]).astype(int)
        mine = owners[y * 40 + x] == 1
        assert image["Z"][j, i] == (buffers["Z"][y * 40 + x] if mine else math.inf)
        taken += mine
    assert taken > 25


def test_an_enlarged_facet_goes_there_and_back():
    layout = make_layout([[[3, 0, 2], [0, 2, 1]]], [(7, 5)], [rectangle(7, 5)])
    owners, rng = pixel_owners(layout), np.random.default_rng(2)
    image = {"Z": rng.random((5, 7)).astype(np.float32)}
    quilt = quilt_buffers({0: image}, layout, owners)
    assert np.count_nonzero(np.isfinite(quilt["Z"])) == 7 * 3 * 5 * 2
    assert_same(image, facet_image(quilt, layout, 0, owners))


def test_a_facet_without_a_page_is_background():
    layout = make_layout([np.eye(2, 3)], [(7, 5)], [rectangle(7, 5)], page=[-1])
    image = facet_image(noise(layout), layout, 0, np.zeros(1200, np.int16))
    assert image["Z"].shape == (5, 7)
    assert np.isinf(image["Z"]).all()


# --- many facets on many pages ---


def crowd():
    """Facets in all eight turns, on two pages of different size."""
    sizes = [(3 + n, 8 - n) for n in range(8)]
    corners = [(1 + 10 * (n % 4), 2 + 12 * (n // 4 % 2)) for n in range(8)]
    maps = [
        turned(turn, np.array(size), corner) for turn, size, corner in zip(TURNS, sizes, corners, strict=True)
    ]
    polygons = [np.array([[0, 0], [w, 0], [w, h - 1], [w / 2, h]]) for w, h in sizes]
    page = [0, 1, 0, 1, 1, 0, 0, 1]
    return make_layout(maps, sizes, polygons, pages=((44, 30), (50, 27)), page=page)


def test_a_crowd_goes_there_and_back():
    layout = crowd()
    owners, buffers = pixel_owners(layout), noise(layout)
    images = {row: facet_image(buffers, layout, row, owners) for row in range(8)}
    again = quilt_buffers(images, layout, owners)
    for name, flat in buffers.items():
        np.testing.assert_array_equal(flat[owners > 0], again[name][owners > 0])
    assert (again["Z"][owners == 0] == math.inf).all()


def test_the_map_from_the_world_finds_pixels():
    layout = crowd()
    maps = facet_from_world(layout.origin, layout.du, layout.dv)
    for row in range(8):
        world = layout.origin[row] + 2.5 * layout.du[row] + 4.25 * layout.dv[row]
        normal = np.cross(layout.dv[row], layout.du[row])
        i, j, w = maps[row] @ [*(world + 100 * normal), 1]
        assert (i, j, w) == pytest.approx((2.5, 4.25, 1))


def test_the_map_from_the_world_copes_with_slanted_rasters():
    layout = single(np.eye(2, dtype=int))
    layout.dv[0] = [0.004, -0.02, 0.001]
    i, j, w = facet_from_world(layout.origin, layout.du, layout.dv)[0] @ [
        *(layout.origin[0] + 3 * layout.du[0] + 2 * layout.dv[0]),
        1,
    ]
    assert (i, j, w) == pytest.approx((3, 2, 1))


# --- files ---


def write_quilt(out, layout, frame=3, named=True, **how):
    buffers, paths = noise(layout), []
    (out / "quilt").mkdir(parents=True, exist_ok=True)
    for page in range(len(layout.pages)):
        channels = {name: unmap.page_of(flat, layout, page) for name, flat in buffers.items()}
        attributes = {"quilt:page": page + 1, "quilt:frame": frame, "quilt:job": "ab", "owner": "us"}
        path = quilt_path(out, page + 1, frame) if named else out / f"comp{page}.exr"
        write_exr(path, channels, attributes, "piz")
        paths.append(path)
    return paths, buffers


def test_quilt_files_become_facet_files(tmp_path):
    layout = crowd()
    paths, buffers = write_quilt(tmp_path, layout)
    written = unmap_files(paths, layout, tmp_path / "new")
    assert sorted(written) == [facet_path(tmp_path / "new", n, 3) for n in range(1, 9)]
    assert sorted(written) == sorted((tmp_path / "new" / "facets").iterdir())
    owners = pixel_owners(layout)
    for row in range(8):
        image = read_exr(facet_path(tmp_path / "new", row + 1, 3))
        assert_same(facet_image(buffers, layout, row, owners), image.channels)
        assert image.compression == "piz"
        assert image.attributes["quilt:facet"] == row + 1
        assert image.attributes["quilt:job"] == "ab"
        assert image.attributes["owner"] == "us"
        assert "quilt:page" not in image.attributes
        numbers = np.array(image.attributes["quilt:facet_from_world"].split(), dtype=float)
        np.testing.assert_array_equal(
            facet_from_world(layout.origin, layout.du, layout.dv)[row].ravel(), numbers
        )


def test_attributes_speak_where_names_do_not(tmp_path):
    layout = crowd()
    paths, _ = write_quilt(tmp_path, layout, frame=-12, named=False)
    written = unmap_files(paths, layout, tmp_path / "new")
    assert sorted(written)[0] == facet_path(tmp_path / "new", 1, -12)


def test_a_cropped_data_window_is_filled_up(tmp_path):
    layout = single(np.eye(2, dtype=int))
    path = tmp_path / "comp.0009.exr"
    channels = {"Z": np.ones((3, 4), np.float32), "R": np.ones((3, 4), np.float16)}
    window = {"data_window": ((12, 5), (15, 7)), "display_window": ((0, 0), (39, 29))}
    write_exr(path, channels, {}, **window)
    (written,) = unmap_files([path], layout, tmp_path)
    expected = np.zeros((5, 7), np.float16)
    expected[1:4, 1:5] = 1
    image = read_exr(written)
    np.testing.assert_array_equal(expected, image.channels["R"])
    np.testing.assert_array_equal(np.where(expected == 1, 1, np.inf), image.channels["Z"])


def test_overscan_is_cut_off(tmp_path):
    layout = single(np.eye(2, dtype=int))
    path = tmp_path / "comp.0009.exr"
    pixels = np.arange(50 * 44, dtype=np.float32).reshape(44, 50)
    write_exr(path, {"Z": pixels}, {}, data_window=((-5, -7), (44, 36)), display_window=((0, 0), (39, 29)))
    (written,) = unmap_files([path], layout, tmp_path)
    np.testing.assert_array_equal(pixels[7 + 4 : 7 + 9, 5 + 11 : 5 + 18], read_exr(written).channels["Z"])


def test_a_quilt_of_another_size(tmp_path):
    path = tmp_path / "page_01.0001.exr"
    write_exr(path, {"Z": np.zeros((40, 30), np.float32)}, {})
    with pytest.raises(OutputError) as caught:
        unmap_files([path], single(TURNS[0]), tmp_path / "new")
    assert f"{path}: is 30×40 pixels, page 1 of the layout is 40×30" == said(caught)
    assert not (tmp_path / "new").exists()


def test_every_problem_is_told_before_anything_is_written(tmp_path):
    layout = crowd()
    paths, _ = write_quilt(tmp_path, layout)
    blank = {"Z": np.zeros((30, 44), np.float32)}
    others = [tmp_path / name for name in ("page_03.0001.exr", "comp.0001.exr", "comp.exr", "no.exr")]
    write_exr(others[0], blank, {})
    write_exr(others[1], blank, {})
    write_exr(others[2], blank, {"quilt:page": 1})
    twin = tmp_path / "page_01.0003.exr"
    write_exr(twin, blank, {})
    with pytest.raises(OutputError) as caught:
        unmap_files([*paths, *others, twin], layout, tmp_path / "new")
    wanted = "expected a name like page_01.0001.exr or the attribute quilt:"
    assert said(caught).splitlines() == [
        f"{others[0]}: is page 3, the layout has pages 1–2",
        f"{others[1]}: does not say which page it is, {wanted}page",
        f"{others[2]}: does not say which frame it is, {wanted}frame",
        f"{others[3]}: no such file (expected an EXR)",
        f"{twin}: is page 1 of frame 3, and so is {paths[0]}",
    ]
    assert not (tmp_path / "new").exists()


def test_files_that_exist_stay(tmp_path):
    layout = crowd()
    paths, _ = write_quilt(tmp_path, layout)
    mine = facet_path(tmp_path, 3, 3)
    mine.parent.mkdir()
    mine.write_text("mine")
    with pytest.raises(OutputError) as caught:
        unmap_files(paths, layout, tmp_path)
    assert f"{mine}: exists already, expected to be told to overwrite it" == said(caught)
    assert [mine] == list(mine.parent.iterdir())
    assert mine.read_text() == "mine"
    unmap_files(paths, layout, tmp_path, overwrite=True)
    assert exr.exr_fault(mine) == ""


@pytest.mark.parametrize("compression", ["dwaa", "dwab", "b44", "b44a", "pxr24", "lj2k"])
def test_what_was_lossily_stored_once_does_not_lose_again(tmp_path, compression):
    layout = single(TURNS[0])
    rng = np.random.default_rng(7)
    values = {name: rng.random((30, 40)).astype(np.float16) for name in "RGBA"}
    values["Z"] = rng.random((30, 40)).astype(np.float32)
    write_exr(tmp_path / "page_01.0001.exr", values, {"quilt:frame": 1}, compression)
    (path,) = unmap_files([tmp_path / "page_01.0001.exr"], layout, tmp_path / "new")
    decoded = read_exr(tmp_path / "page_01.0001.exr").channels
    cut = {name: plane[4:9, 11:18] for name, plane in decoded.items()}
    assert_same(cut, read_exr(path).channels)
    assert read_exr(path).compression == "zip"


def test_a_damaged_quilt_leaves_no_empty_folder(tmp_path):
    layout = single(TURNS[0])
    path = tmp_path / "page_01.0001.exr"
    write_exr(path, {"R": np.random.default_rng(1).random((30, 40)).astype(np.float16)}, {})
    data = bytearray(path.read_bytes())
    data[-200:-100] = b"x" * 100
    path.write_bytes(data)
    with pytest.raises(OutputError, match="is damaged"):
        unmap_files([path], layout, tmp_path / "new")
    assert not (tmp_path / "new").exists()
