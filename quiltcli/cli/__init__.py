"""The command line: parse, call one library function a command, print.

Nothing heavy is imported before a command runs, so `quilt --help` answers at once. Results go to
stdout, everything else to stderr. A command is a function in a file of its own name, which `group`
lists and imports when the command is wanted.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from quiltcli.cli.group import main

__all__ = ["main", "run"]


def run() -> None:
    """Entry point: numerical libraries are told to stay on one thread, the renderer has its own."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    main.main(prog_name=Path(sys.argv[0]).name if "__main__" not in sys.argv[0] else "quilt")
