"""ST maps from pages to the picture that is projected, for compositors: where each pixel looks it up."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.exchange.project.master import Master, loaded
from quiltcli.exchange.project.sights import facet_rays, shown_pixels
from quiltcli.exchange.project.tiles import Window, places
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import Float32Array
from quiltcli.images.facets import page_of, surroundings
from quiltcli.images.names import quilt_path
from quiltcli.render.sequence import Prepared
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import View


def write_st_maps(ready: Prepared, master: Master, overwrite: bool) -> list[Path]:
    """Write `st_map/page_01.0001.exr` and so on beside the images; return the files.

    R and G are across and up the picture, 0 to 1, the way compositors have it: (x + 0.5) / width at the
    middle of the texel x. A is 1 where the picture shows the pixel.

    Raises:
        JobError: a cube's faces have no such map.
        OutputError: a file cannot be written, or is in the way.
    """
    if master.kind == "cubemap":
        raise JobError("a cube map has six pictures, and no map to one (expected no --st-map)")
    layout = ready.stage.layout
    written = []
    for view in ready.views:
        lens_size = loaded(master, view)[1].size
        for page, image in enumerate(_maps(ready.stage, master, view, lens_size)):
            folder = ready.out.folder / "st_map"
            path = folder / quilt_path(folder, page + 1, *view.file_key).name
            if path.exists() and not overwrite:
                raise OutputError(Problem("exists already (use --overwrite to replace it)", file=str(path)))
            make_folder(folder)
            width, height = layout.pages[page].tolist()
            channels = {name: image[c].reshape(height, width) for c, name in enumerate("RGBA")}
            write_exr(path, channels, {"quilt:frame": view.frame, "quilt:page": page + 1})
            written.append(path)
    return written


def _maps(stage: Stage, master: Master, view: View, size: tuple[int, int]) -> list[Float32Array]:
    """Maps (4, pixels) of all pages."""
    layout = stage.layout
    lens = master.lens(view, size)
    flat = np.zeros((4, stage.owners.size), dtype=np.float32)
    for viewer in view.viewers:
        rays = facet_rays(stage, viewer)
        lit = their_lit_facets(stage.facets, viewer) & (layout.page >= 0)
        for row in np.flatnonzero(lit).tolist():
            window = Window(*surroundings(layout, row, stage.job.render.bleed + 1))
            spot = slice(window.y0, window.y1), slice(window.x0, window.x1)
            page = int(layout.page[row])
            mine = np.abs(page_of(stage.owners, layout, page)[spot]) == layout.facet[row]
            shown = shown_pixels(rays[row], *window.centres())
            mine = mine if shown is None else mine & shown
            place = places(window, rays[row], lens)
            values = (place.x / size[0], 1 - place.y / size[1], np.zeros_like(place.x), place.inside)
            for channel, value in zip(flat, values, strict=True):
                np.copyto(page_of(channel, layout, page)[spot], value, where=mine, casting="unsafe")
    return [flat[:, first:last] for first, last in pairwise(layout.page_offset)]
