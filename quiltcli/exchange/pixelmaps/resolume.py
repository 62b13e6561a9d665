"""Resolume Arena's Advanced Output: a slice a facet, a screen a page.

A page is the composition. A slice's `InputRect` is the rectangle that it takes from there: four vertices,
clockwise from what is its top left corner, and how far they are turned clockwise, radians. `OutputRect`
is where it goes on its screen: the same place here, as the quilt is the LED processor's canvas already;
who wants it elsewhere moves it there. The structure is that of presets which Arena 7 writes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from quiltcli.display import Facets
from quiltcli.display.check import called
from quiltcli.errors import LayoutError, OutputError, Problem, raise_all
from quiltcli.exchange.pixelmaps.naming import existing_pages, facet_label, page_files, parse_label
from quiltcli.exchange.pixelmaps.placing import Rasters, adopted, display_rasters, placed_rows
from quiltcli.exchange.pixelmaps.xmltext import parsed_xml
from quiltcli.formats.inputs import read_input
from quiltcli.formats.whole import write_text
from quiltcli.formats.yaml.source import shorten
from quiltcli.geometry import FloatArray
from quiltcli.layout import Layout

_VERSION = {"name": "Resolume Arena", "majorVersion": "7", "minorVersion": "0", "microVersion": "0"}
_COMPOSITION = "0:1"  # as the source of a slice
_FIRST_ID = 1000
_MOST_BYTES = 32_000_000
_MOST_PIXELS = 1_000_000
_CLOSE = 0.1  # pixels that a dragged corner may be off a whole one, and still be meant to be there


def write_resolume(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write a preset a page. Raises OutputError for facets that are sheared or stretched in the quilt."""
    raise_all(OutputError, _unfit(layout, path))
    files = page_files(path, len(layout.pages))
    for page, file in enumerate(files):
        write_text(file, resolume_text(layout, facets, page, file.stem))
    return files


def _unfit(layout: Layout, path: Path) -> Iterator[Problem]:
    for row in placed_rows(layout):
        turn = layout.quilt_from_facet[row, :, :2]
        if np.abs(turn.T @ turn - np.eye(2)).max() > 1e-6:
            words = "is sheared or stretched in the quilt, and no slice of Resolume is (json and obj hold it)"
            yield Problem(f"facet {layout.facet[row]} {words}", file=str(path))


def resolume_text(layout: Layout, facets: Facets | None, page: int, name: str) -> str:
    """The preset of a page (0-based)."""
    width, height = layout.pages[page].tolist()
    root = ElementTree.Element("XmlState", name=name)
    ElementTree.SubElement(root, "versionInfo", _VERSION)
    setup = ElementTree.SubElement(root, "ScreenSetup", name="ScreenSetup")
    ElementTree.SubElement(setup, "Params", name="ScreenSetupParams")
    size = {"width": str(width), "height": str(height)}
    ElementTree.SubElement(setup, "CurrentCompositionTextureSize", size)
    screens = ElementTree.SubElement(setup, "screens")
    title = f"page {page + 1}"
    screen = ElementTree.SubElement(screens, "Screen", name=title, uniqueId=str(_FIRST_ID))
    _params(screen, "Params", ("Name", "STRING", title), ("Enabled", "BOOL", "1"), ("Hidden", "BOOL", "0"))
    layers = ElementTree.SubElement(screen, "layers")
    for row in placed_rows(layout):
        if layout.page[row] == page:
            facet = int(layout.facet[row])
            names = facets.names if facets is not None else ()
            _slice(layers, facet_label(facet, names), _FIRST_ID + facet, _corners(layout, row))
    device = ElementTree.SubElement(screen, "OutputDevice")
    about = {"name": title, "deviceId": f"VirtualScreen {page + 1}"}
    ElementTree.SubElement(device, "OutputDeviceVirtual", {**about, **size})
    ElementTree.indent(root, "  ")
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


def _corners(layout: Layout, row: int) -> FloatArray:
    """The raster's corners (4, 2) on its page, clockwise in the facet's image from the top left."""
    width, height = layout.size[row].tolist()
    own = np.array([(0, 0, 1), (width, 0, 1), (width, height, 1), (0, height, 1)], dtype=np.float64)
    result: FloatArray = own @ layout.quilt_from_facet[row].T + 0.0
    return result


def _params(parent: ElementTree.Element, group: str, *params: tuple[str, str, str]) -> None:
    inner = ElementTree.SubElement(parent, "Params", name=group)
    for name, kind, value in params:
        ElementTree.SubElement(inner, "Param", {"name": name, "T": kind, "default": value, "value": value})


def _slice(layers: ElementTree.Element, name: str, number: int, corners: FloatArray) -> None:
    inner = ElementTree.SubElement(layers, "Slice", uniqueId=str(number))
    _params(inner, "Common", ("Name", "STRING", name), ("Enabled", "BOOL", "1"))
    source = ElementTree.SubElement(inner, "Params", name="Input")
    choice = {"name": "Input Source", "default": _COMPOSITION, "value": _COMPOSITION, "storeChoices": "0"}
    ElementTree.SubElement(source, "ParamChoice", choice)
    _params(inner, "Output", ("Flip", "UINT8", "0"), ("Is Key", "BOOL", "0"), ("Black BG", "BOOL", "0"))
    along = corners[1] - corners[0]
    turned = repr(math.atan2(along[1], along[0]) + 0.0)
    for tag in ("InputRect", "OutputRect"):
        _vertices(ElementTree.SubElement(inner, tag, orientation=turned), corners)
    warper = ElementTree.SubElement(inner, "Warper")
    mode = ElementTree.SubElement(warper, "Params", name="Warper")
    linear = {"name": "Point Mode", "default": "PM_LINEAR", "value": "PM_LINEAR", "storeChoices": "0"}
    ElementTree.SubElement(mode, "ParamChoice", linear)
    bezier = ElementTree.SubElement(warper, "BezierWarper", controlWidth="4", controlHeight="4")
    share = np.arange(4)[:, None] / 3
    lines = [corners[0] + (corners[3] - corners[0]) * down + along * share for down in share]
    _vertices(ElementTree.SubElement(bezier, "vertices"), np.concatenate(lines))
    homography = ElementTree.SubElement(warper, "Homography")
    for tag in ("src", "dst"):
        _vertices(ElementTree.SubElement(homography, tag), corners)


def _vertices(parent: ElementTree.Element, points: FloatArray) -> None:
    for x, y in points.tolist():
        ElementTree.SubElement(parent, "v", x=_number(x), y=_number(y))


def _number(value: float) -> str:
    return str(int(value)) if value.is_integer() else repr(value)


@dataclass(frozen=True)
class _Slice:
    """A slice of a composition: its name, page (0-based), and vertices (4, 2)."""

    name: str
    page: int
    corners: FloatArray


def read_resolume(path: Path, display: Facets | None, size: tuple[int, int] | None) -> Layout:
    """Read where slices lie on the composition; each is the facet of its name, `facet_0007` or its own.

    Where slices go on their screens, and how they are warped there, is Resolume's to do. Its corners are
    those of the facet's image, from the top left; those that are a tenth of a pixel off are put right.

    Raises:
        LayoutError: no display, a facet without a slice or with several, a slice of another size.
    """
    if display is None:
        words = "says where slices lie, not where facets are in the world: name the display"
        raise LayoutError(Problem(words, file=str(path)))
    slices: list[_Slice] = []
    pages = []
    for page, file in enumerate(existing_pages(path) or [path]):
        pages.append(_read_page(file, page, size, slices))
    rows = [k for k in range(display.count) if display.enabled[k]]
    found = [_of_facet(path, display, k, slices) for k in rows]
    problems = [one for one in found if isinstance(one, Problem)]
    rasters = display_rasters(display, [k + 1 for k in rows])
    maps = []
    for at, one in enumerate(found):
        if isinstance(one, _Slice):
            fitted = _fitted(path, one, rasters, at)
            problems += [fitted] if isinstance(fitted, Problem) else []
            maps.append(fitted)
    raise_all(LayoutError, problems[:20])
    layout = Layout(
        facet=np.array([k + 1 for k in rows], dtype=np.int32),
        page=np.array([one.page for one in found if isinstance(one, _Slice)], dtype=np.int32),
        size=rasters.size,
        quilt_from_facet=np.array(maps),
        origin=rasters.origin,
        du=rasters.du,
        dv=rasters.dv,
        corner_start=rasters.corner_start,
        polygon=rasters.polygon,
        pages=np.array(pages, dtype=np.int32),
        padding=0,
        method="resolume",
        display="",
        display_sha256="",
    )
    return adopted(layout, display, path)


def _read_page(path: Path, page: int, size: tuple[int, int] | None, slices: list[_Slice]) -> tuple[int, int]:
    """Add the slices of a file; the size of its composition."""
    data = read_input(path, LayoutError)
    if len(data) > _MOST_BYTES:
        raise LayoutError(Problem("is larger than any preset of Resolume", file=str(path)))
    root = parsed_xml(data, "", path)
    setup = root if root.tag == "ScreenSetup" else root.find(".//ScreenSetup")
    if setup is None:
        words = f"holds <{shorten(root.tag)}>, expected a preset of Resolume's Advanced Output: <ScreenSetup>"
        raise LayoutError(Problem(words, file=str(path)))
    for element in setup.iter("Slice"):
        choice = element.find("./Params[@name='Input']/ParamChoice[@name='Input Source']")
        if choice is None or choice.get("value", _COMPOSITION) == _COMPOSITION:
            slices.append(_read_slice(path, page, element))
    return _composition(path, setup, size)


def _composition(path: Path, setup: ElementTree.Element, size: tuple[int, int] | None) -> tuple[int, int]:
    element = setup.find("CurrentCompositionTextureSize")
    if element is None:  # of Arena 5 and 6
        element = setup.find("./sizing/inputs/InputSize")
    if element is None and size is not None:
        return size
    sides = [] if element is None else [element.get(key, "") for key in ("width", "height")]
    if not all(side.isdecimal() and 0 < int(side) <= _MOST_PIXELS for side in sides) or not sides:
        words = (
            "does not say how large its composition is (expected CurrentCompositionTextureSize, or a size)"
        )
        raise LayoutError(Problem(words, file=str(path)))
    return int(sides[0]), int(sides[1])


def _read_slice(path: Path, page: int, element: ElementTree.Element) -> _Slice:
    param = element.find("./Params[@name='Common']/Param[@name='Name']")
    name = param.get("value", "") if param is not None else ""
    try:
        points = [(float(v.attrib["x"]), float(v.attrib["y"])) for v in element.findall("./InputRect/v")]
    except (KeyError, ValueError):
        points = []
    if len(points) != 4 or not np.abs(points).max() <= _MOST_PIXELS:
        words = f"the slice {quoteattr(shorten(name))} has no InputRect of four vertices <v x y/>"
        raise LayoutError(Problem(words, file=str(path)))
    return _Slice(name, page, np.array(points))


def _of_facet(path: Path, display: Facets, k: int, slices: Sequence[_Slice]) -> _Slice | Problem:
    """The slice of a facet, by its row in the display."""
    own = display.names[k]
    mine = []
    for one in slices:
        label = parse_label(one.name)
        by_id = label is not None and label[0] == k + 1
        if by_id or (label is None and own and one.name.strip() == own):
            mine.append(one)
    named = called(k, display.names)
    if not mine:
        others = ", ".join(sorted({repr(shorten(one.name)) for one in slices})[:12]) or "none"
        words = f"has no slice for {named} (expected {facet_label(k + 1, display.names)!r} or the facet's"
        return Problem(f"{words} name; slices of the composition: {others})", file=str(path))
    if any(one.page != mine[0].page or not np.allclose(one.corners, mine[0].corners) for one in mine):
        return Problem(f"has {len(mine)} slices for {named} at several places", file=str(path))
    return mine[0]


def _fitted(path: Path, one: _Slice, rasters: Rasters, at: int) -> FloatArray | Problem:
    """The map (2, 3) of a facet's raster to its slice."""
    width, height = rasters.size[at].tolist()
    corners = one.corners
    near = np.rint(corners)
    corners = np.where(np.abs(corners - near) <= _CLOSE, near, corners)
    across, down = corners[1] - corners[0], corners[3] - corners[0]
    sizes = float(np.hypot(*across)), float(np.hypot(*down))
    bent = float(np.abs(corners[0] + across + down - corners[2]).max())
    square = abs(float(across @ down)) <= _CLOSE * max(sizes)
    if bent > _CLOSE or not square:
        words = f"the slice {one.name!r} is no rectangle on the composition"
        return Problem(words, file=str(path))
    if abs(sizes[0] - width) > _CLOSE or abs(sizes[1] - height) > _CLOSE:
        words = f"the slice {one.name!r} is {sizes[0]:.6g}×{sizes[1]:.6g} pixels from its top left corner on"
        return Problem(f"{words}, its facet's image {width}×{height}", file=str(path))
    turn = np.column_stack((across / sizes[0], down / sizes[1]))
    return np.column_stack((turn, corners[0])) + 0.0
