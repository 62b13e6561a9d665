"""What a job takes of the machine, said before anything is drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from quiltcli.channels import exr_channels
from quiltcli.display import Facets, eyes_apart
from quiltcli.errors import JobError, Problem
from quiltcli.formats.capacity import bytes_text, free_disk, free_memory
from quiltcli.job import JobFile
from quiltcli.job.names import Slot, read_template
from quiltcli.layout import Layout
from quiltcli.layout.owners import owner_bytes

MOST_SIDE = 16384
MOST_PIXELS = 10**9


def demand_memory(job: JobFile, layout: Layout, frames: Sequence[int] | None = None) -> None:
    """Raise unless the quilt's buffers fit into the memory that is free, one view at a time.

    Args:
        job: says which channels there are.
        layout: says how many pixels.
        frames: the frames to draw, the job's by default; of two eyes in one file both are in memory.

    Raises:
        JobError: they do not; the sentence says how much is needed and what would need less.
    """
    pixels, free = int(layout.page_offset[-1]), free_memory()
    sheets = min(view_count(job, frames), 2 if job.is_stereo and job.output.stereo == "parts" else 1)
    needed = pixels * (owner_bytes(layout) + sheets * pixel_bytes(job))
    if free is None or needed <= free:
        return
    pages = "page" if len(layout.pages) == 1 else f"{len(layout.pages)} pages"
    words = f"the quilt's {pages} of {pixels:,} pixels in all would take {bytes_text(needed)} of memory"
    raise JobError(
        layout.problem(
            f"{words}, but {bytes_text(free)} are free (smaller pages or fewer channels take less)"
        )
    )


def pixel_bytes(job: JobFile) -> int:
    """Bytes a pixel of all the channels that the job asks for."""
    return sum(np.dtype(dtype).itemsize for dtype, _ in exr_channels(job.output.channels).values())


def view_count(job: JobFile, frames: Sequence[int] | None = None) -> int:
    """How many views are drawn: one a frame, or one a frame and eye."""
    return len(job.frames if frames is None else frames) * (2 if job.is_stereo else 1)


def page_warnings(layout: Layout) -> Iterator[str]:
    """A sentence for pages that few programs take, and for more pixels than displays have."""
    for page, (width, height) in enumerate(layout.pages.tolist(), 1):
        if max(width, height) > MOST_SIDE:
            yield (
                f"page {page} is {width}×{height} pixels: many cards and players take {MOST_SIDE} a side at"
                " most (layout: size and max_pages make smaller ones)"
            )
    pixels = int(layout.page_offset[-1])
    if pixels > MOST_PIXELS:
        yield f"the pages hold {pixels:,} pixels in all, more than a gigapixel: is the pitch right?"


def number_warnings(job: JobFile, frames: Sequence[int] | None = None) -> Iterator[str]:
    """A sentence where the frame numbers of a sequence grow a digit, which ends it for many players."""
    numbers = job.frames if frames is None else frames
    written = (("page", job.output.quilts), ("facet", job.output.facets))
    digits = min(
        slot.digits
        for kind, wanted in written
        if wanted
        for slot in read_template(getattr(job.output.names, kind), kind).parts
        if isinstance(slot, Slot) and slot.field == "frame"
    )
    if max(map(abs, numbers), default=0) >= 10**digits > min(map(abs, numbers), default=0):
        most = len(str(max(map(abs, numbers))))
        yield (
            f"frame numbers in names grow from {digits} digits to {most}, where many players end"
            f" (output.names with {{frame:0{most}}} keeps them alike)"
        )


def image_bytes(job: JobFile, layout: Layout) -> int:
    """Bytes of a view's images before compression."""
    pixels = int(layout.page_offset[-1]) * job.output.quilts
    pixels += int(layout.size.astype(np.int64).prod(axis=1)[layout.page >= 0].sum()) * job.output.facets
    return pixels * pixel_bytes(job)


def disk_warnings(job: JobFile, layout: Layout, frames: Sequence[int] | None = None) -> Iterator[str]:
    """A sentence when the images, not compressed, are larger than the disk has room for."""
    count = view_count(job, frames)
    needed, free = count * image_bytes(job, layout), free_disk(job.output.directory)
    if free is not None and needed > free:
        yield (
            f"the images of {count:,} view{'s' * (count > 1)} hold {bytes_text(needed)} before compression,"
            f" and {bytes_text(free)} are free in {job.output.directory}"
        )


def method_problems(job: JobFile, facets: Facets) -> list[Problem]:
    """What a job asks for that curved facets do not have: methods that project onto planes."""
    how, source = job.render, job.render.source
    standing = [chart is not None and chart.stands for chart in facets.charts]
    if how.method == "tessellate" and not (standing and all(standing)):
        return [source.problem("method", "tessellate is for displays of curved surfaces and nothing else")]
    if not facets.charts:
        return []
    if how.method not in ("homography", "raycast", "cubemap", "tessellate"):
        words = f"{how.method} projects onto flat facets, and the display has curved ones"
        return [source.problem("method", f"{words} (expected homography, raycast, cubemap or tessellate)")]
    if eyes_apart(facets):
        return _omnistereo_problems(job)
    if how.depth_bits is not None:
        words = "a depth buffer of so many bits belongs to flat facets, and the display has curved ones"
        return [source.problem("depth_bits", f"{words} (expected no such key)")]
    if how.method == "tessellate" and "motion" in job.output.channels:
        words = "tessellate does not tell motion (expected homography or raycast)"
        return [job.output.source.problem("channels", words)]
    return []


def _omnistereo_problems(job: JobFile) -> list[Problem]:
    """What a panorama with an eye for each column asks of a job: two eyes, and rays."""
    how, found = job.render, []
    if not job.is_stereo:
        words = "the display's omnistereo gives each eye a picture, and the job has one eye (expected stereo)"
        found += [spec.source.problem((), words) for spec in job.people.values()]
    wanted = {
        "method": (how.method, ("homography", "raycast")),
        "shutter": (how.shutter, (0,)),
        "depth_bits": (how.depth_bits, (None,)),
        "backface_culling": (how.backface_culling, (False,)),
        "double_sided": (how.double_sided, ("all",)),
    }
    for key, (value, allowed) in wanted.items():
        if value not in allowed:
            shown = str(value).lower() if isinstance(value, bool) else value
            words = f"expected {_shown(allowed)} with omnistereo, which casts rays, got {shown}"
            found.append(how.source.problem(key, words))
    if "motion" in job.output.channels:
        found.append(job.output.source.problem("channels", "motion is not told with omnistereo"))
    return found


def _shown(allowed: tuple[object, ...]) -> str:
    """Values that are allowed, in words."""
    return " or ".join("no such key" if value is None else str(value).lower() for value in allowed)
