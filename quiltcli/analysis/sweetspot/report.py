"""The answer in words and as data."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from quiltcli.analysis.sweetspot.audience import Served
from quiltcli.analysis.sweetspot.distortion import MEASURES
from quiltcli.analysis.sweetspot.floor import DIRECTIONS
from quiltcli.analysis.sweetspot.study import SweetSpot
from quiltcli.geometry import FloatArray

Rows = list[tuple[str, ...]]
AUDIENCE_COLUMNS = ("the audience sees", "eye", "mean", "worst", "dark")


def lines(spot: SweetSpot) -> Rows:
    """What was asked, as (label, text)."""
    x0, z0, x1, z1 = spot.floor.area
    places = f"{len(spot.floor.x)} × {len(spot.floor.z)} places, eyes {spot.floor.height:g} m high"
    lit = len(np.unique(spot.shown.samples.facet[spot.shown.shown]))
    found: Rows = [
        ("display", f"{spot.display.path}, {lit} of {spot.display.count} facets lit towards the eye"),
        ("eye", _triple(spot.shown.eye)),
        ("content", str(spot.content)),
        ("map", f"x {x0:.4g} to {x1:.4g} m, z {z0:.4g} to {z1:.4g} m, {places}"),
    ]
    blind = int(np.isnan(spot.figures.mean).sum())
    if blind:
        found.append(("unseen", f"nothing is seen from {blind} of {len(spot.figures.mean)} places"))
    return found


def reach_columns(spot: SweetSpot) -> tuple[str, ...]:
    """Headings of `reach_rows`."""
    return (f"within {spot.limit_deg:g}°", "area", *DIRECTIONS)


def reach_rows(spot: SweetSpot) -> Rows:
    """Room under the limit, a row a measure; `>` where the limit was not met within the map."""
    rows: Rows = []
    for key, name in MEASURES.items():
        reach = spot.reach[key]
        far = [f"{'> ' if way in reach.open else ''}{_digits(reach.metres[way])} m" for way in DIRECTIONS]
        rows.append((name, f"{_digits(reach.area)} m²", *far))
    return rows


def audience_rows(spot: SweetSpot) -> Rows:
    """How the eye and the best eye serve the audience; nothing without one."""
    if spot.here is None or spot.best is None:
        return []
    rows = [("drawn for the best eye", spot.best)]
    if not np.array_equal(spot.here.eye, spot.best.eye):
        rows.insert(0, ("drawn for this eye", spot.here))
    return [
        (name, _triple(one.eye), f"{one.mean:.2f}°", f"{one.worst:.2f}°", f"{100 * one.dark:.1f} %")
        for name, one in rows
    ]


def as_data(spot: SweetSpot) -> dict[str, Any]:
    """Everything, for programs: numbers, lists and None where nothing is seen."""
    content: dict[str, Any] = {"kind": spot.content.kind}
    if spot.content.kind == "plane":
        content["point"] = list(spot.content.point)
    else:
        content["metres"] = _finite(spot.content.metres)
    data: dict[str, Any] = {
        "display": spot.display.path,
        "eye": spot.shown.eye.tolist(),
        "content": content,
        "limit_deg": spot.limit_deg,
        "within_limit": {
            key: {
                "area_m2": reach.area,
                **{f"{way}_m": far for way, far in reach.metres.items()},
                "open": list(reach.open),
            }
            for key, reach in spot.reach.items()
        },
        "map": {
            "x": spot.floor.x.tolist(),
            "z": spot.floor.z.tolist(),
            "height": spot.floor.height,
            **{f"{key}_deg": _table(spot.map(key)) for key in MEASURES},
            "dark": _table(spot.map("dark")),
        },
    }
    if spot.audience is not None and spot.here is not None and spot.best is not None:
        data["audience"] = {
            "area": list(spot.audience),
            "minimise": spot.minimise,
            "eye": _served(spot.here),
            "best": _served(spot.best),
        }
    return data


def _served(one: Served) -> dict[str, Any]:
    return {
        "eye": one.eye.tolist(),
        "mean_deg": _finite(one.mean),
        "worst_deg": _finite(one.worst),
        "dark": _finite(one.dark),
    }


def _table(values: FloatArray) -> list[list[float | None]]:
    return [[_finite(value) for value in row] for row in values.tolist()]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _triple(point: Iterable[float]) -> str:
    return ", ".join(f"{value + 0.0:.4g}" for value in point)


def _digits(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}" if value >= 0.001 else "0"
