"""A picture made for the viewpoint, put on the facets of a display."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from quiltcli.errors import JobError, OutputError, Problem, raise_all
from quiltcli.exchange.elsewhere import Made, MadeOptions, prepare_made, write_made
from quiltcli.exchange.project.lenses import Lens
from quiltcli.exchange.project.master import Master, loaded
from quiltcli.exchange.project.sights import Rays, facet_rays, shown_pixels
from quiltcli.exchange.project.stmap import write_st_maps
from quiltcli.exchange.project.texels import Texels
from quiltcli.exchange.project.tiles import TILE, Window, tile_light
from quiltcli.formats.films import film_pictures
from quiltcli.formats.inputs import is_regular
from quiltcli.geometry import IntArray
from quiltcli.images.facets import page_of, surroundings
from quiltcli.job import JobFile
from quiltcli.render.buffers import Buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.report import FrameRecord
from quiltcli.render.sequence import Listener, Prepared
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import View

Kept: TypeAlias = dict[tuple[tuple[Path, ...], str, int], Texels]


@dataclass(frozen=True)
class Projected:
    """What is common to all tiles of a view."""

    stage: Stage
    lens: Lens
    texels: Texels
    buffers: Buffers


def project(
    job: JobFile,
    master: Master,
    options: MadeOptions,
    listener: Listener | None = None,
    *,
    st_map: bool = False,
) -> list[FrameRecord]:
    """Put a picture on the facets, frame by frame, and write pages and facet images.

    Args:
        job: the job.
        master: the picture.
        options: where to, and which frames.
        listener: told of every finished frame.
        st_map: write maps from pages to the picture, too.

    Raises:
        JobError: what is said of the picture does not go together.
        OutputError: a picture is missing or cannot be read.
        QuiltError: as for a render.
    """
    master.check()
    master = replace(master, fps=float(job.fps))
    if master.stereo and not job.is_stereo:
        raise JobError("--stereo is for two eyes (the job has one; viewer.stereo gives it two)")
    ready = prepare_made(job, options, f"project {master.kind}")
    raise_all(OutputError, _missing(ready, master))
    threads = options.threads or default_threads()
    with ThreadPoolExecutor(threads) as pool:
        kept: Kept = {}
        if ready.views:  # what is wrong with the first picture is told before anything is written
            _lookup(master, kept, ready.views[0])
        records = write_made(ready, partial(_fill, ready.stage, master, pool, kept), threads, listener)
    if st_map:
        write_st_maps(ready, master, options.overwrite)
    return records


def _missing(ready: Prepared, master: Master) -> Iterator[Problem]:
    paths = dict.fromkeys(path for view in ready.views for path in master.files(view.frame))
    missing = [path for path in paths if not is_regular(path)]
    for path in missing[:10]:
        yield Problem("no such picture", file=str(path))
    if len(missing) > 10:
        yield Problem(f"and {len(missing) - 10} pictures more are missing", file=str(missing[0].parent))
    if master.is_film and not missing:
        yield from _beyond(ready, master)


def _beyond(ready: Prepared, master: Master) -> Iterator[Problem]:
    """Frames that come before a film or after it."""
    for path in dict.fromkeys(path for view in ready.views for path in master.files(view.frame)):
        count, rate = film_pictures(path)
        last = max(view.frame for view in ready.views)
        if count and (last - 1) / master.fps >= count / float(rate) - 1e-6:
            words = f"has {count} pictures at {float(rate):g} a second, and none of frame {last}"
            yield Problem(words, file=str(path))
        first = min(view.frame for view in ready.views)
        if first < 1:
            yield Problem(f"begins with frame 1, and has none of frame {first}", file=str(path))


def _fill(
    stage: Stage,
    master: Master,
    pool: ThreadPoolExecutor,
    kept: Kept,
    view: View,
    buffers: Buffers,
) -> Made:
    """Fill the buffers of a view."""
    lens, texels = _lookup(master, kept, view)
    task = Projected(stage, lens, texels, buffers)
    shown = list(pool.map(lambda band: _band(task, *band), list(_bands(stage, view))))
    whole, seen = sum(pixels for pixels, _ in shown), sum(count for _, count in shown)
    dark = 1 - seen / whole if whole else 0.0
    warnings = [f"the picture does not show {dark:.1%} of the lit facets' pixels"] if dark > 0.0005 else []
    warnings += filter(None, [master.doubt(texels.size)])
    warnings += _other_rate(master, view)
    camera = master.camera_of(view, texels.size)
    warnings += [camera.notice(view)] if camera is not None and camera.notice(view) else []
    return Made(seen, tuple(warnings))


def _other_rate(master: Master, view: View) -> list[str]:
    """A sentence where a film has another rate than the job."""
    if not master.is_film:
        return []
    rate = float(film_pictures(master.files(view.frame)[0])[1])
    if abs(rate / master.fps - 1) < 1e-3:
        return []
    return [f"the film has {rate:g} pictures a second, the job {master.fps:g} frames: the nearest before"]


def _lookup(master: Master, kept: Kept, view: View) -> tuple[Lens, Texels]:
    """The picture of a view; one that stays is read once."""
    eye, frame = view.eye if master.stereo else "", view.frame if master.is_film else 0
    key = (master.files(view.frame), eye, frame)
    if key not in kept:
        kept.clear()
        kept[key] = loaded(master, view)[1]
    return master.lens(view, kept[key].size), kept[key]


def _bands(stage: Stage, view: View) -> Iterator[tuple[int, Window, Rays]]:
    """Rows of tiles on the pages: the facet's row in the layout, a window, and its rays."""
    for viewer in view.viewers:
        lit = their_lit_facets(stage.facets, viewer) & (stage.layout.page >= 0)
        rays = facet_rays(stage, viewer)
        for row in np.flatnonzero(lit).tolist():
            whole = Window(*surroundings(stage.layout, row, stage.job.render.bleed + 1))
            for band in whole.tiles(whole.x1 - whole.x0, TILE[1]):
                yield row, band, rays[row]


def _band(task: Projected, row: int, band: Window, rays: Rays) -> tuple[int, int]:
    """Fill a row of tiles; the facet's pixels in it, and how many of them show the picture."""
    layout = task.stage.layout
    page, facet = int(layout.page[row]), layout.facet[row]
    owners = page_of(task.stage.owners, layout, page)
    channels = [page_of(task.buffers[name], layout, page) for name in "RGBA"]
    pixels = seen = 0
    for tile in band.tiles(*TILE):
        spot = slice(tile.y0, tile.y1), slice(tile.x0, tile.x1)
        owner: IntArray = owners[spot]
        inside = owner == facet
        mine = inside | (owner == -facet)
        shown = shown_pixels(rays, *tile.centres())
        if shown is not None:
            inside, mine = inside & shown, mine & shown
        if not mine.any():
            continue
        values = tile_light(tile, rays, task.lens, task.texels).astype(np.float16)
        for c, channel in enumerate(channels):
            np.copyto(channel[spot], values[..., c], where=mine)
        pixels += int(np.count_nonzero(inside))
        seen += int(np.count_nonzero(inside & (values[..., 3] > 0)))
    return pixels, seen
