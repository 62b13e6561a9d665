"""`quilt schema`: what a file may say, for editors."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH


@click.command()
@click.argument("kind", type=click.Choice(("job", "display", "layout", "scene", "lightfield", "calibration")))
@click.option("-o", "--output", type=PATH, help="File to write, instead of stdout.")
def schema(kind: str, output: Path | None) -> None:
    """Print the JSON Schema of files of a KIND, by which editors check YAML while it is typed.

    A YAML file names its schema in its first line: # yaml-language-server: $schema=job.schema.json
    """
    from quiltcli.formats.whole import write_text
    from quiltcli.job.schema import schema_text

    if output is None:
        click.echo(schema_text(kind), nl=False)
    else:
        write_text(output, schema_text(kind))
