"""The camera from photos of a ChArUco board: a checkerboard with markers in its white squares."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.calibration.dictionaries import dictionary, open_cv
from quiltcli.calibration.panels.camera import Camera
from quiltcli.calibration.panels.sightings import read_photo
from quiltcli.errors import JobError
from quiltcli.job.lengths import read_length

_FORM = re.compile(r"(\d+)x(\d+),([^,]+),([^,]+)(?:,([^,]+))?")
_FEWEST_CORNERS = 6
_FEWEST_PHOTOS = 4
_WORST = 2.0


@dataclass(frozen=True)
class Board:
    """A ChArUco board.

    Attributes:
        squares: across and down.
        square: side of a square, metres.
        marker: side of a marker, metres.
        dictionary: name of the markers' dictionary.
    """

    squares: tuple[int, int]
    square: float
    marker: float
    dictionary: str


def parse_board(text: str) -> Board:
    """A board from a text such as `7x5,30mm,22mm,4x4`: squares, their side, the markers' side, dictionary.

    Raises:
        JobError: it is none.
    """
    found = _FORM.fullmatch(text.replace(" ", ""))
    sides = [read_length(side) for side in found.group(3, 4)] if found else [None]
    if found is None or None in sides or min(int(found[1]), int(found[2])) < 2:
        raise JobError(
            f"--board: expected squares, their side, the markers' side and a dictionary, such as "
            f"7x5,30mm,22mm,4x4, got {text!r}"
        )
    square, marker = (float(side) for side in sides if side is not None)
    if not 0 < marker < square:
        raise JobError(f"--board: expected markers smaller than their squares, got {text!r}")
    dictionary(found[5] or "4x4")
    return Board((int(found[1]), int(found[2])), square, marker, found[5] or "4x4")


def camera_from_board(paths: Sequence[Path], board: Board) -> tuple[Camera, list[Path]]:
    """The camera from those of the photos that show the board; and the others.

    Raises:
        JobError: too few photos show it, or it is not as large as was said.
    """
    cv2 = open_cv()
    words = dictionary(board.dictionary).words
    made = cv2.aruco.CharucoBoard(board.squares, board.square, board.marker, words)
    detector = cv2.aruco.CharucoDetector(made)
    points, pixels, rest, size = [], [], [], (0, 0)
    for path in paths:
        image = read_photo(cv2, path)
        corners, ids, _, _ = detector.detectBoard(image)
        if ids is None or len(ids) < _FEWEST_CORNERS:
            rest.append(path)
            continue
        known, seen = made.matchImagePoints(corners, ids)
        points.append(known.astype(np.float32))
        pixels.append(seen.astype(np.float32))
        size = (image.shape[1], image.shape[0])
    if len(points) < _FEWEST_PHOTOS:
        raise JobError(
            f"the board was found in {len(points)} of {len(paths)} photos (expected {_FEWEST_PHOTOS} at "
            "least, from several sides, most of it in each)"
        )
    error, matrix, terms, _, _ = cv2.calibrateCamera(points, pixels, size, None, None)
    if not error < _WORST:
        raise JobError(
            f"the board's corners are {error:.1f} pixels from where a camera would see them (expected under "
            f"{_WORST:g}: is it flat, and is --board right?)"
        )
    focal, centre = np.array((matrix[0, 0], matrix[1, 1])), np.array((matrix[0, 2], matrix[1, 2])) + 0.5
    return Camera(size, focal, centre, np.asarray(terms, float).reshape(-1)[:5]), rest
