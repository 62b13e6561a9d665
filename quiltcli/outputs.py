"""The files of a render: which there will be, which are there already, and how they are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli import __version__
from quiltcli.draw import Buffers, Stage
from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.exr import (
    facet_attributes,
    facet_path,
    frame_attributes,
    is_complete,
    quilt_path,
    read_exr,
    read_header,
    write_exr,
)
from quiltcli.geometry import IntArray, facet_from_world
from quiltcli.job import dump_job
from quiltcli.layout import write_layout
from quiltcli.unmap import facet_image, page_of
from quiltcli.viewer import Viewer
from quiltcli.wholefile import make_folder, write_text


@dataclass(frozen=True)
class Outputs:
    """Where a job's files go.

    Attributes:
        folder: the output folder.
        job_sha: hash of the job, written into every file.
        rows: facets whose images are written, indices into the layout.
    """

    folder: Path
    job_sha: str
    rows: IntArray


def outputs(stage: Stage, folder: Path, job_sha: str, facet_ids: Iterable[int] | None = None) -> Outputs:
    """The output of a stage into `folder`, of all placed facets or those with these ids."""
    placed = stage.layout.page >= 0
    if facet_ids is not None:
        placed &= np.isin(stage.layout.facet, list(facet_ids))
    return Outputs(folder, job_sha, np.flatnonzero(placed))


def frame_files(stage: Stage, out: Outputs, frame: int) -> list[Path]:
    """Every image of one frame."""
    job = stage.job.output
    pages = [quilt_path(out.folder, page + 1, frame) for page in range(len(stage.layout.pages))]
    facets = [facet_path(out.folder, int(stage.layout.facet[row]), frame) for row in out.rows]
    return pages * job.quilts + facets * job.facets


def frame_is_complete(stage: Stage, out: Outputs, frame: int) -> bool:
    """Whether every image of a frame is there, whole, and made by this job."""
    return all(is_complete(path, out.job_sha, frame) for path in frame_files(stage, out, frame))


def refuse_to_overwrite(stage: Stage, out: Outputs, frames: Iterable[int]) -> None:
    """Raise OutputError if any image of these frames exists; it names the first and counts the rest."""
    present = [path for frame in frames for path in frame_files(stage, out, frame) if path.exists()]
    if present:
        more = f" and {len(present) - 1} more" if len(present) > 1 else ""
        message = f"exists already{more} (use --resume to keep finished frames, --overwrite to replace them)"
        raise OutputError(Problem(message, file=str(present[0])))


def write_settings(stage: Stage, out: Outputs) -> None:
    """Make the folders; write the layout used and the job as resolved."""
    for name, wanted in (("quilt", stage.job.output.quilts), ("facets", stage.job.output.facets)):
        if wanted:
            make_folder(out.folder / name)
    write_layout(stage.layout, out.folder / "layout.yaml")
    write_text(out.folder / "job.yaml", dump_job(stage.job, out.folder))


def write_frame(stage: Stage, out: Outputs, viewer: Viewer, buffers: Buffers, threads: int) -> None:
    """Write the images of one frame, several files at a time.

    Raises:
        OutputError: a file cannot be written; those already written are whole.
    """
    attributes = frame_attributes(viewer, stage.job.fps, out.job_sha, __version__)
    with ThreadPoolExecutor(threads) as pool:
        written = []
        if stage.job.output.quilts:
            pages = range(len(stage.layout.pages))
            written += [pool.submit(_write_page, stage, out, page, buffers, attributes) for page in pages]
        if stage.job.output.facets:
            maps = facet_from_world(stage.layout.origin, stage.layout.du, stage.layout.dv)
            written += [
                pool.submit(
                    _write_facet,
                    stage,
                    out,
                    row,
                    buffers,
                    attributes | facet_attributes(int(stage.layout.facet[row]), maps[row]),
                )
                for row in out.rows.tolist()
            ]
        for each in written:
            each.result()


def _write_page(
    stage: Stage, out: Outputs, page: int, buffers: Buffers, attributes: dict[str, object]
) -> None:
    """Write one page of the quilt."""
    pixels = {name: page_of(flat, stage.layout, page) for name, flat in buffers.items()}
    path = quilt_path(out.folder, page + 1, int(str(attributes["quilt:frame"])))
    write_exr(path, pixels, attributes | {"quilt:page": page + 1}, stage.job.output.compression)


def _write_facet(
    stage: Stage, out: Outputs, row: int, buffers: Buffers, attributes: dict[str, object]
) -> None:
    """Write the image of one facet."""
    pixels = facet_image(buffers, stage.layout, row, stage.owners)
    path = facet_path(out.folder, int(stage.layout.facet[row]), int(str(attributes["quilt:frame"])))
    write_exr(path, pixels, attributes, stage.job.output.compression)


def merge_problems(stage: Stage, out: Outputs, frames: Iterable[int]) -> list[Problem]:
    """What keeps facets from being merged into the quilts of these frames."""
    return [problem for frame in frames for _, problem in _pages_on_disk(stage, out, frame) if problem]


def read_quilt(stage: Stage, out: Outputs, frame: int, buffers: Buffers) -> None:
    """Fill `buffers` with the quilt that is on disk, for facets to be merged into.

    Raises:
        OutputError: a page is missing, damaged, of another size, has other channels, or another job's.
    """
    raise_all(OutputError, merge_problems(stage, out, [frame]))
    for page in range(len(stage.layout.pages)):
        path = quilt_path(out.folder, page + 1, frame)
        image = read_exr(path)
        if missing := sorted(set(buffers) - set(image.channels)):
            raise OutputError(Problem(f"lacks the channels {', '.join(missing)}", str(path)))
        for name in buffers:
            page_of(buffers[name], stage.layout, page)[:] = image.channels[name]


def _pages_on_disk(stage: Stage, out: Outputs, frame: int) -> Iterator[tuple[int, Problem | None]]:
    """Every page of the frame's quilt, with what is wrong with its file; no pixel is read."""
    for page, (width, height) in enumerate(stage.layout.pages.tolist()):
        path = quilt_path(out.folder, page + 1, frame)
        if not path.exists():
            yield (
                page,
                Problem("no such quilt to merge facets into (render the whole frame first)", str(path)),
            )
            continue
        image = read_header(path)
        size = tuple(np.subtract(image.display_window[1], image.display_window[0]) + 1)
        if size != (width, height):
            words = f"is {size[0]}×{size[1]} pixels, the layout's page is {width}×{height}"
            yield page, Problem(words, str(path))
        elif image.attributes.get("quilt:job") != out.job_sha:
            words = "was made by another job; facets can only be merged into the same job's"
            yield page, Problem(words, str(path))
        else:
            yield page, None
