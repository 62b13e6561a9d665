"""What shadows cost: scenes whose lamps have them against the same lamps without."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.scene import Light
from quiltcli.scene.lights import area, directional, point
from quiltcli.shading.lights import prepare_shadows
from tests.benchmarks.race import race, seconds
from tests.benchmarks.stages import DENSITY, cube, stage_for, viewer_of
from tests.benchmarks.textured import PAGE, SCENES

_ABOVE = np.array([0.3, 0.9, 0.4])
"""Where lamps are, from the middle of a display that reaches 1 to all sides."""


def lamps(reach: float, middle: np.ndarray) -> Mapping[str, Sequence[Light]]:
    """Lamps about a display, by what they are called in tables."""
    sun = directional((-0.5, -1, -0.4), (3, 3, 3))
    near, beside = (point((middle + reach * place).tolist(), (3, 3, 3)) for place in (_ABOVE, _ABOVE[::-1]))
    panel = area((middle + reach * _ABOVE).tolist(), (0, -1, 0), (0.3, 0.3), 0, (9, 9, 9), rays=16)
    return {"a sun": (sun,), "a point": (near,), "two points": (near, beside), "a rectangle": (panel,)}


def measure(name: str, rounds: int) -> dict[str, Any]:
    """Times of whole frames by one process."""
    place = cube(DENSITY * PAGE / 8192)
    stage, viewer = stage_for(place, SCENES[name](), (PAGE, PAGE)), viewer_of(place)
    buffers = new_buffers(stage)
    contestants: dict[str, Callable[[], object]] = {}
    counts = {}
    pixels = 0
    for kind, lights in lamps(place.reach, place.middle).items():
        counts[kind] = len(lights)
        for shadows in (False, True):
            lit = _lit(stage, lights, shadows=shadows)
            pixels = draw_frame(lit, viewer, buffers).visible_pixels
            contestants[f"{kind}, {'with' if shadows else 'without'}"] = partial(_drawn, lit, viewer, buffers)
    brief = [kind for kind in contestants if kind.startswith("a rectangle")]
    return {"pixels": pixels, "lamps": counts, "times": race(contestants, rounds, brief=brief)}


def _lit(stage: Stage, lights: Sequence[Light], *, shadows: bool) -> Stage:
    lights = tuple(replace(light, shadows=shadows) for light in lights)
    return replace(stage, scene=replace(stage.scene, lights=lights))


def _drawn(stage: Stage, viewer: Any, buffers: Any) -> None:
    prepare_shadows(stage.scene)  # once a scene that does not move
    draw_frame(stage, viewer, buffers)


def cost(found: Mapping[str, Any], kind: str) -> float:
    """Nanoseconds of processor time that shadows of such lamps take for a pixel and lamp."""
    more, less = (seconds(found["times"], f"{kind}, {how}", "cpu") for how in ("with", "without"))
    return (more - less) / found["pixels"] / found["lamps"][kind] * 1e9
