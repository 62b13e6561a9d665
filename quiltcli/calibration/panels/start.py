"""Where the search for camera, photos and facets begins: from markers of single facets.

Each facet in a photo is a known flat figure, which alone tells where the photo was taken from, if not
always unambiguously. Of all the places that facets name, a photo takes the one that explains most of its
markers with the display as its file says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from quiltcli.calibration.dictionaries import open_cv
from quiltcli.calibration.panels.adjust import Bundle, Corners
from quiltcli.calibration.panels.camera import Camera, project
from quiltcli.errors import JobError, Problem, raise_all
from quiltcli.geometry import FloatArray, IntArray, normalized

_FEWEST_VIEWS = 4
"""Views of single facets that a camera of which nothing is known needs."""


def unconnected(corners: Corners, names: Sequence[str], photos: int, anchor: int) -> Iterator[Problem]:
    """Facets that no chain of photos leads to from the anchor."""
    # Facets of one photo are one group; groups that share a facet are one as well.
    group = np.arange(len(names))
    for number in range(photos):
        here = np.unique(group[np.unique(corners.facet[corners.photo == number])])
        if here.size:
            group[np.isin(group, here)] = here[0]
    lost = [names[k] for k in np.flatnonzero(group != group[anchor]).tolist()]
    if lost:
        yield Problem(
            f"no photo shows facets {', '.join(lost)} together with facet {names[anchor]}, or with a facet "
            "that is tied to it (expected photos that show two neighbours at once, all the way round)"
        )


def first_camera(corners: Corners, frames: FloatArray, size: tuple[int, int]) -> Camera:
    """A camera from flat figures seen from several sides (Zhang), without distortion.

    Args:
        corners: what the photos show.
        frames: (K, 3, 4) from the world to each facet's plane: its axes, and minus its middle along them.
        size: of the photos, pixels.

    Raises:
        JobError: too few views to tell.
    """
    cv2 = open_cv()
    flat, seen = [], []
    for photo, facet in _views(corners):
        here = (corners.photo == photo) & (corners.facet == facet)
        flat.append(_in_plane(corners.world[here], frames[facet]).astype(np.float32))
        seen.append((corners.pixel[here] - 0.5).astype(np.float32))
    if len(flat) < _FEWEST_VIEWS:
        raise JobError(
            f"the photos show {len(flat)} views of facets, too few to tell what camera took them (expected "
            f"{_FEWEST_VIEWS} from different sides at least, or the camera's own figures: --camera)"
        )
    guess = 1.2 * max(size)
    matrix = np.array([[guess, 0, (size[0] - 1) / 2], [0, guess, (size[1] - 1) / 2], [0, 0, 1.0]])
    flags = (
        cv2.CALIB_USE_INTRINSIC_GUESS
        | cv2.CALIB_FIX_ASPECT_RATIO
        | cv2.CALIB_FIX_PRINCIPAL_POINT
        | cv2.CALIB_ZERO_TANGENT_DIST
        | cv2.CALIB_FIX_K1
        | cv2.CALIB_FIX_K2
        | cv2.CALIB_FIX_K3
    )
    _, matrix, *_ = cv2.calibrateCamera(flat, seen, size, matrix, np.zeros(5), flags=flags)
    focal = float(np.clip(matrix[0, 0], 0.2 * max(size), 20 * max(size)))
    return Camera(size, np.array((focal, focal)), np.array(size) / 2, np.zeros(5))


def first_bundle(
    camera: Camera,
    corners: Corners,
    frames: FloatArray,
    middles: FloatArray,
    anchor: int,
    photos: Sequence[str],
    *,
    free: bool,
    otherwise: Sequence[int] = (),
) -> Bundle:
    """Where the search begins: the display as it should be, and each photo's pose.

    Photos that show something else, `otherwise`, need show no facet; their poses are zero then.

    Raises:
        JobError: photos in which nothing was found.
    """
    shows = np.isin(np.arange(len(photos)), corners.photo)
    empty = [name for k, name in enumerate(photos) if not shows[k] and k not in otherwise]
    raise_all(JobError, [Problem("no marker of the display was found in it", file=name) for name in empty])
    poses = np.zeros((len(photos), 6))
    for k in np.flatnonzero(shows).tolist():
        poses[k] = _pose(camera, corners.kept(corners.photo == k), frames)
    return Bundle(camera, poses, np.zeros((len(middles), 6)), middles, anchor, free)


def _pose(camera: Camera, here: Corners, frames: FloatArray) -> FloatArray:
    """Rotation vector and shift (6,) of a photo, from its corners."""
    cv2 = open_cv()
    best, least = np.zeros(6), np.inf
    for facet in np.unique(here.facet).tolist():
        own = here.facet == facet
        axes, shift = frames[facet][:, :3], frames[facet][:, 3]
        flat = _in_plane(here.world[own], frames[facet])
        _, turns, shifts, _ = cv2.solvePnPGeneric(
            flat, here.pixel[own] - 0.5, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
        )
        for vector, move in zip(turns, shifts, strict=True):
            # From the world to the facet's plane, then before the lens.
            turn, _ = cv2.Rodrigues(vector)
            rotation, translation = turn @ axes, turn @ shift + move[:, 0]
            error = miss(camera, here, rotation, translation)
            if error < least:
                least = error
                best = np.concatenate((cv2.Rodrigues(rotation)[0][:, 0], translation))
    return best


def miss(camera: Camera, here: Corners, rotation: FloatArray, translation: FloatArray) -> float:
    """How badly a pose explains a photo: errors in pixels, of which none counts more than a few hundred."""
    seen = here.world @ rotation.T + translation
    away = np.abs(project(camera, seen) - here.pixel).sum(axis=1)
    result: float = float(np.where(seen[:, 2] > 0, np.minimum(away, 300.0), 600.0).mean())
    return result


def _views(corners: Corners) -> list[tuple[int, int]]:
    """Photos and facets that are seen in them."""
    pairs = np.unique(np.stack((corners.photo, corners.facet), axis=1), axis=0)
    return [(int(photo), int(facet)) for photo, facet in pairs]


def _in_plane(world: FloatArray, frame: FloatArray) -> FloatArray:
    """Points (n, 3) in a facet's plane: z is 0."""
    local = world @ frame[:, :3].T + frame[:, 3]
    local[:, 2] = 0
    return local


def plane_frames(du: FloatArray, dv: FloatArray, middles: FloatArray) -> FloatArray:
    """World to plane (K, 3, 4): along the rasters' steps (K, 3), and off the plane; middles (K, 3) at 0."""
    right, down = normalized(du), normalized(dv)
    axes = np.stack((right, down, np.cross(right, down)), axis=1)
    return np.concatenate((axes, -(axes @ middles[..., None])), axis=2)


def middles_of(corners: FloatArray, start: IntArray) -> FloatArray:
    """Means (F, 3) of the facets' corners (C, 3)."""
    sums = np.add.reduceat(corners, start[:-1], axis=0)
    result: FloatArray = sums / np.diff(start)[:, None]
    return result
