"""What counts as exact: the tolerances a render is held to."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray

CLOSE = 1e-5
"""Share of a depth within which two surfaces are too close for either to be wrong."""

BESIDE = 2e-6
"""Pixels by which a pixel's sample may lie beside its centre, so that no vertex sits on it."""


def depth_tolerance(depth: FloatArray) -> FloatArray:
    """Metres by which a depth may be off."""
    result: FloatArray = 2e-6 * np.abs(depth) + 1e-6
    return result
