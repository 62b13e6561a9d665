"""The job file: what to render, and how, and where to."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    Tag,
    WithJsonSchema,
)

from quiltcli.channels import CHANNELS
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.job.model import (
    YAMLS,
    AnyPath,
    Complaint,
    ExistingFile,
    FileModel,
    Listed,
    Model,
    OneOf,
    ScenePath,
    YamlPath,
    complaint,
    describe,
    either,
    exactly_one,
)
from quiltcli.job.names import NamesSpec
from quiltcli.job.viewer import FrameRange, ViewerSpec

METHODS = ("homography", "offaxis", "raskar", "zscale", "twopass", "raycast")
DEPTH_BITS = ("16", "24", "32f")
LOSSLESS = ("none", "rle", "zips", "zip", "piz", "zstd", "htj2k32", "htj2k256")
COMPRESSIONS = (*LOSSLESS, "pxr24", "b44", "b44a", "dwaa", "dwab", "lj2k")
CLIPS = ("auto", "planar", "distance")
STEREO = ("files", "parts")
_NAME = re.compile(r"[\w-]+")
MOST_SAMPLES = 4096
MOST_BLEED = 4096
MOST_PLACES = 64
UNLIT = ("write", "link", "skip")
DATA_WINDOWS = ("full", "tight")
_FRACTION = re.compile(r"[-+]?\d{1,9}(\.\d{0,9}|/\d{1,9})?")
_LONGEST = 1_000_000_000
# Decimal rates that stand for fractions in film and television.
_NTSC = {23.98: 24, 23.976: 24, 29.97: 30, 47.95: 48, 47.952: 48, 59.94: 60, 119.88: 120}


def _rate(value: Any) -> Fraction:
    if isinstance(value, Fraction):
        return value
    wrong = complaint(f"expected frames a second such as 30, 23.976 or 30000/1001, got {describe(value)}")
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong
    try:
        # An exponent is a power that Fraction would work out, however long that takes.
        rate = Fraction(value if not isinstance(value, str) or _FRACTION.fullmatch(value) else "none")
    except (ValueError, ZeroDivisionError, OverflowError):
        raise wrong from None
    if isinstance(value, float):
        rate = Fraction(_NTSC[value] * 1000, 1001) if value in _NTSC else rate.limit_denominator(1001)
    if rate <= 0:
        raise complaint(f"must be greater than 0, got {value}")
    if not Fraction(1, 1000) <= rate <= 1_000_000 or rate.denominator > _LONGEST:
        raise complaint(f"must be from 0.001 to 1000000 frames a second, got {describe(value)}")
    return rate


def _scale(value: Any) -> Fraction:
    if isinstance(value, Fraction):
        return value
    wrong = complaint(f"expected a share such as 1/4 or 0.5, got {describe(value)}")
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong
    try:
        scale = Fraction(value if not isinstance(value, str) or _FRACTION.fullmatch(value) else "none")
    except (ValueError, ZeroDivisionError, OverflowError):
        raise wrong from None
    if not 0 < scale <= 1:
        raise complaint(f"must be above 0 and at most 1, got {describe(value)}")
    return scale.limit_denominator(1000)


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

    samples: Annotated[int, Field(ge=1, le=MOST_SAMPLES)] = 1
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
    bleed: Annotated[int, Field(ge=0, le=MOST_BLEED)] = 2
    """How far to render past a facet's edge, into the padding, pixels."""
    anisotropy: Annotated[int, Field(ge=1, le=MOST_PLACES)] = 16
    """Places of a texture that a pixel looks at, at most; more are sharper where surfaces are seen aslant."""
    max_texture: Annotated[int, Field(ge=1, le=65536)] = 8192
    """Largest side of a texture, pixels; larger pictures are reduced."""
    texture_memory: Annotated[float, Field(gt=0, le=1_000_000)] = 4096.0
    """Memory that all textures may take together, megabytes."""

    scale: Annotated[
        Fraction,
        PlainValidator(_scale),
        PlainSerializer(float, return_type=float),
        WithJsonSchema({"type": ["number", "string"], "examples": [0.5, "1/4"]}),
    ] = Fraction(1)
    """Share of the display's pixels across and down, for proxies: 1/4; its layout is packed anew."""

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
    """Folder of the results, relative to the job."""
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
    stereo: Annotated[str, OneOf(STEREO)] = "files"
    """Two eyes' images: files of their own, or parts of one file."""
    unlit: Annotated[str, OneOf(UNLIT)] = "write"
    """Images of facets that face away from the viewer: written, hard links to one of their size, or none."""
    data_window: Annotated[str, OneOf(DATA_WINDOWS)] = "full"
    """Pixels in a file: all of the page or facet, or no margins that show nothing (tight)."""
    names: NamesSpec = NamesSpec()
    """Names of the images."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Something is written, and nothing twice."""
        if not (self.quilts or self.facets):
            yield (), "nothing to write (expected quilts or facets to be true)"
        yield from _twice(self.channels)


def _twice(channels: Sequence[str]) -> Iterator[Complaint]:
    for i, name in enumerate(channels):
        if name in channels[:i]:
            yield ("channels", i), f"{name!r} is already asked for"


def _shared_facets(viewers: Mapping[str, ViewerSpec]) -> Iterator[Complaint]:
    """What is wrong with how facets are shared out among viewers."""
    owner: dict[int, str] = {}
    for name, spec in viewers.items():
        if not _NAME.fullmatch(name):
            yield ("viewers", name), "expected a name of letters, digits, - and _"
        if spec.facets is None:
            if len(viewers) > 1:
                words = "missing key (each of several viewers has facets of their own)"
                yield ("viewers", name, "facets"), words
            continue
        taken = [facet for facet in spec.facets if facet in owner]
        if taken:
            first = f"facet {taken[0]} belongs to {owner[taken[0]]} already"
            words = f"{first} (a facet shows one viewer's picture)"
            yield ("viewers", name, "facets"), words
        owner |= dict.fromkeys(spec.facets, name)
    if len({spec.stereo is None for spec in viewers.values()}) > 1:
        plain = next(name for name, spec in viewers.items() if spec.stereo is None)
        words = "has one eye where others have two (give all of them stereo, or none)"
        yield ("viewers", plain), words


class JobFile(FileModel):
    """A render job."""

    @property
    def people(self) -> Mapping[str, ViewerSpec]:
        """Everybody who looks, by name; the only viewer has none."""
        if self.viewers is not None:
            return self.viewers
        assert self.viewer is not None
        return {"": self.viewer}

    @property
    def is_stereo(self) -> bool:
        """Whether there are images for two eyes."""
        return any(spec.stereo is not None for spec in self.people.values())

    def cross_checks(self) -> Iterator[Complaint]:
        """One viewer or several, each facet for one; the canonical depth lies between two planes."""
        yield from exactly_one(self, "viewer", "viewers")
        if self.viewer is not None and self.viewer.facets is not None:
            yield ("viewer", "facets"), "belongs to one of several viewers (expected viewers: {NAME: …})"
        yield from _shared_facets(self.viewers or {})
        if (self.viewer or self.viewers) and self.is_stereo and self.output.stereo == "files":
            written = (("page", self.output.quilts), ("facet", self.output.facets))
            yield from self.output.names.lacking_eyes([kind for kind, wanted in written if wanted])
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
    viewer: ViewerSpec | None = None
    """The viewer."""
    viewers: Annotated[dict[str, ViewerSpec], Field(min_length=1)] | None = None
    """Several viewers by name, each with facets of their own, instead of `viewer`."""
    render: RenderSpec = RenderSpec()
    """How pixels are made."""
    output: OutputSpec = OutputSpec()
    """What is written."""
