"""The sky: a panorama that is seen where nothing else is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from quiltcli.geometry import FloatArray, rotation_deg
from quiltcli.scene.materials import Texture
from quiltcli.scene.textures.picture import Picture
from quiltcli.scene.textures.pool import Textures, TextureStore

if TYPE_CHECKING:
    from quiltcli.job.lights import EnvironmentLight


@dataclass(frozen=True, eq=False)
class Sky:
    """What is seen in every direction, infinitely far away.

    Attributes:
        picture: a panorama as the only image, with all its levels.
        turn: (3, 3) from its directions, as `panorama.cell_directions` has them, to the world's.
        strength: factor of its radiance.
    """

    picture: Textures
    turn: FloatArray
    strength: np.float32


def sky_of(spec: EnvironmentLight, store: TextureStore) -> Sky:
    """The sky of an environment that is seen, filtered as the store's textures are.

    Raises:
        SceneError: its picture takes more memory than textures may.
    """
    texture = Texture(
        role="color", picture=Picture(str(spec.file)), wrap=("repeat", "clamp"), use="the environment"
    )
    picture = TextureStore(store.limits).of([(texture,)])
    assert picture is not None
    return Sky(picture, rotation_deg((0.0, spec.rotate_deg, 0.0)), np.float32(spec.intensity))
