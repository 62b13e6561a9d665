"""`quilt pack`: a layout for a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import ASPECT, PACKING_METHOD, PATH, SIZE


@click.command()
@click.argument("display", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option(
    "--method",
    type=PACKING_METHOD,
    default="auto",
    help="auto (the best of rects and nest), rows (by id, as people read), rects or maxrects (bounding"
    " rectangles), nest (outlines interlock), or net (neighbours stay neighbours at any angle: each facet's"
    " raster is then taken from the quilt, not from the display).",
)
@click.option(
    "--size",
    type=SIZE,
    help="Page size such as 8192x8192; uhd, dci4k or uhd8k; auto (the default) takes the smallest page.",
)
@click.option("--aspect", type=ASPECT, help="Aspect of the smallest page, such as 16:9.")
@click.option("--max-pages", type=click.IntRange(min=1), help="Most pages that may be used.")
@click.option(
    "--padding", type=click.IntRange(min=0), default=2, show_default=True, help="Pixels between facets."
)
@click.option("--align", type=click.IntRange(min=1), default=1, help="Facets' corners at multiples of this.")
@click.option("--mirror", is_flag=True, help="Let nest and auto mirror facets.")
@click.option("--page-facets", type=click.IntRange(min=1), help="Most facets on a page.")
@click.option("--page-pixels", type=click.IntRange(min=1), help="Most pixels of facets on a page.")
@click.option("--pins", type=PATH, help="A layout whose facets stay; the others are packed around them.")
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=10.0,
    help="Effort, 10 by default: seconds on a slow computer; every computer packs alike.",
)
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def pack(
    display: Path,
    output: Path,
    picture: Path | None,
    **wishes: Any,
) -> None:
    """Make a facet layout for DISPLAY; print its fill and pages.

    By every method but net a facet's own pixels are the quilt's pixels, moved and perhaps turned.
    """
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file, pack_spec
    from quiltcli.layout import fill, write_layout
    from quiltcli.layout.packing import pack as pack_facets
    from quiltcli.layout.picture.picture import layout_picture

    facets = load_display(load_display_file(display))
    layout = pack_facets(facets, pack_spec(**wishes))
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets=facets)
    pages = list(dict.fromkeys(map(tuple, layout.pages.tolist())))
    click.echo(f"fill {100 * fill(layout):.1f} %")
    click.echo(f"pages {len(layout.pages)} of {' and '.join(f'{w}×{h}' for w, h in pages)} pixels")
