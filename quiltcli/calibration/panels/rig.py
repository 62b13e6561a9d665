"""Panels that have moved in sets, from photos of the boards alone that they are fixed to.

Once a calibration has told how boards stand to the display (its `rig.json`), nothing has to be shown on the
panels any more: each board carries its facets along, rigidly.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from quiltcli.calibration.panels.adjust import Adjusted, Corners, adjust
from quiltcli.calibration.panels.attached import Attached, SeenBoard, check_boards, find_boards, joined
from quiltcli.calibration.panels.camera import Camera
from quiltcli.calibration.panels.display_files import moved_display
from quiltcli.calibration.panels.solve import check_camera
from quiltcli.calibration.panels.start import first_bundle, first_camera, plane_frames, unconnected
from quiltcli.display import Facets
from quiltcli.errors import JobError
from quiltcli.geometry import FloatArray
from quiltcli.job import DisplayFile


@dataclass(frozen=True)
class Moved:
    """Sets of facets that have moved.

    Attributes:
        boards: K boards, each with its facets.
        adjusted: the boards' motions, a body each.
        corners: what they were found from.
        photos: how many photos there were.
    """

    boards: tuple[Attached, ...]
    adjusted: Adjusted
    corners: Corners
    photos: int


def find_moved(
    facets: Facets,
    boards: Sequence[Attached],
    places: Sequence[FloatArray],
    photos: Sequence[Path],
    camera: Camera | None = None,
    anchor: int | None = None,
) -> Moved:
    """Look for the boards of a rig in photos, and find how they have moved; as `solve_rig`."""
    check_boards(boards, None, facets.count)
    size, found = find_boards(photos, boards)
    names = tuple(path.name for path in photos)
    return solve_rig(boards, places, found, names, size, camera, anchor)


def solve_rig(
    boards: Sequence[Attached],
    places: Sequence[FloatArray],
    seen: Sequence[SeenBoard],
    photos: Sequence[str],
    size: tuple[int, int],
    camera: Camera | None = None,
    anchor: int | None = None,
) -> Moved:
    """Find how boards have moved against each other.

    Args:
        boards: the boards, each with the facets that it carries.
        places: (m, 4, 3) corners of their markers before, world metres.
        seen: what photos show of them.
        photos: the photos' names.
        size: width and height of the photos, pixels.
        camera: of the photos; sought as well if it is not known.
        anchor: id of a facet whose set stays; the board that is seen most stays by default.

    Raises:
        JobError: boards without facets, one board alone, photos that do not tell.
    """
    for number, board in enumerate(boards, 1):
        if not board.facets:
            words = "expected --attached …=1-3 when the rig was measured"
            raise JobError(f"board {number} of the rig carries no facets ({words})")
    if len(boards) < 2:
        raise JobError("one board alone cannot have moved against another (expected two sets of facets)")
    if camera is not None and camera.size != size:
        raise JobError(
            f"the camera's photos are {camera.size[0]} × {camera.size[1]} pixels, "
            f"these are {size[0]} × {size[1]} (expected photos as the camera was measured with)"
        )
    corners = seen[0].corners(0, places[0])
    for k, one in enumerate(seen[1:], 1):
        corners = joined(corners, one.corners(k, places[k]))
    held = _anchor(boards, corners, anchor)
    names = [f"(board {k + 1})" for k in range(len(boards))]
    lost = list(unconnected(corners, names, len(photos), held))
    if lost:
        words = "not every board is tied to the others by a photo that shows two of them"
        raise JobError(f"{words} (expected photos that show neighbours, all the way round)")
    middles = np.array([place.reshape(-1, 3).mean(axis=0) for place in places])
    right, down = (np.array([place[0, k] - place[0, 0] for place in places]) for k in (1, 3))
    frames = plane_frames(right, down, middles)
    free = camera is None
    if camera is None:
        camera = first_camera(corners, frames, size)
    adjusted = adjust(first_bundle(camera, corners, frames, middles, held, photos, free=free), corners)
    check_camera(adjusted)
    for row in range(len(boards)):
        own = corners.facet == row
        if adjusted.used[own].sum() < own.sum() / 2:
            raise JobError(
                f"the corners seen of board {row + 1} contradict those of the other boards (expected boards "
                "as large as the rig says, and nothing to have moved between the photos)"
            )
    return Moved(tuple(boards), adjusted, corners, len(photos))


def _anchor(boards: Sequence[Attached], corners: Corners, wish: int | None) -> int:
    if wish is None:
        return int(np.bincount(corners.facet, minlength=len(boards)).argmax())
    for row, board in enumerate(boards):
        if wish in board.facets:
            return row
    known = ", ".join(str(facet) for board in boards for facet in board.facets)
    raise JobError(f"--anchor {wish}: no board carries this facet (known: {known})")


def rig_files(spec: DisplayFile, facets: Facets, moved: Moved, mesh: str) -> dict[str, str]:
    """Texts of the display whose facets were carried along; those on no board stay."""
    bundle = moved.adjusted.bundle
    turns, shifts = np.tile(np.eye(3), (facets.count, 1, 1)), np.zeros((facets.count, 3))
    about = np.zeros((facets.count, 3))
    for row, board in enumerate(moved.boards):
        rows = np.array(board.facets) - 1
        turns[rows] = Rotation.from_rotvec(bundle.facets[row, :3]).as_matrix()
        shifts[rows], about[rows] = bundle.facets[row, 3:], bundle.middles[row]
    return moved_display(spec, facets, turns, about, shifts, mesh)


def rig_table(moved: Moved) -> Iterator[str]:
    """A line a board: how it has moved with its facets, and how sure that is (two standard deviations)."""
    adjusted = moved.adjusted
    yield "board  facets        moved mm (x, y, z)            ±      turned °   ±       corners   rms px"
    for row, board in enumerate(moved.boards):
        own = (moved.corners.facet == row) & adjusted.used
        rms = math.sqrt(float((adjusted.residual[own] ** 2).sum() / max(int(own.sum()), 1)))
        motion = adjusted.bundle.facets[row]
        shift, turn = (
            2 * math.sqrt(max(float(np.trace(adjusted.covariance[row, part, part])), 0.0))
            for part in (slice(3, 6), slice(0, 3))
        )
        words = " ".join(f"{1000 * value:8.2f}" for value in motion[3:])
        names = ",".join(map(str, board.facets))
        note = "  stays" if row == adjusted.bundle.anchor else ""
        angle = math.degrees(float(np.linalg.norm(motion[:3])))
        yield (
            f"{row + 1:>5}  {names[:12]:<12}  {words}  {1000 * shift:8.3f}  {angle:8.3f}  "
            f"{math.degrees(turn):7.4f}  {int(own.sum()):>7}   {rms:6.3f}{note}"
        )
    yield f"{moved.photos} photos of boards; corners agree to {adjusted.deviation:.3f} px"
