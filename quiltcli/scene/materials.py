"""What a surface is made of, and the table a scene keeps of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from quiltcli.geometry import Float32Array
from quiltcli.job.model import FARTHEST
from quiltcli.scene.scene import ALPHAS, Materials
from quiltcli.scene.textures.picture import Picture

if TYPE_CHECKING:
    from quiltcli.job.scene import MaterialSpec


@dataclass(frozen=True)
class Texture:
    """A picture that varies a surface.

    Attributes:
        role: what it varies: `color`, `emission`, `roughness`, `metallic`, `normal`, `occlusion`, and what
            is not drawn: `specular`, `displacement`, …
        picture: where its pixels come from.
        matrix: (2 · 3) row by row: u, v of the picture from the vertices' texture coordinates, both with
            v down from the picture's upper edge.
        uv_set: which texture coordinates, 0 or 1.
        wrap: `repeat`, `clamp` or `mirror` along u and v.
        strength: scale of a normal map or a bump, strength of an occlusion map.
        gain: base and gain: values become base + gain · value.
        channel: r, g, b or a where the role takes one number; empty for the first.
        raw: whether its numbers are light as they are, whatever the role.
        opaque: whether its alpha is of no account.
        use: whose texture it is, for messages.
        nearest: whether texels that are seen enlarged are squares of one colour.
    """

    role: str
    picture: Picture
    matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    uv_set: int = 0
    wrap: tuple[str, str] = ("repeat", "repeat")
    strength: float = 1.0
    gain: tuple[float, float] = (0.0, 1.0)
    channel: str = ""
    raw: bool = False
    opaque: bool = False
    use: str = field(default="", compare=False)
    nearest: bool = False


@dataclass(frozen=True)
class Surface:
    """One material; equal surfaces share a row of the scene's table.

    Attributes:
        color: base colour, linear.
        metallic: 0 to 1.
        roughness: 0 to 1.
        emission: emitted radiance, linear.
        unlit: shows exactly `color`.
        specular: 0 to 1, strength of the layer that reflects; metals reflect all the same.
        textures: images that vary it.
        opacity: alpha, 0 to 1.
        alpha: what that means: `opaque`, `mask` or `blend`.
        cutoff: the least alpha that `mask` shows.
        double_sided: whether its back is seen, too, in jobs that ask the files.
    """

    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    metallic: float = 0.0
    roughness: float = 0.5
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    unlit: bool = False
    specular: float = 1.0
    textures: tuple[Texture, ...] = ()
    opacity: float = 1.0
    alpha: str = "opaque"
    cutoff: float = 0.5
    double_sided: bool = True

    def overridden(self, given: Mapping[str, Any], textures: Sequence[Texture] = ()) -> Surface:
        """This surface with the keys of `given` in place of its own, without images that vary those.

        Args:
            given: values by name.
            textures: pictures that vary it from now on.
        """
        changes: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
        if "opacity" in changes and "alpha" not in changes and self.alpha == "opaque":
            changes["alpha"] = "blend"
        gone = {*changes, *(texture.role for texture in textures)}
        kept = tuple(texture for texture in self.textures if texture.role not in gone)
        changes.setdefault("textures", (*kept, *textures))
        return replace(self, **changes)


def textures_of(material: MaterialSpec) -> tuple[Texture, ...]:
    """The pictures that a scene file puts on an object; v is up in its numbers, as in most programs."""
    spec = material.textures
    if spec is None:
        return ()
    (su, sv), (ou, ov) = spec.scale, spec.offset
    return tuple(
        Texture(
            role=role,
            picture=Picture(str(path)),
            matrix=(su, 0.0, ou, 0.0, sv, 1.0 - sv - ov),
            uv_set=spec.uv_set,
            wrap=(spec.wrap, spec.wrap),
            strength=spec.strength if role in ("normal", "bump") else 1.0,
            use=f"material.textures.{role}",
        )
        for role, path in spec.pictures().items()
    )


def material_table(surfaces: Sequence[Surface]) -> Materials:
    """The table of M surfaces, one row each, in float32."""
    return Materials(
        color=_plausible([s.color for s in surfaces]).reshape(-1, 3),
        metallic=_plausible([s.metallic for s in surfaces], 1.0),
        roughness=_plausible([s.roughness for s in surfaces], 1.0),
        emission=_plausible([s.emission for s in surfaces]).reshape(-1, 3),
        unlit=np.array([s.unlit for s in surfaces], dtype=np.bool_),
        specular=_plausible([s.specular for s in surfaces], 1.0),
        textures=tuple(s.textures for s in surfaces),
        opacity=_plausible([s.opacity for s in surfaces], 1.0),
        alpha=np.array([ALPHAS.index(s.alpha) for s in surfaces], dtype=np.int32),
        cutoff=_plausible([s.cutoff for s in surfaces]),
        one_sided=np.array([not s.double_sided for s in surfaces], dtype=np.bool_),
    )


def _plausible(values: Sequence[Any], most: float = FARTHEST) -> Float32Array:
    """Values of mesh files within what light can be: from 0 to `most`, 0 for what is no number."""
    found = np.nan_to_num(np.array(values, dtype=np.float64), nan=0.0, posinf=most)
    return np.clip(found, 0.0, most).astype(np.float32)


def without_pictures(materials: Materials) -> Materials:
    """The table with textures that do not know their files: what they vary is known all the same."""
    textures = (
        tuple(replace(texture, picture=Picture(texture.picture.path)) for texture in own)
        for own in materials.textures
    )
    return replace(materials, textures=tuple(textures))
