"""Pictures of glTF files against Filament, a renderer of others, through one facet; skipped where it is not.

Filament draws with OpenGL: edges are its rasterizer's, levels its own approximation. So pictures are
enlarged here, where both are bilinear, and pixels at edges of shapes are left out.
"""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import quiltcli
from quiltcli.scene import load_scene
from tests.helpers.gltf_files import SQUARE, TWO, GltfFile
from tests.helpers.in_memory import icosphere

filly = pytest.importorskip("filly", reason="Filament is not here (pip install -e '.[crosscheck]')")
SIZE, FOV = 160, 40.0
KEY = (1, 0, 1)
"""What is behind Filament's pictures: no picture here is of that colour."""
QUAD = [(0, 1), (1, 1), (1, 0), (0, 0)]
CORNERS = np.array(SQUARE)


def picture(file, seed, alpha=False):
    """An embedded PNG of soft random colours."""
    dice = np.random.default_rng(seed)
    small = Image.fromarray(dice.integers(0, 256, (5, 6, 4 if alpha else 3)).astype(np.uint8))
    stream = io.BytesIO()
    small.save(stream, format="PNG")
    return file.add("images", bufferView=file.view(stream.getvalue()), mimeType="image/png")


def textured(file, image, *, uv_set=0, transform=None, wrap=(10497, 10497), color=(1, 1, 1, 1)):
    """An unlit material of a picture."""
    sampler = file.add("samplers", magFilter=9729, minFilter=9987, wrapS=wrap[0], wrapT=wrap[1])
    texture = {"index": file.add("textures", source=image, sampler=sampler), "texCoord": uv_set}
    if transform:
        texture["extensions"] = {"KHR_texture_transform": transform}
    return file.add(
        "materials",
        pbrMetallicRoughness={"baseColorTexture": texture, "baseColorFactor": color},
        extensions={"KHR_materials_unlit": {}},
        doubleSided=True,
    )


def square(file, material, at, uv=QUAD, uv1=None, colors=None):
    """A unit square at a place, aslant."""
    attributes = {"TEXCOORD_0": file.accessor(uv)}
    if uv1 is not None:
        attributes["TEXCOORD_1"] = file.accessor(uv1)
    if colors is not None:
        attributes["COLOR_0"] = file.accessor(colors)
    places = CORNERS - 0.5 + CORNERS[:, :1] * (0, 0, 0.4)
    positions = file.accessor(places, min=places.min(axis=0).tolist(), max=places.max(axis=0).tolist())
    primitive = {"attributes": {"POSITION": positions, **attributes}, "indices": file.accessor(TWO, "u2")}
    file.node(mesh=file.mesh({**primitive, "material": material}), translation=at)


def plain(file):
    square(file, textured(file, picture(file, 1)), (0, 0, 0))


def wraps(file):
    image, far = picture(file, 2), (np.array(QUAD) * 2.6 - 0.7).tolist()
    for k, wrap in enumerate([(33071, 33071), (33648, 33648), (10497, 33071), (33648, 10497)]):
        square(file, textured(file, image, wrap=wrap), (k % 2 * 1.1, k // 2 * 1.1, 0), far)


def transforms(file):
    image = picture(file, 3)
    turns = [{"offset": [0.3, 0.2]}, {"rotation": 0.5}, {"scale": [1.6, 0.7]}]
    turns.append({"scale": [1.4, 1.4], "rotation": -0.8})
    for k, transform in enumerate(turns):
        square(file, textured(file, image, transform=transform), (k % 2 * 1.1, k // 2 * 1.1, 0))


def second_coordinates(file):
    turned = [QUAD[(k + 1) % 4] for k in range(4)]
    square(file, textured(file, picture(file, 4), uv_set=1), (0, 0, 0), uv1=turned)


def factors_and_vertex_colors(file):
    colors = np.float32([(1, 0.2, 0.1), (0.1, 1, 0.2), (0.3, 0.2, 1), (1, 1, 1)])
    square(file, textured(file, picture(file, 5), color=(0.9, 0.5, 0.7, 1)), (0, 0, 0), colors=colors)


def alpha_without_blending(file):
    square(file, textured(file, picture(file, 6, alpha=True)), (0, 0, 0))


SCENES = (plain, wraps, transforms, second_coordinates, factors_and_vertex_colors, alpha_without_blending)
FILES = {make.__name__: make for make in SCENES}


def ours(scene: str, eye, target, folder: Path, *, size=SIZE, fov=FOV, frame=1, fps=10):
    """Linear R, G, B, A of a square facet that fills the view."""
    ahead = np.subtract(target, eye)
    far = np.linalg.norm(ahead)
    ahead /= far
    right = np.cross(ahead, (0, 1, 0))
    right /= np.linalg.norm(right)
    up, half = np.cross(right, ahead), math.tan(math.radians(fov / 2)) * far * 0.1
    middle = eye + ahead * far * 0.1
    corners = [middle + half * (x * right + y * up) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    lines = "".join("v {:.17g} {:.17g} {:.17g}\n".format(*corner) for corner in corners)
    (folder / "d.obj").write_text(f"{lines}f 1 2 3 4\n")
    (folder / "d.yaml").write_text(
        f"quilt_display: 1\nmesh: d.obj\nresolution: {{facet_pixels: [{size}, {size}]}}\n"
    )
    (folder / "j.yaml").write_text(
        f"quilt_job: 1\ndisplay: d.yaml\nscene: {scene}\nframes: {frame}\nfps: {fps}\n"
        f"viewer: {{near: {far * 0.01}, far: {far * 10}, path: {{keyframes: "
        f"[{{frame: {frame}, position: {eye.tolist()}, look_at: {target.tolist()}}}]}}}}\n"
    )
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    return frame.stack(1).astype(np.float64)


@pytest.fixture(scope="module")
def filament():
    with filly.Renderer() as renderer:
        yield renderer


def theirs(renderer, path: Path, eye, target, *, size=SIZE, fov=FOV, seconds=None, behind=(0, 0, 0)):
    """The same as Filament draws it, encoded, 0 to 255; at a time of the file's first animation."""
    far = float(np.linalg.norm(target - eye))
    scene, camera = renderer.create_scene(), renderer.create_camera()
    model = scene.load(str(path))
    if seconds is not None:
        model.apply_animation(0, seconds)
    camera.set_perspective(fov_y_deg=fov, near=far * 0.01, far=far * 10)
    camera.position, scene.background = eye.tolist(), (*behind, 1)
    camera.look_at(target.tolist())
    scene.camera = camera
    image = renderer.create_render_target(width=size, height=size)
    renderer.render(scene, image)
    return np.asarray(image.read())[..., :3].astype(np.float64)


@pytest.mark.parametrize("name", FILES)
def test_enlarged_pictures_are_those_of_filament(tmp_path, filament, name):
    file = GltfFile(extensionsUsed=["KHR_materials_unlit", "KHR_texture_transform"])
    FILES[name](file)
    file.add("scenes", nodes=list(range(len(file.json["nodes"]))))
    path = file.write(tmp_path / f"{name}.glb")
    scene = load_scene(path)
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    target, size = (low + high) / 2, np.linalg.norm(high - low)
    eye = target + size * 1.3 * np.array([0.25, 0.3, 0.92])
    linear = ours(path.name, eye, target, tmp_path)
    compare(linear, theirs(filament, path, eye, target, behind=KEY))


def compare(linear, other):
    """Hold a picture against Filament's, which has KEY behind it."""
    shown, light = linear[..., 3] > 0, linear[..., :3]
    encoded = np.where(
        light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    )
    inner = shown.copy()
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            inner &= np.roll(shown, (dy, dx), (0, 1))
    error = np.abs(encoded * 255 - other).max(axis=-1)
    assert np.count_nonzero(inner) > 200
    assert np.quantile(error[inner], 0.99) < 1
    seen = np.abs(other - np.multiply(KEY, 255)).max(axis=-1) > 2
    assert np.count_nonzero(seen != shown) <= 0.003 * shown.size


def lit_ball(path: Path, metallic: float, gain: float) -> Path:
    """A ball in the light of a sun from the upper left, of 3 times a unit of ours times `gain`."""
    file = GltfFile(extensionsUsed=["KHR_lights_punctual"])
    vertices, triangles = icosphere(4)
    look = {"baseColorFactor": [0.8, 0.5, 0.3, 1], "metallicFactor": metallic, "roughnessFactor": 0.5}
    file.json["materials"] = [{"pbrMetallicRoughness": look}]
    places = file.accessor(vertices, min=vertices.min(axis=0).tolist(), max=vertices.max(axis=0).tolist())
    primitive = {"attributes": {"POSITION": places, "NORMAL": file.accessor(vertices)}, "material": 0}
    file.node(mesh=file.mesh({**primitive, "indices": file.accessor(triangles.ravel(), "u2")}))
    sun = {"type": "directional", "intensity": 683 * 3.0 * gain, "color": [1, 1, 1]}
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [sun]}}
    turn = [-0.2468, 0.2905, 0.0778, 0.9212]  # about X, then Y
    file.node(rotation=turn, extensions={"KHR_lights_punctual": {"light": 0}})
    file.add("scenes", nodes=[0, 1])
    return file.write(path)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_light_is_that_of_filament_but_for_what_the_models_differ_in(tmp_path, filament, metallic):
    """Half of a lit ball is within 5 %, up to one factor for Filament's exposure.

    Near the border of light our layer lets less in and out, as its Fresnel terms say; Filament's base is
    Lambert's, and it makes up for light that rough metal loses from lobe to lobe.
    """
    eye, target = np.array([0, 0, 4.0]), np.zeros(3)
    lit_ball(tmp_path / "ball.glb", metallic, 1)
    (tmp_path / "s.yaml").write_text("quilt_scene: 1\nobjects: [{mesh: ball.glb}]\nlights: [{type: file}]\n")
    light = ours("s.yaml", eye, target, tmp_path)[..., :3]
    encoded = theirs(filament, lit_ball(tmp_path / "bright.glb", metallic, 40), eye, target) / 255
    other = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    some = (other > 0.01) & (other < 0.98) & (light > 0.005)
    assert np.count_nonzero(some) > 10_000
    exposure = np.median(other[some] / light[some])
    assert exposure == pytest.approx(0.76, rel=0.03), "the same for paint and metal"
    off = np.abs(other[some] / (exposure * light[some]) - 1)
    assert np.median(off) < 0.05
    assert np.quantile(np.abs(other / exposure - light)[some], 0.75) < 0.03, "of light up to 1"
