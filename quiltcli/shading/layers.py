"""Surfaces that light may pass: how much of it they hold up, and the light of a pixel through all of them.

From the front, with T the share of light that all layers before have let through, a layer of opacity α and
colour c adds T·α·c, and T becomes T·(1 − α) (Porter & Duff 1984, over). What is `mask` has an α of 0 or 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.opacity import opacity_at, opacity_wants
from quiltcli.shading.shadows import CENTRE, Sample
from quiltcli.visibility.draw import Drawing, Wanted
from quiltcli.visibility.resolve.layers import LayerHits

_ONE = np.float32(1)


@dataclass(frozen=True)
class Layer:
    """Points of a layer, each at a pixel of its own.

    Attributes:
        shaded: what channels are made of.
        weight: (G,) share of the pixel's light that comes from them.
        first: (G,) whether they are the nearest at their pixel that hold up any light.
        inside: (G,) whether they lie in their facet's polygon, not in its bleed.
    """

    shaded: Shaded
    weight: Float32Array
    first: BoolArray
    inside: BoolArray


def layers(
    drawing: Drawing, wanted: Wanted, scene: Scene, eye: FloatArray, sample: Sample = CENTRE
) -> Iterator[Layer]:
    """What of a drawing is seen through something, from the front to the back.

    Args:
        drawing: a batch that is drawn.
        wanted: what the hits shall tell.
        scene: what was drawn.
        eye: (3,) from where it is seen.
        sample: which sample of its pixels was drawn.
    """
    if drawing.soft is not None:
        light = np.ones(drawing.soft.pixel.size, dtype=np.bool_)
        found = drawing.layers(light, wanted | opacity_wants(scene), scene)
        yield from blended(found, light, scene, eye, sample)


def blended(
    found: Iterable[LayerHits],
    light: BoolArray,
    scene: Scene,
    eye: FloatArray,
    sample: Sample = CENTRE,
) -> Iterator[Layer]:
    """Layers with the share of their pixels' light that each has.

    Args:
        found: the hits of all layers, the nearest first; with what `opacity_wants`.
        light: (n,) pixels that light still passes, of which their rows tell; kept up to date.
        scene: what is seen.
        eye: (3,) from where it is seen.
        sample: which sample of its pixels they are.
    """
    passed = np.ones(light.size, dtype=np.float32)
    seen = np.zeros(light.size, dtype=np.bool_)
    for one in found:
        opacity = opacity_at(scene, one.hits.points).reshape(-1)
        through = passed.take(one.row)
        some = opacity > 0
        first = some & ~seen.take(one.row)
        seen[one.row] |= some
        yield Layer(Shaded(scene, eye, one.hits, sample=sample), through * opacity, first, one.inside)
        passed[one.row] = through * (_ONE - opacity)
        light[one.row] = passed.take(one.row) > 0
