"""Colours as mesh files write them.

Vertex and face colours of PLY, OBJ, OFF and STL are meant for the screen: sRGB, whether they are bytes
or fractions. They become linear here, exactly: bytes are divided by 255, fractions taken as they are.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray


def linear_from_srgb(colors: FloatArray) -> Float32Array:
    """Linear colours (N, 3) from sRGB values, 0 to 1 (IEC 61966-2-1); what is no number becomes 1."""
    value = np.clip(np.nan_to_num(colors, nan=1.0), 0.0, 1.0)
    curve = ((np.maximum(value, 0.04045) + 0.055) / 1.055) ** 2.4
    result: Float32Array = np.where(value <= 0.04045, value / 12.92, curve).astype(np.float32)
    return result
