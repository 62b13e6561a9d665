"""Charts: pixels on curved surfaces, and pixels that are directions. Points, normals, checks at load."""

from __future__ import annotations

from quiltcli.charts.build import projection_charts, surface_chart
from quiltcli.charts.chart import Chart

__all__ = ["Chart", "projection_charts", "surface_chart"]
