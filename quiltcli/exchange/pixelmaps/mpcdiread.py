"""MPCDI, read: layouts from 2D media archives of version 1 and 2."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import JobError, LayoutError, Problem
from quiltcli.exchange.pixelmaps.jsonmap import layout_from_json
from quiltcli.exchange.pixelmaps.mpcdiwrite import SUPPLEMENT, XML
from quiltcli.exchange.pixelmaps.mpcdixml import (
    Archive,
    Region,
    attributes,
    elements,
    open_archive,
    read_regions,
    read_root,
)
from quiltcli.exchange.pixelmaps.naming import parse_label
from quiltcli.exchange.pixelmaps.placing import Rasters, adopted, display_rasters, entries, rows_in_order
from quiltcli.formats.pfm import PfmError, read_pfm
from quiltcli.geometry import FloatArray
from quiltcli.layout import Layout
from quiltcli.layout.layout import PIXEL_TOLERANCE

_SUPPLEMENT_BYTES = 64_000_000
_LEAST_WARP, _MOST_WARP = 2**22, 2**29


def read_mpcdi(path: Path, display: Facets | None, size: tuple[int, int] | None) -> Layout:
    """Read an archive; buffers are pages and regions facets, by ids such as `facet_0007` or their order.

    What MPCDI has no place for (where facets are in the world, exact polygons) comes from the display,
    or from the file quilt.json that `write_mpcdi` adds.
    """
    with open_archive(path) as archive:
        layout, supplement = _read(archive, display)
    return adopted(_exact(layout, supplement), display, path)


def _read(archive: Archive, display: Facets | None) -> tuple[Layout, Layout | None]:
    """The layout as the archive's warps have it, and its supplement."""
    path, root = archive.path, read_root(archive)
    pages, regions = read_regions(root, path)
    warps = {attributes(fileset).get("region", ""): fileset for fileset in elements(root, "fileset")}
    supplement = _supplement(archive)
    if supplement is None and display is None:
        message = f"says nothing of where facets are in the world: it has no {SUPPLEMENT}; name the display"
        raise LayoutError(Problem(message, file=str(path)))
    labels = [parse_label(region.id) for region in regions]
    ids = [label[0] for label in labels if label]
    if len(ids) < len(regions):
        ids = list(range(1, len(regions) + 1))
    order = rows_in_order(ids)
    problems: list[Problem] = []
    maps = []
    for region in (regions[at] for at in order):
        try:
            maps.append(_place(archive, region, warps))
        except LayoutError as error:
            problems += error.problems
    entries(path, problems)
    ids, regions = [ids[at] for at in order], [regions[at] for at in order]
    rasters = _rasters(path, ids, regions, supplement, display)
    layout = Layout(
        facet=np.array(ids, dtype=np.int32),
        page=np.array([region.page for region in regions], dtype=np.int32),
        size=rasters.size,
        quilt_from_facet=np.array(maps),
        origin=rasters.origin,
        du=rasters.du,
        dv=rasters.dv,
        corner_start=rasters.corner_start,
        polygon=rasters.polygon,
        pages=np.array(pages, dtype=np.int32),
        padding=supplement.padding if supplement else 0,
        method=supplement.method if supplement else "mpcdi",
        display="",
        display_sha256=supplement.display_sha256 if supplement else "",
    )
    return layout, supplement


def _place(archive: Archive, region: Region, filesets: dict[str, ElementTree.Element]) -> FloatArray:
    """The map (2, 3) from the region's pixels to its page, fitted to the warp.

    Raises:
        LayoutError: no warp, a broken one, or one that no affine map follows.
    """
    fileset = filesets.get(region.id)
    warp = next(elements(fileset, "geometryWarpFile"), None) if fileset is not None else None
    name = next((inner.text or "" for inner in elements(warp, "path")), "") if warp is not None else ""
    if not name:
        message = f"{XML} names no geometryWarpFile for the region {region.id!r}"
        raise LayoutError(Problem(message, file=str(archive.path)))
    try:
        image = read_pfm(archive.read(name.strip(), _warp_bytes(region)))
    except PfmError as error:
        raise LayoutError(Problem(f"{name.strip()} {error}", file=str(archive.path))) from None
    matrix, miss = fitted(image, region)
    if miss > PIXEL_TOLERANCE * 5:
        message = f"{name.strip()} bends the region {region.id!r} by up to {miss:.3g} pixels"
        raise LayoutError(
            Problem(f"{message}, expected an affine map (a flat facet)", file=str(archive.path))
        )
    return matrix


def _warp_bytes(region: Region) -> int:
    """The most that a warp may hold: some samples for each of the region's pixels."""
    width, height = region.size
    return min(max(4 * 12 * width * height, _LEAST_WARP), _MOST_WARP)


def fitted(image: np.ndarray, region: Region) -> tuple[FloatArray, float]:
    """Affine map (2, 3) from the region's pixels to page pixels that a warp (h, w, 3) follows.

    Whole-pixel maps come out exact: what the single precision of the warp leaves over is rounded off.

    Returns:
        The map, and by how many pixels the warp leaves it at most.
    """
    height, width = image.shape[:2]
    i, j = (np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / height - 0.5
    quilt = region.low + image[:, :, :2].astype(np.float64) * region.extent
    mean = quilt.mean(axis=(0, 1))
    along = np.einsum("ijk,j->k", quilt, i) / max((i * i).sum() * height, 1e-12)
    down = np.einsum("ijk,i->k", quilt, j) / max((j * j).sum() * width, 1e-12)
    if width == 1 or height == 1:  # one pixel tells no direction: the rectangle's own
        along = along if width > 1 else np.array([region.extent[0], 0])
        down = down if height > 1 else np.array([0, region.extent[1]])
    left = quilt - mean - along * i[:, None] - down * j[:, None, None]
    linear = np.stack((along / region.size[0], down / region.size[1]), axis=1)
    matrix = np.column_stack((linear, mean - linear @ np.array(region.size) / 2))
    whole = np.rint(matrix)
    corners = np.array([[0, 0, 1], [region.size[0], 0, 1], [*region.size, 1], [0, region.size[1], 1]])
    if np.abs((matrix - whole) @ corners.T).max() <= PIXEL_TOLERANCE:
        matrix = whole + 0.0
    return matrix, float(np.abs(left).max())


def _supplement(archive: Archive) -> Layout | None:
    """What quilt.json says, when there is one (LayoutError)."""
    if not archive.has(SUPPLEMENT):
        return None
    try:
        data = archive.read(SUPPLEMENT, _SUPPLEMENT_BYTES)
        return layout_from_json(data, archive.path, what=SUPPLEMENT)
    except JobError as error:
        message = f"{SUPPLEMENT} is not what quilt writes; without it the display is needed"
        raise LayoutError([Problem(message, file=str(archive.path)), *error.problems]) from None


def _rasters(
    path: Path,
    ids: list[int],
    regions: list[Region],
    supplement: Layout | None,
    display: Facets | None,
) -> Rasters:
    """Rasters of the facets, from the display when one is given and the supplement is not there."""
    problems = []
    if supplement is None and display is not None:
        known = [facet for facet in ids if facet <= display.count]
        missing = [facet for facet in ids if facet > display.count]
        problems += [
            Problem(f"facet {n} is not in {display.path}, which has facets 1 to {display.count}", str(path))
            for n in missing
        ]
        entries(path, problems)
        rasters = display_rasters(display, known)
    else:
        assert supplement is not None  # `_read` has seen to it
        rasters = _supplement_rasters(path, ids, supplement)
    for facet, region, own in zip(ids, regions, rasters.size.tolist(), strict=True):
        if tuple(own) != region.size:
            source = display.path if supplement is None and display else SUPPLEMENT
            size = "×".join(map(str, region.size))
            message = (
                f"the region {region.id!r} is {size} pixels, facet {facet} of {source} {own[0]}×{own[1]}"
            )
            problems.append(Problem(message, file=str(path)))
    entries(path, problems)
    return rasters


def _supplement_rasters(path: Path, ids: list[int], supplement: Layout) -> Rasters:
    known = set(supplement.facet.tolist())
    missing = [facet for facet in ids if facet not in known]
    entries(path, [Problem(f"{SUPPLEMENT} says nothing of facet {n}", file=str(path)) for n in missing])
    rows = np.searchsorted(supplement.facet, ids)
    starts = supplement.corner_start
    polygons = [supplement.polygon[starts[row] : starts[row + 1]] for row in rows]
    return Rasters(
        supplement.size[rows],
        supplement.origin[rows],
        supplement.du[rows],
        supplement.dv[rows],
        np.cumsum([0, *map(len, polygons)]),
        np.concatenate(polygons),
    )


def _exact(layout: Layout, supplement: Layout | None) -> Layout:
    """The maps of the supplement, in full precision, where the warps say the same."""
    if supplement is None:
        return layout
    maps = layout.quilt_from_facet.copy()
    for row, facet in enumerate(layout.facet.tolist()):
        said = supplement.quilt_from_facet[int(np.searchsorted(supplement.facet, facet))]
        corners = np.array([[0, 0, 1], [*layout.size[row], 1]])
        if np.abs((said - maps[row]) @ corners.T).max() <= PIXEL_TOLERANCE:
            maps[row] = said
    return replace(layout, quilt_from_facet=maps)
