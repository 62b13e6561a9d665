"""The display: planar facets in world space, each with its own pixel raster."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class Facets:
    """The F facets of a display, in mesh face order (facet id = index + 1).

    A facet's raster is W × H pixels in its plane: the continuous facet pixel (i, j) lies at
    `origin + i·du + j·dv` in the world. Seen from the lit side `du` points right and `dv` down.

    Attributes:
        names: F names, empty where none was given.
        corner_start: (F+1,) offsets into `corners`.
        corners: (C, 3) world metres, in the winding of the mesh face.
        origin: (F, 3) world position of the raster's top-left corner, metres.
        du: (F, 3) world step to the next pixel right, metres.
        dv: (F, 3) world step to the next pixel down, metres.
        size: (F, 2) raster width and height, pixels.
        normal: (F, 3) unit normal on the lit side (of the winding's front when both sides are lit).
        both_sides: whether a facet is lit on both sides.
        enabled: (F,) facets that take part.
        mirrored: (F,) facets whose image is mirrored because the user asked for it.
        uv: (C, 2) texture coordinates of the mesh, v up, or None.
        path: the display file as the user named it, for messages.
    """

    names: tuple[str, ...]
    corner_start: IntArray
    corners: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    size: Int32Array
    normal: FloatArray
    both_sides: bool
    enabled: BoolArray
    mirrored: BoolArray
    uv: FloatArray | None
    path: str

    @property
    def count(self) -> int:
        """Number of facets, F."""
        return len(self.names)

    def polygon(self, facet: int) -> FloatArray:
        """Corners (n, 3) of the facet with this 0-based index, world metres."""
        return self.corners[self.corner_start[facet] : self.corner_start[facet + 1]]
