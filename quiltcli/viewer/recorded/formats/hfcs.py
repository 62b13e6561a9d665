"""HitFilm composites as CamTrackAR writes them (`.hfcs`): XML with keys of a camera's place and turn.

Places are in pixels of 1/72 inch, as HitFilm has them, y up; angles are degrees with their signs
reversed, turned about z, then y, then x; key k stands at k / FrameRate seconds.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from quiltcli.formats.yaml.syntax import read_text
from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.tables import check_size
from quiltcli.viewer.recorded.take import Y_UP, Recording, choose, wrong

PIXELS_PER_METRE = 2835.2


def read_hfcs(spec: RecordedSpec) -> Recording:
    """Samples of a camera of a `.hfcs` file.

    Raises:
        ViewerError: the file is no XML, or has no camera with keys.
    """
    check_size(spec.file)
    text = read_text(spec.file)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise wrong(spec.file, "defines entities (expected the plain XML that CamTrackAR writes)")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise wrong(spec.file, f"not XML: {error.msg}", *error.position) from None
    cameras = list(root.iter("CameraLayer"))
    names = [camera.findtext(".//Name") or f"camera {k}" for k, camera in enumerate(cameras, 1)]
    camera = cameras[choose(spec, names, "cameras")]
    places = _keys(camera, "position", "FXPoint3_32f", spec.file)
    turns = _keys(camera, "orientation", "Orientation3D", spec.file)
    if not len(places) or len(turns) not in (0, len(places)):
        words = f"has {len(places)} keys of the camera's place and {len(turns)} of its turn"
        raise wrong(spec.file, f"{words} (expected as many of both)")
    rate = _rate(root)
    return Recording(
        subject=names[cameras.index(camera)],
        positions=places,
        rotations=quaternions.from_euler(np.radians(-turns[:, ::-1]), "zyx") if len(turns) else None,
        times=None if rate is None else np.arange(len(places)) / rate,
        metres=1 / PIXELS_PER_METRE,
        axes=Y_UP,
        is_camera=True,
    )


def _rate(root: ET.Element) -> float | None:
    try:
        rate = float(root.findtext(".//AudioVideoSettings/FrameRate") or "")
    except ValueError:
        return None
    return rate if rate > 0 else None


def _keys(camera: ET.Element, what: str, point: str, path: Path) -> FloatArray:
    """X, Y, Z (N, 3) of the keys of a property."""
    animation = camera.find(f".//{what}/Animation")
    found = []
    for k, key in enumerate(animation if animation is not None else ()):
        at = key.find(f".//{point}")
        try:
            found.append([float(at.attrib[axis]) for axis in "XYZ"] if at is not None else [np.nan] * 3)
        except (KeyError, ValueError):
            raise wrong(path, f"key {k} of {what}: expected numbers X, Y and Z") from None
    return np.array(found, dtype=np.float64).reshape(-1, 3)
