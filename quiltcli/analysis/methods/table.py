"""A comparison as a table and for programs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from quiltcli.analysis.methods.findings import Findings
from quiltcli.analysis.methods.study import Study

COLUMNS = (
    "method",
    "wrong",
    "lost",
    "depth error mean",
    "max",
    "seam jumps",
    "largest",
    "light mean",
    "99 %",
    "max",
    "PSNR",
    "seen mean",
    "seconds",
)


def study_rows(study: Study) -> Iterator[tuple[str, ...]]:
    """The rows of a comparison under `COLUMNS`; lengths are in millimetres."""
    for found in study.findings:
        yield (
            found.variant.name,
            _count(found.wrong),
            _count(found.lost),
            _length(found.depth.mean),
            _length(found.depth.maximum),
            f"{found.seams.failures:,} of {found.seams.counts['points_compared']:,}",
            _length(found.seams.most),
            _share(found.image.mean),
            _share(found.image.percentile_99),
            _share(found.image.maximum),
            "same" if math.isinf(found.psnr) else f"{found.psnr:.1f} dB",
            _share(found.seen.mean),
            f"{sum(found.seconds.values()):.2f}",
        )


def study_words(study: Study) -> Iterator[str]:
    """What the figures come to, in sentences."""
    flawless = [
        found.variant.name
        for found in study.findings
        if found.wrong == found.lost == 0 and not found.seams.failures
    ]
    yield f"no pixel in wrong order and no seam jump: {', '.join(flawless) or 'none'}"
    by_name = {found.variant.name: found for found in study.findings}
    twice = by_name.get("twopass")
    once = by_name.get("homography", study.findings[0])
    if twice is not None and once.seen.mean:
        factor = twice.seen.mean / once.seen.mean
        yield f"seen from the eye, twopass errs {factor:.2f} × as much as {once.variant.name}"


def _count(pixels: int | None) -> str:
    return "–" if pixels is None else f"{pixels:,}"


def _length(metres: float) -> str:
    return f"{metres * 1000:.3g} mm"


def _share(value: float) -> str:
    return f"{value:.2g}" if value < 0.001 else f"{value:.4f}"


def study_json(study: Study) -> dict[str, Any]:
    """A comparison for programs; lengths are in metres, what is infinite or unknown is null."""
    profile = study.profile
    return {
        "quilt_compare": 1,
        "frame": study.frame,
        "pixels": study.pixels,
        "lit_facets": study.lit,
        "near": study.near,
        "far": study.far,
        "methods": [_found_json(found) for found in study.findings],
        "profile": None
        if profile is None
        else {
            "facets": list(profile.facets),
            "along": profile.along.tolist(),
            "depth": {
                found.variant.name: [_finite(z) for z in depths.tolist()]
                for found, depths in zip(study.findings, study.depths, strict=True)
            },
        },
    }


def _found_json(found: Findings) -> dict[str, Any]:
    return {
        "method": found.variant.method,
        "depth_bits": found.variant.bits,
        "wrong_pixels": found.wrong,
        "lost_pixels": found.lost,
        "behind_max": found.behind,
        "depth_error": asdict(found.depth),
        "seams": found.seams.as_json(),
        "light_error": {**asdict(found.image), "psnr": _finite(found.psnr)},
        "seen_from_eye": {
            "mean": found.seen.mean,
            "percentile_99": found.seen.percentile_99,
            "maximum": found.seen.maximum,
            "psnr": _finite(found.seen.psnr),
            "flip": found.seen.flip,
        },
        "seconds": {name: round(value, 4) for name, value in found.seconds.items()},
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
