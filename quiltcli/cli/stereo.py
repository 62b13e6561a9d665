"""`quilt stereo`: two eyes' images as stereo hardware takes them."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH, frames_option
from quiltcli.cli.printing import print_files
from quiltcli.errors import JobError

MODES = (
    *("anaglyph", "side-by-side", "side-by-side-half", "top-bottom", "top-bottom-half"),
    *("rows", "columns", "checkerboard", "sequential", "rgb-frames"),
)
MATRICES = (
    *("true", "grey", "color", "half-color", "optimized"),
    *("dubois-red-cyan", "dubois-green-magenta", "dubois-amber-blue"),
)


@click.command()
@click.argument("out", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the images.")
@click.option("--as", "mode", type=click.Choice(MODES), required=True, help="How the two become one.")
@click.option(
    "--matrix",
    type=click.Choice(MATRICES),
    help="Colours of an anaglyph.  [default: dubois-red-cyan]",
)
@click.option("--of", "kind", type=click.Choice(("pages", "facets")), default="pages", show_default=True)
@frames_option("Frames; all by default.")
@click.option("--swap", is_flag=True, help="Take left for right.")
@click.option("--sync-line", is_flag=True, help="A blue line in the last row, for shutter glasses.")
@OVERWRITE
def stereo(
    out: Path,
    output: Path,
    mode: str,
    matrix: str | None,
    kind: str,
    frames: tuple[int, ...] | None,
    swap: bool,
    sync_line: bool,
    overwrite: bool,
) -> None:
    """Make of the two eyes' images in OUT, the output folder of a render, what stereo hardware takes.

    Rows, columns and checkerboards are counted from each panel's own top-left pixel, which is the left
    eye's. A sequence has the left eye's image of frame n at 2n−1, the right one's at 2n.
    """
    from quiltcli.images.stereo.files import StereoOptions, write_stereo

    if matrix is not None and mode != "anaglyph":
        raise JobError(f"--matrix goes with --as anaglyph, not with {mode}")
    colors = matrix or "dubois-red-cyan"
    options = StereoOptions(mode, kind.removesuffix("s"), frames, colors, swap, sync_line, overwrite)
    written = write_stereo(out, output, options)
    print_files(written, output)
