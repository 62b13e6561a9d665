"""What is verified: the quilt on disk, or one drawn for the purpose in memory."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.channels import empty_buffers
from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.images.metadata import is_complete
from quiltcli.job import job_sha256
from quiltcli.render.buffers import Buffers
from quiltcli.render.methods import draw_view
from quiltcli.render.outputs import outputs, read_quilt
from quiltcli.render.setup import Stage
from quiltcli.viewer.view import View

_DRAWN = ("Z", "triangle")


@dataclass(frozen=True)
class Images:
    """The channels of a quilt that are held against rays.

    Attributes:
        words: where they come from, for the reader.
        channels: flat `Z` (pixels,) float32; `triangle` uint32 and `A` half where the images have them.
    """

    words: str
    channels: Buffers

    def depth(self, address: IntArray) -> FloatArray:
        """Depths (P,) in metres, +inf where nothing shows; what is no depth at all counts as 0."""
        z = self.channels["Z"][address].astype("f8")
        return np.where(np.isfinite(z) | (z == np.inf), z, 0.0)

    def triangle(self, address: IntArray) -> IntArray | None:
        """Triangles (P,), −1 for none; None where the images do not tell."""
        if "triangle" not in self.channels:
            return None
        return self.channels["triangle"][address].astype("i8") - 1

    def alpha_covers(self, address: IntArray) -> BoolArray | None:
        """Whether A says that the scene shows (P,); None where the images do not tell."""
        return self.channels["A"][address] > 0 if "A" in self.channels else None


def find_images(stage: Stage, view: View, folder: Path, threads: int, redraw: bool) -> Images:
    """The quilt in `folder` if it is whole and made by this job, else one drawn in memory.

    Raises:
        OutputError: the quilt changed under our hands.
    """
    channels = stage.job.output.channels
    out = outputs(stage, folder, job_sha256(stage.job))
    pages = [stage.names.page(folder, page + 1, *view.file_key) for page in range(len(stage.layout.pages))]
    if redraw:
        return draw_images(stage, view, threads)
    if not all(is_complete(path, out.job_sha, view.frame) for path in pages):
        return draw_images(stage, view, threads, f" ({folder} has no quilt of this frame by this job)")
    if "Z" not in channels:
        return draw_images(stage, view, threads, f" (the quilt in {folder} has no Z)")
    # With several samples a pixel, A is a share of them and Z is still the centre's.
    alpha = () if stage.job.render.averages else ("rgba",)
    wanted = [name for name in channels if name in (*_DRAWN, *alpha)]
    buffers = empty_buffers(wanted, stage.owners.size)
    for unused in "RGB":
        buffers.pop(unused, None)
    read_quilt(stage, out, view, buffers)
    return Images(f"the quilt in {folder}", buffers)


def draw_images(stage: Stage, view: View, threads: int, why: str = "") -> Images:
    """Draw the depth and triangle of every pixel in memory."""
    job = stage.job
    output = job.output.model_copy(update={"channels": _DRAWN})
    render = job.render.model_copy(update={"samples": 1, "shutter": 0.0})
    plain = replace(stage, job=job.model_copy(update={"output": output, "render": render}))
    buffers = empty_buffers(_DRAWN, stage.owners.size)
    draw_view(plain, view, buffers, threads)
    return Images(f"drawn in memory{why}", buffers)
