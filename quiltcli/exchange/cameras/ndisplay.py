"""nDisplay's JSON: a screen a facet, a viewport where the facet lies in the quilt, a node a page.

Unreal's world is left-handed, in centimetres, with X ahead and Z up: (x, y, z) here is 100 (−z, x, y) there.
A screen that is not turned stands across X and is looked at along it; turns are Unreal's pitch, yaw, roll.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import DisplayError
from quiltcli.exchange.cameras.cameras import Shot, camera_names
from quiltcli.geometry import FloatArray, cross
from quiltcli.layout import Layout

_CM = 100.0


def ndisplay_text(facets: Facets, layout: Layout, shots: Sequence[Shot]) -> str:
    """The configuration; its view point is the eye of the first frame.

    Raises:
        DisplayError: a facet is turned or mirrored in the quilt, which no viewport can be; or none is lit.
    """
    cameras = [camera for shot in shots for camera in shot.cameras]
    if not cameras:
        raise DisplayError("no facet is lit at these frames, so there is nowhere to stand")
    names = camera_names(facets)
    shown = [k for k in range(facets.count) if facets.enabled[k] and layout.page[k] >= 0]
    screens = {f"screen_{names[k]}": _screen(facets, k) for k in shown}
    nodes = {
        f"node_{page + 1}": _node(layout, names, page, [k for k in shown if layout.page[k] == page])
        for page in range(len(layout.pages))
    }
    eye = {
        "interpupillaryDistance": 6.4,
        "swapEyes": False,
        "stereoOffset": "none",
        "parentId": "",
        "location": _place(cameras[0].position),
        "rotation": _turn(np.eye(3)),
    }
    ports = {"ClusterSync": 41001, "ClusterEventsJson": 41003, "ClusterEventsBinary": 41004}
    data = {
        "nDisplay": {
            "description": "made by quilt",
            "version": "5.00",
            "assetPath": "",
            "misc": {"bFollowLocalPlayerCamera": False, "bExitOnEsc": True},
            "scene": {"xforms": {}, "cameras": {"DefaultViewPoint": eye}, "screens": screens},
            "cluster": {
                "primaryNode": {"id": "node_1", "ports": ports},
                "sync": {
                    "renderSyncPolicy": {"type": "ethernet", "parameters": {}},
                    "inputSyncPolicy": {"type": "ReplicatePrimary", "parameters": {}},
                },
                "failover": {"failoverPolicy": "Disabled"},
                "nodes": nodes,
            },
            "customParameters": {},
            "diagnostics": {"simulateLag": False, "minLagTime": 0.01, "maxLagTime": 0.3},
        }
    }
    return json.dumps(data, indent=1) + "\n"


def _node(layout: Layout, names: Sequence[str], page: int, shown: Sequence[int]) -> dict[str, Any]:
    """A machine whose window is a page."""
    width, height = layout.pages[page].tolist()
    return {
        "host": "127.0.0.1",
        "sound": False,
        "fullScreen": False,
        "window": {"x": 0, "y": 0, "w": width, "h": height},
        "postprocess": {},
        "viewports": {names[k]: _viewport(layout, k, names[k]) for k in shown},
        "outputRemap": {"bEnable": False, "dataSource": "mesh", "staticMeshAsset": "", "externalFile": ""},
    }


def _viewport(layout: Layout, row: int, name: str) -> dict[str, Any]:
    matrix = layout.quilt_from_facet[row]
    corner = np.rint(matrix[:, 2])
    if np.abs(matrix[:, :2] - np.eye(2)).max() > 1e-9 or np.abs(matrix[:, 2] - corner).max() > 1e-3:
        raise DisplayError(
            f"facet {row + 1} ({name}) is turned or mirrored in the quilt, and a viewport of nDisplay"
            " cannot be (give it an upright place in the display file)"
        )
    x, y = corner.astype(np.int64).tolist()
    width, height = layout.size[row].tolist()
    return {
        "camera": "DefaultViewPoint",
        "bufferRatio": 1,
        "gPUIndex": -1,
        "allowCrossGPUTransfer": False,
        "isShared": False,
        "region": {"x": x, "y": y, "w": width, "h": height},
        "projectionPolicy": {"type": "simple", "parameters": {"screen": f"screen_{name}"}},
    }


def _screen(facets: Facets, k: int) -> dict[str, Any]:
    """The rectangle of a facet's raster."""
    across, down = facets.size[k].tolist()
    right, below = across * facets.du[k], down * facets.dv[k]
    wide, high = (float(np.sqrt((side * side).sum())) for side in (right, below))
    u, v = right / wide, -below / high
    axes = np.stack([_unreal(axis) for axis in (-cross(u, v), u, v)])
    return {
        "parentId": "",
        "location": _place(facets.origin[k] + (right + below) / 2),
        "rotation": _turn(axes),
        "size": {"width": round(_CM * wide, 9), "height": round(_CM * high, 9)},
    }


def _unreal(vector: FloatArray) -> FloatArray:
    return np.array([-vector[2], vector[0], vector[1]])


def _place(point: FloatArray) -> dict[str, float]:
    x, y, z = (round(_CM * float(c), 9) + 0.0 for c in _unreal(point))
    return {"x": x, "y": y, "z": z}


def _turn(axes: FloatArray) -> dict[str, float]:
    """Degrees of the rotator whose axes ahead, right, up are these rows, in Unreal's world.

    Unreal's rows are X = (cos p cos y, cos p sin y, sin p), Y.z = −sin r cos p, Z.z = cos r cos p.
    """
    ahead, right, up = axes
    pitch = math.asin(min(max(float(ahead[2]), -1.0), 1.0))
    if abs(ahead[2]) > 1 - 1e-12:  # straight up or down: the yaw tells all
        yaw, roll = math.atan2(-right[0], right[1]), 0.0
    else:
        yaw, roll = math.atan2(ahead[1], ahead[0]), math.atan2(-right[2], up[2])
    angles = {"pitch": pitch, "yaw": yaw, "roll": roll}
    return {name: round(math.degrees(angle), 12) + 0.0 for name, angle in angles.items()}
