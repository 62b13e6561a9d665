"""Points that pixels with viewpoints of their own see, as shading takes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.job import load_scene_file
from quiltcli.ring.hits import EYE, ring_hits
from quiltcli.ring.raster import mesh_of, see
from quiltcli.scene import Scene
from quiltcli.scene.load import load_scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import light_at_points
from quiltcli.visibility.resolve.hits import Hits
from tests.helpers.ring_job import ring_job
from tests.helpers.ring_scenes import RING, pose

SIZE = (48, 48)
LAMPS = """\
lights:
- {type: directional, direction: [-1, -2, -1], color: [1, 1, 1]}
- {type: point, position: [0.25, 0.5, -0.125], color: [0.1, 0.2, 0.3]}
- {type: spot, position: [-0.5, 0.75, 0.25], direction: [0.5, -0.75, -0.25], color: [0.3, 0.2, 0.1]}
- {type: ambient, color: [0.1, 0.1, 0.1]}
"""


def seen_of(folder: Path, lamps: str) -> tuple[Scene, Hits]:
    """A ball in the light of lamps, and what is seen of it."""
    ring_job(folder)
    path = folder / "scene.yaml"
    text = path.read_text()
    path.write_text(text[: text.index("lights:")] + lamps)
    scene = load_scene(load_scene_file(path))
    mesh, where = mesh_of(scene.vertices, scene.triangles), pose(SIZE)
    seen = see(where, RING, mesh, SIZE)
    return scene, ring_hits(where, mesh, scene, seen, slice(None), np.arange(seen.pixel.size))


@pytest.mark.parametrize("channel", ["rgba", "diffuse", "specular"])
@pytest.mark.parametrize("lamps", ["lamps", "shadows", "none"])
def test_light_is_that_of_an_eye_anywhere_whose_rays_these_are(
    tmp_path: Path, channel: str, lamps: str
) -> None:
    """Shading takes places from the eye; here this is the world's middle, and rays are each pixel's own.

    Places, eye and lamps are in steps of 2⁻¹⁶ m, so that from where they are told costs no bit.
    """
    told = {"lamps": LAMPS, "shadows": LAMPS.replace("color", "shadows: true, color", 3), "none": ""}
    scene, hits = seen_of(tmp_path, told[lamps])  # without any, a lamp is at the eye
    assert hits.position is not None
    assert hits.inside > 300
    place = np.round(hits.position * 2**16) / 2**16
    eye = np.array([0.75, 0.5, -0.25])
    here = Shaded(scene, EYE, replace(hits, position=place))
    there = Shaded(scene, eye, replace(hits, position=place - eye[:, None, None]))
    for mine, theirs in zip(light_at_points(channel, here), light_at_points(channel, there), strict=True):
        assert np.array_equal(mine, theirs)
    assert np.ptp(light_at_points("rgba", here)[0]) > 0.1


def test_a_body_without_hollows_throws_no_shadow_on_itself(tmp_path: Path) -> None:
    """Rays to lamps start on the side of a surface from which its pixel sees it, not the world's middle."""
    lamp = "lights:\n- {{type: directional, shadows: {}, direction: [-1, -2, -1], color: [1, 1, 1]}}\n"
    with_them, without = (
        light_at_points("rgba", Shaded(scene, EYE, hits))[0]
        for shadows in ("true", "false")
        for scene, hits in [seen_of(tmp_path, lamp.format(shadows))]
    )
    assert np.array_equal(with_them, without)
    assert with_them.max() > 0.3
