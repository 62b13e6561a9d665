"""Displays as MPCDI archives of the advanced 3D profile (a3): a point of the world for each pixel; and back.

A facet is a region and a buffer of its own; its warp holds the point under the centre of every pixel, metres,
Y up, its alpha map the pixels that there are. Shader lamps (sl) hold the same and the projectors' own
places, which are left aside when they are read.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import LayoutError, Problem
from quiltcli.exchange.pixelmaps.mpcdiwrite import XML, add_member
from quiltcli.exchange.pixelmaps.mpcdixml import (
    Archive,
    Region,
    attributes,
    elements,
    open_archive,
    parsed_root,
    read_regions,
)
from quiltcli.exchange.pixelmaps.naming import facet_label
from quiltcli.exchange.pixelmaps.points import facet_points
from quiltcli.formats.pfm import PfmError, pfm_bytes, read_pfm
from quiltcli.formats.png import png_bytes
from quiltcli.formats.whole import whole_file, write_bytes, write_text
from quiltcli.geometry import Float32Array

PROFILES = ("a3", "sl")
_UNITS = {"mm": ("mm", 1), "cm": ("cm", 1), "dm": ("cm", 10), "m": ("m", 1), "in": ("in", 1), "ft": ("ft", 1)}
_UNITS["yd"] = ("ft", 3)
_MOST = 2**30


@dataclass(frozen=True)
class ImportedSurfaces:
    """A display that was made of an archive.

    Attributes:
        files: what was written, the display file first.
        surfaces: how many surfaces it has.
        notices: what was left aside, sentences.
    """

    files: tuple[Path, ...]
    surfaces: int
    notices: tuple[str, ...]


def write_surfaces(facets: Facets, path: Path) -> list[Path]:
    """Write an archive of a display that stands in the world.

    Raises:
        LayoutError: it is a projection, which stands nowhere.
        OutputError: the file cannot be written.
    """
    if any(chart is not None and not chart.stands for chart in facets.charts):
        words = (
            "is a projection, which goes along with the eye (MPCDI's a3 says where pixels are in the world)"
        )
        raise LayoutError(Problem(words, file=facets.path))
    rows = np.flatnonzero(facets.enabled).tolist()
    labels = {row: facet_label(row + 1, facets.names) for row in rows}
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        add_member(archive, XML, _xml(facets, labels).encode())
        for row, label in labels.items():
            points = facet_points(facets, row)
            known = np.isfinite(points.sum(axis=0))
            add_member(archive, f"{label}.pfm", pfm_bytes(np.moveaxis(points, 0, 2)))
            add_member(archive, f"{label}_alpha.png", png_bytes(np.where(known, 255, 0).astype(np.uint8)))
    return [path]


def _xml(facets: Facets, labels: dict[int, str]) -> str:
    """The text of mpcdi.xml, of version 1, which all readers of this profile know."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>']
    lines += ['<MPCDI profile="a3" level="1" date="1980-01-01 00:00:00" version="1.0">', "  <display>"]
    for row, label in labels.items():
        width, height = facets.size[row].tolist()
        size = f'Xresolution="{width}" Yresolution="{height}"'
        lines.append(f"    <buffer id={quoteattr(f'buffer_{row + 1:02d}')} {size}>")
        lines.append(f'      <region id={quoteattr(label)} {size} x="0" y="0" xsize="1" ysize="1"/>')
        lines.append("    </buffer>")
    lines += ["  </display>", "  <files>"]
    for label in labels.values():
        lines += [
            f"    <fileset region={quoteattr(label)}>",
            f"      <geometryWarpFile><path>{label}.pfm</path><interpolation>linear</interpolation>"
            "<geometricUnit>m</geometricUnit><originOf3DData>floorCenter</originOf3DData></geometryWarpFile>",
            f"      <alphaMap><path>{label}_alpha.png</path><componentDepth>1</componentDepth>"
            "<bitDepth>8</bitDepth><gammaEmbedded>1.0</gammaEmbedded></alphaMap>",
            "    </fileset>",
        ]
    return "\n".join([*lines, "  </files>", "</MPCDI>"]) + "\n"


def holds_surfaces(path: Path) -> bool:
    """Whether a file is an archive of points in the world, not of a layout.

    Raises:
        LayoutError: it is an archive that cannot be read.
    """
    if not path.name.lower().endswith((".mpcdi", ".mpcdi.xml")) and path.name.lower() != XML:
        return False
    with open_archive(path) as archive:
        return attributes(parsed_root(archive)).get("profile", "").lower() in PROFILES


def read_surfaces(path: Path, output: Path) -> ImportedSurfaces:
    """Make a display file of an archive: a map of points, and perhaps a mask, beside it for each region.

    Raises:
        LayoutError: the archive is broken, or a region has not a point a pixel.
        OutputError: a file cannot be written.
    """
    with open_archive(path) as archive:
        root = parsed_root(archive)
        pages, regions = read_regions(root, path)
        filesets = {attributes(entry).get("region", ""): entry for entry in elements(root, "fileset")}
        found = [_surface(archive, region, filesets.get(region.id)) for region in regions]
    lines: list[str] = []
    files: list[tuple[Path, bytes]] = []
    notices: list[str] = []
    for region, (points, unit, mask, notice) in zip(regions, found, strict=True):
        word = re.sub(r"[^\w.-]+", "_", region.id).strip("_") or f"region_{len(lines) + 1}"
        map_file = output.with_name(f"{output.stem}_{word}.pfm")
        files.append((map_file, pfm_bytes(points)))
        keys = [f"name: {json.dumps(region.id)}", "kind: map", f"file: {json.dumps(map_file.name)}"]
        keys.append(f"units: {unit}")
        if mask is not None:
            mask_file = output.with_name(f"{output.stem}_{word}_mask.png")
            files.append((mask_file, mask))
            keys.append(f"mask: {json.dumps(mask_file.name)}")
        if place := _place(region, pages):
            keys.append(place)
        lines.append("- {" + ", ".join(keys) + "}")
        notices += [notice] if notice else []
    for file, data in files:
        write_bytes(file, data)
    write_text(output, f"# made of {path.name}\nquilt_display: 1\nsurfaces:\n" + "\n".join(lines) + "\n")
    return ImportedSurfaces((output, *(file for file, _ in files)), len(regions), tuple(notices))


def _place(region: Region, pages: list[tuple[int, int]]) -> str:
    """Where a region's pixels lie in its buffer, as a key; nothing where they are not those of the buffer."""
    low, extent = np.rint(region.low), np.rint(region.extent)
    one_by_one = np.abs(region.low - low).max() < 0.01 and tuple(extent.astype(int)) == region.size
    if not one_by_one or (len(pages) == 1 and region.size == pages[0]):
        return ""
    return f"place: {{page: {region.page + 1}, at: [{int(low[0])}, {int(low[1])}]}}"


def _surface(
    archive: Archive, region: Region, fileset: ElementTree.Element | None
) -> tuple[Float32Array, str, bytes | None, str]:
    """Points (H, W, 3) of a region, their unit, a mask's PNG or None, and what is to be said of it."""

    def wrong(message: str) -> LayoutError:
        return LayoutError(Problem(f"the region {region.id!r} {message}", file=str(archive.path)))

    warp = next(elements(fileset, "geometryWarpFile"), None) if fileset is not None else None
    name = _text(warp, "path")
    if not name:
        raise wrong(f"has no geometryWarpFile in {XML}")
    try:
        points = read_pfm(archive.read(name, _MOST), finite=False)
    except PfmError as error:
        raise LayoutError(Problem(f"{name} {error}", file=str(archive.path))) from None
    if points.shape[2] != 3:
        raise wrong(f"has a warp of one channel, {name} (expected x, y and z)")
    if points.shape[1::-1] != region.size:
        got, wanted = ("×".join(map(str, size)) for size in (points.shape[1::-1], region.size))
        raise wrong(f"has {wanted} pixels, and its warp {name} {got} (expected a point a pixel)")
    given = _text(warp, "geometricUnit") or "m"
    if given.lower() not in _UNITS:
        raise wrong(f"is measured in {given!r} (expected one of {', '.join(_UNITS)})")
    unit, factor = _UNITS[given.lower()]
    points = points * np.float32(factor) if factor != 1 else points
    mask, notice = _mask(archive, region, fileset)
    return points, unit, mask, notice


def _mask(archive: Archive, region: Region, fileset: ElementTree.Element | None) -> tuple[bytes | None, str]:
    """A mask of a region's alpha map, where that leaves pixels out; and a word where it blends as well."""
    alpha = next(elements(fileset, "alphaMap"), None) if fileset is not None else None
    name = _text(alpha, "path")
    if not name or not archive.has(name):
        return None, ""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(archive.read(name, _MOST))) as picture:
            bright = np.asarray(picture.convert("L"))
    except (UnidentifiedImageError, OSError):
        raise LayoutError(Problem(f"{name} is no picture", file=str(archive.path))) from None
    if bright.shape[::-1] != region.size:
        return None, f"the region {region.id!r}: {name} has another size than the region, and is left aside"
    there = bright > 0
    soft = bool((there & (bright < 255)).any())
    notice = f"the region {region.id!r}: {name} blends; the player does that, and it is left aside here"
    return (
        None if there.all() else png_bytes(np.where(there, 255, 0).astype(np.uint8))
    ), notice if soft else ""


def _text(element: ElementTree.Element | None, tag: str) -> str:
    """The text of the first element of a tag inside another; nothing where there is none."""
    inner = next(elements(element, tag), None) if element is not None else None
    return (inner.text or "").strip() if inner is not None else ""
