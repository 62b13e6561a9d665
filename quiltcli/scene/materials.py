"""What a surface is made of, and the table a scene keeps of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quiltcli.geometry import Float32Array
from quiltcli.job.model import FARTHEST
from quiltcli.scene.scene import ALPHAS, Materials


@dataclass(frozen=True)
class Texture:
    """An image that varies a surface; carried along, not drawn yet.

    Attributes:
        role: what it varies: `color`, `emission`, `roughness`, `metallic`, `opacity`, `normal`, `bump`, …
        path: its file.
        offset: added to texture coordinates (u, v), v up.
        scale: multiplies them first.
        clamp: whether they are held to 0…1 instead of repeating.
        strength: multiplies a bump.
        gain: base and gain: values become base + gain · value.
        channel: the channel to use, empty for what the role asks for.
    """

    role: str
    path: str
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    clamp: bool = False
    strength: float = 1.0
    gain: tuple[float, float] = (0.0, 1.0)
    channel: str = ""


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

    def overridden(self, given: Mapping[str, Any]) -> Surface:
        """This surface with the keys of `given` in place of its own, without images that vary those."""
        changes: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
        if "opacity" in changes and "alpha" not in changes and self.alpha == "opaque":
            changes["alpha"] = "blend"
        changes.setdefault("textures", tuple(t for t in self.textures if t.role not in changes))
        return replace(self, **changes)


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
