"""quilt: a batch renderer for multiplanar displays.

What Python programs may use of it are the names of `quiltcli.api`, which this package offers as its own:
`quiltcli.load_job`, `quiltcli.draw` and so on (docs/python.md). They are looked up when they are first
asked for, so that `import quiltcli` costs nothing.

The program reads in one direction, and so does the code: docs/architecture.md is its map.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quiltcli.api import *  # noqa: F403 - for type checkers and editors alone

__version__ = "0.1.0"

# The names of `quiltcli.api.__all__`, which a test compares.
_API = (
    *("Drawn", "Facets", "FrameRecord", "Image", "JobFile", "Layout", "QuiltError", "RenderOptions"),
    *("Setup", "View", "Viewer", "draw", "load_facets", "load_job", "pack_layout", "read_image"),
    *("read_layout", "render_job", "set_up", "shipped", "tone_map", "viewers", "write_layout"),
    "write_picture",
)


def __getattr__(name: str) -> Any:
    """A name of the public interface, when it is first asked for."""
    if name not in _API:
        raise AttributeError(f"module 'quiltcli' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module("quiltcli.api"), name)
    return value


def __dir__() -> list[str]:
    """What there is, for completion."""
    return sorted(("__version__", *_API))
