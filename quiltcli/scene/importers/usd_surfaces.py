"""UsdPreviewSurface materials as surfaces of a scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from quiltcli.formats.usd.materials import Material, UvTexture
from quiltcli.formats.usd.walk import Piece
from quiltcli.scene.materials import Surface, Texture
from quiltcli.scene.textures.picture import Picture

_DIELECTRIC = 0.04
"""What a surface of the specification's own index of refraction, 1.5, mirrors."""
_ROLES = {
    "diffuseColor": "color",
    "emissiveColor": "emission",
    "metallic": "metallic",
    "roughness": "roughness",
    "opacity": "opacity",
    "occlusion": "occlusion",
    "normal": "normal",
}


def uv_names(piece: Piece) -> tuple[str, ...]:
    """Primvars of the texture coordinates that a mesh's materials look up."""
    found = [name for one in piece.materials if one is not None for name in one.uv_names]
    return tuple(dict.fromkeys(found))


def surface_of(
    material: Material | None,
    names: Sequence[str],
    *,
    colored: bool = False,
    faint: bool = False,
    double_sided: bool = False,
) -> Surface:
    """The surface of a material, or of a mesh without any.

    Args:
        material: the material.
        names: primvars of the two sets of texture coordinates.
        colored: whether the mesh has colours of its own, which a surface without a material shows.
        faint: whether it has opacities below 1.
        double_sided: whether its back is seen.
    """
    if material is None:
        white = {"color": (1.0, 1.0, 1.0)} if colored else {}
        alpha = "blend" if faint else "opaque"
        return Surface(**white, alpha=alpha, double_sided=double_sided)  # type: ignore[arg-type]
    values: dict[str, Any] = {
        "color": (1.0, 1.0, 1.0) if material.color else material.values["diffuseColor"],
        "emission": material.values["emissiveColor"],
        "roughness": min(max(material.values["roughness"], 0.0), 1.0),
        "metallic": min(max(material.values["metallic"], 0.0), 1.0),
        "opacity": min(max(material.values["opacity"], 0.0), 1.0),
        "double_sided": double_sided,
    }
    if material.values["useSpecularWorkflow"]:
        mirrored = max(material.values["specularColor"])
        values |= {"metallic": 0.0, "specular": min(mirrored / _DIELECTRIC, 1.0)}
    threshold = material.values["opacityThreshold"]
    if threshold > 0:
        values |= {"alpha": "mask", "cutoff": threshold}
    elif values["opacity"] < 1 or "opacity" in material.textures or material.opacity:
        values["alpha"] = "blend"
    textures = []
    for name, texture in material.textures.items():
        role = _ROLES[name]
        own = _texture(material, name, texture, names)
        if role in ("color", "emission"):
            values[role], gain = _factor(texture)
            own = replace(own, gain=gain)
        elif role in ("metallic", "roughness"):
            values[role] = 1.0
        elif role == "opacity":
            values["opacity"] = 1.0
        textures.append(own)
    return Surface(**values, textures=tuple(textures))


def lost(materials: Sequence[Material]) -> Iterator[str]:
    """What of materials' textures cannot be drawn as it is meant."""
    for material in materials:
        for name, texture in material.textures.items():
            where = f"material {material.path}, {name}"
            if name in ("diffuseColor", "emissiveColor") and not _simple(texture):
                yield f"{where}: a bias of the picture is drawn the same for red, green and blue"
            if name == "normal" and (texture.scale[1] < 0) != (texture.scale[0] < 0):
                yield f"{where}: green goes down in the picture, and is drawn as if it went up"


def _simple(texture: UvTexture) -> bool:
    return not any(texture.bias[:3]) or (len(set(texture.scale[:3])) == 1 and len(set(texture.bias[:3])) == 1)


def _factor(texture: UvTexture) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """What multiplies a picture of colours, and the base and gain of its values."""
    red, green, blue = texture.scale[:3]
    if not any(texture.bias[:3]):
        return (red, green, blue), (0.0, 1.0)
    return (1.0, 1.0, 1.0), (float(np.mean(texture.bias[:3])), float(np.mean(texture.scale[:3])))


def _texture(material: Material, name: str, texture: UvTexture, names: Sequence[str]) -> Texture:
    """A picture in one of its roles."""
    of_colors = name in ("diffuseColor", "emissiveColor", "normal")
    channel = "r" if texture.channel == "rgb" else texture.channel
    number = "rgba".find(channel)
    # A normal map's scale and bias are 2 and -1; what differs from these makes it flatter or steeper.
    strength = abs(texture.scale[0]) / 2 if name == "normal" and any(texture.bias[:3]) else 1.0
    place = names.index(texture.uv) if texture.uv in names else 0
    return Texture(
        role=_ROLES[name],
        picture=Picture(texture.file),
        matrix=texture.matrix,
        uv_set=min(place, 1),
        wrap=texture.wrap,
        strength=strength,
        gain=(0.0, 1.0) if of_colors else (texture.bias[number], texture.scale[number]),
        channel="" if of_colors else channel,
        use=f"material {material.path}, {name}",
        raw=texture.space == "raw",
        opaque=name == "diffuseColor",
    )
