"""Displays of projectors, small."""

from __future__ import annotations

from pathlib import Path

from quiltcli.display import Facets, load_display
from quiltcli.job import load_display_file

WALL = "panels:\n- {name: wall, pixels: [8, 8], size: [4, 3], at: [0, 0, 0]}\n"
SPHERE = "surfaces:\n- {kind: sphere, radius: 1, pixels: [8, 8]}\n"
LEFT = "- {name: left, pixels: [192, 128], lens: {at: [-1.6, 0.2, 3], look_at: [-0.7, 0, 0], throw: 1.5}}\n"
RIGHT = "- {name: right, pixels: [160, 144], lens: {at: [1.5, 0.1, 3.1], look_at: [0.7, 0, 0], throw: 1.5}}\n"


def projected_text(folder: Path, screen: str, projectors: str, more: str = "") -> str:
    """What a display file of projectors says after its first line; its screen is written beside it."""
    (folder / "screen.yaml").write_text(f"quilt_display: 1\n{screen}")
    return f"screen: screen.yaml\nprojectors:\n{projectors}{more}"


def projected(folder: Path, screen: str, projectors: str, more: str = "") -> Facets:
    """The facets of a display of projectors."""
    text = projected_text(folder, screen, projectors, more)
    (folder / "display.yaml").write_text(f"quilt_display: 1\n{text}")
    return load_display(load_display_file(folder / "display.yaml"))
