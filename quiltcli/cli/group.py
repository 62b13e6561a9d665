"""The `quilt` command itself, and the one place that turns an error into a message and an exit code."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import click

from quiltcli import __version__
from quiltcli.ending import end_by_error, ended
from quiltcli.errors import QuiltError

COMMANDS = (
    "assemble",
    "calibrate",
    "cameras",
    "capture",
    "check",
    "compare",
    "contact",
    "diff",
    "export",
    "facet",
    "farm",
    "film",
    "import",
    "info",
    "new",
    "pack",
    "path",
    "pattern",
    "points",
    "preview",
    "project",
    "render",
    "schema",
    "simulate",
    "stereo",
    "study",
    "sweetspot",
    "unmap",
    "unpack",
    "verify",
    "view",
)


class Quilt(click.Group):
    """The `quilt` command; a command's module is imported when the command is wanted."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command: the function of the name of its module."""
        if cmd_name not in self.commands:
            return None
        name = "import_" if cmd_name == "import" else cmd_name  # the word is Python's
        command = getattr(import_module(f"quiltcli.cli.{name}"), name)
        assert isinstance(command, click.Command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; errors that are the user's to mend become one line a problem."""
        try:
            end_by_error()
            return super().invoke(ctx)
        except QuiltError as error:
            if ctx.params.get("debug"):
                raise
            click.echo(f"error: {error}" if len(error.problems) == 1 else str(error), err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt as error:
            ctx.exit(ended(error))
        except MemoryError:
            if ctx.params.get("debug"):
                raise
            click.echo("error: not enough memory (smaller pages or fewer threads need less)", err=True)
            ctx.exit(1)
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except Exception as error:
            if code := ended(error):  # a library has made another error of it
                ctx.exit(code)
            if ctx.params.get("debug"):
                raise
            named = isinstance(error, OSError) and error.filename is not None
            click.echo(f"error: {_refused(error) if named else _unexpected(error)}", err=True)
            ctx.exit(1)


def _refused(error: Any) -> str:
    """What the system has against a file, in its own words."""
    from quiltcli.formats.inputs import shown_name

    return f"{shown_name(str(error.filename))}: {error.strerror or error}"


def _unexpected(error: Exception) -> str:
    """What is said of an error that is no user's fault, and that nobody thought of."""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"quilt has met a fault of its own: {what} (quilt --debug COMMAND … shows where)"


@click.group(
    cls=Quilt,
    commands={name: click.Command(name) for name in COMMANDS},  # names alone, until one is wanted
    context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "QUILT"},
)
@click.version_option(__version__, prog_name="quilt")
@click.option("--debug", is_flag=True, help="Show tracebacks.")
def main(debug: bool) -> None:
    """Render perspectively correct 3D for multiplanar displays.

    A display is a set of flat facets; a quilt is the packed image of them all. (No patch stack, and
    no Looking Glass grid of views.) The same program answers to quiltcli.
    """
