"""Packing: find a place in the quilt for every facet of a display."""

from quiltcli.packing.attempt import Attempt, Method
from quiltcli.packing.choice import layout_for
from quiltcli.packing.methods import DEFAULT_METHOD, METHODS, STEADY
from quiltcli.packing.model import PackInput, PackResult
from quiltcli.packing.pack import pack
from quiltcli.packing.target import CANVASES, DEFAULT_SECONDS, read_aspect

__all__ = [
    "CANVASES",
    "DEFAULT_METHOD",
    "DEFAULT_SECONDS",
    "METHODS",
    "STEADY",
    "Attempt",
    "Method",
    "PackInput",
    "PackResult",
    "layout_for",
    "pack",
    "read_aspect",
]
