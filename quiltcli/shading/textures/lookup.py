"""What the textures of a role say at visible points.

Everything that belongs to a triangle (its material, its picture, how that lies on it) is looked up once for
a triangle; places and footprints are worked out once for all textures that lie alike.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array
from quiltcli.scene import Scene
from quiltcli.scene.textures.coordinates import texture_corners
from quiltcli.scene.textures.pool import Lay, Slot, Textures
from quiltcli.shading.textures.filter import look_up
from quiltcli.visibility.resolve.footprints import Edges, Footprint
from quiltcli.visibility.resolve.hits import Points

COLOR, ALPHA = (0, 1, 2), (3,)


def texels_at(
    scene: Scene, seen: Points, role: str, channels: tuple[int, ...], missing: float = 1.0
) -> Float32Array | None:
    """Texels of a role at points.

    Args:
        scene: the scene.
        seen: n groups of k points.
        role: what the textures vary.
        channels: which of red, green, blue and alpha (0 to 3).
        missing: what is there at points without such a texture.

    Returns:
        (channels, n, k); None where no point has such a texture, or nothing is known of the points' edges.
    """
    textures, edges = scene.textures, seen.edges
    if textures is None or edges is None or role not in textures.slots:
        return None
    slot = textures.slots[role]
    image = slot.image.take(scene.material.take(edges.triangle))
    if not (image >= 0).any():
        return None
    key = "texels", slot.lay, id(slot.image), channels, missing
    if key not in edges.kept:
        edges.kept[key] = _looked_up(
            textures, edges, image, footprint_of(scene, edges, slot.lay), channels, missing
        )
    found: Float32Array = edges.kept[key]
    return found


def value_at(scene: Scene, seen: Points, role: str) -> Float32Array | None:
    """The one number (n, k) that textures of a role give, 1 where there is none; None as of `texels_at`."""
    textures = scene.textures
    if textures is None or seen.edges is None or role not in textures.slots:
        return None
    slot = textures.slots[role]
    channels = _channels(textures, slot)
    texels = texels_at(scene, seen, role, channels)
    if texels is None:
        return None
    material = scene.material.take(seen.edges.triangle)
    own = slot.channel.take(material)
    result: Float32Array = texels[channels.index(int(own[0]))]
    if not bool((own == own[0]).all()):
        wanted = seen.edges.each(own)
        result = np.asarray(np.select([wanted == channel for channel in channels], list(texels)))
    gain = slot.gain.take(material, axis=0)
    if bool((gain == (0, 1)).all()):
        return result
    base, factor = seen.edges.each(gain.T)
    image = seen.edges.each(slot.image.take(material))
    return np.asarray(np.where(image >= 0, np.maximum(base + factor * result, np.float32(0)), result))


def footprint_of(scene: Scene, edges: Edges, lay: int) -> Footprint:
    """Where points are in the textures of one lay, u and v within a period, and their footprints there."""
    key = "footprint", lay
    if key not in edges.kept:
        assert scene.textures is not None
        edges.kept[key] = _footprint(scene, edges, scene.textures.lays[lay])
    found: Footprint = edges.kept[key]
    return found


def _footprint(scene: Scene, edges: Edges, lay: Lay) -> Footprint:
    period = lay.period.take(scene.material.take(edges.triangle), axis=0).T
    corners = texture_corners(scene, edges.triangle, lay)
    # Far from 0 there would be fewer bits for what lies between texels.
    corners -= _whole_periods(corners.min(axis=1), period)[:, None]
    found = edges.footprint(corners)
    for values, each in zip((found.u, found.v), edges.each(period), strict=True):
        values -= _whole_periods(values, each)
    return found


def _whole_periods(values: FloatArray, period: FloatArray) -> FloatArray:
    """The greatest multiples of periods not above values; 0 where there is no period."""
    if bool((period == 1).all()):
        return np.floor(values)
    return np.floor(values / np.where(period > 0, period, 1.0)) * period


def _looked_up(
    textures: Textures,
    edges: Edges,
    image: Int32Array,
    place: Footprint,
    channels: tuple[int, ...],
    missing: float,
) -> Float32Array:
    """Texels (channels, n, k) at places, of one image (S,) a triangle."""
    shape = place.u.shape
    u, v = (values.astype(np.float32).reshape(-1) for values in (place.u, place.v))
    slopes = place.slopes.reshape(4, -1)
    if bool((image == image[0]).all()):
        return look_up(textures, image[:1], u, v, slopes, channels).reshape(-1, *shape)
    each = np.ascontiguousarray(np.broadcast_to(edges.each(image), shape)).reshape(-1)
    if bool((image >= 0).all()):
        return look_up(textures, each, u, v, slopes, channels).reshape(-1, *shape)
    some = np.flatnonzero(each >= 0)
    result = np.full((len(channels), u.size), missing, dtype=np.float32)
    result[:, some] = look_up(textures, each[some], u[some], v[some], slopes[:, some], channels)
    return result.reshape(-1, *shape)


def _channels(textures: Textures, slot: Slot) -> tuple[int, ...]:
    """The channels that all roles want of the pictures of a slot: they are looked up together."""
    found: set[int] = set()
    for other in textures.slots.values():
        if other.image is slot.image and other.lay == slot.lay:
            found |= set(other.channel[other.image >= 0].tolist())
    return tuple(sorted(found))
