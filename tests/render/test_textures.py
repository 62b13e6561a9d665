"""Whole frames with textures, held against rays in plain float64 that know nothing of planes or levels."""

import numpy as np
import pytest

import quiltcli
from quiltcli.render.antialiasing import sample_places
from tests.helpers import textured_floor as floor

REPEATS = (40, 120)
COLUMNS = slice(60, 108)


@pytest.fixture
def finer(monkeypatch):
    monkeypatch.setattr(floor, "PIXELS", (320, 200))


def truth(texels, rays=512, step=355):
    """Means over pixels of the picture itself, by a lattice of rays; the rows that lie on the floor alone."""
    total = np.zeros(floor.PIXELS[::-1])[:, COLUMNS]
    for i in range(rays):
        u, v = floor.floor_places(((i + 0.5) / rays - 0.5, ((i * step) % rays + 0.5) / rays - 0.5))
        u, v = u[:, COLUMNS], v[:, COLUMNS]
        some = np.isfinite(u)
        total[some] += floor.bilinear(texels, u[some] / 80 * REPEATS[0], v[some] / 240 * REPEATS[1])
    rows = np.isfinite(floor.floor_places((0, -0.5))[0]).all(axis=1)
    return total / rays, rows


def rms(job, expected, rows):
    (red,) = floor.drawn(job, "R")
    return float(np.sqrt(np.mean((red[:, COLUMNS] - expected)[rows] ** 2)))


def test_a_checkered_floor_to_the_horizon_is_filtered_well_at_any_number_of_samples(tmp_path, finer):
    board = floor.checker()
    expected, rows = truth(board[..., 0] / 255)
    errors = [
        rms(
            floor.write_floor_job(tmp_path, board, repeats=REPEATS, render=f"{{samples: {n}}}"),
            expected,
            rows,
        )
        for n in (1, 2, 4, 16)
    ]
    assert errors[0] < 0.012
    assert errors[3] < 0.003
    assert errors == sorted(errors, reverse=True)


def test_a_zone_plate_shows_no_moire(tmp_path):
    """Rings ever finer to the edges, seen at a third of their size: where they are too fine, grey."""
    y, x = np.mgrid[0:480, 0:480] - 239.5
    plate = np.rint(127.5 + 127.5 * np.cos((x * x + y * y) * (np.pi / 480))).astype(np.uint8)
    picture = np.repeat(plate[..., None], 3, axis=2)
    job = floor.write_floor_job(tmp_path, picture, repeats=(1, 1), textures=", wrap: clamp")
    (tmp_path / "floor.obj").write_text(
        "v -1 0 -1\nv 1 0 -1\nv 1 2.4 -1\nv -1 2.4 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    )
    (red,) = floor.drawn(job, "R")
    light = np.where(plate <= 10, plate / 255 / 12.92, ((plate / 255 + 0.055) / 1.055) ** 2.4)
    # The display's pixels by the plate's, both are in the plane of the wall.
    rows = 479 - np.floor((2.5 - (np.arange(100) + 0.5) * 0.025) / 2.4 * 480).astype(int)
    columns = np.floor((np.arange(160) * 0.025 + 0.0125 - 1) / 2 * 480).astype(int)
    on = np.ix_((rows >= 0) & (rows < 480), (columns >= 0) & (columns < 480))
    radius = ((rows[:, None] - 239.5) ** 2 + (columns - 239.5) ** 2) ** 0.5
    seen, far = red[on], (radius > 130)[on]  # less than two thirds of a pixel for a ring
    strays = np.abs(seen[far] - light.mean())
    nearest = np.abs(light[np.ix_(rows % 480, columns % 480)][on][far] - light.mean())
    assert np.sqrt(np.mean(strays**2)) < 0.05 < 0.3 < np.sqrt(np.mean(nearest**2))
    assert strays.max() < 0.16
    assert np.ptp(seen[(radius < 30)[on]]) > 0.8


def test_every_pixel_of_a_magnified_picture_is_that_of_float64(tmp_path):
    """Bilinear between texel centres, at the ray of the pixel's centre, for every method that asks rays."""
    dice = np.random.default_rng(7)
    picture = np.repeat(dice.integers(0, 256, (8, 16, 1)), 3, axis=2).astype(np.uint8)
    table = np.arange(256) / 255
    table = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4)
    u, v = floor.floor_places()
    u, v = u / 80 * 3, v / 240 * 6
    expected = floor.bilinear(table[picture[..., 0]], np.nan_to_num(u), np.nan_to_num(v))
    near = np.isfinite(u) & (np.arange(floor.PIXELS[1]) > 75)[:, None]
    for method in ("homography", "raycast"):
        job = floor.write_floor_job(tmp_path, picture, repeats=(3, 6), render=f"{{method: {method}}}")
        (red,) = floor.drawn(job, "R")
        np.testing.assert_allclose(red[near], expected[near], atol=1e-3)


SUN = "{type: directional, direction: [-1, -2, -1], color: [2, 1.5, 1]}"
LIT = f"[{SUN}, {{type: ambient, color: [0.2, 0.3, 0.4]}}]"


@pytest.mark.parametrize(
    "material", ["roughness: 0.4", "specular: 0", "metallic: 1, roughness: 0.3", "unlit: true"]
)
def test_light_at_nodes_and_textures_at_pixels_make_what_each_pixel_alone_makes(tmp_path, material):
    """Ray casting shades every pixel by itself, with slopes from another formula."""
    picture = np.random.default_rng(8).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    channels = "[rgba, albedo, diffuse, specular, emission]"
    more = ", emission: floor.png, occlusion: floor.png"
    seen = []
    for method in ("homography", "raycast"):
        job = floor.write_floor_job(
            tmp_path, picture, material=material, textures=more, lights=LIT, channels=channels,
            render=f"{{method: {method}}}",
        )  # fmt: skip
        names = ("R", "G", "B", "albedo.G", "diffuse.B", "specular.R", "emission.R")
        seen.append(np.stack(floor.drawn(job, *names)).astype(np.float64))
    np.testing.assert_allclose(seen[0], seen[1], rtol=2e-3, atol=1e-3)
    assert np.ptp(seen[0][0]) > 0.1


def test_beauty_is_the_sum_of_its_parts(tmp_path):
    picture = np.random.default_rng(9).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    more = ", emission: floor.png, roughness: floor.png, occlusion: floor.png"
    job = floor.write_floor_job(
        tmp_path, picture, material="specular: 1", textures=more, lights=LIT,
        channels="[rgba, albedo, diffuse, specular, emission]",
    )  # fmt: skip
    names = ("R", "albedo.R", "diffuse.R", "specular.R", "emission.R")
    total, albedo, diffuse, specular, emission = (v.astype(np.float64) for v in floor.drawn(job, *names))
    np.testing.assert_allclose(total, albedo * diffuse + specular + emission, rtol=3e-3, atol=1e-3)
    assert specular.max() > 0.01


def test_texture_coordinates_are_a_channel(tmp_path):
    job = floor.write_floor_job(tmp_path, floor.checker(), repeats=(80, 240), channels="[rgba, uv]")
    found = floor.drawn(job, "uv.U", "uv.V")
    expected = floor.floor_places()
    some = np.isfinite(expected[0])
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one[some], other[some], rtol=1e-6, atol=1e-4)
        assert (one[~some] == 0).all()


@pytest.mark.parametrize("samples", [1, 4])
def test_any_split_of_the_work_gives_the_same_bytes(tmp_path, samples):
    picture = np.random.default_rng(10).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    job = floor.write_floor_job(
        tmp_path, picture, lights=LIT, material="roughness: 0.5", render=f"{{samples: {samples}}}"
    )
    setup = quiltcli.set_up(job)
    one, four = (next(iter(quiltcli.draw(setup, threads=n))) for n in (1, 4))
    assert all(one.pages[0][name].tobytes() == four.pages[0][name].tobytes() for name in one.pages[0])


@pytest.mark.parametrize("samples", [1, 4, 8])
def test_a_facet_shows_the_same_however_it_lies_in_the_quilt(tmp_path, samples):
    """Footprints and cells turn with the facet: the picture of a wall that is packed lying is that of one
    that stands."""
    board = floor.checker()
    pictures = []
    for rotate in (0, 90):
        job = floor.write_floor_job(tmp_path, board, repeats=REPEATS, render=f"{{samples: {samples}}}")
        page = "[200, 200]" if not rotate else "[100, 160]"
        text = job.read_text()
        job.write_text(text + f"layout: {{size: {page}, padding: 0}}\n")
        (frame,) = quiltcli.draw(job, threads=1)
        pictures.append(frame.facet(1)["R"])
    np.testing.assert_allclose(pictures[0], pictures[1], atol=2e-3)


def test_textures_are_filtered_over_the_cells_of_samples():
    """The mean of the footprints' middles is the pixel's, whatever the number."""
    from quiltcli.render.antialiasing import cell_grid, cell_of

    for count in (1, 2, 4, 8, 9, 16, 25, 64):
        across, down = cell_grid(count)
        cells = [cell_of(place, count) for place in sample_places(count)]
        middles = np.array(
            [np.add(place, cell[0]) for place, cell in zip(sample_places(count), cells, strict=True)]
        )
        grid = {(i, j) for i in range(across) for j in range(down)}
        found = np.rint((middles + 0.5) * (across, down) - 0.5).astype(int)
        assert set(map(tuple, found.tolist())) == grid
        assert {cell[1] for cell in cells} == {(1 / across, 1 / down)}
    assert cell_of((0.1, 0.2), 6) == ((0, 0), (6**-0.5, 6**-0.5))
