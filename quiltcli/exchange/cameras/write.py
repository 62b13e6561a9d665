"""Camera files: which form a file's name asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from quiltcli.display import Facets
from quiltcli.errors import DisplayError, OutputError, Problem
from quiltcli.exchange.cameras import blender, ndisplay, screens, usd
from quiltcli.exchange.cameras.cameras import Shot, shots
from quiltcli.exchange.cameras.json import json_text
from quiltcli.formats.whole import write_whole
from quiltcli.layout import Layout
from quiltcli.render.setup import Stage


@dataclass(frozen=True)
class Shooting:
    """What every form is written from."""

    facets: Facets
    layout: Layout
    shots: Sequence[Shot]
    fps: Fraction


FORMS: dict[str, Callable[[Shooting], str | bytes]] = {
    ".sgct.json": lambda given: screens.sgct_text(given.facets, given.shots),
    ".json": lambda given: json_text(given.shots),
    ".py": lambda given: blender.script(given.shots, given.fps),
    ".usda": lambda given: usd.usda_text(given.shots, given.fps),
    ".usdc": lambda given: usd.usdc_bytes(given.shots, given.fps),
    ".ndisplay": lambda given: ndisplay.ndisplay_text(given.facets, given.layout, given.shots),
    ".pvx": lambda given: screens.pvx_text(given.facets),
}


def write_cameras(stage: Stage, frames: Sequence[int], path: Path) -> int:
    """Write the cameras of some frames; the number of cameras, each counted once a frame and eye.

    Raises:
        OutputError: a name that asks for no form there is, or a file that cannot be written.
        DisplayError: facets that no camera can make.
        ViewerError: no pose at one of the frames.
        MissingExtraError: `.usdc` is asked for without usd-core.
    """
    form = next((form for suffix, form in FORMS.items() if path.name.lower().endswith(suffix)), None)
    if form is None:
        why = (
            " (glTF has no cameras whose window is off their axis)"
            if path.suffix in (".gltf", ".glb")
            else ""
        )
        raise OutputError(Problem(f"expected a name that ends in {', '.join(FORMS)}{why}", file=str(path)))
    if path.exists():
        raise OutputError(Problem("exists already (remove it, or choose another name)", file=str(path)))
    if stage.facets.curved.any():
        words = "a camera's picture is flat, and no camera makes the image of a curved facet"
        hint = "quilt facet cuts a surface into flat ones, quilt project takes a panorama made at the eye"
        raise DisplayError(Problem(f"{words} ({hint})", stage.facets.path))
    found = shots(stage.facets, stage.views(frames))
    content = form(Shooting(stage.facets, stage.layout, found, stage.job.fps))
    write_whole(path, content.encode() if isinstance(content, str) else content)
    return sum(len(shot.cameras) for shot in found)
