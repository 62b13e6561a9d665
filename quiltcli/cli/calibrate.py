"""`quilt calibrate`: a display as it really is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import OVERWRITE, PATH, POINT


@click.command()
@click.argument("inputs", type=PATH, nargs=-1, required=True)
@click.option("--display", type=PATH, required=True, help="The display as it should be.")
@click.option("-o", "--output", type=PATH, required=True, help="Display file to write; its mesh beside it.")
@click.option("--markers", type=PATH, help="The markers.json that quilt pattern wrote.")
@click.option(
    "--dictionary", default="5x5", show_default=True, help="Dictionary, where there is no such file."
)
@click.option("--camera", type=PATH, help="Camera file; without one the camera is sought as well.")
@click.option("--board", default="", help="ChArUco board in some photos: 7x5,30mm,22mm,4x4.")
@click.option("--anchor", type=int, help="Facet that stays where it is; the one seen most by default.")
@click.option("--eye", type=POINT, metavar="X,Y,Z", help="Say what uncertainty means to an eye there.")
@click.option("--units", default="m", show_default=True, help="Unit of measured corners: m, cm, mm, in, ft.")
@click.option("--report", type=PATH, help="Folder for residuals, pictures and the camera.")
@OVERWRITE
def calibrate(inputs: tuple[Path, ...], display: Path, output: Path, overwrite: bool, **how: Any) -> None:
    """Correct a display file by INPUTS: photos of its markers, or a table of measured corners (.csv).

    Markers are shown by quilt pattern --kind markers. Every facet should be in two photos or more, with a
    neighbour beside it, from several sides; six to twelve photos are plenty.
    """
    from quiltcli.calibration.panels.display_files import display_name
    from quiltcli.cli.printing import print_files
    from quiltcli.display import load_display
    from quiltcli.errors import OutputError, Problem, raise_all
    from quiltcli.formats.whole import make_folder, write_text
    from quiltcli.job import load_display_file

    spec = load_display_file(display)
    facets, mesh = load_display(spec), display_name(output)
    tables = [path for path in inputs if path.suffix.lower() == ".csv"]
    if tables and len(inputs) > 1:
        raise click.UsageError("expected photos, or one table of corners, not both")
    lines, texts = (
        _from_corners(spec, facets, tables[0], mesh, how)
        if tables
        else (_from_photos(spec, facets, inputs, mesh, how))
    )
    paths = [output.with_name(name) if name else output for name in texts]
    taken = [
        Problem("exists already (--overwrite replaces it)", file=str(path)) for path in paths if path.exists()
    ]
    raise_all(OutputError, [] if overwrite else taken)
    for line in lines:
        click.echo(line)
    make_folder(output.parent)
    for path, text in zip(paths, texts.values(), strict=True):
        write_text(path, text)
    print_files(paths, output.parent)


def _from_corners(
    spec: Any, facets: Any, path: Path, mesh: str, how: dict[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """What to say, and the files' texts."""
    from quiltcli.calibration.panels.corners import corner_table, fit_corners, read_corners
    from quiltcli.job import UNITS

    if how["units"] not in UNITS:
        raise click.UsageError(f"--units: expected {', '.join(UNITS)}, got {how['units']}")
    found = fit_corners(spec, facets, read_corners(path, facets, how["units"]), mesh)
    return list(corner_table(facets, found.residual)), found.files


def _from_photos(
    spec: Any, facets: Any, photos: tuple[Path, ...], mesh: str, how: dict[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """The same from photos; the report is written here."""
    import numpy as np

    from quiltcli.calibration.panels import report
    from quiltcli.calibration.panels.calibrate import Wishes, calibrate, calibrated_files

    names = ("markers", "dictionary", "camera", "board", "anchor")
    solution, used = calibrate(facets, photos, Wishes(**{name: how[name] for name in names}))
    lines = [*report.table(solution, facets), *report.summary(solution)]
    if how["eye"] is not None:
        lines += report.at_the_eye(solution, facets, np.array(how["eye"]))
    if how["report"] is not None:
        lines += [str(path) for path in report.write_report(how["report"], solution, facets, used)]
    return lines, calibrated_files(spec, facets, solution, mesh)
