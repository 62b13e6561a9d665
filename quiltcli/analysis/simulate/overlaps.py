"""What a camera sees of a display where light of several projectors adds up.

Their facets lie on each other, so none of them hides another: each is looked at by itself, and counts where
it lies on what the ray meets first.
"""

from __future__ import annotations

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.analysis.simulate.picture import Camera, displayed_light, first_triangles
from quiltcli.analysis.simulate.skin import Skin
from quiltcli.geometry import BoolArray, Float32Array, Int32Array
from quiltcli.render.setup import Stage
from quiltcli.scene.bare import bare_scene
from quiltcli.viewer.viewer import Viewer

_SAME = np.float32(0.01)  # of the distance: nets of one screen are so near to each other


def all_light(
    stage: Stage,
    shown: Shown,
    camera: Viewer,
    through: Camera,
    facet: Int32Array,
    how: str,
    skin: Skin,
    triangle: Int32Array,
    depth: Float32Array,
    threads: int,
) -> tuple[Float32Array, BoolArray]:
    """As `displayed_light`, but of projectors everything that lies where a ray meets the display.

    Args:
        stage: display and layout.
        shown: the images, as the camera sees them.
        camera: the camera.
        through: its display of one facet.
        facet: (P,) facet that each ray meets first, −1 for none.
        how: a filter of `lookup.FILTERS`.
        skin: the display's triangles.
        triangle: (P,) which of them each ray meets.
        depth: (P,) how far away.
        threads: batches drawn at a time.
    """
    light, lit = displayed_light(shown, camera, through, facet, how, skin, triangle)
    adding = [row for row, chart in enumerate(stage.facets.charts) if chart is not None and chart.adds]
    if len(adding) < 2:
        return light, lit
    total = np.zeros_like(light)
    some = np.zeros_like(lit)
    met_at = np.where(facet >= 0, depth, np.float32(0))
    for row in adding:
        own = np.flatnonzero(skin.facet == row)
        alone = bare_scene(skin.vertices, skin.triangles[own])
        met, away = first_triangles(stage, camera, through, alone, threads)
        here = (met >= 0) & (np.abs(np.where(met >= 0, away, 0) - met_at) <= _SAME * met_at)
        mine = np.where(here, row, -1).astype(np.int32)
        which = np.where(here, own[np.where(here, met, 0)], -1).astype(np.int32)
        part, shows = displayed_light(shown, camera, through, mine, how, skin, which)
        total[:, shows] += part[:, shows]
        some |= shows
    return np.where(some, total, light).astype(np.float32), some | lit
