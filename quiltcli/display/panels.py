"""Facets from the panels of a display file: rectangles whose corners and rasters are closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from quiltcli.display.check import called, check_polygons
from quiltcli.display.facets import Facets, places_of
from quiltcli.display.rasters import MOST_PIXELS
from quiltcli.errors import DisplayError, Problem, raise_all
from quiltcli.geometry import FloatArray, applied, cross, dot, normalized
from quiltcli.job.display import DisplayFile, PanelSpec
from quiltcli.job.lengths import exact_metres

_SQUARE = 1e-9  # cosine of the angle between a raster's sides that still counts as a right one


def panel_facets(spec: DisplayFile) -> Facets:
    """Make the facets of a display that lists panels, one each, in the order of the file.

    A panel's raster is the panel, with exactly its pixels, and its upper edge is the image's: nothing
    is guessed from the world's vertical.

    Raises:
        DisplayError: panels too large, doubled, or sheared by the display's transform.
    """
    panels = spec.panels or ()
    count = len(panels)
    start = 4 * np.arange(count + 1, dtype=np.int64)
    names = tuple(panel.name for panel in panels)
    raise_all(DisplayError, _impossible_sizes(spec))
    middle, right, up = _half_axes(spec)
    raise_all(DisplayError, _sheared(right, up, spec))
    # From the lower left corner, anticlockwise as seen from the lit side.
    corners = middle[:, None] + np.stack((-right - up, right - up, right + up, up - right), axis=1)
    raise_all(DisplayError, _unfit(corners, spec))
    size = np.array([panel.pixels for panel in panels], dtype=np.int32)
    mirrored = np.array([panel.mirror for panel in panels])
    along = np.where(mirrored[:, None], -right, right)
    return Facets(
        names=names,
        corner_start=start,
        corners=corners.reshape(-1, 3),
        origin=middle - along + up,
        du=2 * along / size[:, :1] + 0.0,  # no −0, for people who read layouts
        dv=-2 * up / size[:, 1:] + 0.0,
        size=size,
        normal=normalized(cross(right, up)),
        both_sides=spec.viewing_side == "both",
        enabled=np.array([panel.enabled for panel in panels]),
        mirrored=mirrored,
        uv=None,
        path=str(spec.source.path),
        places=places_of({k: panel.place for k, panel in enumerate(panels, 1)}, spec.source, listed="panels"),
    )


def panel_axes(yaw_deg: float, pitch_deg: float, roll_deg: float) -> FloatArray:
    """Right, up and facing directions (3, 3), a row each, of a panel that is turned.

    Yaw about the vertical, anticlockwise from above; pitch up; roll in its own plane, clockwise as seen
    from the lit side; each about the axes that the ones before have left. Unturned it faces +Z.
    """
    (cy, sy), (cp, sp), (cr, sr) = map(_cos_sin, (yaw_deg, pitch_deg, roll_deg))
    level, facing = np.array((cy, 0.0, -sy)), np.array((sy * cp, sp, cy * cp))
    raised = np.array((-sy * sp, cp, -cy * sp))
    # Turned clockwise the right side goes down, and the top to the right.
    return np.stack((cr * level - sr * raised, sr * level + cr * raised, facing))


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exact at quarter turns."""
    if degrees % 90 == 0:
        quarter = int(degrees // 90) % 4
        return (1.0, 0.0, -1.0, 0.0)[quarter], (0.0, 1.0, 0.0, -1.0)[quarter]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def _half_axes(spec: DisplayFile) -> tuple[FloatArray, FloatArray, FloatArray]:
    """World middles (F, 3) of the panels and their vectors to the right edge and to the upper one."""
    placed = [_half_axes_of(panel, spec) for panel in spec.panels or ()]
    middle, right, up = (np.array(rows) for rows in zip(*placed, strict=True))
    matrix = spec.transform.array if spec.transform is not None else np.eye(4)
    middle, right, up = (applied(matrix[:3, :3], rows) for rows in (middle, right, up))
    return middle + matrix[:3, 3], right, up


def _half_axes_of(panel: PanelSpec, spec: DisplayFile) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same for one panel, before the display's transform."""
    width, height = (float(side / 2) for side in panel.metres(spec.metres))
    x, y, z = (float(exact_metres(value, spec.metres)) for value in panel.at)
    right, up, _ = panel_axes(panel.yaw_deg, panel.pitch_deg, panel.roll_deg)
    # Yaw 0 faces the world's +Z whichever axis is up, so only the place need be told anew.
    middle = np.array((x, z, -y) if spec.up_axis == "z" else (x, y, z))
    return middle, width * right, height * up


def _impossible_sizes(spec: DisplayFile) -> Iterator[Problem]:
    for k, panel in enumerate(spec.panels or ()):
        if max(panel.pixels) > MOST_PIXELS:
            yield spec.source.problem(("panels", k, "pixels"), f"expected at most {MOST_PIXELS} a side")


def _sheared(right: FloatArray, up: FloatArray, spec: DisplayFile) -> Iterator[Problem]:
    """Problems with a transform that makes parallelograms of rectangles."""
    lean = np.abs(dot(normalized(right), normalized(up)))
    for k in np.flatnonzero(lean > _SQUARE)[:1]:
        name = called(int(k), [panel.name for panel in spec.panels or ()])
        yield spec.source.problem(
            ("transform",), f"shears {name} (expected panels to stay rectangles: scale all axes alike)"
        )


def _unfit(corners: FloatArray, spec: DisplayFile) -> Iterator[Problem]:
    """Problems with panels that cannot be facets, doubled ones above all."""
    count = len(corners)
    # The 0-based panel stands in for the line, which the file is then asked for.
    rows = np.arange(count, dtype=np.int64)
    names = [panel.name for panel in spec.panels or ()]
    for problem in check_polygons(corners.reshape(-1, 3), 4 * np.arange(count + 1), names, rows, ""):
        yield spec.source.problem(("panels", problem.line), problem.message)
