"""The camera a pinhole's picture was made through: of JSON, glTF or USD."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import JobError, Problem, missing_extra
from quiltcli.exchange.project.lenses import Pinhole
from quiltcli.formats.gltf.container import read_container
from quiltcli.formats.inputs import is_regular, read_input
from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import RecordedSpec
from quiltcli.job.model import suggest
from quiltcli.viewer.recorded.head import pose_of, read_head
from quiltcli.viewer.view import View

_Window = tuple[float, float, float, float]
_SHAPE = 5e-3  # by which the shapes of a picture and of its camera's window may differ
_SAME = 1e-5  # single precision, in which USD keeps apertures
_AWAY = 0.01  # metres


@dataclass(frozen=True)
class Asked:
    """The camera of a file that is wanted, and for what.

    Attributes:
        path: the file.
        name: which of its cameras; empty where it has one, or one an eye.
        view: frame and eye.
        fps: of the job: frames are seconds of the file by it.
        size: width and height of the picture.
    """

    path: Path
    name: str
    view: View
    fps: float
    size: tuple[int, int]

    def wrong(self, words: str) -> JobError:
        """An error of the file."""
        return JobError(Problem(words, file=str(self.path)))


@dataclass(frozen=True)
class Found:
    """A camera.

    Attributes:
        lens: how it shows directions.
        position: (3,) world metres, or None where the file does not say.
    """

    lens: Pinhole
    position: FloatArray | None

    def notice(self, view: View) -> str:
        """A sentence if the camera does not stand where the eye is, else nothing."""
        if self.position is None:
            return ""
        away = float(np.sqrt(((self.position - view.viewer.eye) ** 2).sum()))
        if away <= _AWAY:
            return ""
        return f"its camera stands {away:.3g} m from the viewer's eye: what is near appears elsewhere"


def read_camera(asked: Asked) -> Found:
    """The camera of a view.

    Raises:
        JobError: the file is none of cameras, or has none or several that are meant.
        MissingExtraError: USD without the extra `usd`.
        QuiltError: the file is broken.
    """
    return READERS.get(asked.path.suffix.lower(), _json_camera)(asked)


def _json_camera(asked: Asked) -> Found:
    """One of `quilt cameras`, or its record alone."""
    try:
        data: Any = json.loads(read_input(asked.path, JobError, "a camera"))
        record = _record(data, asked)
        axes: FloatArray = np.array([record[key] for key in ("right", "up", "forward")], dtype=np.float64)
        left, right, bottom, top = (float(record["window"][k]) for k in ("left", "right", "bottom", "top"))
        place = record.get("position")
        position = None if place is None else np.array(place, dtype=np.float64).reshape(3)
    except (ValueError, KeyError, TypeError, IndexError, RecursionError, AttributeError) as error:
        if isinstance(error, JobError):
            raise
        words = "is no camera (expected right, up, forward and window, as quilt cameras writes them)"
        raise asked.wrong(words) from None
    good = axes.shape == (3, 3) and bool(np.abs(axes @ axes.T - np.eye(3)).max() < 1e-6)
    if not (good and left < right and bottom < top):
        raise asked.wrong(
            "is no camera: its axes must be perpendicular and of length 1, its window not empty"
        )
    return Found(Pinhole(axes, (left, right, bottom, top), asked.size), position)


def _record(data: Any, asked: Asked) -> Any:
    if "frames" not in data:
        return data
    frames, view = data["frames"], asked.view
    mine = [shot for shot in frames if shot["frame"] == view.frame and shot["eye"] in (view.eye, "center")]
    cameras = (mine or (frames if len(frames) == 1 else []) or [{"cameras": []}])[0]["cameras"]
    names = [str(camera["name"]) for camera in cameras] if asked.name else [""] * len(cameras)
    return cameras[_chosen(asked, names)]


def _chosen(asked: Asked, names: Sequence[str]) -> int:
    """Index of the camera that is wanted."""
    found = [k for k, name in enumerate(names) if not asked.name or name == asked.name]
    if len(found) == 1:
        return found[0]
    of = f" of frame {asked.view.name}" if asked.path.suffix.lower() not in READERS else ""
    if not asked.name:
        listed = ", ".join(filter(None, names[:12]))
        hint = f" (--camera-name says which: {listed})" if listed else ""
        raise asked.wrong(f"has {len(names)} cameras{of}, expected one{hint}")
    near = suggest(asked.name, names)
    hint = f"; did you mean {near}?" if near else ""
    raise asked.wrong(f"has {len(found)} cameras{of} called {asked.name!r}, expected one{hint}")


def _gltf_camera(asked: Asked) -> Found:
    """A camera of glTF at second (frame − 1) / fps, the time at which a scene shows the file."""
    entries = read_container(asked.path).json
    nodes = entries["nodes"]
    own = [node for node in range(nodes.length()) if nodes.at(node).has("camera")]
    names = [nodes.at(node)["name"].text("") or f"node {node}" for node in own]
    k = _chosen(asked, names)
    cameras = entries["cameras"]
    camera = cameras.at(nodes.at(own[k])["camera"].index(cameras.length(), "camera"))
    if not camera.has("perspective"):
        raise asked.wrong(f"{names[k]} is not a perspective camera")
    lens = camera["perspective"]
    width, height = asked.size
    shape = lens["aspectRatio"].number(width / height, low=1e-6)
    if abs(shape * height / width - 1) > _SHAPE:
        words = f"{names[k]} makes pictures {shape:.4g} times as wide as high, this is {width}×{height}"
        raise asked.wrong(words)
    up = math.tan(lens["yfov"].number(low=1e-3, high=3.14) / 2)
    across = up * width / height
    return _posed(asked, names[k], (asked.view.frame - 1) / asked.fps, (-across, across, -up, up))


def _usd_camera(asked: Asked) -> Found:
    """A camera of USD at the time code of the frame, as `quilt cameras` writes it, by the rates of both.

    Where apertures have not the picture's shape they grow to it: `expandAperture`, USD's own default.
    """
    try:
        from pxr import Tf, Usd, UsdGeom
    except ImportError:
        raise missing_extra("a camera of USD", "usd-core", "usd") from None
    if not is_regular(asked.path):
        raise asked.wrong("no such file")
    try:
        stage = Usd.Stage.Open(str(asked.path))
    except Tf.ErrorException as error:
        raise asked.wrong(
            f"is no USD file that can be opened: {' '.join(str(error).split())[:200]}"
        ) from None
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if asked.view.eye and not asked.name:
        mine = [prim for prim in prims if UsdGeom.Camera(prim).GetStereoRoleAttr().Get() == asked.view.eye]
        prims = mine or prims
    paths = [str(prim.GetPath()) for prim in prims]
    short = [path.rpartition("/")[2] for path in paths]
    k = _chosen(asked, paths if "/" in asked.name else short)
    camera, seconds = UsdGeom.Camera(prims[k]), asked.view.frame / asked.fps
    code = seconds * stage.GetTimeCodesPerSecond()
    if camera.GetProjectionAttr().Get(code) != UsdGeom.Tokens.perspective:
        raise asked.wrong(f"{paths[k]} is not a perspective camera")
    return _posed(asked, paths[k], seconds, _usd_window(asked, camera, code))


def _usd_window(asked: Asked, camera: Any, code: float) -> _Window:
    """Left, right, bottom, top at distance 1; doubles where quilt has left them beside the apertures."""
    names = (
        "horizontalAperture",
        "verticalAperture",
        "horizontalApertureOffset",
        "verticalApertureOffset",
        "focalLength",
    )
    values = [float(camera.GetPrim().GetAttribute(name).Get(code)) for name in names]
    wide, high, right, up, focal = values
    if not (wide > 0 and high > 0 and focal > 0 and all(map(math.isfinite, values))):
        raise asked.wrong(f"{camera.GetPath()} has a focal length or aperture that is not above 0")
    ends = (right - wide / 2, right + wide / 2, up - high / 2, up + high / 2)
    own = camera.GetPrim().GetAttribute("quilt:window")
    exact = tuple(float(end) for end in own.Get(code)) if own and own.HasValue() else ()
    if exact and max(abs(e - end / focal) for e, end in zip(exact, ends, strict=True)) < _SAME * max(
        map(abs, exact)
    ):
        return exact[0], exact[1], exact[2], exact[3]
    shape = asked.size[0] / asked.size[1]
    if abs(wide / high / shape - 1) > _SHAPE:
        wide, high = max(wide, high * shape), max(high, wide / shape)
    return (
        (right - wide / 2) / focal,
        (right + wide / 2) / focal,
        (up - high / 2) / focal,
        (up + high / 2) / focal,
    )


def _posed(asked: Asked, name: str, seconds: float, window: _Window) -> Found:
    """A camera where it stands at a second of its file, in metres with Y up."""
    spec = RecordedSpec(file=asked.path.absolute(), subject=name)
    place, turn = pose_of(read_head(spec), spec, seconds, asked.fps)
    assert turn is not None  # cameras of these files are turned somehow
    columns = quaternions.matrices(turn)
    axes = np.stack((columns[:, 0], columns[:, 1], -columns[:, 2]))
    return Found(Pinhole(axes, window, asked.size), place)


READERS: dict[str, Callable[[Asked], Found]] = {
    ".gltf": _gltf_camera,
    ".glb": _gltf_camera,
    ".usd": _usd_camera,
    ".usda": _usd_camera,
    ".usdc": _usd_camera,
    ".usdz": _usd_camera,
}
"""Who reads a camera, by the ending of the file; all others are JSON."""
