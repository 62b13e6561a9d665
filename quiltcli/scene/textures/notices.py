"""What is to be said of textures that are not shown as their files mean them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from quiltcli.errors import counted
from quiltcli.scene.bake import Baked
from quiltcli.scene.materials import Surface
from quiltcli.scene.textures.pool import ROLES


def textures_not_drawn(surfaces: Sequence[Surface]) -> Iterator[str]:
    """Textures of roles that are not drawn, one sentence for all."""
    others = {texture for surface in surfaces for texture in surface.textures if texture.role not in ROLES}
    if others:
        roles = ", ".join(sorted({texture.role for texture in others}))
        yield f"{counted(len(others), 'texture')} not drawn ({roles})"


def textures_without_places(baked: Baked, surfaces: Sequence[Surface]) -> Iterator[str]:
    """Triangles whose textures have no texture coordinates to lie by, one sentence for all."""
    lost = np.zeros(len(baked.triangles), dtype=np.bool_)
    for number, uv in enumerate((baked.uv, baked.uv1)):
        wanted = [any(t.uv_set == number and t.role in ROLES for t in s.textures) for s in surfaces]
        if not any(wanted):
            continue
        nowhere = True if uv is None else np.isnan(uv[:, 0])[baked.triangles].any(axis=1)
        lost |= np.array(wanted)[baked.part] & nowhere
    if lost.any():
        count = counted(int(np.count_nonzero(lost)), "textured triangle")
        yield f"{count} without texture coordinates show one place of the picture"
