"""Markers seen in photos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.calibration.dictionaries import dictionary, open_cv
from quiltcli.calibration.markers import MarkerSet
from quiltcli.errors import JobError, Problem, raise_all
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import FloatArray, IntArray


@dataclass(frozen=True)
class Sightings:
    """n sightings: one marker in one photo each.

    Attributes:
        photos: names of all photos, for messages.
        size: width and height of the photos, pixels.
        photo: (n,) 0-based photo.
        marker: (n,) row of the marker in its set.
        pixels: (n, 4, 2) its corners, from the photo's top-left corner, in the order of `Marker.corners`.
        strangers: ids of the dictionary that were seen and are not on the display.
    """

    photos: tuple[str, ...]
    size: tuple[int, int]
    photo: IntArray
    marker: IntArray
    pixels: FloatArray
    strangers: tuple[int, ...] = ()


def find_markers(paths: Sequence[Path], markers: MarkerSet) -> Sightings:
    """Look for a display's markers in photos; errors as for `find_ids`."""
    return find_ids(paths, markers.dictionary, [marker.id for marker in markers.markers])


def find_ids(paths: Sequence[Path], name: str, ids_wanted: Sequence[int]) -> Sightings:
    """Look for some markers of a dictionary in photos; a sighting's marker is its row among these.

    Raises:
        JobError: photos that cannot be read or are of different sizes, a marker that is in one twice.
        MissingExtraError: OpenCV is not installed.
    """
    cv2 = open_cv()
    detector = _detector(cv2, dictionary(name).words)
    row_of = {wanted: row for row, wanted in enumerate(ids_wanted)}
    size: tuple[int, int] | None = None
    photo, marker, pixels, strangers = [], [], [], set()
    problems: list[Problem] = []
    for number, path in enumerate(paths):
        image = read_photo(cv2, path)
        here = (image.shape[1], image.shape[0])
        size = size or here
        if here != size:
            problems.append(
                Problem(
                    f"is {here[0]} × {here[1]} pixels (expected {size[0]} × {size[1]} like {paths[0].name}: "
                    "all photos by one camera, held the same way, uncut)",
                    file=str(path),
                )
            )
            continue
        found, ids, _ = detector.detectMarkers(image)
        ids = [] if ids is None else ids.reshape(-1).tolist()
        problems += _twice(ids, path)
        for corners, marked in zip(found, ids, strict=True):
            if marked not in row_of:
                strangers.add(marked)
                continue
            photo.append(number)
            marker.append(row_of[marked])
            pixels.append(corners.reshape(4, 2).astype(float))
    raise_all(JobError, problems)
    assert size is not None
    return Sightings(
        tuple(path.name for path in paths),
        size,
        np.array(photo, np.int64),
        np.array(marker, np.int64),
        np.array(pixels, float).reshape(-1, 4, 2),
        tuple(sorted(strangers)),
    )


def _detector(cv2: Any, words: Any) -> Any:
    """OpenCV's, with corners where lines meet that are fitted to the marker's edges.

    Of its refinements this one is several times as exact on slanted markers, and no corner of another
    thing nearby draws it away. It counts pixels from the photo's corner, as this program does.
    """
    wishes = cv2.aruco.DetectorParameters()
    wishes.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    wishes.minMarkerPerimeterRate = 0.01
    return cv2.aruco.ArucoDetector(words, wishes)


def read_photo(cv2: Any, path: Path) -> Any:
    """A photo's grey values (H, W), upright as its camera says (JobError)."""
    data = np.frombuffer(read_input(path, JobError, "a photo"), np.uint8)
    try:
        image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if data.size else None
    except cv2.error:
        image = None
    if image is None:
        raise JobError(Problem("cannot be read as a photo (expected JPEG, PNG or TIFF)", file=str(path)))
    return image


def _twice(ids: Sequence[int], path: Path) -> Iterator[Problem]:
    for name in sorted({name for name in ids if ids.count(name) > 1}):
        yield Problem(
            f"shows marker {name} twice (expected once; a mirror image, or a second display with the same "
            "markers? cover it)",
            file=str(path),
        )
