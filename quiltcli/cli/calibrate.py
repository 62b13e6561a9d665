"""`quilt calibrate`: a display as it really is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import OVERWRITE, PATH, POINT, refuse_typed


@click.command()
@click.argument("inputs", type=PATH, nargs=-1, required=True)
@click.option("--display", type=PATH, help="Photos, corners: the display as it should be.")
@click.option("-o", "--output", type=PATH, help="Display file to write, or whose projector to replace.")
@click.option("--markers", type=PATH, help="The markers.json that quilt pattern wrote.")
@click.option(
    "--dictionary", default="5x5", show_default=True, help="Dictionary, where there is no such file."
)
@click.option("--camera", type=PATH, help="Camera file; without one the camera is sought as well.")
@click.option("--board", default="", help="ChArUco board in some photos: 7x5,30mm,22mm,4x4.")
@click.option("--anchor", type=int, help="Facet that stays where it is; the one seen most by default.")
@click.option(
    "--attached",
    multiple=True,
    metavar="3x2,40mm,10mm,4x4,20=1-3",
    help="Board of markers fixed to facets: across x down, side, gap, dictionary, first id, facets.",
)
@click.option("--rig", type=PATH, help="The rig.json of an earlier report: photos show its boards alone.")
@click.option(
    "--distance", "distances", multiple=True, metavar="1A-3C=1.532m", help="Measured between two corners."
)
@click.option("--eye", type=POINT, metavar="X,Y,Z", help="Say what uncertainty means to an eye there.")
@click.option("--units", default="m", show_default=True, help="Unit of measured corners: m, cm, mm, in, ft.")
@click.option("--report", type=PATH, help="Folder for residuals, pictures and the camera.")
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0),
    default=1.0,
    show_default=True,
    help="Clicks: pixels, rms, they may be off.",
)
@click.option("--json", "as_json", is_flag=True, help="Clicks: everything, for programs.")
@OVERWRITE
def calibrate(inputs: tuple[Path, ...], display: Path | None, output: Path | None, **how: Any) -> None:
    """Correct a display by INPUTS: photos of its markers, a table of its corners (.csv), or clicks (.yaml).

    Markers are shown by quilt pattern --kind markers. Every facet should be in two photos or more, with a
    neighbour beside it, from several sides; six to twelve photos are plenty. A table has columns facet,
    corner, x, y, z.

    Clicks are a quilt_calibration file: six or more points of a spinning mirror and the pixels that light
    them. They are listed with the worst first; the exit code is 1 where they are off by more than the
    tolerance, and then no display is written.
    """
    clicks = [path for path in inputs if path.suffix.lower() in (".yaml", ".yml")]
    if clicks and (len(inputs) > 1 or display is not None):
        raise click.UsageError("expected one file of clicks, without --display, or photos, or a table")
    if clicks:
        refuse_typed("beside clicks", but=("inputs", "output", "tolerance", "as_json", "overwrite"))
        _by_clicks(clicks[0], output, **{name: how[name] for name in ("tolerance", "as_json", "overwrite")})
    elif display is None or output is None:
        raise click.UsageError("expected --display and -o beside photos or a table of corners")
    else:
        _by_panels(inputs, display, output, how)


def _by_clicks(clicks: Path, output: Path | None, tolerance: float, as_json: bool, overwrite: bool) -> None:
    """Find the projector that lights marks where they were seen."""
    from quiltcli.calibration import clicks as library
    from quiltcli.cli.printing import print_aligned

    file, found = library.calibrate_file(clicks)
    if as_json:
        import json

        click.echo(json.dumps(library.figures(found), indent=2, allow_nan=False))
    else:
        for label, text in library.lines(found):
            click.echo(f"{label:<13} {text}")
        click.echo()
        print_aligned(library.COLUMNS, library.rows(file, found))
    library.within(clicks, found, tolerance)
    if output is not None:
        library.write_display(output, file, found, overwrite=overwrite)


def _by_panels(inputs: tuple[Path, ...], display: Path, output: Path, how: dict[str, Any]) -> None:
    """Find where facets are."""
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
    if tables:
        refuse_typed("beside a table of corners", but=("inputs", "display", "output", "units", "overwrite"))
        lines, texts = _from_corners(spec, facets, tables[0], mesh, how)
    else:
        refuse_typed("beside photos", ("units", "tolerance", "as_json"))
        from_these = _from_photos if how["rig"] is None else _from_rig
        lines, texts = from_these(spec, facets, inputs, mesh, how)
    paths = [output.with_name(name) if name else output for name in texts]
    taken = [
        Problem("exists already (--overwrite replaces it)", file=str(path)) for path in paths if path.exists()
    ]
    raise_all(OutputError, [] if how["overwrite"] else taken)
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
    from quiltcli.calibration.panels.corners import (
        corner_table,
        doubtful_corners,
        fit_corners,
        read_corners,
        turned_facets,
    )
    from quiltcli.errors import JobError, raise_all
    from quiltcli.job import UNITS

    if how["units"] not in UNITS:
        raise click.UsageError(f"--units: expected {', '.join(UNITS)}, got {how['units']}")
    corners = read_corners(path, facets, how["units"])
    raise_all(JobError, list(doubtful_corners(path, facets, corners, how["units"]))[:20])
    for notice in turned_facets(facets, corners):
        click.echo(f"note: {notice}", err=True)
    found = fit_corners(spec, facets, corners, mesh)
    return list(corner_table(facets, found.residual)), found.files


def _from_rig(
    spec: Any, facets: Any, photos: tuple[Path, ...], mesh: str, how: dict[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """The same from photos of boards that carry facets."""
    from quiltcli.calibration.panels.attached import read_rig
    from quiltcli.calibration.panels.camera import camera_of
    from quiltcli.calibration.panels.rig import find_moved, rig_files, rig_table
    from quiltcli.job.load import load_camera_file

    idle = [name for name in ("markers", "board", "attached", "distances", "eye", "report") if how[name]]
    if idle:
        raise click.UsageError(f"--rig takes --camera and --anchor, not --{idle[0].rstrip('s')}")
    camera = None if how["camera"] is None else camera_of(load_camera_file(how["camera"]))
    boards, places = read_rig(how["rig"])
    moved = find_moved(facets, boards, places, photos, camera, how["anchor"])
    return list(rig_table(moved)), rig_files(spec, facets, moved, mesh)


def _from_photos(
    spec: Any, facets: Any, photos: tuple[Path, ...], mesh: str, how: dict[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """The same from photos; the report is written here."""
    import numpy as np

    from quiltcli.calibration.panels import report
    from quiltcli.calibration.panels.calibrate import Wishes, calibrate, calibrated_files
    from quiltcli.calibration.panels.distances import parse_distance

    names = ("markers", "dictionary", "camera", "board", "anchor", "attached", "distances")
    distances = [parse_distance(text, facets) for text in how["distances"]]
    solution, used = calibrate(facets, photos, Wishes(**{name: how[name] for name in names}))
    lines = [*report.table(solution, facets), *report.summary(solution)]
    if how["eye"] is not None:
        lines += report.at_the_eye(solution, facets, np.array(how["eye"]))
    if how["report"] is not None:
        lines += [str(path) for path in report.write_report(how["report"], solution, facets, used)]
    files, told = calibrated_files(spec, facets, solution, mesh, distances)
    return [*lines, *told], files
