"""Displays of single lights: points of the world, each a pixel of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from quiltcli.job.lengths import Length
from quiltcli.job.model import ExistingFile, Model

MOST_COLUMNS = 16384


class PointsSpec(Model):
    """Single lights anywhere in space, each a facet of one pixel."""

    file: Annotated[Path, ExistingFile((".json",), "a list of points")]
    """List of points, JSON: [[x, y, z], …], or a layout of Open Pixel Control, [{"point": [x, y, z]}, …];
    null keeps the number of a light that is not there."""
    size: Length = "5 mm"
    """How wide a light is: what several samples of it are the mean of, and what pictures of the display show;
    a number of `units` (metres), or a text such as 5 mm."""
    columns: Annotated[int, Field(ge=1, le=MOST_COLUMNS)] = 170
    """How many points of the list stand in a row of the quilt; 170 fill a universe of DMX, pixels."""
