"""From markers in photos to the poses of facets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.calibration.markers import MarkerSet, marker_places
from quiltcli.calibration.panels.adjust import Adjusted, Corners, adjust
from quiltcli.calibration.panels.camera import Camera
from quiltcli.calibration.panels.sightings import Sightings
from quiltcli.calibration.panels.start import (
    first_bundle,
    first_camera,
    middles_of,
    plane_frames,
    unconnected,
)
from quiltcli.display import Facets
from quiltcli.errors import JobError, Problem, counted, raise_all
from quiltcli.geometry import BoolArray, FloatArray, IntArray

_SURE = 0.05
"""A focal length is known if its standard deviation is a smaller part of it."""
_FEWEST_MARKS = 2


@dataclass(frozen=True)
class Solution:
    """Where the facets of a display are.

    Attributes:
        facets: (K,) ids of the facets that were sought.
        adjusted: what was found.
        corners: what it was found from.
        marker: (n,) ids of the markers the corners belong to.
        photos: the photos' names.
        strangers: markers of the dictionary that were seen and are not on the display.
    """

    facets: tuple[int, ...]
    adjusted: Adjusted
    corners: Corners
    marker: IntArray
    photos: tuple[str, ...]
    strangers: tuple[int, ...]

    @property
    def camera(self) -> Camera:
        """The camera of the photos."""
        return self.adjusted.bundle.camera

    @property
    def anchor(self) -> int:
        """Id of the facet that stays where the display's file has it."""
        return self.facets[self.adjusted.bundle.anchor]

    @property
    def shift(self) -> FloatArray:
        """How far (K,) the facets' middles are from where they should be, metres."""
        result: FloatArray = np.linalg.norm(self.adjusted.bundle.facets[:, 3:], axis=1)
        return result

    @property
    def turn(self) -> FloatArray:
        """By how much (K,) the facets are turned from where they should be, radians."""
        result: FloatArray = np.linalg.norm(self.adjusted.bundle.facets[:, :3], axis=1)
        return result

    @property
    def shift_deviation(self) -> FloatArray:
        """Standard deviations (K, 3) of the middles, along the world's axes, metres."""
        return np.sqrt(np.maximum(np.diagonal(self.adjusted.covariance[:, 3:, 3:], axis1=1, axis2=2), 0))

    @property
    def turn_deviation(self) -> FloatArray:
        """Standard deviations (K, 3) of the turns, radians."""
        return np.sqrt(np.maximum(np.diagonal(self.adjusted.covariance[:, :3, :3], axis1=1, axis2=2), 0))


def solve(
    facets: Facets,
    markers: MarkerSet,
    seen: Sightings,
    camera: Camera | None = None,
    anchor: int | None = None,
) -> Solution:
    """Find where facets are from photos of the markers on them.

    Args:
        facets: the display as it should be; each facet is rigid, and of the size the file says.
        markers: what is on it.
        seen: what the photos show of these.
        camera: of the photos; sought with the rest if it is not known.
        anchor: id of the facet that stays where the file has it; the one that most markers are seen of
            by default.

    Raises:
        JobError: photos that do not tell: too few, facets that are in none, a camera that they leave open.
    """
    if camera is not None and camera.size != seen.size:
        raise JobError(
            f"the camera's photos are {camera.size[0]} × {camera.size[1]} pixels, "
            f"these are {seen.size[0]} × {seen.size[1]} (expected photos as the camera was measured with)"
        )
    marked = sorted({marker.facet for marker in markers.markers})
    facet_of = np.array([marker.facet for marker in markers.markers], np.int64)[seen.marker]
    raise_all(JobError, _unseen(marked, facet_of, seen))
    ids = tuple(marked)
    rows = np.array(ids) - 1
    corners = _corners(facets, markers, seen, np.searchsorted(marked, facet_of))
    middles = middles_of(facets.corners, facets.corner_start)[rows]
    held = _anchor(ids, facet_of, anchor)
    raise_all(JobError, unconnected(corners, ids, len(seen.photos), held))
    frames = plane_frames(facets.du[rows], facets.dv[rows], middles)
    free = camera is None
    if camera is None:
        camera = first_camera(corners, frames, seen.size)
    bundle = first_bundle(camera, corners, frames, middles, held, seen.photos, free=free)
    adjusted = adjust(bundle, corners)
    _check_camera(adjusted)
    _check_used(adjusted.used, corners, ids)
    marker = np.repeat(np.array([m.id for m in markers.markers], np.int64)[seen.marker], 4)
    return Solution(ids, adjusted, corners, marker, seen.photos, seen.strangers)


def _corners(facets: Facets, markers: MarkerSet, seen: Sightings, facet: IntArray) -> Corners:
    places = marker_places(facets, markers.markers)[seen.marker]
    return Corners(
        np.repeat(seen.photo, 4), np.repeat(facet, 4), places.reshape(-1, 3), seen.pixels.reshape(-1, 2)
    )


def _unseen(marked: list[int], facet: IntArray, seen: Sightings) -> Iterator[Problem]:
    """Facets of which too little is seen."""
    if not len(facet):
        yield Problem(
            f"no marker was found in {counted(len(seen.photos), 'photo')} (expected markers that fill a "
            "hundredth of a photo's width or more, sharp, with their white border, of the dictionary named)"
        )
        return
    lost = [str(name) for name in marked if not (facet == name).any()]
    if lost:
        yield Problem(
            f"no photo shows a marker of facets {', '.join(lost)} (expected each facet in two photos)"
        )
    views = {name: len(np.unique(seen.photo[facet == name])) for name in marked}
    single = [str(name) for name, count in views.items() if 0 < count < _FEWEST_MARKS]
    if single:
        yield Problem(
            f"only one photo shows facets {', '.join(single)} (expected two at least, from different places)"
        )


def _anchor(ids: tuple[int, ...], facet: IntArray, wish: int | None) -> int:
    if wish is None:
        return int(np.argmax([(facet == name).sum() for name in ids]))
    if wish not in ids:
        raise JobError(f"--anchor {wish}: there is no such facet with markers (known: {_listed(ids)})")
    return ids.index(wish)


def _listed(ids: tuple[int, ...]) -> str:
    return ", ".join(map(str, ids)) if len(ids) < 12 else f"{ids[0]} to {ids[-1]}"


def _check_camera(adjusted: Adjusted) -> None:
    """Flat things seen from one side fit any focal length."""
    if adjusted.bundle.free:
        focal, deviation = adjusted.bundle.camera.focal[0], adjusted.camera_deviation[0]
        if not deviation < _SURE * focal:
            raise JobError(
                f"the photos do not tell the camera's focal length ({focal:.0f} ± {deviation:.0f}): flat "
                "facets seen from one side fit any (expected photos from several sides, 30 degrees apart "
                "and more, or the camera's own figures: --camera)"
            )


def _check_used(used: BoolArray, corners: Corners, ids: tuple[int, ...]) -> None:
    """A facet whose corners contradict all others was not found."""
    for row, name in enumerate(ids):
        own = corners.facet == row
        if used[own].sum() < own.sum() / 2:
            raise JobError(
                f"the corners seen of facet {name} contradict those of the other facets (expected the facet "
                "to be as large as the display's file says, its markers on their pixels, and nothing to have "
                "moved between the photos)"
            )
