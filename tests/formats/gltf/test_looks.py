"""Materials, lights and pictures of a file."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import io
import math
import struct
import zlib

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf import read_gltf
from quiltcli.scene.importers.gltf import read_gltf_model, surface_of
from tests.helpers.gltf_files import GltfFile


def material(path, use=None, **entry):
    """A material read back from a file with two images, of which `use` names the texture."""
    file = GltfFile()
    for color in ((255, 0, 0, 17), (0, 255, 0, 255)):
        file.add("images", bufferView=file.view(png(color)), mimeType="image/png")
    file.add("samplers", wrapS=33071, wrapT=33648, magFilter=9728, minFilter=9729)
    file.add("textures", source=1, sampler=0)
    file.add("textures", source=0)
    file.add("materials", **entry)
    file.node(mesh=file.mesh(file.primitive(material=0)))
    return read_gltf_model(file.write(path / "m.glb")).gltf


def png(color, size=(3, 2)):
    from PIL import Image

    found = io.BytesIO()
    Image.new("RGBA", size, color).save(found, "PNG")
    return found.getvalue()


def only(gltf):
    return gltf.materials[0]


def test_a_material_that_says_nothing_is_the_formats_own(tmp_path):
    found = only(material(tmp_path))
    assert (found.color, found.metallic, found.roughness) == ((1, 1, 1, 1), 1, 1)
    assert (found.alpha_mode, found.cutoff, found.double_sided, found.unlit) == ("OPAQUE", 0.5, False, False)


def test_factors_are_not_rounded(tmp_path):
    found = material(
        tmp_path,
        pbrMetallicRoughness={"baseColorFactor": [0.0015, 0.5, 0, 0.3], "metallicFactor": 0.25},
        emissiveFactor=[1, 0.5, 0],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 5}},
        alphaMode="MASK",
        alphaCutoff=0.2,
        doubleSided=True,
    )
    surface = surface_of(only(found))
    assert surface.color == (0.0015, 0.5, 0)
    assert surface.emission == (5, 2.5, 0)
    assert surface.metallic == 0.25
    assert (only(found).alpha_mode, only(found).cutoff, only(found).double_sided) == ("MASK", 0.2, True)
    assert found.notices == ()


def test_unlit_shows_the_colour_alone(tmp_path):
    found = material(
        tmp_path,
        pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1]},
        emissiveFactor=[1, 1, 1],
        extensions={"KHR_materials_unlit": {}},
    )
    surface = surface_of(only(found))
    assert surface.unlit
    assert (surface.color, surface.emission) == ((1, 0, 0), (0, 0, 0))


def test_every_texture_with_its_set_sampler_and_transform(tmp_path):
    change = {"offset": [0.25, 0.5], "rotation": math.pi / 2, "scale": [2, 3], "texCoord": 1}
    found = material(
        tmp_path,
        pbrMetallicRoughness={
            "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": change}},
            "metallicRoughnessTexture": {"index": 1, "texCoord": 1},
        },
        normalTexture={"index": 1, "scale": 0.5},
        occlusionTexture={"index": 0, "strength": 0.75},
        emissiveTexture={"index": 0},
    )
    textures = only(found).textures
    assert list(textures) == ["color", "metallic_roughness", "normal", "occlusion", "emission"]
    color, other = textures["color"], textures["metallic_roughness"]
    assert (color.image, color.uv_set, color.wrap) == (1, 1, ("clamp", "mirror"))
    assert (color.nearest, color.mipmaps) == (True, False)
    # A quarter turn against the clock, v down: u goes to -v.
    assert color.matrix == pytest.approx((0, 3, 0.25, -2, 0, 0.5), abs=1e-15)
    assert (other.image, other.uv_set, other.wrap) == (0, 1, ("repeat", "repeat"))
    assert (other.nearest, other.mipmaps, other.matrix) == (False, True, (1, 0, 0, 0, 1, 0))
    assert (textures["normal"].strength, textures["occlusion"].strength) == (0.5, 0.75)


def test_pixels_are_read_when_they_are_asked_for_and_alpha_is_not_multiplied_in(tmp_path):
    images = material(tmp_path).images
    assert images.size(0) == (3, 2)
    assert images.pixels(0).tolist() == [[[255, 0, 0, 17]] * 3] * 2


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"alphaMode": "GLOW"}, "materials[0].alphaMode: expected OPAQUE, MASK or BLEND, got 'GLOW'"),
        ({"normalTexture": {"index": 2}}, "materials[0].normalTexture.index: expected texture, 0 to 1, got 2"),
        ({"normalTexture": {"index": 0, "texCoord": 2}}, "texCoord: expected a whole number from 0 to 1, got 2"),
        ({"pbrMetallicRoughness": {"metallicFactor": 7}}, "metallicFactor: expected a number from 0 to 1, got 7"),
        ({"emissiveFactor": [-1, 0, 0]}, "materials[0].emissiveFactor[0]: expected a number from 0, got -1"),
        ({"pbrMetallicRoughness": 3}, "materials[0].pbrMetallicRoughness: expected an object, got 3"),
    ],
)  # fmt: skip
def test_materials_that_are_wrong_are_named(tmp_path, entry, words):
    with pytest.raises(MeshError) as caught:
        material(tmp_path, **entry)
    assert words in str(caught.value)


def test_looks_that_are_not_drawn_are_told_with_the_material(tmp_path):
    found = material(tmp_path, name="glass", extensions={"KHR_materials_transmission": {}}, alphaMode="BLEND")
    assert found.notices == ("KHR_materials_transmission is not drawn ('glass')",)


@pytest.mark.parametrize(
    ("given", "strength", "told"),
    [
        ({}, 1.0, ()),
        ({"specularFactor": 0.3}, 0.3, ()),
        ({"specularFactor": 2.5}, 1.0, ()),
        (
            {"specularFactor": 0, "specularColorFactor": [1, 0, 0]},
            0.0,
            ("KHR_materials_specular is drawn by its specularFactor alone ('paint')",),
        ),
    ],
)
def test_the_layer_is_as_strong_as_its_extension_says(tmp_path, given, strength, told):
    found = material(tmp_path, name="paint", extensions={"KHR_materials_specular": given})
    assert surface_of(found.materials[0]).specular == strength
    assert found.notices == told


def test_a_strength_below_0_is_an_error(tmp_path):
    with pytest.raises(MeshError, match="specularFactor: expected a number from 0, got -1"):
        material(tmp_path, extensions={"KHR_materials_specular": {"specularFactor": -1}})


def textured(path, **image):
    """A file whose only picture is `image`; with its bytes given as `data`."""
    file = GltfFile()
    if "data" in image:
        image["bufferView"] = file.view(image.pop("data"))
    file.add("images", **image)
    file.add("textures", source=0)
    file.add("materials", name="wood", pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    file.node(mesh=file.mesh(file.primitive(material=0)))
    with pytest.raises(MeshError) as caught:
        read_gltf_model(file.write(path / "m.glb"))
    return str(caught.value).replace(f"{path}/", "")


def bomb(side: int) -> bytes:
    """A PNG that promises side × side pixels and holds none."""
    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    chunks = b""
    for kind, data in ((b"IHDR", head), (b"IDAT", zlib.compress(b"")), (b"IEND", b"")):
        chunks += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return b"\x89PNG\r\n\x1a\n" + chunks


@pytest.mark.parametrize("side", [60_000, 2**31 - 1])
def test_an_image_bomb_is_refused_by_its_header(tmp_path, side):
    found = textured(tmp_path, data=bomb(side))
    assert found.startswith(
        "m.glb: images[0]: material 'wood', baseColorTexture: image 0 cannot be read: it "
    )


def test_images_that_cannot_be_read_are_named_with_their_material(tmp_path):
    start = "m.glb: images[0]: material 'wood', baseColorTexture: "
    damaged = "cannot be read: it is damaged or of no kind that is read"
    assert textured(tmp_path, data=b"not an image") == f"{start}image 0 {damaged}"
    (tmp_path / "oak.png").write_bytes(b"not an image")
    assert textured(tmp_path, uri="oak.png") == f"{start}'oak.png' {damaged}"
    ktx = b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(60)
    words = "it is KTX2, which is not read (export it as PNG or JPEG)"
    assert textured(tmp_path, data=ktx, name="bark") == f"{start}'bark' cannot be read: {words}"
    assert textured(tmp_path, uri="gone.png") == "m.glb: images[0].uri: 'gone.png' is missing beside it"


@pytest.mark.parametrize("change", ["cut", "head", "middle"])
def test_a_damaged_png_is_found_before_it_is_read_and_nothing_is_printed(tmp_path, capfd, change):
    data = bytearray(png((1, 2, 3, 4), (64, 64)))
    if change == "cut":
        del data[-30:]
    else:
        data[18 if change == "head" else len(data) // 2] ^= 1
    words = "image 0 cannot be read: it is damaged or cut off"
    assert textured(tmp_path, data=bytes(data)).endswith(words)
    assert capfd.readouterr() == ("", "")


def test_a_jpeg_cut_off_is_no_half_grey_picture(tmp_path):
    from PIL import Image

    whole = io.BytesIO()
    Image.effect_noise((64, 64), 90).save(whole, "JPEG")
    data = whole.getvalue()
    assert "it is damaged or cut off" in textured(tmp_path, data=data[: len(data) // 2])


def test_a_picture_cut_off_is_found_when_it_is_read(tmp_path):
    file = GltfFile()
    file.add("images", bufferView=file.view(b"P6 64 64 255\n" + bytes(100)))
    file.add("textures", source=0)
    file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    file.node(mesh=file.mesh(file.primitive(material=0)))
    images = read_gltf_model(file.write(tmp_path / "m.glb")).gltf.images
    with pytest.raises(MeshError, match="image 0 cannot be read"):
        images.pixels(0)


def test_a_webp_stands_before_the_picture_for_others(tmp_path):
    file = GltfFile(extensionsRequired=["EXT_texture_webp"])
    file.add("textures", source=0, extensions={"EXT_texture_webp": {"source": 1}})
    file.add("images", uri="a.png")
    file.add("images", uri="a.webp")
    file.add("materials", emissiveTexture={"index": 0})
    file.node(mesh=file.mesh(file.primitive(material=0)))
    gltf = read_gltf(file.write(tmp_path / "m.glb"))
    assert only(gltf).textures["emission"].image == 1


def test_a_picture_that_is_ktx2_alone(tmp_path):
    file = GltfFile()
    file.add("textures", extensions={"KHR_texture_basisu": {"source": 0}})
    file.add("images", uri="a.ktx2")
    file.add("materials", emissiveTexture={"index": 0})
    file.node(mesh=file.mesh(file.primitive(material=0)))
    with pytest.raises(MeshError, match=r"textures\[0\]: its only image is KTX2, which is not read"):
        read_gltf(file.write(tmp_path / "m.glb"))


def test_lights_are_where_their_nodes_are(tmp_path):
    spot = {
        "type": "spot",
        "intensity": 9,
        "range": 4,
        "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2},
    }
    sun = {"type": "directional", "color": [1, 0.5, 0], "intensity": 683, "name": "sun"}
    file = GltfFile(extensions={"KHR_lights_punctual": {"lights": [sun, spot, {"type": "point"}]}})
    file.node(mesh=file.mesh())
    for number in (1, 0):
        file.node(extensions={"KHR_lights_punctual": {"light": number}}, translation=[number, 2, 3])
    first, second = read_gltf(file.write(tmp_path / "m.glb")).lights
    assert (first.kind, first.reach, first.inner, first.outer) == ("spot", 4, 0.1, 0.2)
    assert (second.kind, second.name, second.color, second.intensity) == (
        "directional",
        "sun",
        (1, 0.5, 0),
        683,
    )
    assert second.reach == np.inf


def test_a_light_that_is_not_there(tmp_path):
    file = GltfFile()
    file.node(extensions={"KHR_lights_punctual": {"light": 0}})
    with pytest.raises(MeshError, match="names light 0, but there are none"):
        read_gltf(file.write(tmp_path / "m.glb"))
