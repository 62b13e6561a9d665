"""Surfaces that light may pass, held against rays that gather all they meet in double precision."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from quiltcli.scene import Materials
from quiltcli.scene.scene import ALPHAS
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.gltf_files import SQUARE, one_square
from tests.helpers.in_memory import cube, panel, viewer
from tests.helpers.tiny_job import replaced, write_tiny_job
from tests.helpers.wall_scene import lights

EYE = viewer((0.21, 0.13, 2.9))


def materials(rows):
    """Unlit materials of (colour, alpha's meaning, opacity)."""
    count = len(rows)
    return Materials(
        color=np.array([color for color, _, _ in rows], np.float32),
        metallic=np.zeros(count, np.float32),
        roughness=np.full(count, 0.5, np.float32),
        emission=np.zeros((count, 3), np.float32),
        unlit=np.ones(count, bool),
        specular=np.ones(count, np.float32),
        opacity=np.array([opacity for _, _, opacity in rows], np.float32),
        alpha=np.array([ALPHAS.index(alpha) for _, alpha, _ in rows], np.int32),
        cutoff=np.full(count, 0.5, np.float32),
    )


def soup(seed=3, count=40, opaque=0.05):
    """Triangles of all sizes that cross one another, some of them opaque, some masks."""
    dice = np.random.default_rng(seed)
    middle = dice.uniform(-0.8, 0.8, (count, 1, 3))
    size = dice.choice([0.05, 0.2, 0.9], (count, 1, 1))
    vertices = (middle + size * dice.normal(size=(count, 3, 3))).reshape(-1, 3)
    rows = []
    for _ in range(count):
        kind = dice.uniform()
        alpha = "opaque" if kind < opaque else "mask" if kind < opaque + 0.2 else "blend"
        opacity = dice.choice([0.2, 0.5, 0.75, 0.0]) if alpha != "opaque" else 1.0
        rows.append((dice.uniform(0.1, 1, 3), alpha, opacity))
    return scene_of(vertices, np.arange(3 * count).reshape(-1, 3), rows, np.arange(count))


def scene_of(vertices, triangles, rows, material, background=(0.1, 0.2, 0.4)):
    plain = ball_scene(0, 1.0, lights(ambient=(1, 1, 1)), background)
    count = len(triangles)
    return replace(
        plain,
        vertices=np.asarray(vertices, float),
        triangles=np.asarray(triangles, np.int32),
        normals=np.tile(np.float32([0, 0, 1]), (len(vertices), 1)),
        colors=np.ones((len(vertices), 3), np.float32),
        flat=np.ones(count, bool),
        object=np.arange(count, dtype=np.int32),
        objects=tuple(f"plate{k}" for k in range(count)),
        material=np.asarray(material, np.int32),
        materials=materials(rows),
    )


def drawn(scene, facets=None, samples=1, channels=("rgba", "Z", "triangle", "cryptoobject"), eye=EYE):
    stage = stage_of_facets(panel(density=40) if facets is None else facets, scene)
    job = stage.job
    update = {
        "render": job.render.model_copy(update={"samples": samples}),
        "output": job.output.model_copy(update={"channels": channels}),
    }
    stage = replace(stage, job=job.model_copy(update=update))
    buffers = new_buffers(stage)
    record = draw_frame(stage, eye, buffers)
    return stage, buffers, record


def gathered(scene, stage, eye):
    """For every pixel of a panel: colour, alpha, depth and triangle, and whether a ray is sure of them."""
    width, height = stage.layout.pages[0]
    y, x = np.divmod(np.arange(width * height), width)
    rays = np.linalg.inv(np.vstack((stage.layout.quilt_from_facet[0], [0, 0, 1])))
    i, j, _ = rays @ np.stack((x + 0.5, y + 0.5, np.ones(x.size)))
    layout = stage.layout
    points = layout.origin[0] + i[:, None] * layout.du[0] + j[:, None] * layout.dv[0]
    d = points - eye.eye
    a, b, c = (scene.vertices[scene.triangles[:, k]] - eye.eye for k in range(3))
    edges = np.stack([np.cross(p, q) @ d.T for p, q in ((b, c), (c, a), (a, b))])
    det = np.einsum("tk,tk->t", a, np.cross(b, c))
    sign = np.sign(det)[None, :, None]
    inside = (edges * sign > 0).all(axis=0)
    size = np.abs(edges).max(axis=2, keepdims=True)
    sure = (np.abs(edges) > 2e-3 * size).all(axis=0)
    t = np.where(inside, det[:, None] / edges.sum(axis=0), np.inf)
    order = np.argsort(t, axis=0)
    sorted_t = np.take_along_axis(t, order, axis=0)
    with np.errstate(invalid="ignore"):
        close = (np.diff(sorted_t, axis=0) < 1e-6) & np.isfinite(sorted_t[1:])
    certain = sure.all(axis=0) & ~close.any(axis=0)
    table = scene.materials
    alpha = table.opacity.astype(float)
    mask = table.alpha == ALPHAS.index("mask")
    alpha = np.where(mask, table.opacity >= table.cutoff, alpha)
    alpha = np.where(table.alpha == 0, 1.0, alpha)[scene.material]
    through = np.ones(d.shape[0])
    light = np.zeros((3, d.shape[0]))
    nearest = np.full(d.shape[0], -1)
    for row, depth in zip(order, sorted_t, strict=True):
        there = np.isfinite(depth)
        own = np.where(there, alpha[row], 0.0)
        light += through * own * table.color[scene.material[row]].T
        through = through * (1 - own)
        nearest = np.where((nearest < 0) & (own > 0), row, nearest)
    light += through * scene.background[:, None]
    depth = np.where(nearest >= 0, t[nearest, np.arange(nearest.size)] * -(d @ -eye.look), np.inf)
    return light, 1 - through, depth, nearest, certain


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_crossing_plates_are_blended_as_rays_meet_them(seed):
    scene = soup(seed)
    stage, buffers, record = drawn(scene)
    light, alpha, depth, nearest, certain = gathered(scene, stage, EYE)
    assert certain.mean() > 0.6
    assert np.unique(alpha[certain]).size > 6
    for k, name in enumerate("RGB"):
        np.testing.assert_allclose(buffers[name][certain], light[k][certain], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(buffers["A"][certain], alpha[certain], atol=1e-3)
    np.testing.assert_array_equal(buffers["triangle"][certain], nearest[certain] + 1)
    np.testing.assert_allclose(buffers["Z"][certain], depth[certain], rtol=1e-5)
    assert record.visible_pixels == np.count_nonzero(np.isfinite(buffers["Z"]) & (stage.owners > 0))


def test_the_order_of_triangles_in_the_file_makes_no_difference():
    scene = soup(5, 30)
    _, first, _ = drawn(scene)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(scene.triangles))
        other = replace(
            scene,
            triangles=scene.triangles[order],
            material=scene.material[order],
            object=scene.object[order],
        )
        _, again, _ = drawn(other)
        for name in first:
            if name != "triangle":
                np.testing.assert_array_equal(
                    again[name].view(np.uint8), first[name].view(np.uint8), err_msg=name
                )


def test_many_layers_are_all_there():
    """Thirty panes one behind another, more than any hardware keeps apart."""
    z = np.linspace(-1, 0.5, 30)
    corners = np.array([(-9, -9), (9, -9), (0, 15)])
    vertices = np.concatenate([np.column_stack((corners, np.full(3, depth))) for depth in z])
    rows = [((0.5, 0.5, 0.5), "blend", 0.1)] * 30
    _, buffers, _ = drawn(scene_of(vertices, np.arange(90).reshape(-1, 3), rows, np.arange(30), (1, 1, 1)))
    held = 1 - 0.9**30
    np.testing.assert_allclose(buffers["A"][buffers["A"] > 0], held, rtol=1e-3)
    np.testing.assert_allclose(buffers["R"][buffers["A"] > 0], 0.5 * held + 1 - held, rtol=1e-3)


def one_plate(alpha, opacity, z=0.2):
    vertices = [(-3, -3, z), (3, -3, z), (0, 5, z), (-3, -3, -1), (3, -3, -1), (0, 5, -1)]
    rows = [((1, 0, 0), alpha, opacity), ((0, 1, 0), "opaque", 1.0)]
    return scene_of(vertices, [[0, 1, 2], [3, 4, 5]], rows, [0, 1])


@pytest.mark.parametrize(("opacity", "there"), [(0.5, True), (0.49999997, False), (1.0, True), (0.0, False)])
def test_a_mask_is_there_from_its_cutoff_on(opacity, there):
    _, buffers, _ = drawn(one_plate("mask", opacity))
    middle = np.isfinite(buffers["Z"])
    assert set(np.unique(buffers["triangle"][middle])) == {1 if there else 2}
    assert (buffers["A"][middle] == 1).all()
    assert (buffers["R"][middle] == (1 if there else 0)).all()


def test_what_is_not_there_has_neither_depth_nor_name():
    _, buffers, _ = drawn(one_plate("blend", 0.0))
    _, only, _ = drawn(one_plate("blend", 1.0, z=-5))
    seen = np.isfinite(buffers["Z"])
    assert (buffers["triangle"][seen] == 2).all()
    np.testing.assert_array_equal(buffers["Z"], only["Z"])
    np.testing.assert_array_equal(buffers["CryptoObject00.R"], only["CryptoObject00.R"])


def test_what_holds_up_everything_is_drawn_as_opaque_to_the_last_bit():
    _, buffers, _ = drawn(one_plate("blend", 1.0))
    _, opaque, _ = drawn(one_plate("opaque", 1.0))
    for name, pixels in opaque.items():
        np.testing.assert_array_equal(buffers[name], pixels, err_msg=name)


def test_samples_are_blended_one_by_one_and_mattes_add_up_to_alpha():
    scene = soup(7)
    _, one, _ = drawn(scene)
    _, many, _ = drawn(scene, samples=16)
    np.testing.assert_array_equal(one["Z"], many["Z"])
    assert abs(one["R"].astype(float).mean() - many["R"].astype(float).mean()) < 0.01
    for buffers in (one, many):
        total = sum(buffers[f"CryptoObject0{k}.{c}"].astype(float) for k in range(3) for c in "GA")
        full = (
            np.count_nonzero([buffers[f"CryptoObject0{k}.{c}"] for k in range(3) for c in "GA"], axis=0) < 6
        )
        np.testing.assert_allclose(total[full], buffers["A"][full].astype(float), atol=1e-3)


@pytest.mark.parametrize("side", [8, 64])
def test_small_blocks_give_the_same(side, monkeypatch):
    scene = soup(9)
    _, whole, _ = drawn(scene, facets=cube(density=30), eye=viewer((1.9, 1.4, 2.6)))
    monkeypatch.setattr("quiltcli.visibility.setup.blocks.SIDE", side)
    monkeypatch.setattr("quiltcli.visibility.setup.prewarp.SIDE", side)
    _, cut, _ = drawn(scene, facets=cube(density=30), eye=viewer((1.9, 1.4, 2.6)))
    np.testing.assert_array_equal(cut["triangle"], whole["triangle"])
    for name in "RGBA":
        np.testing.assert_allclose(cut[name], whole[name], rtol=2**-9, atol=2**-12)


def glass_file(path, mode="BLEND", color=(1, 0, 0, 0.25), vertex=None, double=False):
    file = one_square()
    file.json["materials"] = [
        {
            "name": "glass",
            "alphaMode": mode,
            "doubleSided": double,
            "pbrMetallicRoughness": {"baseColorFactor": list(color)},
            "extensions": {"KHR_materials_unlit": {}},
        }
    ]
    file.json["meshes"][0]["primitives"][0]["material"] = 0
    if vertex is not None:
        colors = np.array([(1, 1, 1, alpha) for alpha in vertex], np.float32)
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = file.accessor(colors)
    file.write(path)


def job_of_glass(tmp_path, how="", **keys):
    job = write_tiny_job(tmp_path, "160, 80")
    glass_file(tmp_path / "m.glb", **keys)
    replaced(
        tmp_path, "scene.yaml", "mesh: ball.obj", "mesh: m.glb, transform: {translate: [-0.5, -0.5, -0.5]}"
    )
    replaced(tmp_path, "scene.yaml", ", material: {color: [0.8, 0.2, 0.1]}", "")
    text = f"frames: 1-4\nrender: {{{how}}}\noutput: {{channels: [rgba, Z]}}"
    replaced(tmp_path, "job.yaml", "frames: 1-4", text)
    return set_stage(load_job(job))


def picture(stage):
    buffers = new_buffers(stage)
    draw_moment(moment(stage, stage.views([1])[0]), buffers)
    return buffers


def test_gltf_says_how_transparent_it_is(tmp_path):
    buffers = picture(job_of_glass(tmp_path))
    seen = np.isfinite(buffers["Z"])
    assert seen.any()
    assert set(np.unique(buffers["A"][seen])) == {0.25}
    assert set(np.unique(buffers["R"][seen])) == {0.25}


def test_alpha_of_vertices_multiplies_it(tmp_path):
    buffers = picture(job_of_glass(tmp_path, color=(1, 0, 0, 1), vertex=(0, 1, 1, 0)))
    seen = np.isfinite(buffers["Z"])
    # From 0 at the left to 1 at the right.
    assert buffers["A"][seen].min() < 0.1
    assert buffers["A"][seen].max() > 0.9
    assert np.unique(buffers["A"]).size > 10


def test_a_mask_of_vertices_ends_at_the_cutoff(tmp_path):
    half = picture(job_of_glass(tmp_path, mode="MASK", color=(1, 0, 0, 1), vertex=(0, 1, 1, 0)))
    (tmp_path / "whole").mkdir()
    whole = picture(job_of_glass(tmp_path / "whole", mode="OPAQUE"))
    assert set(np.unique(half["A"])) == {0, 1}
    share = np.count_nonzero(half["A"]) / np.count_nonzero(whole["A"])
    assert share == pytest.approx(0.5, abs=0.03)
    np.testing.assert_array_equal(np.isfinite(half["Z"]), half["A"] > 0)


@pytest.mark.parametrize(
    ("double", "how", "seen"), [(True, "file", True), (False, "file", False), (False, "all", True)]
)
def test_backs_are_seen_where_file_or_job_say_so(tmp_path, double, how, seen):
    stage = job_of_glass(tmp_path, f"double_sided: {how}", mode="OPAQUE", double=double)
    turned = replace(stage.scene, triangles=stage.scene.triangles[:, ::-1].copy())
    assert np.isfinite(picture(replace(stage, scene=turned))["Z"]).any() == seen
    assert np.isfinite(picture(stage)["Z"]).any()


def test_workers_draw_the_same_and_the_scene_file_has_the_last_word(tmp_path):
    job_of_glass(tmp_path, "samples: 3")
    replaced(tmp_path, "scene.yaml", "mesh: m.glb,", "mesh: m.glb, material: {opacity: 0.75},")
    found = []
    for threads in (1, 2):
        out = tmp_path / f"out{threads}"
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("quiltcli.render.sequence.worth_forking", lambda _: True)
            render(load_job(tmp_path / "job.yaml"), RenderOptions(frames=[1, 2], folder=out, threads=threads))
        found.append([(out / f"quilt/page_01.000{f}.exr").read_bytes() for f in (1, 2)])
    assert found[0] == found[1]
    alpha = read_exr(tmp_path / "out1/quilt/page_01.0001.exr").channels["A"]
    assert alpha.max() == 0.75


def test_rays_see_what_is_visible(tmp_path):
    """A pane that holds up nothing is no surface to verify, one that holds up something is."""
    for opacity in (0.0, 0.5):
        (tmp_path / str(opacity)).mkdir()
        stage = job_of_glass(tmp_path / str(opacity), color=(1, 0, 0, opacity))
        for method in ("homography", "raycast"):
            how = stage.job.render.model_copy(update={"method": method})
            buffers = picture(replace(stage, job=stage.job.model_copy(update={"render": how})))
            assert np.isfinite(buffers["Z"]).any() == (opacity > 0)


def leaf_job(tmp_path, mode, alphas):
    """The square with a picture of two columns, red, of these alphas from left to right."""
    data = io.BytesIO()
    Image.fromarray(np.array([[(255, 0, 0, alpha) for alpha in alphas]], np.uint8)).save(data, "PNG")
    file = one_square()
    image = file.add("images", bufferView=file.view(data.getvalue()), mimeType="image/png")
    sampler = file.add("samplers", wrapS=33071, wrapT=33071)
    file.json["textures"] = [{"source": image, "sampler": sampler}]
    look = {"baseColorTexture": {"index": 0}}
    unlit = {"KHR_materials_unlit": {}}
    file.json["materials"] = [{"alphaMode": mode, "pbrMetallicRoughness": look, "extensions": unlit}]
    primitive = file.json["meshes"][0]["primitives"][0]
    primitive["material"] = 0
    corners = np.array(SQUARE, np.float32)[:, :2]
    primitive["attributes"]["TEXCOORD_0"] = file.accessor(corners)
    file.write(tmp_path / "leaf.glb")
    job = write_tiny_job(tmp_path, "160, 80")
    place = "transform: {translate: [-0.5, -0.5, -0.5]}"
    replaced(tmp_path, "scene.yaml", "mesh: ball.obj", f"mesh: leaf.glb, {place}")
    replaced(tmp_path, "scene.yaml", ", material: {color: [0.8, 0.2, 0.1]}", "")
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-4\noutput: {channels: [rgba, Z, uv]}")
    return set_stage(load_job(job))


def test_a_mask_is_cut_out_by_its_picture(tmp_path):
    """Alpha runs from 0 to 1 between the columns' middles: half of the leaf is there."""
    buffers = picture(leaf_job(tmp_path, "MASK", (0, 255)))
    seen = np.isfinite(buffers["Z"])
    assert set(np.unique(buffers["A"])) == {0, 1}
    np.testing.assert_array_equal(seen, buffers["A"] > 0)
    assert buffers["uv.U"][seen].min() > 0.45
    assert buffers["uv.U"][seen].max() > 0.95


def test_a_picture_blends_and_what_it_leaves_out_has_no_depth(tmp_path):
    buffers = picture(leaf_job(tmp_path, "BLEND", (0, 128)))
    seen = np.isfinite(buffers["Z"])
    assert buffers["A"].max() == pytest.approx(128 / 255, abs=1e-3)
    assert buffers["uv.U"][seen].min() > 0.2, "where alpha is 0 nothing is"
    u = buffers["uv.U"][seen].astype(float)
    expected = np.clip((u - 0.25) / 0.5, 0, 1) * 128 / 255
    np.testing.assert_allclose(buffers["A"][seen], expected, atol=0.03)
    np.testing.assert_allclose(buffers["R"][seen], buffers["A"][seen], atol=1e-3)
