"""Cameras as JSON: axes, window and matrices, in doubles."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from quiltcli.exchange.cameras.cameras import Camera, Shot


def json_text(shots: Sequence[Shot]) -> str:
    """All shots; numbers read back to the last bit. A camera stands in a line of its own."""
    lines = ['{"frames": [']
    for k, shot in enumerate(shots):
        head = json.dumps({"frame": shot.frame, "eye": shot.eye})[:-1]
        lines.append(f'{head}, "cameras": [')
        rows = [json.dumps(_record(camera), ensure_ascii=False) for camera in shot.cameras]
        lines.append(",\n".join(rows))
        lines.append("]}," if k + 1 < len(shots) else "]}")
    lines.append("]}")
    return "\n".join(lines) + "\n"


def _record(camera: Camera) -> dict[str, Any]:
    right, up, forward = (camera.axes + 0.0).tolist()
    return {
        "facet": camera.facet,
        "name": camera.name,
        "pixels": list(camera.pixels),
        "position": camera.position.tolist(),
        "right": right,
        "up": up,
        "forward": forward,
        "window": dict(zip(("left", "right", "bottom", "top"), camera.window, strict=True)),
        "near": camera.near,
        "far": camera.far,
        "view": (camera.view + 0.0).tolist(),
        "projection": (camera.projection + 0.0).tolist(),
    }
