"""From markers in photos to the poses of facets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from quiltcli.calibration.markers import MarkerSet, marker_places
from quiltcli.calibration.panels.adjust import Adjusted, Corners, adjust
from quiltcli.calibration.panels.attached import Attached, SeenBoard, joined, with_boards
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
from quiltcli.geometry import FloatArray, IntArray

_SURE = 0.05
"""A focal length is known if its standard deviation is a smaller part of it."""
_FEWEST_MARKS = 2


@dataclass(frozen=True)
class FoundBoard:
    """Where a board is.

    Attributes:
        board: the board.
        places: (m, 4, 3) corners of its markers, world metres.
        deviation: (3,) standard deviations of its middle, metres.
        photos: how many show it.
    """

    board: Attached
    places: FloatArray
    deviation: FloatArray
    photos: int


@dataclass(frozen=True)
class Solution:
    """Where the facets of a display are.

    Attributes:
        facets: (K,) ids of the facets that were sought.
        adjusted: what was found; boards are bodies behind the facets.
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
    boards: tuple[FoundBoard, ...] = ()

    @property
    def motions(self) -> FloatArray:
        """Rotation vectors and shifts (K, 6) of the facets."""
        return self.adjusted.bundle.facets[: len(self.facets)]

    def body(self, row: int) -> str:
        """Name of what corners of this row are on: a facet's id, or a board."""
        count = len(self.facets)
        return str(self.facets[row]) if row < count else f"board {row - count + 1}"

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
        result: FloatArray = np.linalg.norm(self.motions[:, 3:], axis=1)
        return result

    @property
    def turn(self) -> FloatArray:
        """By how much (K,) the facets are turned from where they should be, radians."""
        result: FloatArray = np.linalg.norm(self.motions[:, :3], axis=1)
        return result

    @property
    def shift_deviation(self) -> FloatArray:
        """Standard deviations (K, 3) of the middles, along the world's axes, metres."""
        return _deviation(self.adjusted.covariance[: len(self.facets), 3:, 3:])

    @property
    def turn_deviation(self) -> FloatArray:
        """Standard deviations (K, 3) of the turns, radians."""
        return _deviation(self.adjusted.covariance[: len(self.facets), :3, :3])


def solve(
    facets: Facets,
    markers: MarkerSet,
    seen: Sightings,
    camera: Camera | None = None,
    anchor: int | None = None,
    boards: Sequence[SeenBoard] = (),
) -> Solution:
    """Find where facets are from photos of the markers on them.

    Args:
        facets: the display as it should be; each facet is rigid, and of the size the file says.
        markers: what is on it.
        seen: what the photos show of these.
        camera: of the photos; sought with the rest if it is not known.
        anchor: id of the facet that stays where the file has it; the one that most markers are seen of
            by default.
        boards: what the photos show of boards that are rigidly attached to facets.

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
    tied = corners
    for number, board in enumerate(boards):
        tied = joined(tied, board.corners(len(ids) + number, board.board.corners))
    names = [*map(str, ids), *(f"(board {k + 1})" for k in range(len(boards)))]
    raise_all(JobError, unconnected(tied, names, len(seen.photos), held))
    frames = plane_frames(facets.du[rows], facets.dv[rows], middles)
    free = camera is None
    if camera is None:
        camera = first_camera(corners, frames, seen.size)
    otherwise = np.unique(tied.photo[tied.facet >= len(ids)]).tolist()
    bundle = first_bundle(camera, corners, frames, middles, held, seen.photos, free=free, otherwise=otherwise)
    shown = np.isin(np.arange(len(seen.photos)), corners.photo)
    bundle, tied, begun = with_boards(bundle, corners, boards, shown.tolist())
    adjusted = adjust(bundle, tied)
    check_camera(adjusted)
    marker = np.repeat(np.array([m.id for m in markers.markers], np.int64)[seen.marker], 4)
    for board in boards:
        marker = np.append(marker, np.repeat(board.board.first + board.marker, 4))
    found = tuple(_found(adjusted, tied, len(ids), k, board, begun[k]) for k, board in enumerate(boards))
    solution = Solution(ids, adjusted, tied, marker, seen.photos, _others(seen, boards, markers), found)
    _check_used(solution)
    return solution


def _deviation(covariance: FloatArray) -> FloatArray:
    result: FloatArray = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))
    return result


def _found(
    adjusted: Adjusted, corners: Corners, count: int, number: int, seen: SeenBoard, begun: FloatArray
) -> FoundBoard:
    """Where a board came to be from where the search began with it."""
    body = count + number
    motion, middle = adjusted.bundle.facets[body], adjusted.bundle.middles[body]
    places = Rotation.from_rotvec(motion[:3]).apply((begun - middle).reshape(-1, 3)) + middle + motion[3:]
    own = corners.facet == body
    return FoundBoard(
        seen.board,
        places.reshape(begun.shape),
        _deviation(adjusted.covariance[body : body + 1, 3:, 3:])[0],
        len(np.unique(corners.photo[own])),
    )


def _others(seen: Sightings, boards: Sequence[SeenBoard], markers: MarkerSet) -> tuple[int, ...]:
    """Markers that are neither the display's nor a board's."""
    known = {name for one in boards if one.board.dictionary == markers.dictionary for name in one.board.ids}
    return tuple(name for name in seen.strangers if name not in known)


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


def check_camera(adjusted: Adjusted) -> None:
    """Flat things seen from one side fit any focal length."""
    if adjusted.bundle.free:
        focal, deviation = adjusted.bundle.camera.focal[0], adjusted.camera_deviation[0]
        if not deviation < _SURE * focal:
            raise JobError(
                f"the photos do not tell the camera's focal length ({focal:.0f} ± {deviation:.0f}): flat "
                "facets seen from one side fit any (expected photos from several sides, 30 degrees apart "
                "and more, or the camera's own figures: --camera)"
            )


def _check_used(solution: Solution) -> None:
    """A body whose corners contradict all others was not found."""
    for row in range(len(solution.adjusted.bundle.facets)):
        own = solution.corners.facet == row
        if solution.adjusted.used[own].sum() < own.sum() / 2:
            if row < len(solution.facets):
                what, others = f"facet {solution.body(row)}", "the other facets"
                wanted = "the facet to be as large as the display's file says, its markers on their pixels"
            else:
                what, others = solution.body(row), "the facets"
                wanted = "the board to be flat and as large as --attached says, and to hold fast"
            raise JobError(
                f"the corners seen of {what} contradict those of {others} (expected {wanted}, and nothing "
                "to have moved between the photos)"
            )
