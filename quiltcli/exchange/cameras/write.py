"""Camera files: which form a file's name asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from quiltcli.display import Facets, demand_flat
from quiltcli.errors import OutputError, Problem
from quiltcli.exchange.cameras import blender, screens, usd
from quiltcli.exchange.cameras.cameras import Shot, shots
from quiltcli.exchange.cameras.json import json_text
from quiltcli.formats.whole import write_text
from quiltcli.render.setup import Stage


@dataclass(frozen=True)
class Shooting:
    """What every form is written from."""

    facets: Facets
    shots: Sequence[Shot]
    fps: Fraction


FORMS: dict[str, Callable[[Shooting], str]] = {
    ".sgct.json": lambda given: screens.sgct_text(given.facets, given.shots),
    ".json": lambda given: json_text(given.shots),
    ".py": lambda given: blender.script(given.shots, given.fps),
    ".usda": lambda given: usd.usda_text(given.shots, given.fps),
    ".pvx": lambda given: screens.pvx_text(given.facets),
}


def write_cameras(stage: Stage, frames: Sequence[int], path: Path) -> int:
    """Write the cameras of some frames; the number of cameras, each counted once a frame and eye.

    Raises:
        OutputError: a name that asks for no form there is, or a file that cannot be written.
        DisplayError: facets that no camera can make.
        ViewerError: no pose at one of the frames.
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
    demand_flat(stage.facets, "quilt cameras")
    found = shots(stage.facets, stage.views(frames))
    write_text(path, form(Shooting(stage.facets, found, stage.job.fps)))
    return sum(len(shot.cameras) for shot in found)
