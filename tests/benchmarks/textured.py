"""What textures cost: scenes covered with one picture against the same scenes in one colour."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.scene import Scene
from quiltcli.scene.materials import Texture
from quiltcli.scene.textures.picture import Picture
from quiltcli.scene.textures.pool import TextureLimits, TextureStore
from tests.benchmarks import meshes, opengl
from tests.benchmarks.race import race, seconds
from tests.benchmarks.stages import DENSITY, binned, cube, stage_for, viewer_of

PAGE = 2048
"""Pixels of the quilt from side to side."""
LARGE = 2 * PAGE
"""The same of a CAVE, on which samples that see one triangle count more than those on rims."""
_TEXELS = 2048
_REPEAT = 1.5  # metres that the picture spans


SCENES: Mapping[str, Callable[[], meshes.Mesh]] = {"mixed": meshes.mixed, "room": meshes.room}


def measure(name: str, rounds: int, scratch: Path) -> dict[str, Any]:
    """Times of whole frames by one process, and of OpenGL's draws of the same picture."""
    place = cube(DENSITY * PAGE / 8192)
    plain = stage_for(place, SCENES[name](), (PAGE, PAGE))
    viewer = viewer_of(place)
    picture = _picture()
    Image.fromarray(picture).save(scratch / "picture.png")
    stages = {"plain": plain, "plain, 16 samples": _sampled(plain, 16)}
    for most in (1, 16):
        covered = _covered(plain, scratch / "picture.png", most)
        kind = "trilinear" if most == 1 else "anisotropic"
        stages[kind] = covered
        stages[f"{kind}, 16 samples"] = _sampled(covered, 16)
    buffers = new_buffers(plain)
    pixels = draw_frame(plain, viewer, buffers).visible_pixels
    with ExitStack() as ends:
        contestants: dict[str, Callable[[], object]] = {
            kind: partial(draw_frame, stage, viewer, buffers) for kind, stage in stages.items()
        }
        if not opengl.renderer().startswith("-"):
            frame = binned(stages["trilinear"], viewer).frame
            quilt = opengl.Quilt(stages["trilinear"], frame, culling=False, picture=picture)
            ends.enter_context(quilt)
            contestants["opengl plain"] = partial(quilt.draw, "ggx")
            contestants["opengl trilinear"] = partial(quilt.draw, "textured")
        if name == "room":
            wide = cube(DENSITY * LARGE / 8192)
            large = stage_for(wide, SCENES[name](), (LARGE, LARGE))
            eye, sheets = viewer_of(wide), new_buffers(large)
            contestants["large"] = partial(draw_frame, large, eye, sheets)
            contestants["large, 16 samples"] = partial(draw_frame, _sampled(large, 16), eye, sheets)
        brief = [kind for kind in contestants if "samples" in kind]
        times = race(contestants, rounds, cold=brief, brief=brief)
    return {"pixels": pixels, "times": times}


def _sampled(stage: Stage, samples: int) -> Stage:
    render = stage.job.render.model_copy(update={"samples": samples})
    return replace(stage, job=stage.job.model_copy(update={"render": render}))


def _covered(stage: Stage, path: Path, most: int) -> Stage:
    """The stage with its scene's only material under a picture, along the axes of its boxes."""
    scene = stage.scene
    textures = ((Texture("color", Picture(str(path)), use="room"),),)
    pool = TextureStore(TextureLimits(anisotropy=most)).of(textures)
    return replace(stage, scene=replace(scene, uv=_along_axes(scene), textures=pool))


def _along_axes(scene: Scene) -> NDArray[np.float64]:
    """Texture coordinates (V, 2): the two axes that a side of a box lies along."""
    facing = np.abs(scene.normals).argmax(axis=1)
    rows = np.arange(len(facing))[:, None]
    along = np.array([(2, 1), (0, 2), (0, 1)])[facing]
    return np.asarray(scene.vertices[rows, along] / _REPEAT)


def _picture() -> NDArray[np.uint8]:
    """Boards and grain, so that every level has something to show."""
    dice = np.random.default_rng(3)
    y, x = np.mgrid[0:_TEXELS, 0:_TEXELS]
    boards = 120 + 50 * np.sin(x / 41) + 30 * np.sin(y / 7 + 3 * np.sin(x / 90))
    grain = dice.normal(0, 12, (_TEXELS, _TEXELS, 1))
    return np.clip(boards[..., None] * (1, 0.8, 0.6) + grain, 0, 255).astype(np.uint8)


def nanoseconds(found: Mapping[str, Any], name: str) -> float:
    """Processor time of a whole frame for a visible pixel; not a number for what was left out."""
    return seconds(found["times"], name, "cpu") / found["pixels"] * 1e9
