"""Commands to look and judge by: simulate, compare, view, preview, sweetspot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.group import main
from quiltcli.cli.options import AREA, FRAMES, PATH, POINT, SIZE, STILL_VIEW, VIEW
from quiltcli.cli.printing import print_aligned


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frames", type=FRAMES, help="Frames such as 7 or 1-12; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="PNG to write; #### in its name is the frame number.")
@click.option("--video", type=PATH, help="Film to write of all the frames, as .mp4 or .mov.")
@click.option("--size", type=SIZE, default="1200x900", show_default=True, help="Size of the picture.")
@click.option("--from", "place", type=POINT, metavar="X,Y,Z", help="Look from here; from the eye by default.")
@click.option("--look-at", type=POINT, metavar="X,Y,Z", help="Look there; at the display by default.")
@click.option("--third-person", is_flag=True, help="Show the viewer too, with rays to the display's outline.")
@click.option(
    "--scene",
    type=click.Choice(("ghost", "solid", "none")),
    default="ghost",
    help="As a third person sees it.",
)
@click.option("--fov", type=click.FloatRange(0, 170, min_open=True), help="Degrees from top to bottom.")
@click.option("--filter", type=click.Choice(("nearest", "linear")), default="linear", show_default=True)
@click.option(
    "--supersample", type=click.IntRange(1, 16), default=2, show_default=True, help="Rays across a pixel."
)
@click.option(
    "--compare/--no-compare",
    default=None,
    help="From the eye, compare with a direct picture; not for a film alone.",
)
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
    from quiltcli.analysis.simulate import PictureOptions
    from quiltcli.analysis.simulate.files import Pictures, write_pictures
    from quiltcli.job import load_job

    wanted = ("direct", "heat_map", "view", "exposure", "video")
    pictures = Pictures(how.pop("output"), **{name: how.pop(name) for name in wanted})
    if pictures.picture is None and pictures.video is None:
        raise click.UsageError("nothing to write: give -o PICTURE.png, --video FILM.mp4, or both")
    if how["compare"] is None:
        how["compare"] = any((pictures.picture, pictures.direct, pictures.heat_map))
    if how["size"] is None:
        raise click.UsageError("--size: a picture needs a width and a height")
    samples, threads = how.pop("supersample"), how.pop("threads") or 0
    options = PictureOptions(samples=samples, threads=threads, resampled=True, **how)
    loaded = load_job(job, sets)
    for line in write_pictures(loaded, frames or loaded.frames[:1], options, pictures):
        click.echo(line)


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", type=int, help="The frame; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="Folder to write to; compare in the job's by default.")
@click.option("--method", "methods", multiple=True, help="Only this method; may be given again.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
def compare(
    job: Path,
    frame: int | None,
    output: Path | None,
    methods: tuple[str, ...],
    threads: int | None,
    sets: tuple[str, ...],
) -> None:
    """Draw a frame of JOB by every render method and hold each against rays.

    Writes a page with figures, charts and close views, and the same as JSON; a table goes to stdout.
    """
    from quiltcli.analysis.methods import COLUMNS, CompareOptions, study_rows, study_words, variants_of
    from quiltcli.analysis.methods import compare as compare_methods
    from quiltcli.analysis.methods.page import write_comparison
    from quiltcli.job import load_job

    loaded = load_job(job, sets)
    options = CompareOptions(
        frame, variants_of(methods), threads or 0, lambda name: click.echo(f"drawing {name}", err=True)
    )
    study = compare_methods(loaded, options)
    paths = write_comparison(study, output or loaded.output.directory / "compare")
    print_aligned(COLUMNS, study_rows(study))
    for words in study_words(study):
        click.echo(words)
    for path in paths:
        click.echo(f"written to {path}")


@main.command()
@click.argument("out", type=PATH)
@click.option("-f", "--frames", type=FRAMES, help="Frames such as 7 or 1-12; all that are there by default.")
@click.option("-o", "--output", type=PATH, help="Page to write, as .html; OUT/view.html by default.")
@click.option("--model/--no-model", default=True, help="Write a model beside it, as .glb.")
@click.option(
    "--filter",
    type=click.Choice(("nearest", "linear")),
    default="linear",
    show_default=True,
    help="At first.",
)
@click.option("--errors", is_flag=True, help="Hold every frame against a direct picture, as a heat map.")
@click.option(
    "--ghost",
    type=click.IntRange(min=0),
    default=20000,
    show_default=True,
    help="Most triangles of the scene.",
)
@click.option(
    "--texture", type=click.IntRange(64, 16384), default=4096, show_default=True, help="Most pixels a side."
)
@click.option(
    "--max-mb", "size", type=click.FloatRange(min=1), default=8.0, show_default=True, help="Size of the page."
)
@click.option("--view", type=VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")
def view(out: Path, frames: tuple[int, ...] | None, output: Path | None, **how: Any) -> None:
    """Write a page to turn the display in the hands, from the output folder OUT of a render.

    The page is one file that opens in any browser and needs no network: the display with its images on,
    from the viewer's eye and from everywhere else, with the scene as a ghost of at most so many triangles.
    """
    from quiltcli.exchange.web import ViewOptions
    from quiltcli.exchange.web import view as write_view

    options = ViewOptions(nearest=how.pop("filter") == "nearest", **how)
    for label, text in write_view(out, frames, output, options).lines:
        click.echo(f"{label:<10}{text}")


@main.command()
@click.argument("images", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Picture to write, or a folder for several.")
@click.option("--format", "kind", type=click.Choice(("png", "tiff")), help="By the picture's name; else PNG.")
@click.option(
    "--depth", type=click.Choice(("8", "16")), default="8", show_default=True, help="Bits a channel."
)
@click.option(
    "--largest", type=click.IntRange(min=0), metavar="PIXELS", help="Most in width and height; 0: all."
)
@click.option("--view", type=STILL_VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")
def preview(
    images: tuple[Path, ...],
    output: Path,
    kind: str | None,
    depth: str,
    largest: int | None,
    view: str,
    exposure: float,
) -> None:
    """Turn EXR IMAGES, quilts or facets, into pictures; sequences too, as page_01.####.exr.

    Pictures of 8 bits are to look at, at most 2048 pixels wide and high; those of 16 bits are to be
    shown, every pixel of them.
    """
    from quiltcli.images.preview import LARGEST, Look, preview_paths
    from quiltcli.images.preview import preview as write_preview

    if largest is None:
        largest = LARGEST if depth == "8" else 0
    look = Look(view, exposure, int(depth), largest)
    for image, picture in preview_paths(images, output, kind):
        width, height = write_preview(image, picture, look)
        click.echo(f"{picture}  {width}×{height}")


@main.command()
@click.argument("out", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Sheet to write, as .png or .tif.")
@click.option("-f", "--frames", type=FRAMES, help="Frames; all of pages, the first of facets by default.")
@click.option("--pages", "kind", flag_value="page", help="Pages of the quilt, the default if there are any.")
@click.option("--facets", "kind", flag_value="facet", help="Images of facets.")
@click.option("--columns", type=click.IntRange(min=1), help="Images in a row.")
@click.option("--width", type=click.IntRange(16, 4096), default=240, show_default=True, metavar="PIXELS")
@click.option("--view", type=STILL_VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")
def contact(out: Path, output: Path, view: str, exposure: float, **how: Any) -> None:
    """Lay the images in the output folder OUT of a render side by side, small, with their names."""
    from quiltcli.formats.whole import make_folder
    from quiltcli.images.contact import Sheet, contact_sheet
    from quiltcli.images.preview import Look

    make_folder(output.parent)
    count, (width, height) = contact_sheet(out, output, Sheet(look=Look(view, exposure), **how))
    click.echo(f"{output}  {width}×{height}, {count} image{'s' * (count > 1)}")


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
    from quiltcli.analysis.sweetspot import ask, sweet_spot
    from quiltcli.analysis.sweetspot.picture import check_picture, sweet_spot_picture

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
    from quiltcli.analysis.sweetspot import report

    if as_json:
        import json

        click.echo(json.dumps(report.as_data(spot), indent=1, ensure_ascii=False, allow_nan=False))
        return
    for label, text in report.lines(spot):
        click.echo(f"{label:<9}{text}")
    click.echo()
    print_aligned(report.reach_columns(spot), report.reach_rows(spot))
    if rows := report.audience_rows(spot):
        click.echo()
        print_aligned(report.AUDIENCE_COLUMNS, rows)
