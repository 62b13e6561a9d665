"""How textures cover materials: what of their light can be known at few points, and what cannot."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.scene import Scene

Kinds: TypeAlias = NDArray[np.uint8]

PLAIN = 0
"""No textures."""
UNLIT = 1
"""A texture is all there is to see: no light."""
BASE = 2
"""Textures multiply what light does: diffuse light, or that from everywhere, or are added to it."""
FULL = 3
"""Textures change how light is reflected: it has to be worked out at every pixel."""


@lru_cache(maxsize=2)
def covers_of(scene: Scene) -> Kinds | None:
    """How each material (M,) is covered; None where no texture is drawn."""
    textures, materials = scene.textures, scene.materials
    if textures is None:
        return None
    # What a surface holds up of light from behind makes no difference to its own.
    has = {role: slot.image >= 0 for role, slot in textures.slots.items() if role != "opacity"}
    none = np.zeros(materials.unlit.shape, dtype=np.bool_)
    result = np.full(none.shape, PLAIN, dtype=np.uint8)
    for role in has:
        result[has[role]] = BASE
    # What a metal reflects has its base's colour.
    colored_metal = has.get("color", none) & (materials.metallic > 0)
    full = colored_metal | has.get("metallic", none) | has.get("roughness", none) | has.get("normal", none)
    result[full] = FULL
    result[materials.unlit & (result != PLAIN)] = UNLIT
    return result
