"""`quilt sweetspot`: where a person may stand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import AREA, PATH, POINT
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("display", type=PATH)
@click.option("--eye", type=POINT, metavar="X,Y,Z", help="The eye the content is drawn for.")
@click.option("--job", type=PATH, help="Take the eye of this job …")
@click.option(
    "-f", "--frame", "--frames", "frame", type=int, help="… at this frame; the job's first by default."
)
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
