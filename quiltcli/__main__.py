"""The program: `quilt`, `quiltcli` and `python -m quiltcli` are all this."""

from __future__ import annotations

from quiltcli.ending import end_at_once


def run() -> None:
    """Entry point. Signals first: importing a command line takes longer than a finger on Ctrl-C."""
    end_at_once()
    from quiltcli.cli import run as run_command

    try:
        run_command()
    finally:
        end_at_once()  # while Python puts itself away


if __name__ == "__main__":
    run()
