"""What reading a canvas needs, whether by microtiles or by pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.hits import Wanted
from quiltcli.raster.planes import PlaneTable
from quiltcli.raster.tiles import Tiles
from quiltcli.raster.vectors import BlockVectors, exact_values


@dataclass(frozen=True)
class Reader:
    """What is needed to read a canvas; `visibility.read_canvas` says what its attributes are."""

    canvas: Canvas
    table: PlaneTable
    blocks: Blocks
    limits: DepthRange
    bits: int
    wanted: Wanted


def rays_through(reader: Reader, tiles: Tiles) -> tuple[BlockVectors, FloatArray, FloatArray | None]:
    """Rays d through the pixels of n microtiles.

    Returns:
        d, of any length; the depth (n, 64) of the points d; and these points (3, n, 64), the eye at the
        origin, where positions are wanted.
    """
    limits = reader.limits
    matrix = np.ascontiguousarray(limits.rays.transpose(1, 2, 0))
    ray = BlockVectors(matrix, tiles.block, tiles.x, tiles.y)
    exact = None
    if limits.radial or reader.wanted.position:
        exact = np.stack([exact_values(plane) for plane in ray.planes])
    if limits.radial and exact is not None:
        depth = np.sqrt(exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2])
    else:
        depth = exact_values(ray.along(limits.look))
    return ray, depth, exact if reader.wanted.position else None
