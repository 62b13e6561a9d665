"""Where a viewer path runs through the plane of a facet, whose image would be a line."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import Problem
from quiltcli.formats.yaml.source import Source
from quiltcli.geometry import dot
from quiltcli.job import JobFile
from quiltcli.viewer.viewer import Viewer

_FLAT = 1e-9  # metres
_MOST_PROBLEMS = 20


def eye_problems(facets: Facets, viewers: Iterable[Viewer], job: JobFile) -> list[Problem]:
    """A problem for every frame in which the eye lies in the plane of an enabled facet.

    Args:
        facets: the display.
        viewers: everybody who looks, frame by frame.
        job: their job.

    Returns:
        At most 20 problems, in the order of the viewers.
    """
    problems: list[Problem] = []
    for viewer in viewers:
        height = dot(viewer.eye - facets.origin, facets.normal)
        mine = facets.enabled & (np.abs(height) <= _FLAT)
        if viewer.facets is not None:
            mine &= np.isin(np.arange(1, facets.count + 1), viewer.facets)
        flat = np.flatnonzero(mine)
        if flat.size:
            source = job.people[viewer.name].source
            problems.append(_edge_on(facets, viewer.frame, flat.tolist(), source))
        if len(problems) == _MOST_PROBLEMS:
            break
    return problems


def _edge_on(facets: Facets, frame: int, flat: list[int], source: Source) -> Problem:
    """The problem of an eye that sees some facets edge-on."""
    name = facets.names[flat[0]]
    which = f"facet {flat[0] + 1}" + (f" ({name})" if name else "")
    which += f" and of {len(flat) - 1} more" if len(flat) > 1 else ""
    message = (
        f"at frame {frame} the eye lies in the plane of {which}, which would be a line to it"
        " (move the path by a millimetre)"
    )
    return source.problem(("path",), message)
