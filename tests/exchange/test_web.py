from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.exchange.web import ViewOptions, view
from quiltcli.exchange.web.fitting import fitting_pictures
from quiltcli.exchange.web.folder import chosen_frames, open_folder
from quiltcli.exchange.web.frames import frame_images
from quiltcli.exchange.web.ghost import Ghost, clustered, ghost
from quiltcli.exchange.web.html import json_text, page
from quiltcli.exchange.web.mesh import display_mesh
from quiltcli.exchange.web.textures import codings, extents, page_light, page_picture
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.preview import tone_map
from quiltcli.job import load_display_file, load_job, load_scene_file
from quiltcli.layout import pixel_owners, quilt_polygons, read_layout
from quiltcli.render.sequence import render
from quiltcli.scene import load_scene
from quiltcli.viewer.view import viewers_of
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.tiny_job import replaced, write_tiny_job

PACKAGE = Path(__file__).parents[2] / "quiltcli" / "exchange" / "web"
MODELS = Path(__file__).parents[2] / "display_models"
HOSTILE = "</script><img src=x onerror=alert(1)><!-- \u2028 & \"'"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """The output folder of the tiny job: its right wall shows its back, the other has a wicked name."""
    folder = tmp_path_factory.mktemp("view")
    job = write_tiny_job(folder)
    replaced(folder, "walls.obj", "f 2 5 6 3", "f 2 3 6 5")
    named = f"facets: {{1: {{name: {json.dumps(HOSTILE)}}}}}\n"
    (folder / "display.yaml").write_text((folder / "display.yaml").read_text() + named)
    render(load_job(job))
    return folder / "out"


@pytest.fixture(scope="module")
def written(out):
    return view(out, [2, 1], out.parent / "two.html")


def data_of(path: Path):
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', path.read_text(), re.S)
    return json.loads(text)


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def picture_of(url: str) -> np.ndarray:
    kind, _, data = url.partition(";base64,")
    assert kind in ("data:image/png", "data:image/jpeg")
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))))


# The page


def test_the_page_holds_the_pages_of_the_quilt_pixel_by_pixel(out, written):
    data = data_of(written.page)
    assert [entry["frame"] for entry in data["frames"]] == [2, 1]
    layout = read_layout(out / "layout.yaml")
    assert data["pages"] == layout.pages.tolist()
    for entry in data["frames"]:
        channels = read_exr(out / "quilt" / f"page_01.{entry['frame']:04d}.exr").channels
        expected = tone_map(np.stack([channels[name] for name in "RGB"], axis=-1))
        inside = pixel_owners(layout).reshape(expected.shape[:2]) > 0
        assert inside.sum() > 1000
        assert (picture_of(entry["pages"][0])[inside] == expected[inside]).all()


def test_the_page_holds_the_display_where_it_is(out, written):
    data = data_of(written.page)
    stage = open_folder(out).stage
    position = unpacked(data["mesh"]["position"], "<f4").reshape(-1, 3) + data["centre"]
    assert np.abs(position - stage.facets.corners).max() < 1e-6
    quilt = unpacked(data["mesh"]["quilt"], "<f4").reshape(-1, 2)
    assert (quilt == quilt_polygons(stage.layout).astype(np.float32)).all()
    assert unpacked(data["mesh"]["page"], "<i4").tolist() == stage.layout.page.tolist()
    viewer = viewers_of(stage.job, [2])[0]
    entry = data["frames"][0]
    assert np.abs(np.array(entry["eye"]) + data["centre"] - viewer.eye).max() < 1e-12
    assert unpacked(entry["lit"], "u1").tolist() == [1, 0]  # the right wall shows its back
    path = unpacked(data["path"], "<f4").reshape(-1, 3) + data["centre"]
    assert np.abs(path - [viewers_of(stage.job, [f])[0].eye for f in (1, 2, 3, 4)]).max() < 1e-6


def test_the_page_names_nothing_that_could_be_loaded(written):
    text = written.page.read_text()
    library = (PACKAGE / "vendor" / "three.bundle.js").read_text()
    assert library in text
    own = re.sub(r'<script type="application/json".*?</script>', "", text.replace(library, ""), flags=re.S)
    assert "http" not in own.replace("http-equiv", "")
    assert re.findall(r"\b(?:src|href)\s*=\s*([^\s>;]+)", own) == [
        '"data:,"',
        "url",
    ]  # an icon; pictures inside
    assert not re.search(r"@import|url\(|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\(|importScripts", own)
    # Of the library, only the name of XML's own space looks like an address.
    assert set(re.findall(r"https?://[\w./-]+", library)) <= {"http://www.w3.org/1999/xhtml"}


def test_the_policy_allows_the_two_scripts_and_pictures_inside(written):
    text = written.page.read_text()
    policy = re.search('Content-Security-Policy" content="(.*?)"', text)[1]
    scripts = re.findall("<script>(.*?)</script>", text, re.S)
    assert len(scripts) == 2
    hashes = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert policy == (
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
        f"script-src 'sha256-{hashes[0]}' 'sha256-{hashes[1]}'"
    )


def test_no_name_of_the_users_becomes_markup(written):
    text = written.page.read_text()
    assert data_of(written.page)["names"][0] == HOSTILE
    assert "<img" not in text
    assert text.count("</script>") == 3
    assert "<title>display · frame 2</title>" in text
    assert "<title>&lt;/title&gt;&amp;&quot;@DATA@</title>" in page('</title>&"@DATA@', {})


def test_data_in_a_page_can_be_neither_tag_nor_comment():
    text = json_text({"a": "</script><!--&\u2028"})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"a": "</script><!--&\u2028"}


def test_errors_are_those_of_the_simulation(out, written, tmp_path):
    assert [entry["heat"] for entry in data_of(written.page)["frames"]] == [None, None]
    options = ViewOptions(errors=True, model=False)
    (entry,) = data_of(view(out, [2], tmp_path / "a.html", options).page)["frames"]
    heat = tmp_path / "heat.png"
    arguments = ["-f", "2", "--size", "800x600", "-o", str(tmp_path / "eye.png"), "--heat-map", str(heat)]
    result = CliRunner().invoke(main, ["simulate", str(out.parent / "job.yaml"), *arguments])
    assert result.exit_code == 0, result.output
    assert (picture_of(entry["heat"]) == np.asarray(Image.open(heat))).all()
    for label, figure in entry["figures"][:-1]:
        assert f"{label:<24}{figure}\n" in result.output


def test_the_bundle_is_small_and_says_whose_it_is():
    text = (PACKAGE / "vendor" / "three.bundle.js").read_text()
    licence = (PACKAGE / "vendor" / "LICENSE.three.txt").read_text()
    assert len(text.encode()) < 700_000
    assert text.startswith(
        "/*! three.js 0.187.0, bundled by esbuild from three.entry.js\n" + licence + "*/\n"
    )
    assert "three.js authors" in licence
    assert "</script" not in text
    assert "<!--" not in text


def test_the_bundle_is_what_was_made_and_nothing_else():
    folder = PACKAGE / "vendor"
    known, name = (folder / "three.bundle.js.sha256").read_text().split()
    assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == known
    attributes = (PACKAGE.parents[2] / ".gitattributes").read_text()
    assert "quiltcli/exchange/web/vendor/three.bundle.js -text linguist-vendored\n" in attributes


# Frames and sizes


def test_by_default_all_frames_there_are_beside_the_images(out):
    result = CliRunner().invoke(main, ["view", str(out)])
    assert result.exit_code == 0, result.output
    assert [entry["frame"] for entry in data_of(out / "view.html")["frames"]] == [1, 2, 3, 4]
    assert result.output.splitlines()[2:] == [
        "frames    1-4",
        "pictures  PNG, at full size",
        "scene     4 triangles",
    ]
    (out / "view.html").unlink()
    (out / "view.glb").unlink()


def test_of_many_frames_some_evenly_apart(out):
    folder = open_folder(out)
    assert chosen_frames(folder, None, 2) == (1, 4)
    assert chosen_frames(folder, None, 3) == (1, 3, 4)
    assert chosen_frames(folder, [3, 3, 1], 1) == (3, 1)


def test_the_same_bytes_every_time(out, tmp_path):
    first, second = (view(out, [3], tmp_path / name) for name in ("a.html", "b.html"))
    assert first.page.read_bytes() == second.page.read_bytes()
    assert first.model.read_bytes() == second.model.read_bytes()


def test_facet_images_will_do(tmp_path, out, written):
    job = write_tiny_job(tmp_path)
    render(load_job(job, ["output.quilts=false", "frames=1"]))
    data = data_of(view(tmp_path / "out").page)
    layout = read_layout(tmp_path / "out" / "layout.yaml")
    inside = pixel_owners(layout).reshape(layout.pages[0, ::-1]) > 0
    expected = picture_of(data_of(written.page)["frames"][1]["pages"][0])
    assert (picture_of(data["frames"][0]["pages"][0])[inside] == expected[inside]).all()


def test_the_best_pictures_that_fit_are_taken(out):
    folder, options = open_folder(out), ViewOptions(texture=1024)
    layout = folder.stage.layout
    shown = frame_images(folder, 1)
    tried = codings(1024)
    lengths = [len(page_picture(shown, 0, coding, "aces", 0.0).url) for coding in tried]
    assert [str(coding) for coding in tried] == ["PNG", "JPEG 92", *["JPEG 90"] * 5]
    assert extents(layout, 1024).tolist() == layout.pages.tolist()
    for room in sorted({length + 100 for length in lengths}):
        best = next(coding for coding, length in zip(tried, lengths, strict=True) if length < room)
        coding, pictures = fitting_pictures(folder, [1], options, room)
        assert coding == best
        assert len(pictures[0][0].url) < room


def test_a_page_keeps_to_its_size(out, tmp_path):
    result = CliRunner().invoke(main, ["view", str(out), "--max-mb", "1", "-o", str(tmp_path / "a.html")])
    assert result.exit_code == 0
    assert (tmp_path / "a.html").stat().st_size < 1e6


def test_what_fits_in_no_way_is_said(out):
    with pytest.raises(OSError, match="2 frames do not fit into a page of 8 MB"):
        fitting_pictures(open_folder(out), [1, 2], ViewOptions(), 1000)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-f", "7"], "has no images of frame 7 (it has 1-4)"),
        (["-o", "page.png"], "page.png: a page's name must end in .html"),
    ],
)
def test_command_refuses(out, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["view", str(out), *arguments])
    assert result.exit_code == 2
    assert message in result.output
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_images_is_refused(tmp_path):
    result = CliRunner().invoke(main, ["view", str(tmp_path)])
    assert (result.exit_code, "has no job.yaml" in result.output) == (2, True)
    write_tiny_job(tmp_path)
    result = CliRunner().invoke(main, ["view", str(tmp_path)])
    assert (result.exit_code, "has no images of frames" in result.output) == (2, True)


def test_images_for_another_eye_are_refused(tmp_path):
    render(load_job(write_tiny_job(tmp_path), ["frames=1-2"]))
    replaced(tmp_path, "out/job.yaml", "2.0]", "2.125]")
    result = CliRunner().invoke(main, ["view", str(tmp_path / "out"), "-f", "1"])
    assert result.exit_code == 2
    assert "was drawn for another eye" in result.output


def test_half_a_frame_is_refused(tmp_path):
    render(load_job(write_tiny_job(tmp_path), ["frames=1-2", "output.quilts=false"]))
    (tmp_path / "out" / "facets" / "facet_0002.0001.exr").unlink()
    result = CliRunner().invoke(main, ["view", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "images of frame 1 are missing" in result.output


# Mesh, pictures, ghost


@pytest.mark.parametrize("model", ["cube5", "cave5", "dodecahedron"])
def test_triangles_turn_to_the_lit_side_and_cover_the_facets(model):
    facets = load_display(load_display_file(MODELS / f"{model}.yaml"))
    mesh = display_mesh(facets, placed(facets, [moved(0, 0)] * facets.count, (9999, 9999)))
    a, b, c = (mesh.position[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    across = np.cross(b - a, c - a)
    assert (np.einsum("tk,tk->t", across, facets.normal[mesh.facet]) > 0).all()
    area = np.zeros(facets.count)
    np.add.at(area, mesh.facet, np.linalg.norm(across, axis=1) / 2)
    for row in (0, facets.count // 2):
        around = facets.polygon(row) - facets.polygon(row)[0]
        whole = np.linalg.norm(np.cross(around[1:-1], around[2:]).sum(axis=0)) / 2
        assert area[row] == pytest.approx(whole, rel=1e-4)


def shown_of(values: np.ndarray, places, bleed: int = 0) -> Shown:
    """Rectangles of 4 × 4 pixels at some places of a page, showing a page's values in all colours."""
    height, width = values.shape
    facets = flat_display([rectangle(4, 4)] * len(places))
    layout = placed(facets, [moved(*place) for place in places], (width, height))
    buffers = {name: values.reshape(-1).astype(np.float16) for name in "RGB"}
    return Shown(
        facets,
        layout,
        np.ones(len(places), bool),
        buffers,
        pixel_owners(layout, bleed),
        np.array([0, 0, 1.0]),
    )


def test_reduced_pictures_average_facets_alone():
    values = np.full((8, 16), 1000.0)
    values[1:5, 1:5] = np.arange(16).reshape(4, 4)
    light = page_light(shown_of(values, [(1, 1)]), 0, 2)[..., 0]
    assert light.shape == (4, 8)
    assert light[0, 0] == 0  # one of the block's pixels is the facet's
    assert light[0, 1] == np.mean([1, 2])
    assert light[1, 1] == np.mean([5, 6, 9, 10])
    assert light[2, 2] == 15


def test_bleed_counts_where_nothing_else_does():
    values = np.zeros((8, 16))
    values[2:6, 2:6] = 1
    values[2:6, 6:8] = 3
    light = page_light(shown_of(values, [(2, 2)], bleed=2), 0, 4)[..., 0]
    assert light[0, 0] == pytest.approx(1, abs=0.01)  # bleed is 1 here and 0 there
    assert light[0, 1] == pytest.approx(1, abs=0.02)


def test_pictures_go_on_for_a_pixel_around_facets():
    values = np.zeros((8, 16))
    values[2:6, 2:6] = 2
    light = page_light(shown_of(values, [(2, 2)]), 0, 1)[..., 0]
    assert (light[1:7, 1:7] == 2).all()
    assert light.sum() == 2 * 36


def test_pages_are_reduced_by_whole_numbers():
    layout = shown_of(np.zeros((10, 30)), [(0, 0)]).layout
    assert extents(layout, 30).tolist() == [[30, 10]]
    assert extents(layout, 29).tolist() == [[30, 10]]
    assert extents(layout, 8).tolist() == [[32, 12]]


def grid(count: int) -> Ghost:
    """A square of 2 n² triangles, red from 0 to 1 from left to right."""
    y, x = (part.reshape(-1) for part in np.mgrid[: count + 1, : count + 1])
    position = np.stack((x, y, 0 * x), axis=1).astype(np.float32) / count
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1, 1)
    quads = corner + [0, 1, count + 2, count + 1]
    triangles = np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))
    color = np.stack((position[:, 0], 0 * position[:, 0], 0 * position[:, 0]), axis=1)
    return Ghost(position, color, triangles.astype(np.int64))


def test_a_thinned_mesh_stays_within_a_cell_and_keeps_its_colour_and_sides():
    thin = clustered(grid(60), 10)
    assert 150 < len(thin.triangles) <= 2 * 10 * 10
    assert np.abs(thin.position.max(axis=0) - [0.95, 0.95, 0]).max() < 0.05
    assert np.abs(thin.position[:, 0] - thin.color[:, 0]).max() < 1e-6
    a, b, c = (thin.position[thin.triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_the_ghost_keeps_to_its_budget(out):
    scene = load_scene(load_scene_file(MODELS.parent / "scenes" / "teapot_and_solids.yaml"))
    centre = np.array([1.0, 2.0, 3.0])
    for budget in (500, 5000):
        found = ghost(scene, centre, budget)
        assert budget / 8 < len(found.triangles) <= budget
        low, high = scene.vertices.min(axis=0) - centre, scene.vertices.max(axis=0) - centre
        assert (found.position >= low - 1e-5).all()
        assert (found.position <= high + 1e-5).all()
    assert ghost(scene, centre, 0) is None
    assert ghost(scene, centre, 3) is None
    whole = ghost(open_folder(out).stage.scene, np.zeros(3), 10)
    assert (len(whole.triangles), whole.cells) == (4, 0)
    assert whole.color[0] == pytest.approx([0.8, 0.2, 0.1])


# The model


def read_glb(path: Path):
    """Document and binary chunk of a file, its frame checked."""
    data = path.read_bytes()
    magic, version, length, text_length, text_kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, text_kind) == (b"glTF", 2, len(data), b"JSON")
    assert text_length % 4 == 0
    binary_length, binary_kind = struct.unpack_from("<I4s", data, 20 + text_length)
    assert (binary_kind, binary_length) == (b"BIN\0", len(data) - 28 - text_length)
    return json.loads(data[20 : 20 + text_length]), data[28 + text_length :]


def accessor(document, binary, index: int) -> np.ndarray:
    entry = document["accessors"][index]
    kind = {5126: "<f4", 5125: "<u4", 5121: "u1"}[entry["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
    place = document["bufferViews"][entry["bufferView"]]
    assert place["byteLength"] == entry["count"] * width * np.dtype(kind).itemsize
    values = np.frombuffer(binary, kind, entry["count"] * width, place["byteOffset"])
    return values.reshape(entry["count"], width)


def test_the_model_is_sound(written):
    document, binary = read_glb(written.model)
    assert document["asset"]["version"] == "2.0"
    assert document["buffers"] == [{"byteLength": len(binary)}]
    assert document["extensionsUsed"] == ["KHR_materials_unlit"]
    end = 0
    for place in document["bufferViews"]:
        assert place["byteOffset"] % 4 == 0
        assert place["byteOffset"] >= end
        end = place["byteOffset"] + place["byteLength"]
    assert len(binary) - end < 4
    for mesh in document["meshes"]:
        for part in mesh["primitives"]:
            arrays = {name: accessor(document, binary, at) for name, at in part["attributes"].items()}
            counts = {len(values) for values in arrays.values()}
            assert len(counts) == 1
            bounds = document["accessors"][part["attributes"]["POSITION"]]
            assert bounds["min"] == arrays["POSITION"].min(axis=0).tolist()
            assert bounds["max"] == arrays["POSITION"].max(axis=0).tolist()
            assert part["material"] < len(document["materials"])
            if "indices" in part:
                assert accessor(document, binary, part["indices"]).max() < counts.pop()
    assert sorted(document["scenes"][0]["nodes"]) == list(range(len(document["nodes"])))


def test_the_model_shows_the_images_where_they_belong(out, written):
    document, binary = read_glb(written.model)
    part = document["meshes"][document["nodes"][0]["mesh"]]["primitives"][0]
    material = document["materials"][part["material"]]
    assert material["extensions"] == {"KHR_materials_unlit": {}}
    texture = document["textures"][material["pbrMetallicRoughness"]["baseColorTexture"]["index"]]
    assert document["samplers"][texture["sampler"]] == {
        "magFilter": 9728, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071
    }  # fmt: skip
    image = document["images"][texture["source"]]
    place = document["bufferViews"][image["bufferView"]]
    stored = binary[place["byteOffset"] :][: place["byteLength"]]
    assert image["mimeType"] == "image/png"
    pixels = np.asarray(Image.open(io.BytesIO(stored)))
    assert (pixels == picture_of(data_of(written.page)["frames"][0]["pages"][0])).all()
    # At a corner of the back wall, through texture coordinates, and from the world into its raster.
    facets, layout = (stage := open_folder(out).stage).facets, stage.layout
    uv = accessor(document, binary, part["attributes"]["TEXCOORD_0"])
    world = accessor(document, binary, part["attributes"]["POSITION"]) + document["nodes"][0]["translation"]
    used = np.unique(accessor(document, binary, part["indices"]))
    assert used.tolist() == [0, 1, 2, 3]
    ij = (world[used] - facets.origin[0]) @ np.stack((facets.du[0], facets.dv[0]), axis=1) * 32**2
    expected = ij @ layout.quilt_from_facet[0][:, :2].T + layout.quilt_from_facet[0][:, 2]
    assert np.abs(uv[used] * layout.pages[0] - expected).max() < 1e-3


def test_the_model_has_dark_sides_and_the_eye(out, written):
    document, binary = read_glb(written.model)
    names = [material["name"] for material in document["materials"]]
    parts = {names[p["material"]]: p for p in document["meshes"][0]["primitives"]}
    corners = {name: accessor(document, binary, p["indices"]).ravel() for name, p in parts.items()}
    assert set(corners["page 1"]) == set(corners["back"]) == {0, 1, 2, 3}
    assert set(corners["dark"]) == {4, 5, 6, 7}
    front, back = corners["page 1"].reshape(-1, 3), corners["back"].reshape(-1, 3)
    assert (front == back[:, ::-1]).all()
    eye = next(node for node in document["nodes"] if "camera" in node)
    matrix = np.array(eye["matrix"]).reshape(4, 4).T
    assert np.abs(matrix[:3, 3] - viewers_of(open_folder(out).stage.job, [2])[0].eye).max() < 1e-12
    assert np.abs(matrix[:3, :3].T @ matrix[:3, :3] - np.eye(3)).max() < 1e-12
    assert np.linalg.det(matrix) == pytest.approx(1)


def test_another_program_reads_the_model(out, written):
    import trimesh

    loaded = trimesh.load(written.model)
    facets = open_folder(out).stage.facets
    page = next(mesh for mesh in loaded.geometry.values() if mesh.visual.material.name == "page 1")
    assert page.area == pytest.approx(4, rel=1e-6)
    assert page.faces.shape == (2, 3)
    assert ((page.visual.uv >= 0) & (page.visual.uv <= 1)).all()
    assert {"display", "scene"} <= {name.split("_")[0] for name in loaded.graph.nodes}
    assert np.abs(loaded.bounds[0] - np.minimum(facets.corners.min(axis=0), [-0.5, -0.5, -1])).max() < 1e-6


def test_the_model_can_be_left_out(out, tmp_path):
    result = CliRunner().invoke(
        main, ["view", str(out), "-f", "1", "--no-model", "--ghost", "0", "-o", str(tmp_path / "v.html")]
    )
    assert result.exit_code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["v.html"]
    assert "left out (4 triangles)" in result.output
    assert data_of(tmp_path / "v.html")["ghost"] is None
