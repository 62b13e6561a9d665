"""USD stages: meshes, materials and lights at any time, as records of arrays (extra `usd`)."""

from __future__ import annotations

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
