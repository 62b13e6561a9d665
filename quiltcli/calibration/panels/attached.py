"""Printed boards of markers that are rigidly attached to panels, beside the markers that panels show.

Harish & Narayanan fix printed markers to the panels of their cube (*A View-Dependent, Polyhedral 3D
Display*): photos tie boards together where no two panels are seen at once, and once it is known how
panels stand to a board, the board alone tells where they are. A board is a flat grid of markers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.calibration.dictionaries import dictionary, open_cv
from quiltcli.calibration.markers import MarkerSet
from quiltcli.calibration.panels.adjust import Bundle, Corners
from quiltcli.calibration.panels.camera import Camera
from quiltcli.calibration.panels.sightings import find_ids
from quiltcli.calibration.panels.start import miss
from quiltcli.errors import JobError, Problem
from quiltcli.formats.inputs import read_input
from quiltcli.formats.whole import write_text
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.job.lengths import read_length

_FORM = re.compile(r"(\d{1,3})x(\d{1,3}),([^,=]+),([^,=]+),([^,=]+),(\d{1,6})(?:=([\d,-]+))?")
_LIKE = "3x2,40mm,10mm,4x4,20=1-3"


@dataclass(frozen=True)
class Attached:
    """A board.

    Attributes:
        across: markers from left to right.
        down: markers from top to bottom.
        side: of a marker, metres.
        gap: between markers, metres.
        dictionary: of the markers.
        first: id of the top left one; others follow, row by row.
        facets: ids of the facets that it is rigidly attached to; none where that is not said.
    """

    across: int
    down: int
    side: float
    gap: float
    dictionary: str
    first: int
    facets: tuple[int, ...] = ()

    @property
    def ids(self) -> range:
        """Ids of its markers."""
        return range(self.first, self.first + self.across * self.down)

    @property
    def corners(self) -> FloatArray:
        """Corners (m, 4, 3) of its markers, metres from its top left: x right, y down, z away."""
        column, row = np.meshgrid(np.arange(self.across), np.arange(self.down))
        start = np.stack((column.ravel(), row.ravel()), axis=1) * (self.side + self.gap)
        flat = start[:, None] + self.side * np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
        return np.concatenate((flat, np.zeros((*flat.shape[:2], 1))), axis=2)


@dataclass(frozen=True)
class SeenBoard:
    """What photos show of a board.

    Attributes:
        board: the board.
        photo: (n,) photos, 0-based, of n sightings of markers.
        marker: (n,) rows of the markers.
        pixels: (n, 4, 2) their corners in the photo.
    """

    board: Attached
    photo: IntArray
    marker: IntArray
    pixels: FloatArray

    def corners(self, body: int, places: FloatArray) -> Corners:
        """As corners of a rigid body whose markers' corners (m, 4, 3) are there."""
        count = 4 * len(self.photo)
        return Corners(
            np.repeat(self.photo, 4),
            np.full(count, body, np.int64),
            places[self.marker].reshape(-1, 3),
            self.pixels.reshape(-1, 2),
        )


def parse_attached(text: str) -> Attached:
    """A board from a text such as `3x2,40mm,10mm,4x4,20=1-3`.

    Markers across and down, their side, the gap between them, dictionary, first id; and facets behind =.

    Raises:
        JobError: it is none.
    """
    found = _FORM.fullmatch(text.replace(" ", ""))
    sides = [read_length(side) for side in found.group(3, 4)] if found else []
    if found is None or None in sides or min(int(found[1]), int(found[2])) < 1:
        raise JobError(
            "--attached: expected markers across and down, their side, the gap, dictionary, first id and, if "
            f"wanted, facets, such as {_LIKE}, got {text!r}"
        )
    side, gap = (float(side) for side in sides if side is not None)
    if not side > 0 or gap < 0:
        raise JobError(f"--attached: expected markers and gaps of a size such as {_LIKE}, got {text!r}")
    board = Attached(
        int(found[1]), int(found[2]), side, gap, found[5], int(found[6]), _facets(found[7], text)
    )
    if board.ids[-1] >= dictionary(board.dictionary).count:
        words = f"has ids 0 to {dictionary(board.dictionary).count - 1}"
        raise JobError(
            f"--attached: dictionary {board.dictionary} {words}, and {text!r} ends at {board.ids[-1]}"
        )
    return board


def _facets(text: str | None, whole: str) -> tuple[int, ...]:
    ids: list[int] = []
    for part in (text or "").split(","):
        first, dash, last = part.partition("-")
        if not part:
            continue
        if not first.isdigit() or (dash and not last.isdigit()) or int(last or first) < int(first):
            raise JobError(f"--attached: expected facets such as 1-3,5 behind =, got {whole!r}")
        ids += range(int(first), int(last or first) + 1)
    return tuple(dict.fromkeys(ids))


def check_boards(boards: Sequence[Attached], markers: MarkerSet | None, facets: int) -> None:
    """Whether boards can be told from each other and from the display's markers.

    Raises:
        JobError: ids that are there twice, facets that are not there or on two boards.
    """
    taken = {} if markers is None else {(markers.dictionary, m.id): "the display" for m in markers.markers}
    owner: dict[int, int] = {}
    for number, board in enumerate(boards, 1):
        for name in board.ids:
            other = taken.setdefault((board.dictionary, name), f"board {number}")
            if other != f"board {number}":
                words = f"marker {name} of {board.dictionary} is on board {number} and on {other}"
                raise JobError(f"--attached: {words} (expected ids of its own, or another dictionary)")
        for facet in board.facets:
            if not 1 <= facet <= facets:
                raise JobError(f"--attached: there is no facet {facet} (the display has 1 to {facets})")
            if owner.setdefault(facet, number) != number:
                raise JobError(f"--attached: facet {facet} is on boards {owner[facet]} and {number}")


def find_boards(paths: Sequence[Path], boards: Sequence[Attached]) -> tuple[tuple[int, int], list[SeenBoard]]:
    """Look for boards in photos; also the photos' width and height.

    Raises:
        JobError: as `find_ids`; a board that no photo shows.
    """
    size, found = (0, 0), []
    for number, board in enumerate(boards, 1):
        seen = find_ids(paths, board.dictionary, board.ids)
        if not len(seen.photo):
            words = f"expected markers {board.ids[0]} to {board.ids[-1]}"
            raise JobError(f"no photo shows board {number} ({words})")
        size = seen.size
        found.append(SeenBoard(board, seen.photo, seen.marker, seen.pixels))
    return size, found


def with_boards(
    bundle: Bundle, corners: Corners, boards: Sequence[SeenBoard], placed: Sequence[bool]
) -> tuple[Bundle, Corners, list[FloatArray]]:
    """A bundle in which boards are rigid bodies as well, behind the facets, begun where photos see them.

    Args:
        bundle: of the facets; poses of photos that show none are to be found here.
        corners: of the facets' markers.
        boards: what is seen of boards.
        placed: photos whose pose is known already.

    Returns:
        The bundle, all corners, and where each board's markers (m, 4, 3) are at first, world metres.
    """
    photos, known = bundle.photos.copy(), list(placed)
    everything, begun = corners, []
    for body, seen in enumerate(boards, len(bundle.facets)):
        start = _begin(bundle.camera, photos, known, seen)
        begun.append(start)
        everything = joined(everything, seen.corners(body, start))
        # Photos that show no facet: by the first board that is known.
        for photo in np.unique(seen.photo).tolist():
            if not known[photo]:
                photos[photo], known[photo] = _pose(bundle.camera, seen, photo, start), True
    middles = [start.reshape(-1, 3).mean(axis=0) for start in begun]
    return (
        replace(
            bundle,
            photos=photos,
            facets=np.vstack((bundle.facets, np.zeros((len(boards), 6)))),
            middles=np.vstack((bundle.middles, *middles)),
        ),
        everything,
        begun,
    )


def joined(first: Corners, second: Corners) -> Corners:
    """All of them."""
    return Corners(
        np.concatenate((first.photo, second.photo)),
        np.concatenate((first.facet, second.facet)),
        np.concatenate((first.world, second.world)),
        np.concatenate((first.pixel, second.pixel)),
    )


def _begin(camera: Camera, photos: FloatArray, known: Sequence[bool], seen: SeenBoard) -> FloatArray:
    """Where a board's markers (m, 4, 3) are, by the photo whose view of it explains the other photos best."""
    cv2 = open_cv()
    local, best, least = seen.board.corners, seen.board.corners, np.inf
    here = [photo for photo in np.unique(seen.photo).tolist() if known[photo]]
    own = seen.corners(0, local)
    judged = own.kept(np.isin(own.photo, here))
    for photo in here:
        part = own.kept(own.photo == photo)
        _, turns, shifts, _ = cv2.solvePnPGeneric(
            part.world, part.pixel - 0.5, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
        )
        to_camera, _ = cv2.Rodrigues(photos[photo, :3])
        for vector, move in zip(turns, shifts, strict=True):
            turn, _ = cv2.Rodrigues(vector)
            # From the board before the lens, then back to the world.
            rotation, shift = to_camera.T @ turn, to_camera.T @ (move[:, 0] - photos[photo, 3:])
            moved = replace(judged, world=judged.world @ rotation.T + shift)
            error = 0.0
            for other in here:
                axes, _ = cv2.Rodrigues(photos[other, :3])
                error += miss(camera, moved.kept(moved.photo == other), axes, photos[other, 3:])
            if error < least:
                best, least = local @ rotation.T + shift, error
    return best


def _pose(camera: Camera, seen: SeenBoard, photo: int, place: FloatArray) -> FloatArray:
    """Rotation vector and shift (6,) of a photo that shows a board whose markers (m, 4, 3) are there."""
    cv2 = open_cv()
    own = seen.corners(0, seen.board.corners)
    part = own.kept(own.photo == photo)
    # The first of the two solutions is the one with the smaller error.
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        part.world, part.pixel - 0.5, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
    )
    turn, _ = cv2.Rodrigues(turns[0])
    right, down = ((place[0, k] - place[0, 0]) / seen.board.side for k in (1, 3))
    rotation = turn @ np.stack((right, down, np.cross(right, down)))
    vector, _ = cv2.Rodrigues(rotation)
    return np.concatenate((vector[:, 0], shifts[0][:, 0] - rotation @ place[0, 0]))


def write_rig(path: Path, boards: Sequence[Attached], places: Sequence[FloatArray]) -> None:
    """Write how boards stand to the display, for photos that show the boards alone (OutputError)."""
    entries = [
        {**asdict(board), "facets": list(board.facets), "corners": np.round(place, 9).tolist()}
        for board, place in zip(boards, places, strict=True)
    ]
    rows = ",\n ".join(json.dumps(entry) for entry in entries)
    write_text(path, f'{{"quilt_rig": 1, "boards": [\n {rows}\n]}}\n')


def read_rig(path: Path) -> tuple[list[Attached], list[FloatArray]]:
    """Read what `write_rig` wrote.

    Raises:
        JobError: no such file, or not one of these.
    """
    boards: list[Attached] = []
    places: list[FloatArray] = []
    try:
        found = json.loads(read_input(path, JobError, "a rig.json"))
        good = found["quilt_rig"] == 1 and len(found["boards"]) > 0
        for entry in found["boards"]:
            board, place = _entry(entry)
            boards.append(board)
            places.append(place)
    except (ValueError, KeyError, TypeError, RecursionError):
        good = False
    if not good:
        message = "is no rig (expected the rig.json that quilt calibrate --attached wrote into its report)"
        raise JobError(Problem(message, file=str(path)))
    return boards, places


def _entry(entry: dict[str, Any]) -> tuple[Attached, FloatArray]:
    """A board of the file and its corners; ValueError and the like where it is none."""
    values = {name: entry[name] for name in ("across", "down", "side", "gap", "dictionary", "first")}
    board = Attached(**values, facets=tuple(int(facet) for facet in entry["facets"]))
    place = np.array(entry["corners"], np.float64)
    if place.shape != board.corners.shape or not np.isfinite(place).all():
        raise ValueError("corners")
    dictionary(board.dictionary)
    return board, place
