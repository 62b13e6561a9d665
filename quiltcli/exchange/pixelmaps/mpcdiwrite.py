"""MPCDI 2.0, written: a zip of mpcdi.xml, a warp and an alpha map a facet, and quilt.json.

The 2D media profile. A page is a buffer and its picture the media; a facet is a region. The region's
resolution is that of the facet's own raster; x, y, xsize, ysize are the rectangle its picture takes up
on the page, in parts of the page, from the top-left corner. For every pixel of the facet, at its
centre, the warp holds where in that rectangle it comes from: u to the right, v down. Rotations and
mirrors are in the warp, the polygon in the alpha map.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from quiltcli.display import Facets
from quiltcli.exchange.pixelmaps.jsonmap import json_text
from quiltcli.exchange.pixelmaps.naming import facet_label
from quiltcli.exchange.pixelmaps.placing import placed_rows
from quiltcli.exchange.pixelmaps.stmap import centres_mapped
from quiltcli.formats.pfm import pfm_bytes
from quiltcli.formats.png import png_bytes
from quiltcli.formats.whole import whole_file
from quiltcli.geometry import Float32Array
from quiltcli.images.facets import facet_image
from quiltcli.layout import Layout, pixel_owners

XML, SUPPLEMENT = "mpcdi.xml", "quilt.json"
_ROOTS = {
    1: '<MPCDI profile="2d" level="1" date="1980-01-01 00:00:00" version="1.0">',
    2: '<MPCDI profile="2d" geometry="1" level="1" color="1" version="2.0">',
}
_LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the same layout gives the same bytes whenever it is written


def write_mpcdi_1(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write the archive in the spelling of version 1, for players that know no other."""
    return write_mpcdi(layout, facets, path, version=1)


def write_mpcdi(layout: Layout, facets: Facets | None, path: Path, *, version: int = 2) -> list[Path]:
    """Write the archive; quilt.json holds what MPCDI has no place for, and may be deleted (OutputError)."""
    owners = pixel_owners(layout)
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        add_member(archive, XML, mpcdi_xml(layout, facets, version).encode())
        add_member(archive, SUPPLEMENT, json_text(layout, facets).encode())
        for row in placed_rows(layout):
            label = _label(layout, facets, row)
            add_member(archive, f"{label}.pfm", pfm_bytes(_warp(layout, row)))
            add_member(archive, f"{label}_alpha.png", _alpha(layout, row, owners))
    return [path]


def add_member(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    """Add a file to an archive, with the same bytes whenever that is done."""
    entry = zipfile.ZipInfo(name, _LONG_AGO)
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, data, compresslevel=6)


def _label(layout: Layout, facets: Facets | None, row: int) -> str:
    return facet_label(int(layout.facet[row]), facets.names if facets else ())


def mpcdi_xml(layout: Layout, facets: Facets | None = None, version: int = 2) -> str:
    """The text of mpcdi.xml; version 1 differs in its first element and in the spelling of resolutions."""
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        _ROOTS[version],
        "  <display>",
    ]
    for page, (width, height) in enumerate(layout.pages.tolist()):
        lines.append(f'    <buffer id="page_{page + 1:02d}" xResolution="{width}" yResolution="{height}">')
        rows = [row for row in placed_rows(layout) if layout.page[row] == page]
        lines += [_region(layout, row, _label(layout, facets, row)) for row in rows]
        lines.append("    </buffer>")
    lines += ["  </display>", "  <files>"]
    for row in placed_rows(layout):
        lines += _fileset(_label(layout, facets, row))
    text = "\n".join([*lines, "  </files>", "</MPCDI>"]) + "\n"
    return (
        re.sub(r" ([xy])Resolution=", lambda m: f" {m[1].upper()}resolution=", text) if version == 1 else text
    )


def _region(layout: Layout, row: int, label: str) -> str:
    width, height = layout.size[row]
    low, high = _box(layout, row)
    page = layout.pages[layout.page[row]]
    (x, y), (xsize, ysize) = (low / page).tolist(), ((high - low) / page).tolist()
    return (
        f'      <region id={quoteattr(label)} xResolution="{width}" yResolution="{height}"'
        f' x="{x!r}" y="{y!r}" xsize="{xsize!r}" ysize="{ysize!r}"/>'
    )


def _fileset(label: str) -> Iterator[str]:
    yield f"    <fileset region={quoteattr(label)}>"
    warp = f"<path>{label}.pfm</path><interpolation>linear</interpolation>"
    yield f"      <geometryWarpFile>{warp}</geometryWarpFile>"
    yield (
        f"      <alphaMap><path>{label}_alpha.png</path><componentDepth>1</componentDepth>"
        "<bitDepth>8</bitDepth><gammaEmbedded>1.0</gammaEmbedded></alphaMap>"
    )
    yield "    </fileset>"


def _box(layout: Layout, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (x, y) of the facet's whole raster on its page."""
    matrix, (width, height) = layout.quilt_from_facet[row], layout.size[row]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) @ matrix[:, :2].T + matrix[:, 2]
    return corners.min(axis=0), corners.max(axis=0)


def _warp(layout: Layout, row: int) -> Float32Array:
    """The warp (H, W, 3): u, v in the region's rectangle, top-left origin, and 0."""
    low, high = _box(layout, row)
    width, height = layout.size[row].tolist()
    x, y = centres_mapped(layout.quilt_from_facet[row], width, height)
    u, v = (x - low[0]) / (high[0] - low[0]), (y - low[1]) / (high[1] - low[1])
    return np.dstack((u, v, np.zeros_like(u))).astype(np.float32)


def _alpha(layout: Layout, row: int, owners: NDArray[np.integer[Any]]) -> bytes:
    """The alpha map, a PNG of 8 bits: 255 in the polygon."""
    inside = facet_image({"id": owners}, layout, row, owners)["id"] == layout.facet[row]
    return png_bytes(np.where(inside, 255, 0).astype(np.uint8))
