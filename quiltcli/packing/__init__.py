"""Packing: find a place in the quilt for every facet of a display."""

from quiltcli.packing.choice import layout_for
from quiltcli.packing.model import Method, PackInput, PackResult
from quiltcli.packing.pack import DEFAULT_METHOD, METHODS, pack

__all__ = ["DEFAULT_METHOD", "METHODS", "Method", "PackInput", "PackResult", "layout_for", "pack"]
