"""Curved displays as flat facets: a mesh with texture coordinates, and a display file that lays it out."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.charts.flat import FlatPieces, flat_pieces
from quiltcli.display import load_display
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.whole import write_text
from quiltcli.job import load_display_file

MOST = 200_000
"""Pieces at most, where no limit is given."""


@dataclass(frozen=True)
class Flattened:
    """What came of cutting a display.

    Attributes:
        files: that were written, the display file first.
        facets: flat facets.
        error: pixels that the surface is away from them at most.
    """

    files: tuple[Path, Path]
    facets: int
    error: float


def flatten_display(display: Path, output: Path, error: float, most: int = MOST) -> Flattened:
    """Cut the one curved surface of a display into flat facets with the same pixels.

    Args:
        display: the display file.
        output: the display file to write; the mesh goes beside it.
        error: pixels that the surface may be away from its facets.
        most: facets at most.

    Raises:
        DisplayError: the display is not one surface, or more facets would be needed.
        OutputError: a file cannot be written.
    """
    facets = load_display(load_display_file(display))
    chart = facets.charts[0] if facets.charts else None
    if facets.count != 1 or chart is None or not chart.stands:
        words = "has not one curved surface and nothing else (quilt facet cuts one at a time)"
        raise DisplayError(Problem(words, file=str(display)))
    pieces = flat_pieces(chart, error, most)
    if pieces is None:
        words = f"needs more than {most:,} facets for an error of {error:g} pixels (raise --error or --limit)"
        raise DisplayError(Problem(words, file=str(display)))
    mesh = output.with_suffix(".obj")
    write_text(mesh, _mesh_text(pieces, chart.size, display.name))
    size = list(chart.size)
    write_text(
        output,
        f"# {len(pieces.faces):,} flat facets of {display.name}, at most {pieces.error:.3g} pixels off\n"
        f"quilt_display: 1\nmesh: {json.dumps(mesh.name)}\n"
        f"layout: {{from_uv: true, size: {size}}}\n"
        f"# beside another layout: resolution: {{pixels_per_metre: {_density(pieces, chart.size):.6g}}}\n",
    )
    return Flattened((output, mesh), len(pieces.faces), pieces.error)


def _density(pieces: FlatPieces, size: tuple[int, int]) -> float:
    """Pixels a metre, about, for who packs the facets anew."""
    extent = float(np.nanmax(np.ptp(pieces.points, axis=0)))
    return max(size) / extent


def _mesh_text(pieces: FlatPieces, size: tuple[int, int], name: str) -> str:
    """The pieces as OBJ; what is not used is left out."""
    used = np.unique([corner for face in pieces.faces for corner in face])
    number = {int(corner): k + 1 for k, corner in enumerate(used)}
    lines = [f"# {name} in flat pieces, metres"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in pieces.points[used].tolist()]
    uv = pieces.pixels[used] / size
    lines += [f"vt {u!r} {1 - v!r}" for u, v in uv.tolist()]
    lines += ["f " + " ".join(f"{number[k]}/{number[k]}" for k in face) for face in pieces.faces]
    return "\n".join(lines) + "\n"
