"""Dictionaries of markers: squares that a camera tells apart, whichever way up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import JobError, missing_extra


def open_cv() -> Any:
    """OpenCV, which has the dictionaries and finds markers in photos.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import cv2
    except ImportError:
        raise missing_extra("a calibration by markers", "opencv-python-headless", "calib") from None
    return cv2


@dataclass(frozen=True)
class Dictionary:
    """Markers of one kind.

    Attributes:
        name: OpenCV's.
        modules: squares along a side, the black border's two with them.
        count: how many markers there are.
    """

    name: str
    modules: int
    count: int

    @property
    def words(self) -> Any:
        """OpenCV's record of it (MissingExtraError)."""
        aruco = open_cv().aruco
        return aruco.getPredefinedDictionary(getattr(aruco, self.name))

    def bits(self, marker: int) -> NDArray[np.uint8]:
        """A marker's modules (n, n), upright: 1 is white, the border is 0 (MissingExtraError)."""
        image = open_cv().aruco.generateImageMarker(self.words, marker, self.modules)
        result: NDArray[np.uint8] = (np.asarray(image) > 127).astype(np.uint8)
        return result


DICTIONARIES = {
    "4x4": Dictionary("DICT_4X4_1000", 6, 1000),
    "5x5": Dictionary("DICT_5X5_1000", 7, 1000),
    "6x6": Dictionary("DICT_6X6_1000", 8, 1000),
    "apriltag36h11": Dictionary("DICT_APRILTAG_36h11", 8, 587),
}
"""The dictionaries by the names a user gives."""


def dictionary(name: str) -> Dictionary:
    """The dictionary of this name (JobError)."""
    if name not in DICTIONARIES:
        raise JobError(f"unknown dictionary {name!r} (known: {', '.join(DICTIONARIES)})")
    return DICTIONARIES[name]
