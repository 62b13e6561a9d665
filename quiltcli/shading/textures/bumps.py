"""Normal maps: shading normals that textures bend."""

from __future__ import annotations

from quiltcli.scene import Scene
from quiltcli.visibility.resolve.hits import Points


def bent(scene: Scene, seen: Points) -> Points:
    """The points with their normals as normal maps bend them; the same points where there are none."""
    return seen
