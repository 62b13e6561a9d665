"""UsdPreviewSurface materials and the networks that vary them (its specification, version 2.6)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from quiltcli.formats.usd.stage import Stage, file_of, library, path_of
from quiltcli.geometry import FloatArray

_DEFAULTS: dict[str, Any] = {
    "diffuseColor": (0.18, 0.18, 0.18),
    "emissiveColor": (0.0, 0.0, 0.0),
    "specularColor": (0.0, 0.0, 0.0),
    "metallic": 0.0,
    "roughness": 0.5,
    "opacity": 1.0,
    "opacityThreshold": 0.0,
    "occlusion": 1.0,
    "normal": (0.0, 0.0, 1.0),
    "useSpecularWorkflow": 0,
    "ior": 1.5,
    "clearcoat": 0.0,
    "displacement": 0.0,
}
_TEXTURED = ("diffuseColor", "emissiveColor", "metallic", "roughness", "opacity", "occlusion", "normal")
_NOT_DRAWN = ("specularColor", "ior", "clearcoat", "displacement", "useSpecularWorkflow")
_WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp", "useMetadata": "repeat"}
_MOST_TRANSFORMS = 16
_PLAIN = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True)
class UvTexture:
    """A picture that an input of a material looks up.

    Attributes:
        file: where it is, inside of a package as `scene.usdz[tex/wood.png]`.
        channel: `rgb`, `r`, `g`, `b` or `a`.
        matrix: 2 × 3, row by row: u, v of the picture from those of the vertices, both with v down.
        uv: name of the primvar of the vertices' texture coordinates.
        wrap: `repeat`, `clamp` or `mirror` along u and v.
        scale: factors of its four channels.
        bias: what is added to them.
        space: `auto`, `raw` or `sRGB`.
    """

    file: str
    channel: str
    matrix: tuple[float, ...] = _PLAIN
    uv: str = "st"
    wrap: tuple[str, str] = ("repeat", "repeat")
    scale: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    space: str = "auto"


@dataclass(frozen=True)
class Material:
    """A UsdPreviewSurface.

    Attributes:
        path: of the material.
        name: its name.
        values: of its inputs by name, those of pictures what they fall back to.
        textures: pictures by the input that looks them up.
        color: primvar that gives the colour, empty for none.
        opacity: likewise.
        notices: what of it is not drawn, as the ends of sentences.
    """

    path: str
    name: str
    values: dict[str, Any] = field(default_factory=dict, hash=False)
    textures: dict[str, UvTexture] = field(default_factory=dict, hash=False)
    color: str = ""
    opacity: str = ""
    notices: tuple[str, ...] = ()

    @property
    def uv_names(self) -> tuple[str, ...]:
        """Primvars of texture coordinates, in the order of the inputs."""
        return tuple(dict.fromkeys(texture.uv for texture in self.textures.values()))


def read_material(stage: Stage, material: Any, time: Any) -> Material | None:
    """A material of `pxr.UsdShade`; None where its surface is no UsdPreviewSurface.

    Raises:
        MeshError: a value is not what it must be, or a picture is named that is not read.
    """
    surface = material.ComputeSurfaceSource()[0]
    if not surface or surface.GetIdAttr().Get() != "UsdPreviewSurface":
        return None
    found = _Network(stage, surface, time)
    values = {name: found.value(name) for name in _DEFAULTS}
    textures, readers = {}, {}
    for name in _TEXTURED:
        shader, output = _source(surface.GetInput(name))
        kind = "" if shader is None else str(shader.GetIdAttr().Get())
        if kind == "UsdUVTexture":
            texture = found.texture(shader, output)
            if texture is None:
                values[name] = found.fallback(shader, output)
            else:
                textures[name] = texture
        elif kind.startswith("UsdPrimvarReader_") and name in ("diffuseColor", "opacity"):
            readers[name] = str(_value(shader.GetInput("varname"), time) or "")
        elif kind:
            found.lost.append(f"{name} from a {kind[:60]}")
    lost = [*found.lost, *(name for name in _NOT_DRAWN if values[name] != _DEFAULTS[name])]
    return Material(
        path=path_of(material),
        name=material.GetPrim().GetName(),
        values=values,
        textures=textures,
        color=readers.get("diffuseColor", ""),
        opacity=readers.get("opacity", ""),
        notices=tuple(dict.fromkeys(lost)),
    )


@dataclass
class _Network:
    """A surface and what stands before it."""

    stage: Stage
    surface: Any
    time: Any
    lost: list[str] = field(default_factory=list)

    def value(self, name: str) -> Any:
        """A number or a colour of the surface, the specification's own where it says nothing."""
        given = _value(self.surface.GetInput(name), self.time)
        default = _DEFAULTS[name]
        if given is None:
            return default
        numbers = self._numbers(self.surface, name, default if isinstance(default, tuple) else (default,))
        return numbers if isinstance(default, tuple) else numbers[0]

    def texture(self, shader: Any, output: str) -> UvTexture | None:
        """A UsdUVTexture by the output that is used; None where it names no file."""
        asset = _value(shader.GetInput("file"), self.time)
        if asset is None or not asset.path:
            return None
        uv, matrix = self._coordinates(shader)
        wraps = [
            str(_value(shader.GetInput(name), self.time) or "useMetadata") for name in ("wrapS", "wrapT")
        ]
        if "black" in wraps:
            self.lost.append("the wrap 'black' (its edge goes on instead)")
        return UvTexture(
            file=self._file(shader, asset),
            channel=output if output in ("r", "g", "b", "a") else "rgb",
            matrix=matrix,
            uv=uv,
            wrap=(_WRAPS.get(wraps[0], "repeat"), _WRAPS.get(wraps[1], "repeat")),
            scale=self._numbers(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
            bias=self._numbers(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
            space=self._space(shader),
        )

    def _space(self, shader: Any) -> str:
        """How the picture's numbers are meant: what the shader says, or the file's attribute."""
        given = _value(shader.GetInput("sourceColorSpace"), self.time)
        said = shader.GetInput("file").GetAttr().GetColorSpace() if given is None else str(given)
        return said if said in ("raw", "sRGB") else "auto"

    def fallback(self, shader: Any, output: str) -> Any:
        """What a texture without a file gives."""
        four = self._numbers(shader, "fallback", (0.0, 0.0, 0.0, 1.0))
        return four[:3] if output == "rgb" else four["rgba".find(output)]

    def _file(self, shader: Any, asset: Any) -> str:
        if "<UDIM>" in asset.path:
            raise self.stage.error(
                shader.GetInput("file").GetAttr(),
                f"is {asset.path!r}: pictures in UDIM tiles are not read (join them to one)",
            )
        return file_of(shader.GetInput("file").GetAttr(), asset)

    def _coordinates(self, shader: Any) -> tuple[str, tuple[float, ...]]:
        """The primvar a texture is looked up by, and how what it says is changed on the way."""
        total = np.eye(3)
        entry = shader.GetInput("st")
        for _ in range(_MOST_TRANSFORMS):
            node, _ = _source(entry)
            kind = "" if node is None else str(node.GetIdAttr().Get())
            if node is None or kind.startswith("UsdPrimvarReader_"):
                name = "st" if node is None else str(_value(node.GetInput("varname"), self.time) or "st")
                return name, _v_down(total)
            if kind != "UsdTransform2d":
                raise self.stage.error(entry.GetAttr(), f"comes from a {kind[:60] or 'shader without an id'}")
            total = total @ self._transform(node)
            entry = node.GetInput("in")
        raise self.stage.error(shader, "has texture coordinates that go round in a circle")

    def _transform(self, node: Any) -> FloatArray:
        """UsdTransform2d: in · scale · rotate + translation, v up."""
        (su, sv), (tu, tv) = (
            self._numbers(node, "scale", (1.0, 1.0)),
            self._numbers(node, "translation", (0, 0)),
        )
        turn = math.radians(self._numbers(node, "rotation", (0.0,))[0])
        c, s = math.cos(turn), math.sin(turn)
        return np.array(((c * su, -s * sv, tu), (s * su, c * sv, tv), (0.0, 0.0, 1.0)))

    def _numbers(self, node: Any, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """An input of finite numbers."""
        value = _value(node.GetInput(name), self.time)
        numbers = np.asarray(default if value is None else value, dtype=np.float64).reshape(-1)
        if numbers.size != len(default) or not np.isfinite(numbers).all():
            words = f"is {value} (expected {len(default)} finite number{'s' * (len(default) > 1)})"
            raise self.stage.error(node.GetInput(name).GetAttr(), words)
        return tuple(numbers.tolist())


def _v_down(matrix: FloatArray) -> tuple[float, ...]:
    """A map (3, 3) of u, v with v up as six numbers for v down, before and after."""
    flip = np.array(((1.0, 0.0, 0.0), (0.0, -1.0, 1.0), (0.0, 0.0, 1.0)))
    return tuple((flip @ matrix @ flip)[:2].ravel().tolist())


def _producers(entry: Any) -> Iterator[Any]:
    if entry:
        yield from entry.GetValueProducingAttributes()


def _source(entry: Any) -> tuple[Any, str]:
    """The shader that an input's value comes from and the name of its output; None where it is a value."""
    shade = library().UsdShade
    for attribute in _producers(entry):
        name, kind = shade.Utils.GetBaseNameAndType(attribute.GetName())
        if kind == shade.AttributeType.Output:
            return shade.Shader(attribute.GetPrim()), str(name)
    return None, ""


def _value(entry: Any, time: Any) -> Any:
    """The value of an input that nothing computes; None without any."""
    shade = library().UsdShade
    for attribute in _producers(entry):
        if shade.Utils.GetBaseNameAndType(attribute.GetName())[1] != shade.AttributeType.Output:
            return attribute.Get(time)
    return None
