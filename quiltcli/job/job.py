"""The job file: what to render, and how, and where to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, PlainValidator, Tag, WithJsonSchema

from quiltcli.channels import CHANNELS
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.job.model import (
    YAMLS,
    AnyPath,
    Complaint,
    Count,
    ExistingFile,
    FileModel,
    Listed,
    Model,
    Natural,
    OneOf,
    ScenePath,
    YamlPath,
    complaint,
    describe,
    either,
)
from quiltcli.job.viewer import FrameRange, ViewerSpec

METHODS = ("homography", "offaxis", "raskar", "zscale", "twopass", "raycast")
DEPTH_BITS = ("16", "24", "32f")
COMPRESSIONS = (
    *("none", "rle", "zips", "zip", "piz", "zstd", "htj2k32", "htj2k256"),  # lossless
    *("pxr24", "b44", "b44a", "dwaa", "dwab", "lj2k"),  # lossy
)
CLIPS = ("auto", "planar", "distance")
UNLIT = ("write", "link", "skip")
DATA_WINDOWS = ("full", "tight")
# Decimal rates that stand for fractions in film and television.
_NTSC = {23.98: 24, 23.976: 24, 29.97: 30, 47.95: 48, 47.952: 48, 59.94: 60, 119.88: 120}


def _rate(value: Any) -> Fraction:
    if isinstance(value, Fraction):
        return value
    wrong = complaint(f"expected frames a second such as 30, 23.976 or 30000/1001, got {describe(value)}")
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong
    try:
        rate = Fraction(value)
    except (ValueError, ZeroDivisionError, OverflowError):
        raise wrong from None
    if isinstance(value, float):
        rate = Fraction(_NTSC[value] * 1000, 1001) if value in _NTSC else rate.limit_denominator(1001)
    if rate <= 0:
        raise complaint(f"must be greater than 0, got {value}")
    return rate


def _layout(value: Any) -> Any:
    if isinstance(value, (str, Path, dict, Model)):
        return value
    raise complaint(
        f"expected a layout file or a mapping such as {{size: [8192, 8192]}}, got {describe(value)}"
    )


def _layout_tag(value: Any) -> str:
    if isinstance(value, (str, Path)):
        return "<path>"
    uv = "from_uv" in value if isinstance(value, dict) else isinstance(value, UvLayoutSpec)
    return "<UvLayoutSpec>" if uv else "<PackSpec>"


LayoutChoice: TypeAlias = Annotated[
    Annotated[Path, ExistingFile(YAMLS, "a layout file"), Tag("<path>")]
    | Annotated[PackSpec, Tag("<PackSpec>")]
    | Annotated[UvLayoutSpec, Tag("<UvLayoutSpec>")],
    Discriminator(_layout_tag),
    BeforeValidator(_layout),
]


def _bits(value: Any) -> Any:
    text = str(value) if isinstance(value, (int, str)) and not isinstance(value, bool) else value
    if text is None or text in DEPTH_BITS:
        return text
    raise complaint(f"expected {either(DEPTH_BITS)}, or no such key, got {describe(value)}")


class RenderSpec(Model):
    """How pixels are made."""

    samples: Count = 1
    """Samples a pixel; 1 is exactly the pixel's centre."""
    method: Annotated[str, OneOf(METHODS)] = "homography"
    """Render method."""
    depth_bits: Annotated[
        str | None, BeforeValidator(_bits), WithJsonSchema({"enum": [16, 24, "16", "24", "32f", None]})
    ] = None
    """Bits of an emulated GPU's depth buffer; exact depth when absent."""
    depth: Annotated[str, OneOf(("planar", "radial"))] = "planar"
    """Z along the look direction (planar) or the distance from the eye (radial)."""
    clip: Annotated[str, OneOf(CLIPS)] = "auto"
    """What near and far cut: along the look direction (planar), by the distance from the eye (distance), or
    planar where depth is planar and every lit pixel of every frame lies ahead of the eye (auto)."""
    backface_culling: bool = False
    """Drop triangles that face away from the viewer."""
    bleed: Natural = 2
    """Pixels rendered past a facet's edge into the padding."""

    def needs_planar_clip(self, channels: Sequence[str]) -> bool:
        """Whether something is asked for that lies between a near and a far plane."""
        return "zv" in channels or self.depth_bits is not None or self.method not in ("homography", "raycast")

    def cross_checks(self) -> Iterator[Complaint]:
        """Rays have neither a depth buffer nor several samples; depth buffers lie between planes."""
        if self.clip == "distance" and self.needs_planar_clip(()):
            what = "depth_bits" if self.depth_bits is not None else f"method: {self.method}"
            yield ("clip",), f"{what} needs a near and a far plane (expected planar or auto), got distance"
        if self.method == "raycast" and self.depth_bits is not None:
            yield ("depth_bits",), "rays have no depth buffer (expected no such key beside method: raycast)"
        if self.method == "raycast" and self.samples > 1:
            yield ("samples",), f"expected 1 beside method: raycast, one ray a pixel, got {self.samples}"


class OutputSpec(Model):
    """What is written."""

    directory: AnyPath = Path("out")
    """Folder of the results."""
    quilts: bool = True
    """Write quilt pages."""
    facets: bool = True
    """Write one image a facet."""
    channels: Annotated[tuple[Annotated[str, OneOf(tuple(CHANNELS))], ...], Listed, Field(min_length=1)] = (
        "rgba",
        "Z",
    )
    """Channels of every image."""
    compression: Annotated[str, OneOf(COMPRESSIONS)] = "zip"
    """OpenEXR compression."""
    unlit: Annotated[str, OneOf(UNLIT)] = "write"
    """Images of facets that face away from the viewer: written, hard links to one of their size, or none."""
    data_window: Annotated[str, OneOf(DATA_WINDOWS)] = "full"
    """Pixels in a file: all of the page or facet, or no margins that show nothing (tight)."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Something is written, and nothing twice."""
        if not (self.quilts or self.facets):
            yield (), "nothing to write (expected quilts or facets to be true)"
        yield from _twice(self.channels)


def _twice(channels: Sequence[str]) -> Iterator[Complaint]:
    for i, name in enumerate(channels):
        if name in channels[:i]:
            yield ("channels", i), f"{name!r} is already asked for"


class JobFile(FileModel):
    """A render job."""

    def cross_checks(self) -> Iterator[Complaint]:
        """The canonical depth lies between a near and a far plane."""
        if self.render.clip == "distance" and "zv" in self.output.channels:
            words = "zv lies between a near and a far plane (expected planar or auto), got distance"
            yield ("render", "clip"), words

    kind: ClassVar[str] = "quilt_job"

    quilt_job: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    display: YamlPath
    """Display file."""
    layout: LayoutChoice | None = None
    """Layout file, or how to pack; the display's own layout or the packing defaults when absent."""
    scene: ScenePath
    """Scene file, or a mesh or glTF file."""
    frames: FrameRange
    """Frames to render: 1-240, 1-9x2, 1,5,20-30."""
    fps: Annotated[
        Fraction,
        PlainValidator(_rate),
        WithJsonSchema({"type": ["number", "string"], "examples": [30, "30000/1001"]}),
    ] = Fraction(30)
    """Frames a second: a number, or a fraction such as 30000/1001."""
    viewer: ViewerSpec
    """The viewer."""
    render: RenderSpec = RenderSpec()
    """How pixels are made."""
    output: OutputSpec = OutputSpec()
    """What is written."""
