"""OBJ with texture coordinates: the display and its pixels in one mesh, as media servers take it.

A vertex is a place in the world in metres, u · width is pixels from the page's left and v · height
pixels from its bottom. Every facet is one polygon, whole, in an object of its own.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, build_facets
from quiltcli.errors import LayoutError, Problem
from quiltcli.exchange.pixelmaps.naming import existing_pages, facet_label, page_files, parse_label
from quiltcli.exchange.pixelmaps.placing import adopted, entries, placed_rows, settled
from quiltcli.formats.inputs import open_input
from quiltcli.formats.mesh import PolygonMesh, read_mesh
from quiltcli.formats.whole import write_text
from quiltcli.formats.yaml.source import Source
from quiltcli.geometry import FloatArray, IntArray, cross, dot, offsets, some_rows
from quiltcli.job import DisplayFile, ResolutionSpec
from quiltcli.job.model import attach
from quiltcli.layout import Layout, quilt_polygons
from quiltcli.layout.from_uv import layout_from_polygons

_HEADING = re.compile(r"^# quilt page \d+ of \d+, (\d{1,7})x(\d{1,7}) pixels", re.MULTILINE)
_OFF_PLACE = 2e-4  # of a facet's size: how far a corner may be from the display's


def write_obj_map(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write one mesh a page; faces wind so that their front is the lit side (OutputError)."""
    files = page_files(path, len(layout.pages))
    for page, file in enumerate(files):
        write_text(file, obj_text(layout, facets, page))
    return files


def obj_text(layout: Layout, facets: Facets | None, page: int) -> str:
    """The mesh of a page (0-based)."""
    width, height = layout.pages[page].tolist()
    lines = [
        f"# quilt page {page + 1} of {len(layout.pages)}, {width}x{height} pixels",
        f"# metres, Y up; u * {width} = pixels from the left, v * {height} = pixels from the bottom",
    ]
    quilt = quilt_polygons(layout)
    names = facets.names if facets else ()
    count = 0
    for row in placed_rows(layout):
        if layout.page[row] != page:
            continue
        corners = slice(int(layout.corner_start[row]), int(layout.corner_start[row + 1]))
        uv = quilt[corners] / (width, height)
        lines.append(f"o {facet_label(int(layout.facet[row]), names)}")
        lines += ["v " + _numbers(point) for point in world_corners(layout, row)]
        lines += ["vt " + _numbers((u, 1 - v)) for u, v in uv.tolist()]
        order = [count + at for at in range(1, len(uv) + 1)]
        if _shows_back(layout, facets, row):
            order.reverse()
        lines.append("f " + " ".join(f"{at}/{at}" for at in order))
        count += len(uv)
    return "\n".join(lines) + "\n"


def _numbers(values: Sequence[float] | FloatArray) -> str:
    return " ".join(repr(float(value)).removesuffix(".0") for value in values)


def world_corners(layout: Layout, row: int) -> FloatArray:
    """World positions (n, 3) of a facet's corners by the layout's raster."""
    corners = layout.outline(row)
    result: FloatArray = (
        layout.origin[row] + corners[:, :1] * layout.du[row] + corners[:, 1:] * layout.dv[row]
    )
    return result


def _shows_back(layout: Layout, facets: Facets | None, row: int) -> bool:
    """Whether the polygon, as wound in the layout, turns its back to the lit side."""
    corners = world_corners(layout, row)
    local = corners - corners[0]
    front = cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    seen = cross(layout.dv[row], layout.du[row])
    lit = seen if facets is None else facets.normal[layout.facet[row] - 1]
    return bool(dot(front, lit) < 0)


@dataclass(frozen=True)
class _Faces:
    """Faces of all pages together; `page` (F,) is 0-based, `labels` are object names."""

    mesh: PolygonMesh
    page: IntArray
    pages: IntArray  # (G, 2)

    @property
    def quilt(self) -> FloatArray:
        """Corners (C, 2) in pixels of their pages; NaN without texture coordinates."""
        size = self.pages[self.page][np.repeat(np.arange(self.mesh.count), np.diff(self.mesh.corner_start))]
        if self.mesh.uv is None:
            return np.full((len(self.mesh.corners), 2), np.nan)
        flipped = np.stack((self.mesh.uv[:, 0], 1 - self.mesh.uv[:, 1]), axis=1)
        with np.errstate(over="ignore"):  # what is no number of pixels is named with its facet
            return np.asarray(flipped * size)

    def taken(self, order: Sequence[int]) -> _Faces:
        """These faces only, in this order."""
        start, pick = some_rows(self.mesh.corner_start, np.array(order, dtype=np.int64))
        mesh = replace(
            self.mesh,
            corner_start=start,
            corners=self.mesh.corners[pick],
            uv=None if self.mesh.uv is None else self.mesh.uv[pick],
            names=tuple(self.mesh.names[face] for face in order),
            lines=self.mesh.lines[list(order)],
        )
        return _Faces(mesh, self.page[list(order)], self.pages)


def read_obj_map(path: Path, display: Facets | None, size: tuple[int, int] | None) -> Layout:
    """Read a mesh, in metres, whose texture coordinates are places in the quilt.

    With a display its facets are found by where they are, whatever the mesh calls them and in
    whatever order; without one the mesh is the display, its fronts are lit, and ids come from object
    names such as `facet_0007`, or count faces. The size of pages comes from `size`, or from the first
    line that this program writes.
    """
    faces = _read_faces(path, size)
    if faces.mesh.uv is None:
        message = "the mesh has no texture coordinates, which a layout is read from"
        raise LayoutError(Problem(message, file=str(path)))
    if display is not None:
        quilt, page = _matched(faces, display, path)
        layout = layout_from_polygons(
            display, quilt, page.astype(np.int32), faces.pages.astype(np.int32), padding=0, method="obj"
        )
        return adopted(settled(layout, display), display, path)
    ids = _ids(faces.mesh.names, path)
    order = sorted(range(len(ids)), key=ids.__getitem__)
    faces = faces.taken(order)
    layout = layout_from_polygons(
        _own_display(faces.mesh, path),
        faces.quilt,
        faces.page.astype(np.int32),
        faces.pages.astype(np.int32),
        padding=0,
        method="obj",
    )
    named = np.array(sorted(ids), dtype=np.int32)
    return adopted(replace(layout, facet=named, display="", display_sha256=""), None, path)


def _read_faces(path: Path, size: tuple[int, int] | None) -> _Faces:
    files = existing_pages(path) or [path]
    meshes = [read_mesh(file) for file in files]
    sizes = [size or _stated_size(file) for file in files]
    entries(
        path,
        [
            Problem("does not say how large its page is, expected a size such as 3840x2160", file=str(file))
            for file, known in zip(files, sizes, strict=True)
            if known is None
        ],
    )
    pages = np.array(sizes, dtype=np.int64)
    face_page = np.repeat(np.arange(len(meshes)), [mesh.count for mesh in meshes])
    return _Faces(_joined(meshes, path), face_page, pages)


def _stated_size(file: Path) -> tuple[int, int] | None:
    with open_input(file, LayoutError) as opened:
        match = _HEADING.search(opened.read(4096).decode("utf-8", "replace"))
    return (int(match[1]), int(match[2])) if match else None


def _joined(meshes: Sequence[PolygonMesh], path: Path) -> PolygonMesh:
    """Meshes as one, in their order."""
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    count = np.concatenate([np.diff(mesh.corner_start) for mesh in meshes])
    uvs = [np.full((len(m.corners), 2), np.nan) if m.uv is None else m.uv for m in meshes]
    return PolygonMesh(
        vertices=np.concatenate([mesh.vertices for mesh in meshes]),
        corner_start=offsets(count),
        corners=np.concatenate([mesh.corners + at for mesh, at in zip(meshes, first, strict=False)]),
        uv=np.concatenate(uvs),
        names=tuple(name for mesh in meshes for name in mesh.names),
        lines=np.zeros(len(count), dtype=np.int64),
        path=str(path),
    )


def _ids(names: Sequence[str], path: Path) -> list[int]:
    """Ids of faces: all by their names, or all by their order."""
    labels = [parse_label(name) for name in names]
    if not all(labels):
        return list(range(1, len(names) + 1))
    ids = [label[0] for label in labels if label]
    twice = sorted(facet for facet, count in Counter(ids).items() if count > 1)
    entries(path, [Problem(f"facet {facet} is in the mesh twice", file=str(path)) for facet in twice])
    return ids


def _own_display(mesh: PolygonMesh, path: Path) -> Facets:
    """The mesh as a display. How many pixels its facets have is said by the quilt, not here."""
    spec = DisplayFile(mesh=path, resolution=ResolutionSpec(facet_pixels=(1024, 1024)))
    attach(spec, Source(path))
    return build_facets(mesh, spec)


def _matched(faces: _Faces, display: Facets, path: Path) -> tuple[FloatArray, IntArray]:
    """Corners of the display (C, 2) in quilt pixels, and each facet's page, −1 where there is no face."""
    start = display.corner_start
    centres = np.stack([display.polygon(row).mean(axis=0) for row in range(display.count)])
    places = faces.mesh.vertices[faces.mesh.corners]
    drawn = faces.quilt
    quilt = np.full((len(display.corners), 2), np.nan)
    page = np.full(display.count, -1)
    problems = []
    for face in range(faces.mesh.count):
        corners = slice(int(faces.mesh.corner_start[face]), int(faces.mesh.corner_start[face + 1]))
        row, order = _facet_of(faces.mesh.names[face], places[corners], display, centres)
        if order is None or page[row] >= 0:
            name = f" ({faces.mesh.names[face]})" if faces.mesh.names[face] else ""
            wrong = f"lies on no facet of {display.path}; the nearest is {row + 1}"
            if order is not None:
                wrong = f"lies on facet {row + 1} of {display.path}, and so does another"
            problems.append(Problem(f"face {face + 1}{name} {wrong}", str(path), int(faces.mesh.lines[face])))
            continue
        quilt[start[row] : start[row + 1]] = drawn[corners][order]
        page[row] = faces.page[face]
    entries(path, problems)
    return quilt, page


def _facet_of(
    name: str, corners: FloatArray, display: Facets, centres: FloatArray
) -> tuple[int, IntArray | None]:
    """The facet a face lies on, by its name else the nearest, and the order of its corners or None."""
    label = parse_label(name)
    if label and label[0] <= display.count:
        order = _same_corners(display.polygon(label[0] - 1), corners)
        if order is not None:
            return label[0] - 1, order
    away = centres - corners.mean(axis=0)
    row = int(dot(away, away).argmin())
    return row, _same_corners(display.polygon(row), corners)


def _same_corners(polygon: FloatArray, corners: FloatArray) -> IntArray | None:
    """Order (n,) that makes `corners` those of the polygon, whichever comes first and whichever way round."""
    count = len(polygon)
    if len(corners) != count:
        return None
    close = _OFF_PLACE * float(np.ptp(polygon, axis=0).max())
    for way in (1, -1):
        for shift in range(count):
            order = (shift + way * np.arange(count)) % count
            away = corners[order] - polygon
            if float(np.sqrt(dot(away, away)).max()) <= close:
                return order
    return None
