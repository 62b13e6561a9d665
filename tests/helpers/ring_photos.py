"""Photographs of a ball from a ring of places, in closed form: a light field whose every ray is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.png import save_png
from quiltcli.geometry import FloatArray
from quiltcli.job import dump_yaml
from quiltcli.lightfield.cameras import Cameras

RADIUS = 0.045


def ball(start: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Linear light (N, 3) of a smoothly painted ball along rays, and how far along (NaN: never)."""
    a, b = np.sum(way * way, axis=1), np.sum(start * way, axis=1)
    root = b * b - a * (np.sum(start * start, axis=1) - RADIUS**2)
    along = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.nan)
    place = start + along[:, None] * way
    light = 0.5 + 0.4 * np.sin(place * [130, 110, 90] + [0, 1, 2])
    return np.where(np.isfinite(along)[:, None], light, 0), along


def picture(cameras: Cameras, row: int, view: int) -> tuple[FloatArray, FloatArray]:
    """Light (H, W, 3) and depth (H, W) that one camera sees."""
    width, height = cameras.lens.size
    y, x = np.mgrid[:height, :width] + 0.5
    (fx, fy), (cx, cy) = cameras.lens.focal, cameras.lens.centre
    seen = np.stack(((x - cx) / fx, (y - cy) / fy, np.ones_like(x)), axis=-1).reshape(-1, 3)
    camera = cameras.rows[row]
    start = np.broadcast_to(camera.position[view], seen.shape)
    light, along = ball(start, seen @ camera.rotation[view])
    return light.reshape(height, width, 3), along.reshape(height, width)


def encoded(light: FloatArray) -> np.ndarray:
    """Bytes by the curve of sRGB."""
    curved = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055)
    return np.rint(255 * curved).astype(np.uint8)


def write_pictures(cameras: Cameras, folder: Path, *, exr: bool = False, depths: bool = False) -> None:
    """Pictures h01/v0001.png or .exr, and depth maps h01/z0001.exr, of all cameras."""
    for r, row in enumerate(cameras.rows):
        (folder / f"h{r + 1:02}").mkdir(parents=True, exist_ok=True)
        for k, view in enumerate(row.view.tolist()):
            light, depth = picture(cameras, r, k)
            name = folder / f"h{r + 1:02}" / f"v{view + 1:04}"
            if exr:
                write_exr(
                    name.with_suffix(".exr"),
                    {c: light[..., i].astype(np.float32) for i, c in enumerate("RGB")},
                    {},
                )
            else:
                save_png(name.with_suffix(".png"), encoded(light))
            if depths:
                filled = np.where(np.isfinite(depth), depth, np.inf).astype(np.float32)
                write_exr(name.with_name(f"z{view + 1:04}.exr"), {"Z": filled}, {})


def field_text(views: int, heights: list[float], *, size: int = 64, exr: bool = False, **more: object) -> str:
    """A light field file of these pictures: cameras 1 m away that see 14 cm."""
    data: dict[str, object] = {
        "quilt_lightfield": 1,
        "images": "h{row:02}/v{view:04}." + ("exr" if exr else "png"),
        "views": views,
        "distance": 1.0,
        "heights": heights,
        "camera": {"focal": [size / 0.14, size / 0.14], "size": [size, size], "look_at": [0, 0, 0]},
        **more,
    }
    return dump_yaml(data)
