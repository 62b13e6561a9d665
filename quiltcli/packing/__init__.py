"""Packing: find a place in the quilt for every facet of a display."""

from quiltcli.packing.model import Method, PackInput, PackResult
from quiltcli.packing.pack import DEFAULT_METHOD, METHODS, pack

__all__ = ["DEFAULT_METHOD", "METHODS", "Method", "PackInput", "PackResult", "pack"]
