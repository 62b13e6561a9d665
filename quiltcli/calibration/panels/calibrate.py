"""A display as it really is, from photos of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from quiltcli.calibration.markers import MarkerSet, place_markers, read_markers, unknown_markers
from quiltcli.calibration.panels.attached import check_boards, find_boards, parse_attached
from quiltcli.calibration.panels.board import camera_from_board, parse_board
from quiltcli.calibration.panels.camera import camera_of
from quiltcli.calibration.panels.display_files import moved_display
from quiltcli.calibration.panels.distances import Distance, distance_lines, enlarged, scale_of
from quiltcli.calibration.panels.sightings import find_markers
from quiltcli.calibration.panels.solve import Solution, solve
from quiltcli.calibration.panels.start import middles_of
from quiltcli.display import Facets
from quiltcli.errors import JobError, raise_all
from quiltcli.job import DisplayFile
from quiltcli.job.load import load_camera_file


@dataclass(frozen=True)
class Wishes:
    """How photos are to be understood.

    Attributes:
        markers: what `quilt pattern --kind markers` wrote; None for the markers it places by itself.
        dictionary: of the markers, where there is no such file.
        camera: the camera's file; None if it is not known.
        board: a ChArUco board in some of the photos, as `board.parse_board` reads it; empty for none.
        anchor: id of the facet that stays; None for the one that is seen most.
        attached: boards that are rigidly attached to facets, as `attached.parse_attached` reads them.
        distances: between corners, as `distances.parse_distance` reads them; none for lengths as the file
            has them.
    """

    markers: Path | None = None
    dictionary: str = "5x5"
    camera: Path | None = None
    board: str = ""
    anchor: int | None = None
    attached: tuple[str, ...] = ()
    distances: tuple[str, ...] = ()


def calibrate(facets: Facets, photos: Sequence[Path], wishes: Wishes) -> tuple[Solution, list[Path]]:
    """Find where a display's facets are; also the photos that were used for it.

    Raises:
        JobError: photos, markers or a camera that do not tell, each with what is missing.
        MissingExtraError: OpenCV is not installed.
    """
    markers = _markers(facets, wishes)
    boards = [parse_attached(text) for text in wishes.attached]
    check_boards(boards, markers, facets.count)
    camera = None if wishes.camera is None else camera_of(load_camera_file(wishes.camera))
    used = list(photos)
    if wishes.board:
        if camera is not None:
            raise JobError("--board: cannot stand beside --camera (either tells the camera)")
        camera, used = camera_from_board(photos, parse_board(wishes.board))
        if not used:
            raise JobError("every photo shows the board (expected photos of the display as well)")
    seen = find_markers(used, markers)
    return solve(facets, markers, seen, camera, wishes.anchor, find_boards(used, boards)[1]), used


def calibrated_files(
    spec: DisplayFile, facets: Facets, solution: Solution, mesh: str, distances: Sequence[Distance] = ()
) -> tuple[dict[str, str], list[str]]:
    """Texts of the display as it is, scaled to distances if there are any, and what these came to.

    Facets without markers stay where the file has them.
    """
    motions = solution.motions
    turns, shifts = np.tile(np.eye(3), (facets.count, 1, 1)), np.zeros((facets.count, 3))
    rows = np.array(solution.facets) - 1
    turns[rows], shifts[rows] = Rotation.from_rotvec(motions[:, :3]).as_matrix(), motions[:, 3:]
    middles = middles_of(facets.corners, facets.corner_start)
    if not distances:
        return moved_display(spec, facets, turns, middles, shifts, mesh), []
    row = np.repeat(np.arange(facets.count), np.diff(facets.corner_start))
    local = (turns[row] @ (facets.corners - middles[row])[..., None])[..., 0]
    corners = local + (middles + shifts)[row]
    scale, about = scale_of(distances, corners), middles[solution.anchor - 1]
    large = enlarged(facets, scale, about)
    spread = about + scale * (middles - about)
    files = moved_display(spec, large, turns, spread, scale * shifts, mesh, scale)
    return files, list(distance_lines(distances, corners, scale))


def _markers(facets: Facets, wishes: Wishes) -> MarkerSet:
    if wishes.markers is None:
        return place_markers(facets, wishes.dictionary)
    found = read_markers(wishes.markers)
    raise_all(JobError, list(unknown_markers(found, facets, wishes.markers))[:20])
    return found
