"""The command line: parse, call one library function a command, print.

Nothing heavy is imported before a command runs, so `quilt --help` answers at once. Results go to
stdout, everything else to stderr; `Quilt.invoke` is the one place that turns an error into a message
and an exit code.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from quiltcli import __version__
from quiltcli.errors import JobError, QuiltError

T = TypeVar("T")
PATH = click.Path(path_type=Path)


class Quilt(click.Group):
    """The `quilt` command."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; errors that are the user's to mend become one line a problem."""
        try:
            return super().invoke(ctx)
        except QuiltError as error:
            if ctx.params.get("debug"):
                raise
            click.echo(f"error: {error}" if len(error.problems) == 1 else str(error), err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            ctx.exit(130)
        except MemoryError:
            if ctx.params.get("debug"):
                raise
            click.echo("error: not enough memory (smaller pages or fewer threads need less)", err=True)
            ctx.exit(1)
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except Exception as error:
            if ctx.params.get("debug"):
                raise
            click.echo(f"error: {_unexpected(error)}", err=True)
            ctx.exit(1)


def _unexpected(error: Exception) -> str:
    """What is said of an error that is no user's fault, and that nobody thought of."""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"quilt has met a fault of its own: {what} (quilt --debug COMMAND … shows where)"


class Parsed(click.ParamType):  # type: ignore[type-arg] # generic only in some versions of click
    """A value that a function of the library reads from text."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name = name
        self.read = read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value, or a usage error with the library's own words."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except ValueError as error:
            return self.fail(str(error), param, ctx)


def _frames(text: str) -> tuple[int, ...]:
    from quiltcli.frames import parse_frames

    return parse_frames(text)


def _facets(text: str) -> tuple[int, ...]:
    from quiltcli.frames import parse_facets

    return parse_facets(text)


def _size(text: str) -> tuple[int, int] | None:
    if text == "auto":
        return None
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise JobError(f"expected WIDTHxHEIGHT in pixels, such as 8192x8192, or auto, got {text!r}")
    return int(width), int(height)


def _point(text: str) -> tuple[float, ...]:
    try:
        point = tuple(map(float, text.split(",")))
    except ValueError:
        point = ()
    if len(point) != 3 or not all(abs(value) < float("inf") for value in point):
        raise JobError(f"expected a point in metres, such as 0,1.6,2.5, got {text!r}")
    return point


def _area(text: str) -> tuple[float, ...]:
    try:
        area = tuple(map(float, text.split(",")))
    except ValueError:
        area = ()
    if len(area) != 4 or not all(abs(value) < float("inf") for value in area):
        raise JobError(f"expected an area x0,z0,x1,z1 in metres, such as -2,1,2,4, got {text!r}")
    return area


FRAMES = Parsed("frames", _frames)
FACETS = Parsed("facets", _facets)
SIZE = Parsed("size", _size)
POINT = Parsed("point", _point)
AREA = Parsed("area", _area)
VIEW = click.Choice(("aces", "srgb"))
ROWS = 20  # of a table, before --all


@click.group(
    cls=Quilt, context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "QUILT"}
)
@click.version_option(__version__, prog_name="quilt")
@click.option("--debug", is_flag=True, help="Show tracebacks.")
def main(debug: bool) -> None:
    """Render perspectively correct 3D for multiplanar displays.

    A display is a set of flat facets; a quilt is the packed image of them all. (No patch stack, and
    no Looking Glass grid of views.) The same program answers to quiltcli.
    """


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frames", type=FRAMES, help="Frames such as 1-240, 1-9x2 or 1,5,20-30; inclusive.")
@click.option("-o", "--output", type=PATH, help="Output folder, instead of the job's.")
@click.option("--resume", is_flag=True, help="Skip frames that are complete and made by the same job.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
@click.option("--facets", type=FACETS, help="Draw only these facets, such as 3,7-9, into existing quilts.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option("--scheduler", metavar="ADDRESS", help="Hand the frames to a dask scheduler.")
@click.option("--dry-run", is_flag=True, help="Find every problem, write nothing.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
def render(
    job: Path,
    frames: tuple[int, ...] | None,
    output: Path | None,
    resume: bool,
    overwrite: bool,
    facets: tuple[int, ...] | None,
    threads: int | None,
    scheduler: str | None,
    dry_run: bool,
    sets: tuple[str, ...],
) -> None:
    """Render the frames of JOB: quilts, facet images, report."""
    from quiltcli.job import load_job
    from quiltcli.render import RenderOptions

    if resume and overwrite:
        raise click.UsageError("--resume keeps finished frames and --overwrite replaces them: give one")
    options = RenderOptions(frames, output, resume, overwrite, facets, threads or 0, dry_run)
    _render(load_job(job, sets), options, scheduler)


def _render(job: Any, options: Any, scheduler: str | None) -> None:
    """Render here or on a farm, with progress on stderr and the summary on stdout."""
    from quiltcli.farm import render_on
    from quiltcli.interrupt import Stopped
    from quiltcli.progress import progress
    from quiltcli.render import Listener
    from quiltcli.render import render as render_here
    from quiltcli.report import summary_warnings

    def work(*given: Any) -> Any:
        return render_here(*given) if scheduler is None else render_on(scheduler, *given)

    with progress() as shown:
        try:
            records = work(job, options, Listener(shown.begin, shown.frame_done, shown.say))
        except Stopped as stopped:
            shown.say(str(stopped))
            sys.exit(stopped.exit_code)
    for warning in summary_warnings(records):
        click.echo(f"warning: {warning}", err=True)
    if options.dry_run:
        click.echo("nothing is wrong with this job")
    elif records:
        _print_summary(records)
        click.echo(f"written to {options.folder or job.output.directory}")
    else:
        click.echo("every frame is complete already")


def _print_summary(records: Any) -> None:
    """The summary table, plain where stdout is no terminal."""
    from rich.console import Console

    from quiltcli.report import summary, summary_table

    if sys.stdout.isatty():
        Console().print(summary_table(records))
        return
    for label, value in summary(records):
        click.echo(f"{label:<24}{value}")


@main.command()
@click.argument("display", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option("--method", help="Packing method.")
@click.option("--size", type=SIZE, help="Page size such as 8192x8192; auto takes the smallest page.")
@click.option("--max-pages", type=click.IntRange(min=1), help="Most pages that may be used.")
@click.option(
    "--padding", type=click.IntRange(min=0), default=2, show_default=True, help="Pixels between facets."
)
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def pack(
    display: Path,
    output: Path,
    method: str | None,
    size: tuple[int, int] | None,
    max_pages: int | None,
    padding: int,
    picture: Path | None,
) -> None:
    """Make a facet layout for DISPLAY; print its fill and pages."""
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file
    from quiltcli.layout import fill, layout_picture, write_layout
    from quiltcli.packing import DEFAULT_METHOD
    from quiltcli.packing import pack as pack_facets

    facets = load_display(load_display_file(display))
    layout = pack_facets(facets, method or DEFAULT_METHOD, size, padding, max_pages)
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets.names)
    pages = layout.pages.tolist()
    click.echo(f"fill {100 * fill(layout):.1f} %")
    click.echo(f"pages {len(pages)} of {pages[0][0]}×{pages[0][1]} pixels")


@main.command()
@click.argument("files", nargs=-1, required=True, type=PATH)
def check(files: tuple[Path, ...]) -> None:
    """Read FILES strictly and report every problem found."""
    from quiltcli.checking import check_files

    problems = check_files(files)
    for problem in problems:
        click.echo(str(problem))
    if problems:
        sys.exit(1)
    click.echo(f"{len(files)} file{'s' * (len(files) > 1)}: nothing is wrong", err=True)


@main.command()
@click.argument("file", type=PATH)
@click.option("--all", "every", is_flag=True, help=f"Every row of the table, not only the first {ROWS}.")
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def info(file: Path, every: bool, as_json: bool) -> None:
    """Say what FILE is: a display, layout, scene, job, mesh or EXR image."""
    from quiltcli.info import describe

    found = describe(file)
    if as_json:
        import json

        click.echo(json.dumps(found.as_json(), indent=2, ensure_ascii=False, allow_nan=False))
        return
    width = max(len(label) for label, _ in found.lines)
    for label, text in (("", f"{found.kind} {file}"), *found.lines):
        click.echo(f"{label:<{width}}  {text}" if label else text)
    rows = found.rows if every else found.rows[:ROWS]
    if rows:
        click.echo()
        _print_aligned(found.columns, rows)
    if len(rows) < len(found.rows):
        click.echo(f"and {len(found.rows) - len(rows):,} more (--all shows them)")


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frames", type=FRAMES, help="Frames such as 7 or 1-12; the job's first by default.")
@click.option(
    "-o", "--output", type=PATH, required=True, help="PNG to write; #### in its name is the frame number."
)
@click.option("--size", type=SIZE, default="1200x900", show_default=True, help="Size of the picture.")
@click.option("--from", "place", type=POINT, metavar="X,Y,Z", help="Look from here; from the eye by default.")
@click.option("--look-at", type=POINT, metavar="X,Y,Z", help="Look there; at the display by default.")
@click.option("--fov", type=click.FloatRange(0, 170, min_open=True), help="Degrees from top to bottom.")
@click.option("--filter", type=click.Choice(("nearest", "linear")), default="linear", show_default=True)
@click.option(
    "--supersample", type=click.IntRange(1, 16), default=2, show_default=True, help="Rays across a pixel."
)
@click.option("--compare/--no-compare", default=True, help="From the eye, compare with a direct picture.")
@click.option("--edges", is_flag=True, help="Draw a line along the edges of the facets.")
@click.option("--direct", type=PATH, help="Write the direct picture, as PNG.")
@click.option("--heat-map", type=PATH, help="Write a picture of the errors, as PNG.")
@click.option("--view", type=VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
def simulate(job: Path, frames: tuple[int, ...] | None, sets: tuple[str, ...], **how: Any) -> None:
    """Light the display of JOB with its images and look at it.

    From the viewer's eye the picture is compared with a direct one of the scene; the figures go to
    stdout. The images are those that a render has left; where there are none they are drawn in memory.
    """
    from quiltcli.job import load_job
    from quiltcli.simulate import PictureOptions
    from quiltcli.simulate.files import Pictures, write_pictures

    pictures = Pictures(
        how.pop("output"), how.pop("direct"), how.pop("heat_map"), how.pop("view"), how.pop("exposure")
    )
    if how["size"] is None:
        raise click.UsageError("--size: a picture needs a width and a height")
    options = PictureOptions(samples=how.pop("supersample"), threads=how.pop("threads") or 0, **how)
    loaded = load_job(job, sets)
    for line in write_pictures(loaded, frames or loaded.frames[:1], options, pictures):
        click.echo(line)


@main.command()
@click.argument("images", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="PNG to write, or a folder for several.")
@click.option("--view", type=VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")
def preview(images: tuple[Path, ...], output: Path, view: str, exposure: float) -> None:
    """Turn EXR IMAGES, quilts or facets, into PNGs to look at, at most 2048 pixels wide and high."""
    from quiltcli.preview import preview as write_preview
    from quiltcli.preview import preview_paths

    for image, picture in preview_paths(images, output):
        width, height = write_preview(image, picture, view, exposure)
        click.echo(f"{picture}  {width}×{height}")


@main.command()
@click.argument("display", type=PATH)
@click.option("--eye", type=POINT, metavar="X,Y,Z", help="The eye the content is drawn for.")
@click.option("--job", type=PATH, help="Take the eye of this job …")
@click.option("-f", "--frame", type=int, help="… at this frame; the job's first by default.")
@click.option(
    "--at", type=POINT, metavar="X,Y,Z", help="Content on the plane through this point, facing the eye."
)
@click.option(
    "--depth", type=float, help="Content this far behind the facets, metres; negative: before them."
)
@click.option("--distance", type=float, help="Content so far from the eye, metres; inf is far away.")
@click.option("--area", type=AREA, metavar="X0,Z0,X1,Z1", help="Floor to map; around the eye by default.")
@click.option("--height", type=float, help="Height of the eyes on the floor; the eye's by default.")
@click.option("--step", type=float, help="Metres between places of the map.")
@click.option("--limit-deg", type=float, default=2.0, show_default=True, help="Distortion that is borne.")
@click.option("--audience", type=AREA, metavar="X0,Z0,X1,Z1", help="Find the eye that serves this area best.")
@click.option("--minimise", type=click.Choice(("mean", "worst")), default="mean", show_default=True)
@click.option("--samples", type=click.IntRange(min=1), default=2000, help="Points on the facets, about.")
@click.option("--picture", type=PATH, help="Draw the map, as .png or .svg.")
@click.option(
    "--measure",
    type=click.Choice(("mean", "p95", "worst")),
    default="p95",
    show_default=True,
    help="What the picture shows.",
)
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def sweetspot(
    display: Path, job: Path | None, frame: int | None, picture: Path | None, measure: str, **how: Any
) -> None:
    """How far may a person stand from the eye the content of DISPLAY is drawn for?

    For every place on the floor: the angle by which things are seen beside their right places, as mean,
    95 % and worst over the facets; and the room there is under a limit.
    """
    from quiltcli.sweetspot import ask, sweet_spot
    from quiltcli.sweetspot.picture import check_picture, sweet_spot_picture

    as_json = how.pop("as_json")
    if picture is not None:
        check_picture(picture)
    facets, question = ask(display, job, frame, **how)
    spot = sweet_spot(facets, question)
    if picture is not None:
        sweet_spot_picture(spot, picture, measure)
    _print_sweet_spot(spot, as_json)


def _print_sweet_spot(spot: Any, as_json: bool) -> None:
    """The answer as data, or in words and tables."""
    from quiltcli.sweetspot import report

    if as_json:
        import json

        click.echo(json.dumps(report.as_data(spot), indent=1, ensure_ascii=False, allow_nan=False))
        return
    for label, text in report.lines(spot):
        click.echo(f"{label:<9}{text}")
    click.echo()
    _print_aligned(report.reach_columns(spot), report.reach_rows(spot))
    if rows := report.audience_rows(spot):
        click.echo()
        _print_aligned(report.AUDIENCE_COLUMNS, rows)


@main.command()
@click.argument("quilts", nargs=-1, required=True, type=PATH)
@click.option("--layout", type=PATH, required=True, help="The layout the quilts were made for.")
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the facet images.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
def unmap(quilts: tuple[Path, ...], layout: Path, output: Path, overwrite: bool) -> None:
    """Cut facet images out of existing QUILTS."""
    from quiltcli.layout import read_layout
    from quiltcli.unmapfiles import unmap as unmap_quilts

    written = unmap_quilts(quilts, read_layout(layout), output, overwrite=overwrite)
    click.echo(f"{len(written)} facet images in {output / 'facets'}")


@main.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="File to write; its suffix says the format.")
@click.option("--format", "format_name", help="obj, csv, json, mpcdi, st, png or svg, whatever the suffix.")
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
def export(layout: Path, output: Path, format_name: str | None, display: Path | None) -> None:
    """Write LAYOUT as a pixel map other tools read.

    Textured mesh (.obj), table of panels (.csv), JSON (.json), MPCDI (.mpcdi), ST maps (.exr), or a
    template picture (.png, .svg).
    """
    from quiltcli.layout import read_layout
    from quiltcli.pixelmaps import known_display, write_map

    loaded = read_layout(layout)
    written = write_map(loaded, known_display(loaded, display), output, format_name)
    for path in written[:12]:
        click.echo(str(path))
    if len(written) > 12:
        click.echo(f"and {len(written) - 12} more in {written[-1].parent}")


@main.command("import")
@click.argument("file", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option("--format", "format_name", help="obj, csv, json or mpcdi, whatever the suffix.")
@click.option("--display", type=PATH, help="Display the layout is for; says what the file does not.")
@click.option("--size", type=SIZE, help="Page size such as 3840x2160, where the file does not say it.")
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def import_(
    file: Path,
    output: Path,
    format_name: str | None,
    display: Path | None,
    size: tuple[int, int] | None,
    picture: Path | None,
) -> None:
    """Make a layout from a pixel map: .obj, .csv, .json or .mpcdi."""
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file
    from quiltcli.layout import layout_picture, write_layout
    from quiltcli.pixelmaps import read_map

    facets = load_display(load_display_file(display)) if display is not None else None
    layout = read_map(file, facets, size=size, format_name=format_name)
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets.names if facets else ())
    pages = len(layout.pages)
    click.echo(f"{layout.facet.size} facets on {pages} page{'s' * (pages > 1)}")


@main.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the images.")
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    default=("id",),
    show_default=True,
    help="id, marker, border, grid, checker, gradient, white, or all; may be given again.",
)
@click.option("--format", "image_format", default="png", show_default=True, help="png or exr.")
@click.option("--step", type=int, default=32, show_default=True, help="Pixels between lines of a grid.")
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
def pattern(
    layout: Path,
    output: Path,
    kinds: tuple[str, ...],
    image_format: str,
    step: int,
    display: Path | None,
    overwrite: bool,
) -> None:
    """Draw test patterns for LAYOUT at exact pixels: which facet, which way up, where it ends."""
    from quiltcli.layout import align, read_layout
    from quiltcli.pattern import KINDS
    from quiltcli.patternfiles import write_patterns
    from quiltcli.pixelmaps import known_display

    loaded = read_layout(layout)
    facets = known_display(loaded, display)
    names = align(loaded, facets)[0].names if facets is not None else ()
    chosen = tuple(KINDS) if "all" in kinds else tuple(dict.fromkeys(kinds))
    paths = write_patterns(
        loaded, output, chosen, image_format=image_format, names=names, step=step, overwrite=overwrite
    )
    for path in paths:
        click.echo(str(path))


@main.command()
@click.argument("a", type=PATH)
@click.argument("b", type=PATH)
@click.option("--fail", type=float, default=0.0, show_default=True, help="Difference a pixel may not exceed.")
@click.option("--fail-percent", type=float, default=0.0, show_default=True, help="Share of pixels that may.")
@click.option("--hard-fail", type=float, help="Difference no pixel may exceed.")
@click.option("--warn", type=float, help="Difference that is worth a warning.")
@click.option(
    "--warn-percent", type=float, default=0.0, show_default=True, help="Share of pixels that may have it."
)
def diff(a: Path, b: Path, **limits: Any) -> None:
    """Compare two images, EXR sequences or output folders, all parts and channels.

    Exit codes are idiff's: 0 match, 1 warning, 2 failure, 3 size, 4 file error.
    """
    from quiltcli.diff import COLUMNS, Limits, diff_rows
    from quiltcli.diff import diff as compare

    result = compare(a, b, Limits(**{name: value for name, value in limits.items() if value is not None}))
    _print_rows(COLUMNS, diff_rows(result))
    sys.exit(result.code)


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", type=int, help="The frame; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="Folder of the images, instead of the job's.")
@click.option("--redraw", is_flag=True, help="Draw the frame in memory even if its images exist.")
@click.option("--all", "everything", is_flag=True, help="Look at every pixel, not a sample.")
@click.option("--pixels", type=click.IntRange(min=1), help="Pixels to look at; 200000 by default.")
@click.option("--json", "as_json", type=PATH, metavar="FILE", help="Write the result as JSON; - is stdout.")
@click.option("--picture", type=PATH, help="Draw the pages with a mark at every fault, as .png.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
def verify(
    job: Path,
    frame: int | None,
    output: Path | None,
    redraw: bool,
    everything: bool,
    pixels: int | None,
    as_json: Path | None,
    picture: Path | None,
    threads: int | None,
    sets: tuple[str, ...],
) -> None:
    """Hold a frame of JOB against ray casts, pixel by pixel; exit 1 if a tolerance is missed."""
    from quiltcli.job import load_job
    from quiltcli.verify import SAMPLE, VerifyOptions
    from quiltcli.verify import verify as verify_frame
    from quiltcli.verify.picture import write_picture

    options = VerifyOptions(frame, everything, pixels or SAMPLE, output, redraw, threads or 0)
    verdict, stage, images = verify_frame(load_job(job, sets), options)
    _print_verdict(verdict, as_json)
    if picture is not None:
        write_picture(picture, stage.layout, images, verdict.faults)
    if not verdict.passed:
        sys.exit(1)


def _print_verdict(verdict: Any, as_json: Path | None) -> None:
    """The verdict as a table on stdout, as JSON, or both."""
    import json

    from quiltcli.verify import COLUMNS, verdict_rows
    from quiltcli.wholefile import write_text

    text = json.dumps(verdict.as_json(), indent=2, allow_nan=False)
    if as_json == Path("-"):
        click.echo(text)
        return
    if as_json is not None:
        write_text(as_json, text + "\n")
    _print_aligned(COLUMNS, verdict_rows(verdict))
    click.echo(f"frame {verdict.frame}, {verdict.images}: {verdict.words}")


def _print_rows(columns: Any, rows: Any) -> None:
    """A table on stdout: drawn on a terminal, separated by tabs elsewhere."""
    if not sys.stdout.isatty():
        for row in (columns, *rows):
            click.echo("\t".join(row))
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*columns, box=SIMPLE, pad_edge=False)
    for row in rows:
        table.add_row(*map(Text, row))  # brackets are brackets, not markup
    Console().print(table)


def _print_aligned(columns: Any, rows: Any) -> None:
    """A table for people to read: drawn on a terminal, aligned by spaces elsewhere."""
    if sys.stdout.isatty():
        _print_rows(columns, rows)
        return
    table = [tuple(columns), *map(tuple, rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        click.echo("  ".join(f"{text:<{width}}" for text, width in zip(row, widths, strict=True)).rstrip())


def run() -> None:
    """Entry point: numerical libraries are told to stay on one thread, the renderer has its own."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    main.main(prog_name=Path(sys.argv[0]).name if "__main__" not in sys.argv[0] else "quilt")
