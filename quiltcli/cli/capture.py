"""`quilt capture`: pictures of a scene from a ring of places around it."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH, POINT, SIZE, frames_option


@click.command()
@click.argument("job", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the light field.")
@click.option("--views", type=click.IntRange(min=1), default=288, show_default=True, help="Pictures a turn.")
@click.option("--distance", type=float, default=1.0, show_default=True, help="From the axis, metres.")
@click.option("--heights", default="0", show_default=True, help="Of rows of cameras: 0,0.1,0.2 or 0:0.3:0.1.")
@click.option("--size", type=SIZE, default="512x512", show_default=True, help="Of a picture, pixels.")
@click.option("--look-at", type=POINT, default="0,0,0", show_default=True, metavar="X,Y,Z")
@click.option("--fov", type=float, help="Degrees from top to bottom; as the scene takes by default.")
@click.option("--format", "image_format", default="png", show_default=True, help="png or exr.")
@click.option("--depths", is_flag=True, help="Write depth maps, and focus by them.")
@frames_option("Frames of the job; its first by default.")
@OVERWRITE
def capture(
    job: Path,
    output: Path,
    views: int,
    distance: float,
    heights: str,
    size: tuple[int, int] | None,
    look_at: tuple[float, float, float],
    fov: float | None,
    image_format: str,
    depths: bool,
    frames: tuple[int, ...] | None,
    overwrite: bool,
) -> None:
    """Take pictures of JOB, or of a scene or mesh, from a ring around it, as a turntable would.

    They are a light field, with its file lightfield.yaml, which a display with a spinning mirror can show.
    """
    from quiltcli.exchange.capture import Ring, parse_heights
    from quiltcli.exchange.capture import capture as take

    ring = Ring(
        views=views,
        distance=distance,
        heights=parse_heights(heights),
        size=size or (512, 512),
        look_at=look_at,
        fov=fov,
        image_format=image_format,
        depths=depths,
        frames=frames or (),
    )
    file = take(job, output, ring, overwrite=overwrite, say=lambda line: click.echo(line, err=True))
    click.echo(str(file))
