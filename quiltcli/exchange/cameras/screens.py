"""Screens for programs that track the eye themselves: ParaView's .pvx and SGCT's JSON.

Both are given named corners of the screens, never corners by their order.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import DisplayError
from quiltcli.exchange.cameras.cameras import Shot, camera_names
from quiltcli.geometry import FloatArray


def _screens(
    facets: Facets, eye: FloatArray | None = None
) -> Iterator[tuple[str, tuple[int, int], dict[str, FloatArray]]]:
    """Name, pixels and corners of every facet's raster, metres, from the world's origin or from an eye."""
    for k, name in enumerate(camera_names(facets)):
        if not facets.enabled[k]:
            continue
        across, down = (int(side) for side in facets.size[k])
        corner = facets.origin[k] - (0.0 if eye is None else eye)
        right, below = across * facets.du[k], down * facets.dv[k]
        corners = {
            "upper left": corner,
            "upper right": corner + right,
            "lower left": corner + below,
            "lower right": corner + right + below,
        }
        yield name, (across, down), {key: np.round(value, 12) + 0.0 for key, value in corners.items()}


def pvx_text(facets: Facets) -> str:
    """ParaView's form: a machine a facet, its window of the facet's pixels."""
    lines = ['<?xml version="1.0" ?>', "<pvx>"]
    for name, (across, down), corners in _screens(facets):
        lines.append(f'  <Machine Name={quoteattr(name)} Geometry="{across}x{down}+0+0" ShowBorders="0"')
        places = [
            f"{key}={quoteattr(' '.join(map(repr, corners[words].tolist())))}"
            for key, words in (
                ("LowerLeft", "lower left"),
                ("LowerRight", "lower right"),
                ("UpperRight", "upper right"),
            )
        ]
        lines.append("           " + "\n           ".join(places) + " />")
    return "\n".join([*lines, "</pvx>"]) + "\n"


def sgct_text(facets: Facets, shots: Sequence[Shot]) -> str:
    """SGCT's form: a window a facet.

    The first frame's eye is the origin, so that it is no matter whether screens are measured from the user
    or from the world.
    """
    cameras = [camera for shot in shots for camera in shot.cameras]
    if not cameras:
        raise DisplayError("no facet is lit at these frames, so there is nowhere to stand")
    windows = [_window(k, *screen) for k, screen in enumerate(_screens(facets, cameras[0].position))]
    data = {
        "version": 1,
        "masteraddress": "localhost",
        "users": [{"position": {"x": 0.0, "y": 0.0, "z": 0.0}}],
        "nodes": [{"address": "localhost", "port": 20401, "windows": windows}],
    }
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def _window(k: int, name: str, pixels: tuple[int, int], corners: dict[str, FloatArray]) -> dict[str, Any]:
    size = {"x": pixels[0], "y": pixels[1]}
    plane = {
        "type": "ProjectionPlane",
        "lowerleft": _vector(corners["lower left"]),
        "upperleft": _vector(corners["upper left"]),
        "upperright": _vector(corners["upper right"]),
    }
    viewport = {"pos": {"x": 0.0, "y": 0.0}, "size": {"x": 1.0, "y": 1.0}, "projection": plane}
    return {"id": k, "name": name, "size": size, "res": size, "viewports": [viewport]}


def _vector(point: FloatArray) -> dict[str, float]:
    return dict(zip("xyz", point.tolist(), strict=True))
