"""Where the pixels of a facet are, flat or curved: points of the world, or directions of a projection."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from quiltcli.charts import Chart
from quiltcli.display import Facets
from quiltcli.geometry import BoolArray, Float32Array, FloatArray


def facet_points(facets: Facets, facet: int) -> Float32Array:
    """Points (3, H, W) under the centres of a facet's pixels, world metres; NaN where it has no pixel."""
    width, height = facets.size[facet].tolist()
    x = (np.arange(width) + 0.5)[None, :]
    result = np.empty((3, height, width), dtype=np.float32)
    at, mask = points_of(facets, facet)
    for first in range(0, height, 64):
        y = (np.arange(first, min(first + 64, height)) + 0.5)[:, None]
        result[:, first : first + 64] = at(x, y)
    if mask is not None:
        result[:, ~mask] = np.nan
    return result


def points_of(
    facets: Facets, facet: int
) -> tuple[Callable[[FloatArray, FloatArray], FloatArray], BoolArray | None]:
    """What gives points (3, ...) of continuous facet pixels, and the facet's mask (H, W)."""
    chart: Chart | None = facets.charts[facet] if facets.charts else None
    if chart is not None:
        return chart.points, chart.mask
    origin, du, dv = (getattr(facets, name)[facet].reshape(3, 1, 1) for name in ("origin", "du", "dv"))
    return lambda x, y: origin + du * x + dv * y, None
