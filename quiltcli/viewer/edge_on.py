"""Where a viewer path runs through the plane of a facet, whose image would be a line: it stays dark there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import dot
from quiltcli.viewer.viewer import Viewer

_FLAT = 1e-9  # metres
_MOST = 20


def edge_on_notices(facets: Facets, viewers: Iterable[Viewer]) -> Iterator[str]:
    """A sentence for every frame in which the eye lies in the plane of an enabled facet; 20 at most.

    Args:
        facets: the display.
        viewers: everybody who looks, frame by frame.
    """
    told = 0
    for viewer in viewers:
        height = dot(viewer.eye - facets.origin, facets.normal)
        flat = facets.enabled & (np.abs(height) <= _FLAT)
        if viewer.facets is not None:
            flat &= np.isin(np.arange(1, facets.count + 1), viewer.facets)
        if not flat.any():
            continue
        yield _edge_on(facets, viewer.frame, np.flatnonzero(flat).tolist())
        told += 1
        if told == _MOST:
            return


def _edge_on(facets: Facets, frame: int, flat: list[int]) -> str:
    """What is said of an eye that sees some facets edge-on."""
    name = facets.names[flat[0]]
    which = f"facet {flat[0] + 1}" + (f" ({name})" if name else "")
    which += f" and of {len(flat) - 1} more" if len(flat) > 1 else ""
    return f"at frame {frame} the eye lies in the plane of {which}: dark there, for it would be a line to it"
