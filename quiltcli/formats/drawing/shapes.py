"""What a drawing consists of."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import FloatArray


@dataclass(frozen=True)
class Shape:
    """A filled polygon (n, 2) with an outline, in picture pixels."""

    points: FloatArray
    fill: str
    outline: str
    width: float


@dataclass(frozen=True)
class Label:
    """A line of text; `anchor` is `middle` (centred both ways) or `start` (left end, vertically centred)."""

    x: float
    y: float
    size: float
    text: str
    color: str
    anchor: str


@dataclass(frozen=True)
class Drawing:
    """Everything to draw, back to front, on a picture of `width` × `height` pixels."""

    width: int
    height: int
    items: tuple[Shape | Label, ...]
