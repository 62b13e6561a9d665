"""`quilt pattern`: test patterns at exact pixels."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH, PATTERN


@click.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the images.")
@click.option(
    "--kind",
    "kinds",
    type=PATTERN,
    multiple=True,
    default=("id",),
    show_default=True,
    help="id, marker, border, grid, checker, gradient, white, or all; may be given again.",
)
@click.option("--format", "image_format", default="png", show_default=True, help="png or exr.")
@click.option("--step", type=int, default=32, show_default=True, help="Pixels between lines of a grid.")
@click.option("--opaque", is_flag=True, help="Black where no facet is, not transparent.")
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
@OVERWRITE
def pattern(
    layout: Path,
    output: Path,
    kinds: tuple[str, ...],
    image_format: str,
    step: int,
    opaque: bool,
    display: Path | None,
    overwrite: bool,
) -> None:
    """Draw test patterns for LAYOUT at exact pixels: which facet, which way up, where it ends.

    Of a display file of the kind lightfield360: id, border, grid or white, packed as they are sent.
    """
    from quiltcli.calibration.pattern import KINDS
    from quiltcli.calibration.pattern_files import write_patterns
    from quiltcli.exchange.pixelmaps import known_display
    from quiltcli.job.load import is_mirror_file
    from quiltcli.layout import align, read_layout

    if is_mirror_file(layout):
        from quiltcli.calibration.ring_pattern import KINDS as ON_MIRROR
        from quiltcli.calibration.ring_pattern import write_ring_patterns
        from quiltcli.cli.printing import print_files

        wanted = tuple(ON_MIRROR) if "all" in kinds else tuple(dict.fromkeys(kinds))
        print_files(write_ring_patterns(layout, output, wanted, overwrite=overwrite), output)
        return
    loaded = read_layout(layout)
    facets = known_display(loaded, display)
    if facets is not None:
        align(loaded, facets)
    names = facets.names if facets is not None else ()
    chosen = tuple(KINDS) if "all" in kinds else tuple(dict.fromkeys(kinds))
    paths = write_patterns(
        loaded,
        output,
        chosen,
        image_format=image_format,
        names=names,
        step=step,
        overwrite=overwrite,
        opaque=opaque,
    )
    for path in paths:
        click.echo(str(path))
