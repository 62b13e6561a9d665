"""Materials and the pictures they use (glTF 2.0, sections 3.8 and 3.9)."""

from __future__ import annotations

import math

from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import Material, TextureUse

UNLIT = "KHR_materials_unlit"
SPECULAR = "KHR_materials_specular"
STRENGTH = "KHR_materials_emissive_strength"
TRANSFORM = "KHR_texture_transform"
WEBP = "EXT_texture_webp"
BASISU = "KHR_texture_basisu"
_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_NEAREST, _NO_MIPMAPS = 9728, (9728, 9729)
_FILTERS = (9728, 9729, 9984, 9985, 9986, 9987)


def read_material(json: Json, entry: Json) -> Material:
    """A material; the images it uses are not read.

    Raises:
        MeshError: a value is not what it must be.
    """
    pbr = entry["pbrMetallicRoughness"]
    color = pbr["baseColorFactor"].numbers(4, (1, 1, 1, 1))
    emission = entry["emissiveFactor"].numbers(3, (0, 0, 0))
    strength = entry.extension(STRENGTH)["emissiveStrength"].number(1.0, low=0)
    slots = {
        "color": (pbr["baseColorTexture"], ""),
        "metallic_roughness": (pbr["metallicRoughnessTexture"], ""),
        "normal": (entry["normalTexture"], "scale"),
        "occlusion": (entry["occlusionTexture"], "strength"),
        "emission": (entry["emissiveTexture"], ""),
    }
    for given in (pbr["baseColorFactor"], entry["emissiveFactor"]):
        for part in given.items():
            part.number(low=0)
    return Material(
        name=entry["name"].text(""),
        color=(color[0], color[1], color[2], color[3]),
        metallic=pbr["metallicFactor"].number(1.0, 0, 1),
        roughness=pbr["roughnessFactor"].number(1.0, 0, 1),
        emission=(emission[0] * strength, emission[1] * strength, emission[2] * strength),
        unlit=bool(entry.extension(UNLIT)),
        alpha_mode=entry["alphaMode"].one_of(("OPAQUE", "MASK", "BLEND"), "OPAQUE"),
        cutoff=entry["alphaCutoff"].number(0.5, low=0),
        double_sided=entry["doubleSided"].flag(),
        textures={name: _texture(json, use, key) for name, (use, key) in slots.items() if use},
        path=entry.path,
        specular=min(entry.extension(SPECULAR)["specularFactor"].number(1.0, low=0), 1.0),
    )


def _texture(json: Json, use: Json, strength: str) -> TextureUse:
    """What a material says of a picture, with the sampler's part."""
    texture = json["textures"].at(use["index"].index(json["textures"].length(), "texture"))
    samplers = json["samplers"]
    sampler = Json(None, texture["sampler"].path, json.file)
    if texture["sampler"]:
        sampler = samplers.at(texture["sampler"].index(samplers.length(), "sampler"))
    change = use.extension(TRANSFORM)
    uv_set = change["texCoord"] if change["texCoord"] else use["texCoord"]
    least = _code(sampler["minFilter"], _FILTERS, 9987)
    return TextureUse(
        image=_image(json, texture),
        uv_set=uv_set.whole(0, high=1),
        wrap=(_wrap(sampler["wrapS"]), _wrap(sampler["wrapT"])),
        nearest=_code(sampler["magFilter"], _FILTERS[:2], 9729) == _NEAREST,
        mipmaps=least not in _NO_MIPMAPS,
        matrix=_transform(change),
        strength=use[strength].number(1.0) if strength else 1.0,
        path=use.path,
    )


def _image(json: Json, texture: Json) -> int:
    """Index of the image a texture shows: a WebP first, as a file that has one says to."""
    count = json["images"].length()
    webp = texture.extension(WEBP)["source"]
    if webp:
        return webp.index(count, "image")
    if not texture["source"] and texture.extension(BASISU):
        raise texture.error("its only image is KTX2, which is not read (export it as PNG, JPEG or WebP)")
    if not texture["source"]:
        raise texture["source"].expected("the index of an image")
    return texture["source"].index(count, "image")


def _wrap(entry: Json) -> str:
    return _WRAPS[_code(entry, tuple(_WRAPS), 10497)]


def _code(entry: Json, codes: tuple[int, ...], default: int) -> int:
    code = entry.whole(default)
    if code not in codes:
        raise entry.expected(" or ".join(map(str, codes)))
    return code


def _transform(change: Json) -> tuple[float, float, float, float, float, float]:
    """KHR_texture_transform as a matrix for u, v with v down.

    Scale, then a turn against the clock as one sees the picture, then the offset: the sign of the
    turn is that of the extension's text and pictures, not of the code fragment beside them.
    """
    offset, scale = change["offset"].numbers(2, (0, 0)), change["scale"].numbers(2, (1, 1))
    angle = change["rotation"].number(0.0)
    c, s = math.cos(angle), math.sin(angle)
    return (c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1])
