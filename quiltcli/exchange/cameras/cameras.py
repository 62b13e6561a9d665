"""The pinhole of a facet: its picture's edges are the raster's edges, so its pixels are the facet's.

A camera stands in the eye and looks straight at the facet's plane; its window lies off its axis. Which
way the viewer looks does not matter. A raster that is turned on its facet makes a camera that is rolled
alike; a mirrored one would need a left-handed camera, which no renderer has.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import DisplayError, Problem, raise_all
from quiltcli.geometry import FloatArray, cross, dot
from quiltcli.images.names import fit_names
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer

_SQUARE = 1e-9
_IN_PLANE = 1e-9  # metres


@dataclass(frozen=True)
class Camera:
    """An off-axis pinhole.

    Attributes:
        facet: 1-based id.
        name: fit for a file's name, unlike any other facet's.
        pixels: width and height.
        position: (3,) world metres.
        axes: (3, 3) unit rows right, up, forward; right × up is −forward.
        window: left, right, bottom, top of the picture on the plane at distance 1 along forward.
        near: distance along forward that is safely nearer than all the viewer's own range shows.
        far: likewise, farther.
    """

    facet: int
    name: str
    pixels: tuple[int, int]
    position: FloatArray
    axes: FloatArray
    window: tuple[float, float, float, float]
    near: float
    far: float

    @property
    def view(self) -> FloatArray:
        """Camera from world (4, 4), for columns: x right, y up, −z ahead."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes * np.array([[1.0], [1.0], [-1.0]])
        matrix[:3, 3] = -dot(matrix[:3, :3], self.position)
        return matrix

    @property
    def projection(self) -> FloatArray:
        """Clip from camera (4, 4), as OpenGL has it: −1 to 1, row 1 of a picture at y = +1."""
        left, right, bottom, top = self.window
        near, far = self.near, self.far
        return np.array(
            [
                [2 / (right - left), 0, (right + left) / (right - left), 0],
                [0, 2 / (top - bottom), (top + bottom) / (top - bottom), 0],
                [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
                [0, 0, -1, 0],
            ]
        )


@dataclass(frozen=True)
class Shot:
    """The cameras of one frame for one eye; facets that are dark for it have none.

    Attributes:
        frame: frame number.
        eye: `center`, `left` or `right`.
        cameras: by ascending facet.
    """

    frame: int
    eye: str
    cameras: tuple[Camera, ...]


def shots(facets: Facets, views: Sequence[View]) -> list[Shot]:
    """The cameras of all views.

    Raises:
        DisplayError: a facet whose raster no camera can make, by name.
    """
    raise_all(DisplayError, _unfit(facets))
    names = camera_names(facets)
    return [_shot(facets, names, view) for view in views]


def camera_names(facets: Facets) -> tuple[str, ...]:
    """A name for every facet: its own where that is fit and single, else `facet_0001`."""
    return fit_names(facets.names)


def _unfit(facets: Facets) -> Iterator[Problem]:
    lean = np.abs(dot(facets.du, facets.dv)) / np.sqrt(dot(facets.du, facets.du) * dot(facets.dv, facets.dv))
    for k in np.flatnonzero(facets.enabled & (facets.mirrored | (lean > _SQUARE))):
        name = f" ({facets.names[k]})" if facets.names[k] else ""
        what = (
            "is mirrored, and no camera makes a mirror image (mirror it in the quilt instead, by place)"
            if facets.mirrored[k]
            else "has a raster whose sides are not perpendicular, which no camera makes"
        )
        yield Problem(f"facet {k + 1}{name} {what}", file=facets.path)


def _shot(facets: Facets, names: Sequence[str], view: View) -> Shot:
    owned = [viewer.facets for viewer in view.viewers]
    cameras = []
    for k in range(facets.count):
        mine = any(ids is None or k + 1 in ids for ids in owned)
        camera = _camera(facets, k, names[k], view.viewer_of(k + 1)) if mine and facets.enabled[k] else None
        if camera is not None:
            cameras.append(camera)
    return Shot(view.frame, view.eye or "center", tuple(cameras))


def _camera(facets: Facets, k: int, name: str, viewer: Viewer) -> Camera | None:
    """The camera of a facet; None where the eye is not on its lit side."""
    du, dv = facets.du[k], facets.dv[k]
    right, up = du / np.sqrt(dot(du, du)), -dv / np.sqrt(dot(dv, dv))
    back = cross(right, up)
    local = facets.origin[k] - viewer.eye
    distance = -float(dot(local, back))
    if distance <= _IN_PLANE:
        return None
    across, down = facets.size[k]
    x, y = float(dot(local, right)), float(dot(local, up))
    end = local + across * du + down * dv
    window = (
        x / distance,
        float(dot(end, right)) / distance,
        float(dot(end, up)) / distance,
        y / distance,
    )
    axes = np.stack((right, up, -back))
    near, far = _range(axes, window, viewer)
    return Camera(k + 1, name, (int(across), int(down)), viewer.eye, axes, window, near, far)


def _range(
    axes: FloatArray, window: tuple[float, float, float, float], viewer: Viewer
) -> tuple[float, float]:
    """Near and far along the camera's axis that hold everything between the viewer's own.

    A ray that goes 1 along the axis goes so far in the viewer's measure; over the window the extremes of
    that are at corners (along the look direction) or bounded by them (by distance).
    """
    left, right, bottom, top = window
    corners = np.array([(x, y, 1.0) for x in (left, right) for y in (bottom, top)]) @ axes
    if viewer.by_distance:
        least, most = 1.0, float(np.sqrt(dot(corners, corners)).max())
    else:
        reach = dot(corners, viewer.look)
        least, most = float(reach.min()), float(reach.max())
        if least <= 1e-6:  # partly behind the viewer: what a plane would cut there is left to the renderer
            least, most = 1.0, max(most, float(np.sqrt(dot(corners, corners)).max()))
    return viewer.near / most, viewer.far / least
