"""What a job says about its layout, turned into one."""

from __future__ import annotations

from pathlib import Path

from quiltcli.display import Facets
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.layout import Layout, align, layout_from_uv, read_layout
from quiltcli.layout.packing.pack import pack


def layout_for(choice: Path | PackSpec | UvLayoutSpec, facets: Facets) -> tuple[Facets, Layout]:
    """Read, pack or take from texture coordinates the layout a job asks for, and align the display with it.

    Returns:
        facets and layout as `quiltcli.layout.align` gives them: one row per facet of the display.

    Raises:
        JobError, LayoutError: as `read_layout`, `pack`, `layout_from_uv` and `align` do.
    """
    if isinstance(choice, PackSpec):
        layout = pack(facets, choice)
    elif isinstance(choice, UvLayoutSpec):
        layout = layout_from_uv(facets, choice.size)
    else:
        layout = read_layout(choice)
    return align(layout, facets)
