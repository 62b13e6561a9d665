"""What a job says about its layout, turned into one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from quiltcli.display import Facets
from quiltcli.errors import QuiltError
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.job.layout_table import places_sha256, read_layout_table
from quiltcli.layout import Layout, align, layout_from_uv, read_layout
from quiltcli.layout.file import layout_from_table
from quiltcli.layout.packed import packed_from


def layout_for(choice: Path | PackSpec | UvLayoutSpec, facets: Facets, kept: Path | None = None) -> Layout:
    """Read, pack or take from texture coordinates the layout a job asks for, and align it with the display.

    Args:
        choice: what the job says.
        facets: the display.
        kept: the layout file of an earlier run, if there was one. It is read instead of packing when it
            is what packing these facets so came to, and was not changed since.

    Returns:
        the layout as `quiltcli.layout.align` gives it: one row per facet of the display.

    Raises:
        JobError, LayoutError: as `read_layout`, `pack`, `layout_from_uv` and `align` do.
    """
    if isinstance(choice, PackSpec):
        layout = _kept(kept, choice, facets) or _packed(choice, facets)
    elif isinstance(choice, UvLayoutSpec):
        layout = layout_from_uv(facets, choice.size)
    else:
        layout = read_layout(choice)
    return align(layout, facets)


def _kept(path: Path | None, wishes: PackSpec, facets: Facets) -> Layout | None:
    """The layout of an earlier run, if nothing it came of has changed since."""
    if path is None or not path.is_file():
        return None
    try:
        layout = layout_from_table(read_layout_table(path))
    except QuiltError:  # what an earlier run left is no reason not to run again
        return None
    same = layout.display_sha256 == facets.sha256
    same = same and layout.packed == packed_from(facets, wishes, places_sha256(layout))
    return layout if same else None


def _packed(wishes: PackSpec, facets: Facets) -> Layout:
    """The layout, packed now, and what it came of."""
    # All that packs is loaded only by those who pack.
    from quiltcli.layout.packing import pack

    layout = pack(facets, wishes)
    return replace(layout, packed=packed_from(facets, wishes, places_sha256(layout)))
