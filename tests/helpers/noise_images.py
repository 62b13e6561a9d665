"""Images of noise, and the attributes of a view, for tests of what is written and read."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from quiltcli.images.metadata import page_attributes
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer

VIEWER = Viewer(
    frame=-7,
    eye=np.array([0.1, 1.6, 2.5]),
    look=np.array([0.0, 0.0, -1.0]),
    up=np.array([0.0, 1.0, 0.0]),
    near=0.05,
    far=50.0,
    depth="planar",
)


def noise(height=40, width=50, seed=1):
    rng = np.random.default_rng(seed)
    channels = {name: rng.standard_normal((height, width)).astype(np.float16) for name in "RGBA"}
    channels["Z"] = np.where(rng.random((height, width)) < 0.3, np.inf, rng.random((height, width)))
    channels["Z"] = channels["Z"].astype(np.float32)
    channels["triangle"] = rng.integers(0, 2**32, (height, width), dtype=np.uint32)
    return channels


def provenance():
    view = View(VIEWER.frame, "", (VIEWER,), VIEWER.frame)
    return page_attributes(view, Fraction(30000, 1001), "ab" * 32, "0.1.0")
