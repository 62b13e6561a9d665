"""Pixel maps: the layout in the forms other tools of the field read and write."""

from quiltcli.exchange.pixelmaps.formats import (
    FORMATS,
    Format,
    imported_map,
    known_display,
    read_map,
    write_map,
)
from quiltcli.exchange.pixelmaps.mpcdi3d import holds_surfaces, read_surfaces
from quiltcli.exchange.pixelmaps.naming import facet_label, page_files, parse_label
from quiltcli.exchange.pixelmaps.xyz import write_display_map

__all__ = [
    "FORMATS",
    "Format",
    "facet_label",
    "holds_surfaces",
    "imported_map",
    "known_display",
    "page_files",
    "parse_label",
    "read_map",
    "read_surfaces",
    "write_display_map",
    "write_map",
]
