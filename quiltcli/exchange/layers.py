"""Channels beside colours that pictures of facets bring: depth, made the job's, and others as they are.

Renderers measure depth along a camera's axis, and the axis of a facet's camera stands straight on the facet.
A point z along it lies at z · d from the eye, d being the direction through the pixel's centre that goes 1
along the axis; so its depth is z times the depth of d, whatever the job calls depth.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS, MOST_HALF
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.image import channel_names, read_parts
from quiltcli.geometry import FloatArray, cross, dot
from quiltcli.images.window import whole_frame
from quiltcli.layout import Layout
from quiltcli.viewer.viewer import Viewer

DEPTHS = ("axis", "distance", "job")
"""What depth of a picture measures: along the camera's axis, along the ray, or what the job's does."""
_PARTS = ("z", "v", "y", "r", "depth")  # what the channel of a layer of depth is called


def layers_of(path: Path, wanted: Sequence[str]) -> tuple[str, ...]:
    """The job's channels beside the colours that a picture has, in the job's order.

    Raises:
        OutputError: it cannot be read.
    """
    if path.suffix.lower() != ".exr":
        return ()
    names = [name for part in channel_names(path) for name in part]
    found = []
    for channel in wanted:
        there = all(layer in names for layer in CHANNELS[channel].layers)
        if channel != "rgba" and (there or (channel == "Z" and _depth_name(names))):
            found.append(channel)
    return tuple(found)


def _depth_name(names: Sequence[str]) -> str:
    """The channel of depth: Z, or the layer of depth of a renderer's file; nothing where there is none."""
    if "Z" in names:
        return "Z"
    layers = (
        name for name in sorted(names) if name.rpartition(".")[2].lower() in ("z", "v", "y", "r", "depth")
    )
    return next((name for name in layers if "depth" in name.lower().split(".")[-2:]), "")


def read_layers(
    path: Path, wanted: Sequence[str], layout: Layout, row: int, viewer: Viewer, measured: str | None
) -> dict[str, NDArray[Any]]:
    """EXR channels (H, W) by name, as a render of the job writes them.

    Args:
        path: the picture.
        wanted: channels of the job, which it has.
        layout: where the facet is in the world.
        row: the facet's row in it.
        viewer: whose eye the camera stands in.
        measured: a name of `DEPTHS`; None for along the axis, but as it is in files of quilt's own.

    Raises:
        OutputError: it cannot be read.
    """
    channels: dict[str, NDArray[Any]] = {}
    own = False
    for image in read_parts(path):
        own = own or "quilt:depth" in image.attributes
        for name, pixels in whole_frame(image).items():
            channels.setdefault(name, pixels)
    result: dict[str, NDArray[Any]] = {}
    for channel in wanted:
        row_of = CHANNELS[channel]
        if channel == "Z":
            depth = np.asarray(channels[_depth_name(list(channels))])
            kind = measured or ("job" if own else "axis")
            result["Z"] = job_depth(depth, kind, layout, row, viewer)
            continue
        for name in row_of.layers:
            result[name] = np.asarray(channels[name]).astype(row_of.dtype)
    if len({pixels.shape for pixels in result.values()}) > 1:
        raise OutputError(Problem("has parts of several sizes, expected one", file=str(path)))
    return result


def job_depth(
    depth: NDArray[Any], measured: str, layout: Layout, row: int, viewer: Viewer
) -> NDArray[np.float32]:
    """Depth (H, W) as a job has it, float32; infinite where a picture shows nothing.

    Args:
        depth: of the picture; what is beyond half floats, as backgrounds are, is nothing.
        measured: a name of `DEPTHS`.
        layout: where the facet is in the world.
        row: the facet's row in it.
        viewer: whose eye the camera stands in.
    """
    far = depth.astype(np.float64)
    shown = np.isfinite(far) & (far > 0) & (far < MOST_HALF)
    if measured != "job":
        through = _through(layout, row, viewer)
        of = viewer.depth_of(through)
        if measured == "distance":
            x, y, z = through
            of = of / np.sqrt(x * x + y * y + z * z)
        far = far * of
        shown &= of > 0
    return np.where(shown, far, np.inf).astype(np.float32)


def _through(layout: Layout, row: int, viewer: Viewer) -> FloatArray:
    """Directions (3, H, W) through the pixels' centres that go 1 along the facet's camera's axis."""
    width, height = layout.size[row].tolist()
    du, dv = layout.du[row], layout.dv[row]
    local = layout.origin[row] - viewer.eye
    axis = cross(du, dv)
    axis = axis / float(np.sqrt(dot(axis, axis)))
    distance = float(dot(local, axis))
    x, y = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    return np.stack([(o + a * x + b * y) / distance for o, a, b in zip(local, du, dv, strict=True)])
