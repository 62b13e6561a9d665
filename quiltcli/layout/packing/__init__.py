"""Packing: find a place in the quilt for every facet of a display."""

from quiltcli.layout.packing.attempt import Attempt, Method
from quiltcli.layout.packing.methods import METHODS
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.pack import pack

__all__ = [
    "METHODS",
    "Attempt",
    "Method",
    "PackInput",
    "PackResult",
    "pack",
]
