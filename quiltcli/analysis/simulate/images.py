"""The images a display shows in a frame: those on disk, else drawn here and now."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.geometry import BoolArray, OwnerArray
from quiltcli.images.facets import page_of, quilt_buffers, surroundings
from quiltcli.images.layers import read_view
from quiltcli.images.metadata import is_complete
from quiltcli.images.window import whole_frame
from quiltcli.layout import pixel_owners
from quiltcli.projection.curved import chart_views
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer

_ROWS = 256


def shown_images(
    stage: Stage, view: View, folder: Path, job_sha: str, threads: int, viewer: Viewer | None = None
) -> tuple[Shown, str]:
    """The images of one frame.

    Args:
        stage: display, layout and scene; its job's channels hold `rgba`.
        view: the view.
        folder: where a render of the job leaves its files.
        job_sha: hash a file must have to be taken for this job's.
        threads: batches drawn at a time.
        viewer: whose facets are shown; the view's first by default.

    Returns:
        The images, and where they came from in words.
    """
    viewer = viewer or view.viewer
    lit = their_lit_facets(stage.facets, viewer) & (stage.layout.page >= 0)
    buffers: Buffers | None = None
    owners: OwnerArray = stage.owners
    if (buffers := _quilts(stage, view, folder, job_sha)) is not None:
        source = f"read from {folder / 'quilt'}"
    elif (buffers := _facets(stage, lit, view, folder, job_sha)) is not None:
        source = f"read from {folder / 'facets'}"
        owners = pixel_owners(stage.layout)  # a facet's image ends at its polygon
    else:
        buffers, source = new_buffers(stage), "drawn for this picture"
        draw_moment(moment(stage, view), buffers, threads)
    return Shown(
        stage.facets, stage.layout, lit, buffers, lit_owners(stage, viewer, owners), viewer.eye
    ), source


def lit_owners(stage: Stage, viewer: Viewer, owners: OwnerArray) -> OwnerArray:
    """Whose every quilt pixel is, those of curved facets that are dark for the viewer nobody's.

    What lies between a pixel that shows an image and one that is dark, as on the rim of a sphere, is of the
    former alone.
    """
    layout, result = stage.layout, owners
    eye, axes = viewer.eye, viewer.camera_from_world
    for row, view in enumerate(chart_views(stage.facets.charts, layout, eye, axes, viewer.head)):
        if view is None or layout.page[row] < 0 or not view.chart.stands:
            continue
        result = owners.copy() if result is owners else result
        x0, y0, x1, y1 = surroundings(layout, row, stage.job.render.bleed + 1)
        pixels = page_of(result, layout, int(layout.page[row]))[:, x0:x1]
        x = np.arange(float(x0), float(x1)) + 0.5
        for first in range(y0, y1, _ROWS):
            rows = pixels[first : min(first + _ROWS, y1)]
            y = np.arange(float(first), float(first + len(rows))) + 0.5
            lit = view.lit(x, y[:, None])
            rows[(np.abs(rows) == layout.facet[row]) & ~lit] = 0
    return result


def _quilts(stage: Stage, view: View, folder: Path, job_sha: str) -> Buffers | None:
    """The quilt on disk, None where a page is missing or not this job's."""
    paths = [stage.names.page(folder, page + 1, *view.file_key) for page in range(len(stage.layout.pages))]
    if not all(is_complete(path, job_sha, view.frame) for path in paths):
        return None
    buffers = {name: np.zeros(stage.owners.size, dtype=np.float16) for name in "RGB"}
    for page, path in enumerate(paths):
        channels = whole_frame(read_view(path, view.part))
        if any(name not in channels for name in "RGB"):
            return None
        for name, flat in buffers.items():
            page_of(flat, stage.layout, page)[:] = channels[name]
    return buffers


def _facets(stage: Stage, lit: BoolArray, view: View, folder: Path, job_sha: str) -> Buffers | None:
    """The quilt put together from the lit facets' images on disk, None where one is missing."""
    rows = np.flatnonzero(lit).tolist()
    paths = {row: stage.names.facet(folder, int(stage.layout.facet[row]), *view.file_key) for row in rows}
    if not paths or not all(is_complete(path, job_sha, view.frame) for path in paths.values()):
        return None
    images = {}
    for row, path in paths.items():
        channels = whole_frame(read_view(path, view.part))
        if any(name not in channels for name in "RGB"):
            return None
        images[row] = {name: channels[name] for name in "RGB"}
    return quilt_buffers(images, stage.layout, stage.owners)
