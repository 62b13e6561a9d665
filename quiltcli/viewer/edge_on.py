"""Where a viewer path runs through the plane of a facet, whose image would be a line: it stays dark there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import dot
from quiltcli.job.frames import format_frames
from quiltcli.viewer.viewer import Viewer

_FLAT = 1e-9  # metres


def edge_on_notices(facets: Facets, viewers: Iterable[Viewer]) -> Iterator[str]:
    """A sentence for all frames in which the eye lies in the planes of the same enabled facets.

    Args:
        facets: the display.
        viewers: everybody who looks, frame by frame.
    """
    frames: dict[tuple[int, ...], list[int]] = {}
    for viewer in viewers:
        height = dot(viewer.eye - facets.origin, facets.normal)
        flat = facets.enabled & ~facets.curved & (np.abs(height) <= _FLAT)
        if viewer.facets is not None:
            flat &= np.isin(np.arange(1, facets.count + 1), viewer.facets)
        if flat.any():
            frames.setdefault(tuple(np.flatnonzero(flat).tolist()), []).append(viewer.frame)
    for which, at in frames.items():
        yield _edge_on(facets, sorted(set(at)), which)


def _edge_on(facets: Facets, frames: list[int], flat: tuple[int, ...]) -> str:
    """What is said of an eye that sees some facets edge-on."""
    name = facets.names[flat[0]]
    which = f"facet {flat[0] + 1}" + (f" ({name})" if name else "")
    which += f" and of {len(flat) - 1} more" if len(flat) > 1 else ""
    when = f"frame {frames[0]}" if len(frames) == 1 else f"frames {format_frames(frames)}"
    return f"at {when} the eye lies in the plane of {which}: dark there, for it would be a line to it"
