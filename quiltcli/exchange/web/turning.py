"""A page to walk around a display with a spinning mirror: what an eye sees of it from all around."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.ring.simulate import EyeOptions, seen_light
from quiltcli.errors import OutputError, Problem
from quiltcli.exchange.web.html import turning_page
from quiltcli.formats.png import png_bytes
from quiltcli.formats.whole import write_text
from quiltcli.images.preview import tone_map
from quiltcli.images.turns import frames_in
from quiltcli.job import load_job
from quiltcli.render.ring.setup import RingStage, set_ring_stage

_SECONDS = 12.0  # once around, while nobody touches it


@dataclass(frozen=True)
class Turning:
    """How the pictures of such a page are taken.

    Attributes:
        views: places around the display.
        size: width and height of a picture, pixels.
        view: how light becomes colour, a name of `images.preview.VIEWS`.
        exposure: stops brighter.
        size_mb: most that the page may be, in megabytes.
    """

    views: int = 72
    size: tuple[int, int] = (400, 300)
    view: str = "aces"
    exposure: float = 0.0
    size_mb: float = 8.0


def turning_view(
    out: Path,
    frames: Sequence[int] | None,
    page: Path | None,
    how: Turning | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Path:
    """Write a page of what an eye on the ring sees from all around, from the output folder of a render.

    Args:
        out: the folder.
        frames: turns to show; the first one that is there when None.
        page: file to write, `out`/view.html when None.
        how: how pictures are taken.
        say: told of every turn.

    Raises:
        OutputError: there is no such turn, or the page gets too large or cannot be written.
    """
    how = how or Turning()
    job = load_job(out / "job.yaml")
    there = frames_in(out)
    for frame in frames or ():
        if frame not in there:
            raise OutputError(Problem(f"has no turn of frame {frame}", str(out)))
    assert job.ring is not None
    chosen, turns = frames or there[:1], []
    stage = set_ring_stage(job, chosen)
    for frame in chosen:
        turns.append({"frame": frame, "pictures": _pictures(stage, out, frame, how)})
        say(f"frame {frame}: {how.views} places")
    where = f"{job.ring.height:g} m high, {job.ring.distance:g} m away"
    data = {"size": list(how.size), "turns": turns, "where": where, "seconds": _SECONDS}
    text = turning_page(f"{out.resolve().parent.name}: a turn of the mirror", data)
    if len(text) > how.size_mb * 1e6:
        words = (
            f"would be {len(text) / 1e6:.1f} MB, more than {how.size_mb:g} (show fewer frames, or --max-mb)"
        )
        raise OutputError(Problem(words, str(out)))
    page = page or out / "view.html"
    write_text(page, text)
    return page


def _pictures(stage: RingStage, out: Path, frame: int, how: Turning) -> list[str]:
    """The pictures of a turn, as text for a page."""
    azimuths = (360 * view / how.views for view in range(how.views))
    height, distance = stage.ring.height, stage.ring.distance
    eyes = (EyeOptions(eye=(turn, height, distance), size=how.size, folder=out) for turn in azimuths)
    return [_source(tone_map(light, how.view, how.exposure)) for light in seen_light(stage, frame, eyes)]


def _source(pixels: Any) -> str:
    """A picture as the source of an image element; grey where it is."""
    grey = pixels[..., 0] if (np.ptp(pixels, axis=-1) == 0).all() else pixels
    return "data:image/png;base64," + base64.b64encode(png_bytes(grey, optimize=True)).decode()
