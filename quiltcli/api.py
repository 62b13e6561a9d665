"""What Python programs may rely on: the names that `import quiltcli` offers.

    import quiltcli

    setup = quiltcli.set_up(quiltcli.load_job("job.yaml"))
    for drawn in quiltcli.draw(setup, frames=[1, 2]):
        rgba = drawn.stack(1)             # facet 1, (H, W, 4)

Everything else in the package may change from one version to the next; these names, their arguments and
the attributes they document do not, but for additions (docs/contributing.md says when). Nothing here
prints, and nothing but `render_job`, `write_layout` and `write_picture` writes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.display import Facets, load_display
from quiltcli.errors import JobError, QuiltError
from quiltcli.formats.exr.image import Image
from quiltcli.images.facets import facet_image, page_of
from quiltcli.images.layers import read_view
from quiltcli.images.preview import tone_map, write_png
from quiltcli.job import JobFile, load_display_file, load_job, pack_spec
from quiltcli.job.shipped import shipped
from quiltcli.layout import Layout, read_layout, write_layout
from quiltcli.render.buffers import new_buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.report import FrameRecord
from quiltcli.render.sequence import RenderOptions
from quiltcli.render.sequence import render as render_job
from quiltcli.render.setup import Stage as Setup
from quiltcli.render.setup import set_stage
from quiltcli.viewer.view import View, views_of
from quiltcli.viewer.viewer import Viewer

__all__ = [
    "Drawn",
    "Facets",
    "FrameRecord",
    "Image",
    "JobFile",
    "Layout",
    "QuiltError",
    "RenderOptions",
    "Setup",
    "View",
    "Viewer",
    "draw",
    "load_facets",
    "load_job",
    "pack_layout",
    "read_image",
    "read_layout",
    "render_job",
    "set_up",
    "shipped",
    "tone_map",
    "viewers",
    "write_layout",
    "write_picture",
]

Pixels: TypeAlias = NDArray[Any]
Job: TypeAlias = JobFile | Path | str


def load_facets(display: Path | str) -> Facets:
    """The facets of a display file.

    Raises:
        QuiltError: with every problem of the file or its mesh.
    """
    return load_display(load_display_file(display))


def pack_layout(facets: Facets, method: str = "auto", **wishes: Any) -> Layout:
    """Find a place in the quilt for every facet of a display.

    Args:
        facets: the display.
        method: the packing method.
        wishes: what else `layout` of a job may say: `size`, `padding` and so on.

    Raises:
        QuiltError: a wish makes no sense, or the facets do not fit.
    """
    from quiltcli.layout.packing import pack

    return pack(facets, pack_spec(method=method, **wishes))


def set_up(job: Job) -> Setup:
    """Load what a job names and prepare what all its frames share: `facets`, `layout`, `scene` of the result.

    Packs the facets, if the job names no layout and no earlier render has left one in its output folder.

    Args:
        job: a job, or the file of one.

    Raises:
        QuiltError: a file is wrong.
    """
    return set_stage(_job(job))


def viewers(job: Job, frames: Iterable[int] | None = None) -> list[Viewer]:
    """Who looks, from where and which way, in some frames of a job; in all of them by default.

    Raises:
        ViewerError: the path gives no usable pose in one of the frames.
    """
    job = _job(job)
    views = views_of(job, job.frames if frames is None else frames)
    return [viewer for view in views for viewer in view.viewers]


@dataclass(frozen=True, eq=False)
class Drawn:
    """The pictures of one frame for one eye, as a render would write them.

    Attributes:
        view: frame, eye and viewers.
        record: counts, times and warnings, as in `report.json`.
        layout: where the facets are on the pages.
        pages: for each page of the quilt, name → (H, W) of every EXR channel.
    """

    view: View
    record: FrameRecord
    layout: Layout
    pages: tuple[dict[str, Pixels], ...]
    _buffers: dict[str, Pixels]
    _owners: NDArray[np.integer[Any]]

    def facet(self, facet: int) -> dict[str, Pixels]:
        """A facet's own image by its id: name → (H, W), a copy; transparent outside its polygon.

        Raises:
            JobError: there is no such facet.
        """
        rows = np.flatnonzero(self.layout.facet == facet)
        if not rows.size:
            raise JobError(f"there is no facet {facet} (the layout has 1 to {self.layout.facet.max()})")
        return facet_image(self._buffers, self.layout, int(rows[0]), self._owners)

    def stack(self, facet: int, channels: Sequence[str] = ("R", "G", "B", "A")) -> Pixels:
        """Channels of a facet's image as one array (H, W, n), of a type that holds them all."""
        image = self.facet(facet)
        return np.stack([image[name] for name in channels], axis=-1)


def draw(what: Setup | Job, frames: Iterable[int] | None = None, *, threads: int = 0) -> Iterator[Drawn]:
    """Draw frames in memory, one after another; the pixels are those that `quilt render` writes.

    Args:
        what: from `set_up`, which a second call need not do again; or a job, or the file of one.
        frames: frame numbers, the job's by default.
        threads: threads that draw; 0 takes every core. The pixels do not depend on it.

    Yields:
        A frame, once for each eye; its arrays are its own.

    Raises:
        QuiltError: a file is wrong, or a viewer stands where no picture can be.
    """
    setup = what if isinstance(what, Setup) else set_up(what)
    job = setup.job
    views = setup.views(job.frames if frames is None else frames)
    for view in views:
        buffers = new_buffers(setup)
        record = draw_moment(moment(setup, view), buffers, threads or default_threads())
        pages = tuple(
            {name: page_of(flat, setup.layout, page) for name, flat in buffers.items()}
            for page in range(len(setup.layout.pages))
        )
        yield Drawn(view, record, setup.layout, pages, buffers, setup.owners)


def read_image(path: Path | str) -> Image:
    """An EXR file of one part, or of parts by channel: its `channels` (H, W) by name and its `attributes`.

    Raises:
        OutputError: it cannot be read.
    """
    return read_view(Path(path))


def write_picture(path: Path | str, rgb: Pixels, view: str = "aces", exposure: float = 0.0) -> None:
    """Write linear light (H, W, 3) as a PNG, as `quilt preview` does: arguments as for `tone_map`."""
    write_png(Path(path), rgb, view, exposure)


def _job(job: Job) -> JobFile:
    """A job, read if need be."""
    return job if isinstance(job, JobFile) else load_job(job)
