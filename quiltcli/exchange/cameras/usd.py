"""Cameras as USD text: an animated Camera and a RenderProduct for each facet and eye.

Apertures, offsets and focal length are in tenths of a scene unit, and single precision by USD's own schema.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

from quiltcli.errors import missing_extra
from quiltcli.exchange.cameras.cameras import Camera, Shot
from quiltcli.exchange.cameras.tracks import Track, tracks

_FOCAL = 10.0  # tenths of a metre: apertures are then ten times the window
_ROLES = {"center": "mono", "left": "left", "right": "right"}


def usda_text(shots: Sequence[Shot], fps: Fraction) -> str:
    """A stage in metres, Y up, whose time codes are frames."""
    found = tracks(shots)
    frames = [shot.frame for shot in shots]
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "cameras"',
        f"    startTimeCode = {min(frames)}",
        f"    endTimeCode = {max(frames)}",
        f"    timeCodesPerSecond = {float(fps)!r}",
        "    metersPerUnit = 1",
        '    upAxis = "Y"',
        ")",
        "",
        'def Scope "cameras"',
        "{",
    ]
    for track in found:
        lines += _camera_lines(track)
    lines += ["}", "", 'def Scope "Render"', "{"]
    for track in found:
        lines += _product_lines(track)
    return "\n".join([*lines, "}"]) + "\n"


def usdc_bytes(shots: Sequence[Shot], fps: Fraction) -> bytes:
    """The same in USD's binary form (MissingExtraError without usd-core)."""
    try:
        from pxr import Sdf
    except ImportError:
        raise missing_extra("a .usdc file", "usd-core", "usd") from None
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(usda_text(shots, fps))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cameras.usdc"
        layer.Export(str(path))
        return path.read_bytes()


def _camera_lines(track: Track) -> list[str]:
    attributes: list[tuple[str, Callable[[Camera], str]]] = [
        ("matrix4d xformOp:transform", _matrix),
        ("float horizontalAperture", lambda c: repr(_FOCAL * (c.window[1] - c.window[0]))),
        ("float horizontalApertureOffset", lambda c: repr(_FOCAL * (c.window[1] + c.window[0]) / 2)),
        ("float verticalAperture", lambda c: repr(_FOCAL * (c.window[3] - c.window[2]))),
        ("float verticalApertureOffset", lambda c: repr(_FOCAL * (c.window[3] + c.window[2]) / 2)),
        ("float2 clippingRange", lambda c: f"({c.near!r}, {c.far!r})"),
        # Apertures are single precision: whoever needs more has the window itself, left to top.
        ("custom double4 quilt:window", lambda c: "(" + ", ".join(map(repr, c.window)) + ")"),
    ]
    lines = [f'    def Camera "{_prim(track.name)}"', "    {"]
    lines.append(f"        float focalLength = {_FOCAL!r}")
    lines.append(f'        uniform token stereoRole = "{_ROLES[track.eye]}"')
    for name, value in attributes:
        keys = ", ".join(f"{frame}: {value(camera)}" for frame, camera in track.keys.items())
        lines.append(f"        {name}.timeSamples = {{ {keys} }}")
    lines.append('        uniform token[] xformOpOrder = ["xformOp:transform"]')
    return [*lines, "    }"]


def _matrix(camera: Camera) -> str:
    """World from camera, for rows, as USD writes it."""
    right, up, forward = (camera.axes + 0.0).tolist()
    back = [-c + 0.0 for c in forward]
    rows = [(*right, 0.0), (*up, 0.0), (*back, 0.0), (*camera.position.tolist(), 1.0)]
    return "(" + ", ".join(f"({', '.join(map(repr, row))})" for row in rows) + ")"


def _product_lines(track: Track) -> list[str]:
    camera = next(iter(track.keys.values()))
    left, right, bottom, top = camera.window
    across, down = camera.pixels
    shape = (right - left) / across / ((top - bottom) / down)
    return [
        f'    def RenderProduct "{_prim(track.name)}"',
        "    {",
        f"        rel camera = </cameras/{_prim(track.name)}>",
        f"        uniform int2 resolution = ({across}, {down})",
        f"        uniform float pixelAspectRatio = {shape!r}",
        f'        token productName = "{track.name}.####.exr"',
        "    }",
    ]


def _prim(name: str) -> str:
    """A name as USD allows it."""
    return re.sub(r"\W", "_", name, flags=re.ASCII)
