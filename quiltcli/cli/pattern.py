"""`quilt pattern`: test patterns at exact pixels."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH, PATTERN, SIZE, refuse_typed


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
    help="id, marker, border, grid, checker, gradient, white, markers, or all; may be given again.",
)
@click.option("--format", "image_format", default="png", show_default=True, help="png or exr.")
@click.option("--step", type=int, default=32, show_default=True, help="Pixels between lines of a grid.")
@click.option("--opaque", is_flag=True, help="Black where no facet is, not transparent.")
@click.option("--dictionary", default="5x5", show_default=True, help="Markers: 4x4, 5x5, 6x6, apriltag36h11.")
@click.option(
    "--per-facet", type=click.IntRange(1, 100), default=8, show_default=True, help="Markers a facet."
)
@click.option("--photo", type=SIZE, default="4000x3000", show_default=True, help="Size of photos of markers.")
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
@OVERWRITE
def pattern(
    layout: Path,
    output: Path,
    kinds: tuple[str, ...],
    image_format: str,
    step: int,
    opaque: bool,
    dictionary: str,
    per_facet: int,
    photo: tuple[int, int] | None,
    display: Path | None,
    overwrite: bool,
) -> None:
    """Draw test patterns for LAYOUT at exact pixels: which facet, which way up, where it ends.

    Of a display file of the kind lightfield360: id, border, grid or white, packed as they are sent.

    The pattern `markers` is for a camera: quilt calibrate finds from photos of it where the facets are.
    """
    from quiltcli.calibration.markers import PHOTO, place_markers
    from quiltcli.calibration.pattern import KINDS, MARKERS
    from quiltcli.calibration.pattern_files import write_patterns
    from quiltcli.exchange.pixelmaps import known_display
    from quiltcli.job.load import is_mirror_file
    from quiltcli.layout import align, read_layout

    if is_mirror_file(layout):
        refuse_typed("in patterns of a mirror", but=("layout", "output", "kinds", "overwrite"))
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
    markers = None
    if MARKERS in chosen:
        if facets is None:
            raise click.UsageError(
                "--kind markers: the layout names no display that is there (--display FILE)"
            )
        markers = place_markers(facets, dictionary, per_facet, photo or PHOTO)
        if without := markers.without(facets):
            shown = ", ".join(map(str, without[:8]))
            click.echo(f"note: {len(without)} facets have no room for a marker ({shown}, …)", err=True)
    paths = write_patterns(
        loaded,
        output,
        chosen,
        image_format=image_format,
        names=names,
        step=step,
        markers=markers,
        overwrite=overwrite,
        opaque=opaque,
    )
    for path in paths:
        click.echo(str(path))
