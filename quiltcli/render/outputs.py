"""The files of a render: which there will be, which are there already, and how they are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from quiltcli import __version__
from quiltcli.display import lit_facets
from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.exr.digest import is_sealed
from quiltcli.formats.exr.header import plausible_frame
from quiltcli.formats.exr.image import Channel, Image, read_header, write_images
from quiltcli.formats.whole import link_whole, make_folder, remove_file, sync_folder, write_text
from quiltcli.geometry import BoolArray, IntArray, facet_from_world
from quiltcli.images.facets import facet_image, page_of
from quiltcli.images.layers import channel_parts, read_view
from quiltcli.images.metadata import facet_attributes, page_attributes, surface_attributes, viewer_attributes
from quiltcli.images.names import layout_path
from quiltcli.images.window import cropped, frame_size, tight_window, whole_frame
from quiltcli.job import PackSpec, dump_job
from quiltcli.layout import Layout, write_layout
from quiltcli.render.buffers import Buffers
from quiltcli.render.corrections import corrects
from quiltcli.render.report import Clock
from quiltcli.render.setup import Stage
from quiltcli.viewer.view import EYES, View

Attributes: TypeAlias = dict[str, object]


@dataclass(frozen=True)
class Outputs:
    """Where a job's files go.

    Attributes:
        folder: the output folder.
        job_sha: hash of the job, written into every file.
        rows: facets whose images are written, indices into the layout.
        besides: attributes that every image has besides those of a render.
    """

    folder: Path
    job_sha: str
    rows: IntArray
    besides: Attributes = field(default_factory=dict)


def outputs(stage: Stage, folder: Path, job_sha: str, facet_ids: Iterable[int] | None = None) -> Outputs:
    """The output of a stage into `folder`, of all placed facets or those with these ids."""
    placed = stage.layout.page >= 0
    if facet_ids is not None:
        placed &= np.isin(stage.layout.facet, list(facet_ids))
    response = corrects(stage)
    besides: Attributes = {} if response is None else {"quilt:corrections": response.record}
    return Outputs(folder, job_sha, np.flatnonzero(placed), besides)


def view_files(stage: Stage, out: Outputs, view: View) -> list[Path]:
    """Every image of one view."""
    job = stage.job.output
    pages = [page_file(stage, out, page, view) for page in range(len(stage.layout.pages))]
    facets = [facet_file(stage, out, row, view) for row in out.rows.tolist()]
    return pages * job.quilts + facets * job.facets


def page_file(stage: Stage, out: Outputs, page: int, view: View) -> Path:
    """The file of a page (0-based) of a view."""
    return stage.names.page(out.folder, page + 1, *view.file_key)


def facet_file(stage: Stage, out: Outputs, row: int, view: View) -> Path:
    """The file of the image of a facet, by its row in the layout."""
    return stage.names.facet(out.folder, int(stage.layout.facet[row]), *view.file_key)


def image_folders(stage: Stage, out: Outputs) -> list[Path]:
    """The folders that hold images, those of pages first; no folder is for a frame alone."""
    job, layout = stage.job, stage.layout
    eyes = EYES if job.is_stereo and job.output.stereo == "files" else ("",)
    pages = range(1, len(layout.pages) + 1) if job.output.quilts else ()
    facets = layout.facet[out.rows].tolist() if job.output.facets else []
    files = [stage.names.page(out.folder, page, 0, eye) for page in pages for eye in eyes]
    files += [stage.names.facet(out.folder, facet, 0, eye) for facet in facets for eye in eyes]
    return list(dict.fromkeys(path.parent for path in files))


def view_lit(stage: Stage, view: View) -> BoolArray:
    """Facets (F,) whose lit side faces the viewer they belong to."""
    lit = np.zeros(stage.facets.count, dtype=np.bool_)
    for viewer in view.viewers:
        theirs = lit_facets(stage.facets, viewer.eye)
        if viewer.facets is not None:
            theirs &= np.isin(stage.layout.facet, viewer.facets)
        lit |= theirs
    return lit


def refuse_to_overwrite(stage: Stage, out: Outputs, views: Iterable[View]) -> None:
    """Raise OutputError if any image of these views exists; it names the first and counts the rest."""
    present = [path for view in views for path in view_files(stage, out, view) if path.exists()]
    if present:
        more = f" and {len(present) - 1} more" if len(present) > 1 else ""
        message = f"exists already{more} (use --resume to keep finished frames, --overwrite to replace them)"
        raise OutputError(Problem(message, file=str(present[0])))


def write_settings(stage: Stage, out: Outputs) -> None:
    """Make the folders; write the layout used and the job as resolved."""
    for folder in image_folders(stage, out):
        make_folder(folder)
    path, job = layout_path(out.folder), stage.job
    if Path(stage.layout.path) != path:  # else it was read from there
        write_layout(stage.layout, path)
    if isinstance(job.layout, PackSpec):
        # Whoever takes the job up from here has the layout, and need not pack again.
        job = job.model_copy(update={"layout": path})
    write_text(out.folder / "job.yaml", dump_job(job, out.folder))
    sync_folder(out.folder)


@dataclass(frozen=True)
class Drawn:
    """A view and its pixels.

    Attributes:
        view: the view.
        buffers: its pixels.
        mattes: attributes that say what its mattes are of.
    """

    view: View
    buffers: Buffers
    mattes: Attributes = field(default_factory=dict)


def write_views(stage: Stage, out: Outputs, drawn: Sequence[Drawn], threads: int) -> dict[str, float]:
    """Write the images of views that share their files, several at a time; then they are on the disk.

    Returns:
        Seconds by what was done, those of all threads together.

    Raises:
        OutputError: a file cannot be written; those already written are whole.
    """
    total: dict[str, float] = {}
    with ThreadPoolExecutor(threads) as pool:
        work = _work(stage, out, drawn)
        for each in [pool.submit(*task) for task in work]:
            for name, seconds in each.result().items():
                total[name] = total.get(name, 0.0) + seconds
    for folder in sorted({path.parent for path in view_files(stage, out, drawn[0].view)}):
        sync_folder(folder)
    return total


def _work(stage: Stage, out: Outputs, drawn: Sequence[Drawn]) -> Iterator[tuple[Any, ...]]:
    """What there is to do for these views: functions that give seconds, and their arguments."""
    how, layout = stage.job.output, stage.layout
    view = drawn[0].view
    told = (stage.job.fps, out.job_sha, __version__)
    if how.quilts:
        for page in range(len(layout.pages)):
            path = page_file(stage, out, page, view)
            also = {"quilt:page": page + 1} | out.besides
            own = [page_attributes(one.view, *told) | also | one.mattes for one in drawn]
            yield _write_page, stage, path, page, drawn, own
    if not how.facets:
        return
    maps = facet_from_world(layout.origin, layout.du, layout.dv)
    lit = np.logical_or.reduce([view_lit(stage, one.view) for one in drawn])
    apart = ~lit[out.rows] & (how.unlit != "write")
    for row in out.rows[~apart].tolist():
        facet = int(layout.facet[row])
        chart = stage.facets.charts[row] if stage.facets.charts else None
        where = facet_attributes(facet, maps[row]) | out.besides
        if chart is not None:
            where = surface_attributes(facet, chart.record) | out.besides
        own = [viewer_attributes(one.view, facet, *told) | where | one.mattes for one in drawn]
        path = facet_file(stage, out, row, view)
        yield _write_facet, stage, path, row, drawn, own
    if apart.any():
        for rows in _by_size(layout, out.rows[apart]):
            paths = [facet_file(stage, out, row, view) for row in rows]
            if how.unlit == "skip":
                yield _remove, paths
            else:
                own = [page_attributes(one.view, *told) | out.besides | one.mattes for one in drawn]
                yield _write_links, stage, rows[0], drawn, own, paths


def _by_size(layout: Layout, rows: IntArray) -> Iterator[list[int]]:
    """The rows in groups of one raster size."""
    _, group = np.unique(layout.size[rows], axis=0, return_inverse=True)
    for number in range(int(group.max()) + 1):
        yield rows[group.reshape(-1) == number].tolist()


def _write_page(
    stage: Stage, path: Path, page: int, drawn: Sequence[Drawn], attributes: Sequence[Attributes]
) -> dict[str, float]:
    """Write one page of the quilt."""
    clock = Clock()
    pixels = [
        {name: page_of(flat, stage.layout, page) for name, flat in one.buffers.items()} for one in drawn
    ]
    _write(stage, path, drawn, pixels, attributes, clock)
    return clock.seconds


def _write_facet(
    stage: Stage, path: Path, row: int, drawn: Sequence[Drawn], attributes: Sequence[Attributes]
) -> dict[str, float]:
    """Write the image of one facet."""
    clock = Clock()
    with clock.stage("cut"):
        pixels = [facet_image(one.buffers, stage.layout, row, stage.owners) for one in drawn]
    _write(stage, path, drawn, pixels, attributes, clock)
    return clock.seconds


def _write_links(
    stage: Stage, row: int, drawn: Sequence[Drawn], attributes: Sequence[Attributes], paths: list[Path]
) -> dict[str, float]:
    """Write one image for facets of one size that show nothing, and link it to the names of them all."""
    clock = Clock()
    with clock.stage("cut"):
        pixels = [facet_image(one.buffers, stage.layout, row, stage.owners) for one in drawn]
    _write(stage, paths[0], drawn, pixels, attributes, clock)
    with clock.stage("link"):
        for path in paths[1:]:
            link_whole(paths[0], path)
    return clock.seconds


def _remove(paths: list[Path]) -> dict[str, float]:
    """Remove images that an earlier render has left of facets that are now skipped."""
    clock = Clock()
    with clock.stage("link"):
        for path in paths:
            remove_file(path)
    return clock.seconds


def _write(
    stage: Stage,
    path: Path,
    drawn: Sequence[Drawn],
    pixels: Sequence[dict[str, Channel]],
    attributes: Sequence[Attributes],
    clock: Clock,
) -> None:
    """Write one image, or one for each view, as the job wants it."""
    how = stage.job.output
    images: list[Image] = []
    for one, channels, own in zip(drawn, pixels, attributes, strict=True):
        height, width = next(iter(channels.values())).shape
        frame = window = (0, 0), (width - 1, height - 1)
        if how.data_window == "tight":
            with clock.stage("tighten"):
                (x0, y0), (x1, y1) = tight_window(channels)
                # An almost empty file of a huge page would not be believed when it is read.
                if plausible_frame((width, height), (x1 - x0 + 1, y1 - y0 + 1)):
                    window = (x0, y0), (x1, y1)
                    channels = cropped(channels, window)
        image = Image(channels, own, how.compression, window, frame, one.view.part)
        images += channel_parts(image, how.channels) if how.parts == "parts" else [image]
    with clock.stage("compress and store"):
        write_images(path, images)


def merge_problems(stage: Stage, out: Outputs, views: Iterable[View]) -> list[Problem]:
    """What keeps facets from being merged into the quilts of these views."""
    return [problem for view in views for _, problem in _pages_on_disk(stage, out, view) if problem]


def read_quilt(stage: Stage, out: Outputs, view: View, buffers: Buffers) -> None:
    """Fill `buffers` with the quilt that is on disk, for facets to be merged into.

    Raises:
        OutputError: a page is missing, damaged, of another size, has other channels, or another job's.
    """
    raise_all(OutputError, merge_problems(stage, out, [view]))
    for page in range(len(stage.layout.pages)):
        path = page_file(stage, out, page, view)
        image = read_view(path, view.part)
        if missing := sorted(set(buffers) - set(image.channels)):
            raise OutputError(Problem(f"lacks the channels {', '.join(missing)}", str(path)))
        channels = whole_frame(image)
        for name in buffers:
            page_of(buffers[name], stage.layout, page)[:] = channels[name]


def _pages_on_disk(stage: Stage, out: Outputs, view: View) -> Iterator[tuple[int, Problem | None]]:
    """Every page of the view's quilt, with what is wrong with its file; no pixel is read."""
    for page, (width, height) in enumerate(stage.layout.pages.tolist()):
        path = page_file(stage, out, page, view)
        if not path.exists():
            yield (
                page,
                Problem("no such quilt to merge facets into (render the whole frame first)", str(path)),
            )
            continue
        image = read_header(path)
        size = frame_size(image)
        if size != (width, height):
            words = f"is {size[0]}×{size[1]} pixels, the layout's page is {width}×{height}"
            yield page, Problem(words, str(path))
        elif image.attributes.get("quilt:job") != out.job_sha:
            words = "was made by another job; facets can only be merged into the same job's"
            yield page, Problem(words, str(path))
        elif not is_sealed(path):
            words = "is damaged, or another program has changed it (render the whole frame again)"
            yield page, Problem(words, str(path))
        else:
            yield page, None
