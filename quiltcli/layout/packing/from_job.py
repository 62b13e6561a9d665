"""What a job says about its layout, turned into one."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from quiltcli.display import Facets
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.layout import Layout, align, layout_from_uv, read_layout
from quiltcli.layout.packing.pack import pack_target
from quiltcli.layout.packing.wishes import Target


def layout_for(choice: Path | PackSpec | UvLayoutSpec, facets: Facets) -> tuple[Facets, Layout]:
    """Read, pack or take from texture coordinates the layout a job asks for, and align the display with it.

    Returns:
        facets and layout as `quiltcli.layout.align` gives them: one row per facet of the display.

    Raises:
        JobError, LayoutError: as `read_layout`, `pack`, `layout_from_uv` and `align` do.
    """
    if isinstance(choice, PackSpec):
        layout = pack_target(facets, _target(choice))
    elif isinstance(choice, UvLayoutSpec):
        layout = layout_from_uv(facets, choice.size)
    else:
        layout = read_layout(choice)
    return align(layout, facets)


def _target(spec: PackSpec) -> Target:
    return Target(
        method=spec.method,
        size=spec.size,
        padding=spec.padding,
        max_pages=spec.max_pages,
        aspect=None if spec.aspect is None else Fraction(str(spec.aspect)),
        align=spec.align,
        mirror=spec.mirror,
        page_facets=spec.page_facets,
        page_pixels=spec.page_pixels,
        pins=None if spec.pins is None else read_layout(spec.pins),
        seconds=spec.seconds,
    )
