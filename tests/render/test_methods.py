"""Render methods: what their depth buffers hold, what they show, and how rays and two passes compare."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tests.helpers.in_memory as rig
from quiltcli.display import lit_facets
from quiltcli.errors import JobError
from quiltcli.geometry import cross, dot
from quiltcli.job import load_job
from quiltcli.layout import align
from quiltcli.projection.camera import viewer_frustum
from quiltcli.projection.planar import plane_homography, quilt_rays
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame as rasterize_frame
from quiltcli.render.methods import draw_frame
from quiltcli.render.methods.twopass import picture_size
from quiltcli.render.notices import job_warnings
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from quiltcli.viewer.view import viewers_of
from quiltcli.visibility.draw import batches, rasterize
from quiltcli.visibility.scan.depth_buffers import (
    LEAST_FACTOR,
    DepthOrder,
    depth_order,
    homography_row,
    ranks,
    rounded,
    uniform_scale,
)
from tests.helpers.packed_layouts import pack
from tests.helpers.tiny_job import write_tiny_job

SCENES = Path(__file__).parents[2] / "scenes"
ALL = ("rgba", "Z", "zv", "facet", "object", "triangle", "N", "P")


def standing(facets, eye):
    """The facets with their rays, as `depth_order` wants them."""
    layout = align(pack(facets, "rows", padding=2), facets)
    return facets, quilt_rays(layout, lit_facets(facets, eye.eye), eye.eye)


def canonical(order: DepthOrder, facet: int, point) -> float:
    """What the buffer of a facet holds for a point minus eye."""
    held, _ = order.stored(np.array([facet]), np.asarray(point, float).reshape(3, 1, 1))
    return float(held[0, 0])


# ---- what is stored ----


def test_rounding_is_to_the_nearest_of_the_buffers_numbers() -> None:
    z = np.array([-1.0, 1.0, 0.0, 0.25])
    assert rounded(z, None) is z
    steps = 2**16 - 1
    expected = np.array([-1, 1, 2 * round(0.5 * steps) / steps - 1, 2 * round(0.625 * steps) / steps - 1])
    assert rounded(z, "16").tolist() == expected.tolist()
    assert np.abs(rounded(z, "24") - z).max() <= 1 / (2**24 - 1)
    assert rounded(z, "32f").tolist() == z.tolist()  # all of them are floats
    assert rounded(np.array([0.1]), "32f")[0] == 2 * float(np.float32(0.55)) - 1


@pytest.mark.parametrize("bits", ["16", "24", "32f"])
def test_ranks_fall_by_one_a_step_of_the_buffer(bits: str) -> None:
    if bits == "32f":
        window = np.array([1.0, np.nextafter(np.float32(1), np.float32(0)), 0.5, 0.0])
        pattern = window.astype(np.float32).view(np.int32)
        expected = pattern[0] + 1 - pattern
    else:
        steps = 2 ** int(bits) - 1
        window = np.array([steps, steps - 1, 0]) / steps
        expected = np.array([1, 2, steps + 1])
    assert ranks(window * 2 - 1, bits).tolist() == expected.tolist()


def test_ranks_keep_their_value_in_a_depth_key() -> None:
    """A key keeps 30 bits of the mantissa beside the leading one: no rank may need more."""
    for bits in ("16", "24", "32f"):
        rank = ranks(np.linspace(-1, 1, 999), bits)
        assert ((rank.view(np.int64) & ((1 << 22) - 1)) == 0).all()


def test_the_viewers_buffer_holds_equation_4() -> None:
    eye = rig.viewer((0, 0, 3), near=0.5, far=10)
    order = depth_order("homography", None, eye, *standing(rig.panel(), eye))
    for z, held in ((0.5, -1.0), (10.0, 1.0), (2.0, 10.5 / 9.5 - 2 * 5 / (9.5 * 2))):
        assert canonical(order, 0, (0.1 * z, -0.2 * z, -z)) == pytest.approx(held, abs=1e-14)


def test_off_axis_depth_is_measured_along_the_facets_normal() -> None:
    eye = rig.viewer((2, 1.5, 3), at=(0, 0, 0), near=0.5, far=10)
    facets, rays = standing(rig.cube(), eye)
    order = depth_order("offaxis", None, eye, facets, rays)
    point = np.array([0.3, -0.2, 0.4]) - eye.eye
    for facet in np.flatnonzero(rays.lit):
        along = -float(facets.normal[facet] @ point)
        expected = 10.5 / 9.5 - 10 / (9.5 * along)
        assert canonical(order, facet, point) == pytest.approx(expected, abs=1e-13)


def test_on_a_facet_that_faces_the_viewer_off_axis_is_the_homography() -> None:
    eye = rig.viewer((0.2, 0.1, 3), at=(0.2, 0.1, 0))
    facets, rays = standing(rig.panel(), eye)
    both = [depth_order(method, None, eye, facets, rays) for method in ("offaxis", "homography")]
    for point in ([0.5, 0.3, -2], [-1, 0.2, -7]):
        values = [canonical(order, 0, point) for order in both]
        assert values[0] == pytest.approx(values[1], abs=1e-14)


def test_the_last_row_of_the_homography_is_that_of_equation_1() -> None:
    """h₃₁ and h₃₂ over h₃₃ from K_v [R − T nᵀ/d] K_i⁻¹, both cameras at the eye and in canonical space."""
    eye = rig.viewer((2, 1.5, 3), at=(0.1, 0, 0))
    facets, rays = standing(rig.cube(), eye)
    wide, high = viewer_frustum(eye, facets, rays.lit)
    found = homography_row(eye, facets, rays)
    to_viewer = np.stack((cross(eye.look, eye.up), eye.up, eye.look))
    k_viewer = np.diag((1 / wide, 1 / high, 1.0))
    for facet in np.flatnonzero(rays.lit):
        normal = facets.normal[facet]
        right = facets.du[facet] / np.linalg.norm(facets.du[facet])
        axes = np.stack((right, cross(-normal, right), -normal))  # a camera that looks straight at the facet
        induced = plane_homography(
            k_viewer, to_viewer @ axes.T, np.zeros(3), np.array([0, 0, 1.0]), 1.0, np.eye(3)
        )
        row = np.linalg.inv(induced)[2]
        np.testing.assert_allclose(
            found[facet] / found[facet, 2], np.abs(row / row[2]), rtol=1e-12, atol=1e-15
        )


def test_raskars_factor_is_one_less_both_and_never_nothing() -> None:
    eye = rig.viewer((2, 1.5, 3), at=(0.1, 0, 0), near=0.5, far=10)
    facets, rays = standing(rig.cube(), eye)
    row = homography_row(eye, facets, rays)
    order = depth_order("raskar", None, eye, facets, rays)
    point = np.array([0.3, -0.2, 0.4]) - eye.eye
    z = float(eye.look @ point)
    scaled = 10.5 / 9.5 * z - 10 / 9.5
    for facet in np.flatnonzero(rays.lit):
        t = float(rays.quilt_from_eye[facet, 2] @ point)
        factor = max(1 - (row[facet, 0] + row[facet, 1]) / row[facet, 2], LEAST_FACTOR)
        w = t / row[facet, 2]
        assert canonical(order, facet, point) == pytest.approx(factor * scaled / w, abs=1e-13)
    steep = (row[:, 0] + row[:, 1] > row[:, 2]) & rays.lit
    assert steep.any()
    assert (order.factor[steep] == LEAST_FACTOR * row[steep, 2]).all()


def test_the_uniform_scale_just_keeps_the_far_plane_on_every_facet() -> None:
    eye = rig.viewer((2, 1.5, 3), at=(0.1, 0, 0), near=0.5, far=1e9)
    facets, rays = standing(rig.cube(), eye)
    order = depth_order("zscale", None, eye, facets, rays)
    most = []
    for facet in np.flatnonzero(rays.lit):
        corners = facets.polygon(facet) - eye.eye
        most += [canonical(order, facet, corner * 1e9 / dot(corner, eye.look)) for corner in corners]
    assert max(most) == pytest.approx(1, abs=1e-9)
    row = homography_row(eye, facets, rays)
    assert order.factor.tolist() == (uniform_scale(row[:, 2], eye, facets, rays) * row[:, 2]).tolist()


def test_a_step_of_an_off_axis_buffer_is_worth_less_depth_the_more_its_facet_slants() -> None:
    """Along a ray D is ρ·Z, so G/D falls 1/ρ times as fast as G/Z: why few bits order fewer pixels wrong."""
    eye = rig.viewer((2, 1.5, 3), at=(0.1, 0, 0), near=0.5, far=10)
    facets, rays = standing(rig.cube(), eye)
    ours, theirs = (depth_order(method, None, eye, facets, rays) for method in ("homography", "offaxis"))
    point = np.array([0.3, -0.2, 0.4]) - eye.eye
    for facet in np.flatnonzero(rays.lit):
        ratio = -dot(facets.normal[facet], point) / dot(eye.look, point)
        rise = [
            canonical(order, facet, 1.001 * point) - canonical(order, facet, point)
            for order in (ours, theirs)
        ]
        assert rise[1] / rise[0] == pytest.approx(1 / ratio, rel=1e-9)
        assert ratio < 1


def test_what_a_buffer_holds_is_read_back_as_the_viewers_depth() -> None:
    eye = rig.viewer((0, 0, 3), near=0.5, far=10)
    for bits, off in ((None, 1e-12), ("24", 1e-5), ("16", 1e-3)):
        order = depth_order("homography", bits, eye, *standing(rig.panel(), eye))
        _, z = order.stored(np.array([0]), np.array([0.3, 0.2, -4.0]).reshape(3, 1, 1))
        assert z[0, 0] == pytest.approx(4, abs=off)
        assert bits is None or z[0, 0] != 4


# ---- what is drawn ----


def drawn(shown, order: DepthOrder):
    """Triangles (pixels,) of a picture drawn again by a depth buffer."""
    frame = replace(shown.frame, order=order)
    triangle = np.full(shown.owners.size, -1)
    for batch in batches(frame):
        for hits in rasterize(frame, batch):
            hits.put(triangle, hits.triangle[:, None])
    return triangle


@pytest.mark.parametrize("splits", [1, 4])
def test_a_buffer_without_rounding_and_clipping_draws_what_exact_depth_draws(splits: int) -> None:
    eye = rig.viewer((2, 1.5, 3), near=0.05, far=100)
    vertices, triangles = rig.icosphere(splits)
    more = np.concatenate((vertices * 0.9, vertices * [0.5, 1.3, 0.4]))
    both = np.concatenate((triangles, triangles + len(vertices)))
    shown = rig.picture(rig.cube(60), more, both, eye)
    for method in ("homography", "offaxis", "raskar", "zscale"):
        order = depth_order(method, None, eye, shown.facets, shown.rays)
        assert (drawn(shown, order) == shown.triangle).all()
    # 32 bits of 1/t would do here: what they tell apart is far more than what is there.
    order = depth_order("offaxis", "32f", eye, shown.facets, shown.rays)
    assert np.count_nonzero(drawn(shown, order) != shown.triangle) < 40


def test_equal_numbers_go_to_the_lowest_triangle_as_in_a_buffer_that_keeps_the_first() -> None:
    eye = rig.viewer((0, 0, 2), near=0.05, far=100)
    wall = np.array([(-1.0, -1, -1), (1, -1, -1), (0, 1, -1)])
    nearer = wall + [0, 0, 1e-6]
    shown = rig.picture(rig.panel(), np.concatenate((wall, nearer)), [[0, 1, 2], [3, 4, 5]], eye)
    assert set(shown.triangle) == {-1, 1}
    coarse = depth_order("homography", "16", eye, shown.facets, shown.rays)
    assert set(drawn(shown, coarse)) == {-1, 0}
    assert set(drawn(shown, replace(coarse, bits="24", viewer=replace(eye, near=1.5, far=5)))) == {-1, 1}


def test_off_axis_clips_at_its_near_plane_along_the_facets_normal() -> None:
    """On a slanted facet, what is 0.6 m away along the ray may be less than 0.5 m along the normal."""
    eye = rig.viewer((2.2, 0, 1.3), at=(0, 0, 1), near=0.5, far=100)
    wall = eye.eye + 0.6 * eye.look + np.array([(0, -1, -1.0), (0, -1, 1), (0, 1, 0)])
    shown = rig.picture(rig.cube(60), wall, [[0, 1, 2]], eye)
    order = depth_order("offaxis", None, eye, shown.facets, shown.rays)
    facet = np.abs(shown.owners) - 1
    seen = np.flatnonzero(shown.triangle >= 0)
    ray = rig.pixel_rays(shown, seen)
    point = ray * (shown.depth[seen] / (ray @ eye.look))[:, None]
    kept = -dot(shown.facets.normal[facet[seen]], point) >= 0.5
    assert kept.any()
    assert not kept.all()
    assert (drawn(shown, order)[seen] == np.where(kept, 0, -1)).all()


@pytest.fixture(scope="module")
def plates(tmp_path_factory: pytest.TempPathFactory):
    """The stage and viewer of the plates and the sphere in a small box of five panels."""
    folder = tmp_path_factory.mktemp("plates")
    box = SCENES.parent / "display_models" / "cube5.obj"
    (folder / "box.yaml").write_text(
        f"quilt_display: 1\nmesh: {box}\nresolution: {{facet_pixels: [160, 90]}}\n"
        "facets: {5: {facet_pixels: [160, 160]}}\n"
    )
    (folder / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: box.yaml\nscene: {SCENES / 'plates_and_sphere.yaml'}\nframes: 1\n"
        "viewer: {near: 0.002, far: 50, path: {orbit: {center: [0, 0.15, 0], radius: 1.05, height: 0.5,"
        " start_deg: -40, end_deg: 60, end_frame: 8}}}\n"
        f"output: {{channels: [{', '.join(ALL)}]}}\n"
    )
    job = load_job(folder / "job.yaml")
    return set_stage(job), viewers_of(job, [1])[0]


def by(stage, viewer, method: str, bits: str | None = None, **more):
    """The buffers of a method."""
    render = stage.job.render.model_copy(update={"method": method, "depth_bits": bits, **more})
    stage = replace(stage, job=stage.job.model_copy(update={"render": render}))
    buffers = new_buffers(stage)
    record = draw_frame(stage, viewer, buffers)
    return buffers, record


def test_rays_show_what_the_rasterizer_shows(plates) -> None:
    stage, viewer = plates
    cast, record = by(*plates, "raycast")
    exact, other = by(*plates, "homography")
    for name in ("triangle", "object", "facet", "A"):
        assert (cast[name] == exact[name]).all()
    assert record.visible_pixels == other.visible_pixels > 5000
    assert record.lit_facets == other.lit_facets == np.count_nonzero(lit_facets(stage.facets, viewer.eye))
    seen = np.isfinite(exact["Z"])
    assert (np.isfinite(cast["Z"]) == seen).all()
    for name in ("Z", "P.X", "P.Y", "P.Z"):  # a step of single precision
        np.testing.assert_allclose(cast[name][seen], exact[name][seen], rtol=2e-7, atol=2e-8)
    for name in ("R", "G", "B", "N.X"):
        np.testing.assert_allclose(cast[name], exact[name], rtol=1.1e-3, atol=1e-3)


def test_rays_cull_and_keep_to_near_and_far(plates) -> None:
    stage, viewer = plates
    viewer = replace(viewer, near=0.95, far=1.1)
    for depth in ("planar", "radial"):
        cut = replace(viewer, depth=depth)
        cast, _ = by(stage, cut, "raycast", backface_culling=True)
        exact, _ = by(stage, cut, "homography", backface_culling=True)
        assert (cast["triangle"] == exact["triangle"]).all()
        assert np.isfinite(exact["Z"]).any()
        assert (exact["triangle"] == 0).any()


def test_rays_take_the_lowest_of_triangles_at_one_depth(tmp_path: Path) -> None:
    """Two coats on one wall, cut along different diagonals: numbers differ in their last bits only."""
    (tmp_path / "coats.obj").write_text(
        "v -1 -1 -1\nv 1 -1 -1\nv 1.1 1 -0.3\nv -0.9 1 -0.3\nf 1 2 3\nf 1 3 4\nf 2 3 4\nf 2 4 1\n"
    )
    job = write_tiny_job(tmp_path)
    job = load_job(job, (f"scene={tmp_path / 'coats.obj'}", "output.channels=[Z, triangle]"))
    stage, viewer = set_stage(job), viewers_of(job, [2])[0]
    cast, exact = (by(stage, viewer, method)[0] for method in ("raycast", "homography"))
    assert set(np.unique(exact["triangle"])) == {0, 1, 2}
    assert (cast["triangle"] == exact["triangle"]).all()


def test_off_axis_shows_what_is_behind_the_view_plane_where_depth_is_radial() -> None:
    eye = rig.viewer((0, 0, 0), at=(0, 0, -1), near=0.1, far=50, depth="radial")
    vertices, triangles = rig.icosphere(2)
    inward = rig.cube(20, viewing_side="back")
    shown = rig.picture(inward, vertices * 3, triangles, eye)
    assert (shown.triangle[shown.mine] >= 0).all()
    assert (drawn(shown, depth_order("offaxis", None, eye, shown.facets, shown.rays)) == shown.triangle).all()
    scaled = drawn(shown, depth_order("zscale", None, eye, shown.facets, shown.rays))
    ahead = rig.pixel_rays(shown, np.flatnonzero(shown.mine)) @ eye.look > 0
    assert (scaled[shown.mine] >= 0).tolist() == ahead.tolist()


def test_only_some_facets_are_drawn_and_the_others_left(plates) -> None:
    stage, viewer = plates
    for method in ("raycast", "twopass"):
        whole, _ = by(stage, viewer, method)
        render = stage.job.render.model_copy(update={"method": method})
        some = replace(stage, job=stage.job.model_copy(update={"render": render}))
        only = np.arange(stage.facets.count) == int(np.flatnonzero(lit_facets(stage.facets, viewer.eye))[0])
        buffers = new_buffers(some)
        buffers["Z"].fill(7)
        draw_frame(some, viewer, buffers, only=only)
        mine = np.append(False, only)[np.abs(stage.owners)]
        assert (buffers["Z"][mine] == whole["Z"][mine]).all()
        assert (buffers["Z"][~mine] == 7).all()


@pytest.mark.parametrize("method", ["homography", "offaxis", "raskar", "zscale"])
def test_a_rounded_buffer_tells_its_own_number_and_what_it_is_taken_for(plates, method: str) -> None:
    stage, viewer = plates
    buffers, _ = by(stage, viewer, method, "16")
    seen = np.isfinite(buffers["Z"])
    held = buffers["zv"][seen].astype(np.float64)
    step = (held + 1) / 2 * (2**16 - 1)
    assert np.abs(step - np.rint(step)).max() < 0.01
    n, f = viewer.near, viewer.far
    # Z near the far plane says little of the number it came from: compare numbers.
    again = (f + n) / (f - n) - 2 * f * n / ((f - n) * buffers["Z"][seen].astype(np.float64))
    np.testing.assert_allclose(again, held, atol=3e-7)


def test_two_passes_repeat_the_picture_where_its_pixels_are_the_facets(tmp_path: Path) -> None:
    """A wall that fills the view: the picture's grid is the wall's, and nothing is lost between."""
    (tmp_path / "wall.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n")
    (tmp_path / "wall.yaml").write_text(
        "quilt_display: 1\nmesh: wall.obj\nresolution: {facet_pixels: [64, 64]}\n"
    )
    (tmp_path / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: wall.yaml\nscene: {SCENES / 'ball.obj'}\nframes: 1\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes:"
        " [{frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}]}}\n"
        f"render: {{bleed: 0}}\noutput: {{channels: [{', '.join(ALL)}]}}\n"
    )
    job = load_job(tmp_path / "job.yaml")
    stage, viewer = set_stage(job), viewers_of(job, [1])[0]
    assert picture_size(stage, viewer, np.ones(1, bool))[0] == (64, 64)
    once, twice = by(stage, viewer, "homography")[0], by(stage, viewer, "twopass")[0]
    assert np.isfinite(once["Z"]).any()
    for name, values in once.items():
        np.testing.assert_allclose(twice[name], values, atol=1e-6 if values.dtype.kind == "f" else 0)


def test_two_passes_say_what_of_a_display_around_the_eye_they_leave_empty(tmp_path: Path) -> None:
    (tmp_path / "room.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
        + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    )
    (tmp_path / "room.yaml").write_text(
        "quilt_display: 1\nmesh: room.obj\nviewing_side: both\nresolution: {facet_pixels: [40, 40]}\n"
    )
    (tmp_path / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: room.yaml\nscene: {SCENES / 'ball.obj'}\nframes: 1-2\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes:"
        " [{frame: 1, position: [0, 0, 0], look_at: [0, 0, -1]}]}}\n"
        "render: {method: twopass, bleed: 0, depth: radial}\n"
    )
    job = load_job(tmp_path / "job.yaml")
    stage, viewer = set_stage(job), viewers_of(job, [1])[0]
    _, record = by(stage, viewer, "twopass")
    # Of 6 sides 1 is ahead within 45°; 60° cut the four beside it at 1/tan 60° of their depth.
    share = 100 * (1 + 4 * (1 - (1 - 1 / np.sqrt(3)) / 2)) / 6
    words = [w for w in record.warnings if "outside the picture" in w]
    assert float(words[0].split(" %")[0]) == pytest.approx(share, abs=1.5)
    told = [w for w in job_warnings(job, stage.facets, stage.layout) if "twopass" in w]
    assert told == [
        "render.method twopass draws 120 degrees about the look direction: in frames 1-2 lit facets reach"
        " beyond, and their pixels there stay empty (every other method draws all around)"
    ]
    other = by(stage, viewer, "homography")[1]
    assert not any("outside the picture" in words for words in other.warnings)


def test_the_first_pass_has_as_many_pixels_as_the_lit_facets(plates) -> None:
    stage, viewer = plates
    lit = lit_facets(stage.facets, viewer.eye)
    (width, height), _ = picture_size(stage, viewer, lit)
    pixels = np.count_nonzero(np.append(False, lit)[np.maximum(stage.owners, 0)])
    assert width * height == pytest.approx(pixels, rel=0.01)


def test_workers_draw_by_the_method_of_the_job(tmp_path: Path) -> None:
    path = write_tiny_job(tmp_path)
    job = load_job(path, ("render.method=raskar", "render.depth_bits=16", "frames=1-2"))
    render(job, RenderOptions(folder=tmp_path / "two", threads=2))
    render(job, RenderOptions(folder=tmp_path / "one", threads=1))
    names = sorted(p.name for p in (tmp_path / "one" / "quilt").iterdir())
    assert names
    for name in names:
        first, second = ((tmp_path / n / "quilt" / name).read_bytes() for n in ("one", "two"))
        assert first == second
    assert job.render.depth_bits == "16"


@pytest.mark.parametrize("method", ["twopass", "raycast"])
def test_a_job_renders_by_the_others_too(tmp_path: Path, method: str) -> None:
    path = write_tiny_job(tmp_path)
    records = render(
        load_job(path, (f"render.method={method}", "frames=1")), RenderOptions(folder=tmp_path / "o")
    )
    assert records[0].visible_pixels > 0


def test_exact_depth_takes_the_fast_path(plates) -> None:
    stage, viewer = plates
    first, second = new_buffers(stage), new_buffers(stage)
    rasterize_frame(stage, viewer, first)
    draw_frame(stage, viewer, second)
    assert all((first[name] == second[name]).all() for name in first)


# ---- what a job may say ----


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (
            "render.method=raycats",
            "expected homography, offaxis, raskar, zscale, twopass, raycast, cubemap, tessellate, octree,"
            " independent, exact or vertex, got the text 'raycats' (did you mean 'raycast'?)",
        ),
        ("render.depth_bits=17", "expected 16, 24 or 32f, or no such key, got 17"),
        ("render.depth_bits=yes", "expected 16, 24 or 32f, or no such key, got the text 'yes'"),
    ],
)
def test_what_is_no_method_is_said(tmp_path: Path, said: str, message: str) -> None:
    with pytest.raises(JobError) as caught:
        load_job(write_tiny_job(tmp_path), (said,))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("render.depth_bits=24", "rays have no depth buffer (expected no such key beside method: raycast)"),
        ("render.samples=4", "expected 1 beside method: raycast, one ray a pixel, got 4"),
    ],
)
def test_rays_have_neither_a_buffer_nor_samples(tmp_path: Path, said: str, message: str) -> None:
    with pytest.raises(JobError) as caught:
        load_job(write_tiny_job(tmp_path), ("render.method=raycast", said))
    assert message in str(caught.value)
