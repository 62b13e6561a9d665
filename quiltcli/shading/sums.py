"""Sums over the samples of pixels: light, the share of samples that see the scene, and what they see of it.

Light is summed in the order of the samples, so that a mean does not depend on how a frame is divided. A matte
has slots for as many identities a pixel as the channel has ranks; one is taken by the first that comes, and
those that find none free are left out, as the channel could not hold them anyway.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS, MOST_HALF, RANKS
from quiltcli.geometry import Float32Array, IntArray
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import light_at_points
from quiltcli.shading.mattes import identities_of

_ONE = np.float32(1)
Layers: TypeAlias = Mapping[str, NDArray[Any]]
Background: TypeAlias = "Float32Array | Callable[[IntArray], Float32Array]"


def summed(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the channels that are made of all samples of a pixel."""
    return tuple(name for name in channels if CHANNELS[name].averaged or CHANNELS[name].matte)


def write_alike(shaded: Shaded, channels: tuple[str, ...], buffers: Layers, count: int) -> None:
    """Write what all of `count` samples of some pixels see alike: to the last bit the mean of their sum."""
    hits, whole = shaded.hits, np.float32(count)
    one = np.ones((1, 1), dtype=np.float16)
    for name in channels:
        if CHANNELS[name].matte:
            identity = identities_of(shaded.scene, name, hits.triangle).view(np.float32)
            first, share, *rest = CHANNELS[name].layers
            hits.put(buffers[first], identity[:, None])
            for layer, value in ((share, 1), *((layer, 0) for layer in rest)):
                hits.put(buffers[layer], np.full((1, 1), value, dtype=np.float32))
            continue
        for layer, values in zip(CHANNELS[name].layers, light_at_points(name, shaded), strict=False):
            mean = np.minimum(values, MOST_HALF) * whole / whole
            hits.put(buffers[layer], np.minimum(mean, MOST_HALF).astype(np.float16))
        if name == "rgba":
            hits.put(buffers["A"], one)


def new_sums(channels: tuple[str, ...], zeros: Callable[[Any], NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Memory for `Sums` of channels, by name; `zeros` makes a flat array of a type."""
    wanted: dict[str, Any] = {"cover": np.float32}
    for name in channels:
        if CHANNELS[name].averaged:
            wanted |= {f"{name}.{k}": np.float32 for k in range(3)}
        else:
            wanted |= {f"{name}.identity{k}": np.uint32 for k in range(RANKS)}
            wanted |= {f"{name}.share{k}": np.float32 for k in range(RANKS)}
    return {name: zeros(dtype) for name, dtype in wanted.items()}


class Sums:
    """Sums over the samples of the pixels from one address on."""

    def __init__(self, memory: Mapping[str, NDArray[Any]], channels: tuple[str, ...], first: int = 0) -> None:
        self.channels = channels
        self._memory, self._first = memory, first

    @property
    def size(self) -> int:
        """How many addresses there are."""
        return int(self._memory["cover"].size)

    @property
    def covered(self) -> int:
        """How many pixels see anything."""
        return int(np.count_nonzero(self._memory["cover"]))

    def add(self, shaded: Shaded, weight: Float32Array | None = None, times: int = 1) -> None:
        """Add what is seen at one sample of some pixels, each of them once.

        Args:
            shaded: what is seen.
            weight: (P,) share of the sample's light that comes from there; None for all of it.
            times: of how many samples this is true.
        """
        pixel = shaded.hits.pixel - self._first
        if times > 1:
            weight = np.full(pixel.size, times, dtype=np.float32)
        self._memory["cover"][pixel] += _ONE if weight is None else weight
        for name in self.channels:
            if CHANNELS[name].matte:
                identity = identities_of(shaded.scene, name, shaded.hits.triangle)
                self._note(name, pixel, shaded.hits.drawn(identity[:, None]), weight)
                continue
            for k, values in enumerate(light_at_points(name, shaded)):
                values = shaded.hits.drawn(np.minimum(values, MOST_HALF))
                self._memory[f"{name}.{k}"][pixel] += values if weight is None else weight * values

    def _note(
        self, name: str, pixel: IntArray, identity: NDArray[np.uint32], weight: Float32Array | None
    ) -> None:
        """Count identities (P,) at pixels (P,), where they have any weight."""
        if weight is not None:
            some = weight > 0
            pixel, identity, weight = pixel[some], identity[some], weight[some]
        for k in range(RANKS):
            slot = self._memory[f"{name}.identity{k}"]
            there = slot[pixel]
            mine = (there == identity) | (there == 0)
            slot[pixel[mine]] = identity[mine]
            self._memory[f"{name}.share{k}"][pixel[mine]] += _ONE if weight is None else weight[mine]
            pixel, identity = pixel[~mine], identity[~mine]
            weight = None if weight is None else weight[~mine]
            if not pixel.size:
                return

    def store(
        self,
        buffers: Layers,
        count: int,
        background: Background,
        part: slice | None = None,
    ) -> None:
        """Write the means into the pixels of which any of `count` samples sees something.

        Args:
            buffers: written to.
            count: samples a pixel.
            background: (3,) what the other samples see, or what gives it (3, P) at quilt addresses (P,).
            part: the only pixels that are looked at, from the first address on; None for all.
        """
        part = part or slice(0, self.size)
        pixel = np.flatnonzero(self._memory["cover"][part]) + part.start
        for name in self.channels:
            if CHANNELS[name].matte:
                self._store_matte(buffers, name, pixel, count)
            else:
                self._store_light(buffers, name, pixel, count, background)

    def clear(self, part: slice) -> None:
        """Make some of the sums 0, from the first address on."""
        pixel = np.flatnonzero(self._memory["cover"][part]) + part.start
        for values in self._memory.values():
            values[pixel] = 0

    def _store_light(
        self,
        buffers: Layers,
        name: str,
        pixel: IntArray,
        count: int,
        background: Background,
    ) -> None:
        seen: Float32Array = self._memory["cover"][pixel]
        whole = np.float32(count)
        behind: Float32Array | None = None
        if callable(background) and name == "rgba":
            behind = np.zeros((3, pixel.size), dtype=np.float32)
            some = np.flatnonzero(seen < whole)
            behind[:, some] = background(pixel[some] + self._first)
        for k, layer in enumerate(CHANNELS[name].layers[:3]):
            values: Float32Array = self._memory[f"{name}.{k}"][pixel]
            if behind is not None:
                values += (count - seen) * behind[k]
            elif name == "rgba" and not callable(background):
                values += (count - seen) * background[k]
            values /= whole
            self._put(buffers, layer, pixel, values)
        if name == "rgba":
            seen /= whole
            self._put(buffers, "A", pixel, seen)

    def _store_matte(self, buffers: Layers, name: str, pixel: IntArray, count: int) -> None:
        """Identities and coverage in the order of coverage."""
        share = np.stack([self._memory[f"{name}.share{k}"][pixel] for k in range(RANKS)])
        identity = np.stack([self._memory[f"{name}.identity{k}"][pixel] for k in range(RANKS)])
        order = np.argsort(-share, axis=0, kind="stable")
        share, identity = (np.take_along_axis(table, order, axis=0) for table in (share, identity))
        layers = CHANNELS[name].layers
        for k in range(RANKS):
            buffers[layers[2 * k]][pixel + self._first] = identity[k].view(np.float32)
            buffers[layers[2 * k + 1]][pixel + self._first] = share[k] / np.float32(count)

    def _put(self, buffers: Layers, layer: str, pixel: IntArray, values: Float32Array) -> None:
        buffers[layer][pixel + self._first] = np.minimum(values, MOST_HALF).astype(np.float16)
