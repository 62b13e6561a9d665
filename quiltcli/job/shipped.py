"""Files that come with quilt: display models, scenes, schemas.

In a clone they lie beside the package, where people look for them; a wheel has them inside the package,
under the same names, so that what one says of another (`../display_models/cube5.yaml`) holds.
"""

from __future__ import annotations

from pathlib import Path

from quiltcli.errors import QuiltError

PACKAGE = Path(__file__).parents[1]
FOLDERS = ("display_models", "scenes", "docs/schema")


def shipped(folder: str) -> Path:
    """Where one of `FOLDERS` is.

    Raises:
        QuiltError: this installation lacks it.
    """
    for base in (PACKAGE / "data", PACKAGE.parent):
        if (base / folder).is_dir():
            return base / folder
    raise QuiltError(f"{folder} did not come with this installation (expected it in {PACKAGE / 'data'})")
