"""The camera file: what a photo's pixels are in front of its lens."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from quiltcli.job.model import FileModel, Items, Number, Positive, Size


class CameraFile(FileModel):
    """A camera that takes photos of a display: focal length, middle and distortion, in pixels."""

    kind: ClassVar[str] = "quilt_camera"

    quilt_camera: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    size: Size
    """Width and height of the photos, pixels."""
    focal: Annotated[tuple[Positive, Positive], Items(2)]
    """Focal length across and down, pixels."""
    centre: Annotated[tuple[Number, Number], Items(2)]
    """Where the lens's axis meets the photo, from its top-left corner, pixels."""
    distortion: Annotated[tuple[Number, Number, Number, Number, Number], Items(5)] = (0, 0, 0, 0, 0)
    """Brown's terms in OpenCV's order: k1, k2, p1, p2, k3."""
