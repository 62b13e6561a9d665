"""The layout: where each facet's pixels lie in the quilt."""

from quiltcli.layout.align import align
from quiltcli.layout.check import check_layout, layout_problems
from quiltcli.layout.file import file_problems, layout_text, read_layout, write_layout
from quiltcli.layout.from_uv import layout_from_polygons, layout_from_uv
from quiltcli.layout.layout import Layout, quilt_polygons, whole_pixel
from quiltcli.layout.owners import pixel_owners
from quiltcli.layout.spans import Spans, facet_spans, fill

__all__ = [
    "Layout",
    "Spans",
    "align",
    "check_layout",
    "facet_spans",
    "file_problems",
    "fill",
    "layout_from_polygons",
    "layout_from_uv",
    "layout_problems",
    "layout_text",
    "pixel_owners",
    "quilt_polygons",
    "read_layout",
    "whole_pixel",
    "write_layout",
]
