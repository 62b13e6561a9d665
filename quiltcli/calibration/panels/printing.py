"""Boards of markers as drawings to print: in millimetres, to come out as large as they were said to be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from quiltcli.calibration.dictionaries import dictionary
from quiltcli.calibration.panels.attached import Attached
from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.geometry import FloatArray

_MARGIN = 2  # modules of white around all markers
_LINE = 4.0  # millimetres for the words below


def write_board(path: Path, board: Attached, text: str) -> tuple[float, float]:
    """Write a board as SVG, with how it is called below; its width and height, millimetres.

    Raises:
        JobError: gaps in which no white is left to tell markers apart.
        OutputError: the name does not end in .svg, or the file cannot be written.
        MissingExtraError: OpenCV, which has the dictionaries, is not installed.
    """
    if path.suffix.lower() != ".svg":
        raise OutputError(Problem("expected a name that ends in .svg", file=str(path)))
    words = dictionary(board.dictionary)
    module = 1000 * board.side / words.modules
    if board.across * board.down > 1 and 1000 * board.gap < module * (1 - 1e-9):
        raise JobError(
            f"the gap of {1000 * board.gap:g} mm is narrower than a module of the markers, {module:.3g} mm "
            "(expected as much white at least, or they are not found)"
        )
    margin = _MARGIN * module
    extent = 1000 * board.corners.reshape(-1, 3)[:, :2].max(axis=0) + 2 * margin
    width, height = float(extent[0]), float(extent[1]) + _LINE
    size = f'width="{width:.4f}mm" height="{height:.4f}mm" viewBox="0 0 {width:.4f} {height:.4f}"'
    place = f'x="{margin:.4f}" y="{height - 1:.4f}" font-size="2.5" font-family="sans-serif"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>',
        f'<rect width="{width:.4f}" height="{height:.4f}" fill="#fff"/>',
        *(f'<path d="{marker}"/>' for marker in _markers(board, margin)),
        f"<text {place}>{text}</text>",
        "</svg>",
    ]
    make_folder(path.parent)
    write_text(path, "\n".join(lines) + "\n")
    return width, height


def _markers(board: Attached, margin: float) -> Iterator[str]:
    """The black of each marker as a path: its modules, row by row, runs in one."""
    words = dictionary(board.dictionary)
    module = 1000 * board.side / words.modules
    for name, corners in zip(board.ids, board.corners, strict=True):
        start: FloatArray = 1000 * corners[0, :2] + margin
        parts = []
        for row, bits in enumerate(words.bits(name)):
            edges = np.flatnonzero(np.diff(np.concatenate(([1], bits, [1]))))
            for first, last in edges.reshape(-1, 2).tolist():
                x, y = start[0] + first * module, start[1] + row * module
                wide = (last - first) * module
                parts.append(f"M{x:.4f} {y:.4f}h{wide:.4f}v{module:.4f}h{-wide:.4f}z")
        yield "".join(parts)
