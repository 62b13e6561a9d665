"""Where an image is to stay in the quilt, as display files say it of facets, panels and surfaces."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from quiltcli.job.model import Count, Items, Model, Natural, Number, complaint


def quarter_turn(value: float) -> int:
    """Degrees that are a quarter turn, from 0 to 270."""
    if value % 90:
        raise complaint(f"expected 0, 90, 180 or 270, got {value:g}")
    return int(value) % 360


Quarter = Annotated[Number, AfterValidator(quarter_turn), WithJsonSchema({"enum": [0, 90, 180, 270]})]


class PlaceOnPage(Model):
    """Where a facet's image is to stay in the quilt, whatever the packing does with the others."""

    page: Count = 1
    """Page, the first being 1."""
    at: Annotated[tuple[Natural, Natural], Items(2)]
    """Where on the page the image's top-left pixel lies, x and y, after mirroring and turning, pixels."""
    rotate: Quarter = 0
    """Quarter turn of the image in the quilt, clockwise, degrees."""
    mirror: bool = False
    """Mirror the image left to right in the quilt, before it is turned."""
