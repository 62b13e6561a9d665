"""The command line: parse, call one library function a command, print."""

from __future__ import annotations


def main() -> None:
    """Run the `quilt` command."""
    raise SystemExit(0)
