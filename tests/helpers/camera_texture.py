"""A camera texture: a plain picture that is stirred, as a map of directions and as many flat facets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.formats.exr.image import write_exr
from quiltcli.geometry import FloatArray

FOV = 60.0


def swirl(columns: int, rows: int, strength: float = 0.6) -> tuple[FloatArray, FloatArray]:
    """Offsets (rows, columns), right and up in heights of a picture of 4 : 3, that turn its middle."""
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    x, y = (u - 0.5) * 4 / 3, 0.5 - v
    # Nothing moves on the border.
    turn = strength * 16 * u * (1 - u) * v * (1 - v) * np.exp(-2 * (x * x + y * y))
    return x * np.cos(turn) - y * np.sin(turn) - x, x * np.sin(turn) + y * np.cos(turn) - y


def as_projection(folder: Path, columns: int, rows: int, pixels: tuple[int, int]) -> str:
    """The text of a display file: a camera texture of so many nodes."""
    right, up = swirl(columns, rows)
    channels = {"R": right.astype(np.float32), "G": up.astype(np.float32)}
    write_exr(folder / "swirl.exr", channels, {})
    keys = f"kind: offset, file: {folder / 'swirl.exr'}, camera: {{fov_deg: {FOV}}}, pixels: {list(pixels)}"
    return f"quilt_display: 1\nprojection: {{{keys}}}\n"


def as_facets(folder: Path, columns: int, rows: int, pixels: tuple[int, int], eye: FloatArray) -> str:
    """The same for one eye, as two flat facets a cell; texture coordinates are the places they move to."""
    # As single precision has them, as in the other file.
    right, up = (part.astype(np.float32).astype(np.float64) for part in swirl(columns, rows))
    width, height = pixels
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    half = np.tan(np.radians(FOV) / 2)
    x, y = (2 * u - 1) * half * width / height, (1 - 2 * v) * half
    points = np.stack((eye[0] + x, eye[1] + y, np.full_like(x, eye[2] - 1)), axis=-1).reshape(-1, 3)
    place = np.stack((u + right * height / width, 1 - v + up), axis=-1).reshape(-1, 2)
    number = np.arange(1, u.size + 1).reshape(u.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    faces = np.stack((np.stack((a, c, b), axis=-1), np.stack((b, c, d), axis=-1)), axis=2).reshape(-1, 3)
    lines = [f"v {p[0]!r} {p[1]!r} {p[2]!r}" for p in points.tolist()]
    lines += [f"vt {p[0]!r} {p[1]!r}" for p in place.tolist()]
    lines += ["f " + " ".join(f"{k}/{k}" for k in face) for face in faces.tolist()]
    (folder / "pieces.obj").write_text("\n".join(lines) + "\n")
    return (
        f"quilt_display: 1\nmesh: {folder / 'pieces.obj'}\nlayout: {{from_uv: true, size: {list(pixels)}}}\n"
    )
