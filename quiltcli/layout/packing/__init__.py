"""Packing: find a place in the quilt for every facet of a display."""

from quiltcli.layout.packing.attempt import Attempt, Method
from quiltcli.layout.packing.from_job import layout_for
from quiltcli.layout.packing.methods import DEFAULT_METHOD, METHODS, STEADY
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.pack import pack
from quiltcli.layout.packing.wishes import CANVASES, DEFAULT_SECONDS, read_aspect

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
