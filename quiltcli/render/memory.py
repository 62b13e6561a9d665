"""How much memory and disk a run will take, and how it makes do with less.

The rule was measured: Linux, proportional set size of all processes, pages of 1 to 17 million pixels, one and
two workers, scenes of 1 and 48,000 triangles. It was 0.98 to 1.3 times what a run took. The program itself
takes `PROGRAM`, a worker `WORKER`, a triangle `TRIANGLE`; a pixel of the pages takes what its owner and its
channels do, those twice, as a frame is written while the next is drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from quiltcli.channels import CHANNELS, RANKS
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.job import JobFile
from quiltcli.layout import Layout
from quiltcli.layout.owners import owner_bytes
from quiltcli.render.needs import image_bytes, pixel_bytes
from quiltcli.viewer.view import View, by_file

PROGRAM = 90 << 20
WORKER = 30 << 20
TRIANGLE = 300
_FLOAT = 4


@dataclass(frozen=True)
class Share:
    """How a run is divided so that it fits.

    Attributes:
        workers: processes or threads that draw.
        sheets: views that are in memory at a time.
    """

    workers: int
    sheets: int


def estimate(job: JobFile, layout: Layout, views: int, triangles: int, workers: int) -> tuple[int, int]:
    """Bytes of memory that a run takes in all, and of its images before compression.

    Args:
        job: says which channels there are.
        layout: says how many pixels.
        views: how many are drawn.
        triangles: of the scene.
        workers: who draw.
    """
    pixels = int(layout.page_offset[-1])
    flat = pixels * (owner_bytes(layout) + min(views, 2) * pixel_bytes(job) + _sum_bytes(job))
    memory = PROGRAM + workers * WORKER + triangles * TRIANGLE + flat
    return memory, views * image_bytes(job, layout)


def estimate_text(job: JobFile, layout: Layout, views: int, triangles: int, workers: int) -> str:
    """The same in words."""
    memory, disk = estimate(job, layout, views, triangles, workers)
    who = f"{workers} worker{'s' * (workers > 1)}"
    count = f"{views:,} view{'s' * (views != 1)}"
    room = f"{bytes_text(memory)} of memory with {who}"
    return f"takes about {room}, and for {count} up to {bytes_text(disk)} of disk"


def shared_out(job: JobFile, layout: Layout, views: Sequence[View], workers: int) -> Share:
    """As many workers and sheets as fit into free memory: one sheet less first, then fewer workers.

    The owners of the pixels and the scene are in memory already.
    """
    least = max(map(len, by_file(views)), default=1)
    wanted = Share(workers, max(min(len(views), 2), least))
    free = free_memory()
    if free is None:
        return wanted
    pixels = int(layout.page_offset[-1])
    for share in (wanted, *(Share(count, least) for count in range(workers, 1, -1))):
        needed = pixels * (share.sheets * pixel_bytes(job) + _sum_bytes(job)) + share.workers * WORKER
        if needed <= free:
            return share
    return Share(1, least)


def less_words(share: Share, workers: int, sheets: int) -> str:
    """A sentence where memory leaves less than was wanted; empty where it does not."""
    free = free_memory()
    parts = []
    if share.workers < workers:
        parts.append(f"{share.workers} worker{'s' * (share.workers > 1)} instead of {workers}")
    if share.sheets < sheets:
        parts.append("no frame is drawn while another is written")
    if not parts or free is None:
        return ""
    return f"{bytes_text(free)} of memory are left: {', and '.join(parts)}"


def _sum_bytes(job: JobFile) -> int:
    """Bytes a pixel of the sums of samples."""
    if job.render.samples <= 1:
        return 0
    rows = [CHANNELS[name] for name in job.output.channels]
    averaged, mattes = sum(row.averaged for row in rows), sum(row.matte for row in rows)
    return _FLOAT * (1 + 3 * averaged + 2 * RANKS * mattes)
