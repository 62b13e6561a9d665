"""Test patterns as files: one image a pattern and page, at the page's exact pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from quiltcli import __version__
from quiltcli.calibration.markers import MarkerSet, write_markers
from quiltcli.calibration.pattern import KINDS, MARKERS, draw, piece
from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.png import save_png
from quiltcli.formats.whole import make_folder
from quiltcli.images.facets import Channel, page_of, quilt_buffers
from quiltcli.layout import Layout, pixel_owners

FORMATS = ("png", "exr")


def write_patterns(
    layout: Layout,
    out: Path,
    kinds: Sequence[str] = ("id",),
    *,
    image_format: str = "png",
    names: Sequence[str] = (),
    step: int = 32,
    markers: MarkerSet | None = None,
    overwrite: bool = False,
    opaque: bool = False,
) -> list[Path]:
    """Write `out`/KIND_page_01.png and so on; return the files.

    The numbers of a pattern are the code values of a PNG (255 times them, rounded, without any
    transfer curve) and the linear values of an EXR. Pixels of no facet are transparent black
    unless `opaque`.

    Args:
        layout: where the facets are.
        out: folder, made if need be.
        kinds: keys of `quiltcli.calibration.pattern.KINDS`, or its `MARKERS`.
        image_format: `png` (8 bits) or `exr` (half floats, the gradient in single precision).
        names: names of the facets by id.
        step: pixels between the lines of a grid, and a checker's field.
        markers: what the pattern `markers` shows; where they are is written beside it, markers.json.
        overwrite: replace files that exist.
        opaque: whether pixels of no facet are black, for who shows a picture as it is.

    Raises:
        OutputError: an unknown pattern or format, a file that is in the way or cannot be written.
    """
    raise_all(OutputError, _wrong(kinds, image_format, step))
    pages = range(len(layout.pages))
    places = {
        (kind, page): pattern_path(out, kind, page + 1, image_format) for kind in kinds for page in pages
    }
    listed = [Path(out) / "markers.json"] if markers is not None and MARKERS in kinds else []
    if not overwrite:
        taken = (path for path in (*places.values(), *listed) if path.exists())
        wanted = "exists already, expected to be told to overwrite it"
        raise_all(OutputError, [Problem(wanted, file=str(path)) for path in taken])
    make_folder(out)
    owners = pixel_owners(layout)
    for (kind, page), path in places.items():
        channels = page_pattern(layout, page, kind, owners, names, step, _dtype(kind, image_format), markers)
        if opaque:
            channels["A"] = np.full_like(channels["A"], 255 if image_format == "png" else 1)
        if image_format == "png":
            write_png(path, channels)
        else:
            attributes = {"quilt:page": page + 1, "quilt:frame": 1, "quilt:pattern": kind}
            write_exr(path, channels, attributes | {"quilt:version": __version__})
    if markers is not None:
        for path in listed:
            write_markers(path, markers)
    return [*places.values(), *listed]


def _dtype(kind: str, image_format: str) -> DTypeLike:
    if image_format == "png":
        return np.uint8
    return np.float32 if kind == "gradient" else np.float16


def _wrong(kinds: Sequence[str], image_format: str, step: int) -> list[Problem]:
    every = (*KINDS, MARKERS)
    known = ", ".join(every)
    found = [Problem(f"unknown pattern {kind!r} (known: {known})") for kind in kinds if kind not in every]
    if image_format not in FORMATS:
        found.append(Problem(f"unknown image format {image_format!r} (known: {', '.join(FORMATS)})"))
    if step < 1:
        found.append(Problem(f"a step of {step} pixels; it must be 1 or more"))
    return found


def pattern_path(out: Path, kind: str, page: int, image_format: str) -> Path:
    """The file of a pattern's page (1-based)."""
    return Path(out) / f"{kind}_page_{page:02d}.{image_format}"


def page_pattern(
    layout: Layout,
    page: int,
    kind: str,
    owners: NDArray[np.integer[Any]],
    names: Sequence[str] = (),
    step: int = 32,
    dtype: DTypeLike = np.float32,
    markers: MarkerSet | None = None,
) -> dict[str, Channel]:
    """A page of a pattern: every facet's picture where it lies in the quilt.

    Args:
        layout: where the facets are.
        page: 0-based.
        kind: a key of `KINDS`, or `MARKERS`.
        owners: `pixel_owners(layout)`.
        names: names of the facets by id.
        step: see `write_patterns`.
        dtype: float16 or float32 for values from 0 to 1, uint8 for 255 times them, rounded.
        markers: see `write_patterns`.

    Returns:
        Channels R, G, B, A (H, W) of that type; A is 1 (or 255) inside facets, all are 0 elsewhere.
    """
    alone = replace(
        layout,
        page=np.where(layout.page == page, 0, -1).astype(np.int32),
        pages=layout.pages[page : page + 1],
    )
    here = page_of(owners, layout, page).reshape(-1)
    images = {}
    for row in np.flatnonzero(alone.page == 0).tolist():
        facet = int(layout.facet[row])
        name = names[facet - 1] if facet <= len(names) else ""
        image = draw(kind, piece(alone, row, here, name, step, markers))
        whole = np.dstack((image, np.ones_like(image[:, :, 0])))
        stored = np.rint(255 * whole).astype(np.uint8) if dtype == np.uint8 else whole.astype(dtype)
        images[row] = {channel: stored[:, :, at] for at, channel in enumerate("RGBA")}
    width, height = layout.pages[page]
    empty = np.zeros((height, width), dtype)
    flat = quilt_buffers(images, alone, here, {})
    return {channel: flat[channel].reshape(height, width) if flat else empty for channel in "RGBA"}


def write_png(path: Path, channels: Mapping[str, Channel]) -> None:
    """Write uint8 channels R, G, B, A (H, W) as a PNG, whole or not at all (OutputError)."""
    save_png(path, np.dstack([channels[name] for name in "RGBA"]))
