"""Maps of light from all around: what surfaces of any normal receive, and what mirrors show.

A map is a square grid of places for all directions: the octahedron |x| + |y| + |z| = 1, unfolded around +Y,
its lower faces folded outward (Praun and Hoppe 2003). No angle is needed to look it up. Its outermost places
lie on the square's edges, which are edges of the octahedron: it goes on there without a border.

All of it is sums over the cells of a reduced panorama, in double precision, rounded to half floats: so all
machines have the same maps, and a panorama of one colour has maps of exactly that.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from quiltcli.channels import MOST_HALF
from quiltcli.geometry import Float32Array, FloatArray, rotation_deg, slices
from quiltcli.scene.environment.panorama import cell_directions, cell_sizes, reduced

_DIFFUSE = 49
_COARSE, _FINE = 96, 128
"""Cells around the horizon from which rough and less rough mirrors are made."""
ROUGHNESS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_SIZES = (257, 65, 33, 25, 25, 25)
_AT_ONCE = 256
_PLACES = 4
"""Looks across and down a place of the sharpest map, at what lies around it."""


@dataclass(frozen=True, eq=False)
class Maps:
    """Maps of one environment, in the world's directions.

    Attributes:
        diffuse: (49, 49, 3) irradiance over π by normal.
        mirrors: (n, n, 3) by direction, radiance as mirrors of the roughnesses `ROUGHNESS` show it.
        cells: (64, 128, 3) radiance of a panorama's cells, before it is turned.
        turn: (3, 3) from its directions to the world's.
    """

    diffuse: Float32Array
    mirrors: tuple[Float32Array, ...]
    cells: Float32Array
    turn: FloatArray


def maps_of(picture: Float32Array, rotate_deg: float) -> Maps:
    """The maps of a panorama (H, W, 3) that is turned to the left about the vertical."""
    return turned_maps(picture, rotation_deg((0.0, float(rotate_deg), 0.0)))


def turned_maps(picture: Float32Array, turn: FloatArray) -> Maps:
    """The maps of a panorama (H, W, 3), whose directions a rotation (3, 3) takes to the world's."""
    key = hashlib.sha256(picture.tobytes()).digest()
    return _made(_Panorama(picture, key), tuple(turn.ravel().tolist()))


@dataclass(frozen=True)
class _Panorama:
    """A panorama, known by what is in it."""

    picture: Float32Array
    key: bytes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Panorama) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@lru_cache(maxsize=2)
def _made(panorama: _Panorama, rows: tuple[float, ...]) -> Maps:
    turn = np.array(rows).reshape(3, 3)
    picture = panorama.picture
    coarse, fine = (_Light(reduced(picture, width), width, turn) for width in (_COARSE, _FINE))
    mirrors = [_rounded(_sharp(picture, turn))]
    for roughness, size in zip(ROUGHNESS[1:], _SIZES[1:], strict=True):
        light = fine if roughness < 0.3 else coarse
        mirrors.append(_rounded(light.seen(size, _blurred(roughness))))
    diffuse = _rounded(coarse.seen(_DIFFUSE, lambda cosine: cosine))
    return Maps(diffuse, tuple(mirrors), fine.radiance.astype(np.float32), turn)


@dataclass(frozen=True)
class _Light:
    """The light of a panorama's cells.

    Attributes:
        radiance: (width / 2, width, 3).
        width: cells around the horizon.
        turn: (3, 3) from the panorama's directions to the world's.
    """

    radiance: FloatArray
    width: int
    turn: FloatArray

    def seen(self, size: int, weight: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """The mean (size, size, 3) of what lies in the half space about each texel's direction.

        Args:
            size: of the map.
            weight: of light from directions of these cosines, all above 0.
        """
        ways = cell_directions(self.width).reshape(-1, 3) @ self.turn.T
        angles = np.repeat(cell_sizes(self.width), self.width)
        light = self.radiance.reshape(-1, 3)
        texels = texel_directions(size).reshape(-1, 3)
        result = np.empty((len(texels), 3))
        for part in slices(0, len(texels), _AT_ONCE):
            cosine = texels[part] @ ways.T
            share = np.where(cosine > 0, weight(np.maximum(cosine, 1e-9)), 0) * angles
            result[part] = (share @ light) / share.sum(axis=1, keepdims=True)
        return result.reshape(size, size, 3)


def _blurred(roughness: float) -> Callable[[FloatArray], FloatArray]:
    """What counts in a mirror of that roughness, of light at angles to the mirror's direction.

    The mirror is looked at along its normal (Karis, Real Shading in Unreal Engine 4, 2013): the lobe is
    GGX's of the half vector, times the cosine.
    """
    alpha2 = roughness**4

    def weight(cosine: FloatArray) -> FloatArray:
        half = (1 + cosine) / 2
        spread = half * (alpha2 - 1) + 1
        return np.asarray(cosine / (spread * spread))

    return weight


def _sharp(picture: Float32Array, turn: FloatArray) -> FloatArray:
    """What a perfect mirror shows, the mean about each place."""
    size = _SIZES[0]
    middle = np.linspace(-1, 1, size)[:, None]
    around = ((np.arange(_PLACES) + 0.5) / _PLACES - 0.5) * (2 / (size - 1))
    ways = _directions(np.clip(middle + around, -1, 1).ravel()) @ turn  # back into the panorama's directions
    height, width = picture.shape[:2]
    row = np.arccos(np.clip(ways[..., 1], -1, 1)) / np.pi * height
    column = (np.arctan2(ways[..., 0], -ways[..., 2]) / (2 * np.pi) + 0.5) * width
    found = picture[np.minimum(row.astype(int), height - 1), np.minimum(column.astype(int), width - 1)]
    return np.asarray(found.reshape(size, _PLACES, size, _PLACES, 3).astype(np.float64).mean(axis=(1, 3)))


def texel_directions(size: int) -> FloatArray:
    """Unit directions (size, size, 3) of a map's places, by row (z) and column (x)."""
    return _directions(np.linspace(-1, 1, size))


def _directions(line: FloatArray) -> FloatArray:
    """Unit directions (n, n, 3) of the square's places with these coordinates (n,) in both axes."""
    x, z = np.meshgrid(line, line)
    y = 1 - np.abs(x) - np.abs(z)
    fold_x, fold_z = (1 - np.abs(z)) * np.where(x < 0, -1, 1), (1 - np.abs(x)) * np.where(z < 0, -1, 1)
    ways = np.stack((np.where(y < 0, fold_x, x), y, np.where(y < 0, fold_z, z)), axis=-1)
    return np.asarray(ways / np.linalg.norm(ways, axis=-1, keepdims=True))


def _rounded(texels: FloatArray) -> Float32Array:
    """Values that are half floats'."""
    return np.minimum(texels, MOST_HALF).astype(np.float16).astype(np.float32)
