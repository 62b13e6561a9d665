"""The job file: what to render, and how, and where to."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    Tag,
    WithJsonSchema,
    model_validator,
)

from quiltcli.channels import CHANNELS
from quiltcli.errors import JobError
from quiltcli.job.halftone import HalftoneSpec
from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.job.lights import MOST_RAYS
from quiltcli.job.model import (
    YAMLS,
    AnyPath,
    Complaint,
    ExistingFile,
    FileModel,
    Listed,
    Model,
    OneOf,
    Positive,
    ScenePath,
    Unit,
    YamlPath,
    complaint,
    describe,
    either,
    exactly_one,
)
from quiltcli.job.names import NamesSpec
from quiltcli.job.ring import RingSpec
from quiltcli.job.viewer import FrameRange, ViewerSpec

UNSORTED = ("octree", "independent")
METHODS = (
    *("homography", "offaxis", "raskar", "zscale", "twopass", "raycast", "cubemap", "tessellate"),
    *UNSORTED,
)
RING_METHODS = ("exact", "raycast", "vertex")
DEPTH_BITS = ("16", "24", "32f")
LOSSLESS = ("none", "rle", "zips", "zip", "piz", "zstd", "htj2k32", "htj2k256")
COMPRESSIONS = (*LOSSLESS, "pxr24", "b44", "b44a", "dwaa", "dwab", "lj2k")
CLIPS = ("auto", "planar", "distance")
STEREO = ("files", "parts")
SIDES = ("all", "file")
PARTS = ("layers", "parts")
_NAME = re.compile(r"[\w-]+")
MOST_SAMPLES = 4096
MOST_TIMES = 256
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


class OcclusionSpec(Model):
    """What keeps light from places that comes from everywhere."""

    distance: Positive
    """How far off it may stand, metres."""
    samples: Annotated[int, Field(ge=1, le=MOST_RAYS)] = 32
    """Directions in which it is looked for from a pixel; those below the horizon are not."""


class RenderSpec(Model):
    """How pixels are made."""

    samples: Annotated[int, Field(ge=1, le=MOST_SAMPLES)] = 1
    """Samples a pixel; 1 is exactly the pixel's centre."""
    sample_shading: bool = False
    """Work light out at every sample of a pixel, not once for a triangle and pixel where it is smooth."""
    shutter: Unit = 0.0
    """How long the shutter is open from the frame's time on, as a share of a frame: motion blur."""
    motion_samples: Annotated[int, Field(ge=1, le=MOST_TIMES)] = 16
    """Times at most at which the samples of a pixel look while the shutter is open."""
    method: Annotated[str, OneOf((*METHODS, "exact", "vertex"))] = "homography"
    """Render method; on a 360° light field display exact (so where the key is absent), raycast or vertex."""
    tessellate: Positive | None = None
    """With method: vertex, how far edges may bend before triangles are divided; 0.05 when absent, pixels."""
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
    faces: Annotated[int, Field(ge=1, le=16384)] | None = None
    """Width and height of the faces that method: cubemap looks pixels up in, 2048 when absent, pixels."""
    shadows: bool = True
    """Draw the shadows of lights that have them."""
    ambient_occlusion: OcclusionSpec | None = None
    """Darken places by what is near them, in light from everywhere that has no shadows."""
    double_sided: Annotated[str, OneOf(SIDES)] = "all"
    """Surfaces whose backs are seen: all, or those that their files call so (file)."""
    threshold: Annotated[float, Field(ge=1e-4, le=1)] | None = None
    """Longest edge on the display for method: tessellate, as a share of its size; 0.01 when absent."""
    bleed: Annotated[int, Field(ge=0, le=MOST_BLEED)] = 2
    """How far to render past a facet's edge, into the padding, pixels."""
    anisotropy: Annotated[int, Field(ge=1, le=MOST_PLACES)] = 16
    """Places of a texture that a pixel looks at, at most; more are sharper where surfaces are seen aslant."""
    max_texture: Annotated[int, Field(ge=1, le=65536)] = 8192
    """Largest side of a texture, pixels; larger pictures are reduced."""
    texture_memory: Annotated[float, Field(gt=0, le=1_000_000)] = 4096.0
    """Memory that all textures may take together, megabytes."""

    corrections: bool = True
    """Make up for what the display file says of its panels (corrections)."""

    scale: Annotated[
        Fraction,
        PlainValidator(_scale),
        PlainSerializer(float, return_type=float),
        WithJsonSchema({"type": ["number", "string"], "examples": [0.5, "1/4"]}),
    ] = Fraction(1)
    """Share of the display's pixels across and down, for proxies: 1/4; its layout is packed anew."""

    @property
    def averages(self) -> bool:
        """Whether light is the mean of samples, and not that of the pixel's centre at the frame's time."""
        return self.samples > 1 or self.shutter > 0

    def needs_planar_clip(self, channels: Sequence[str]) -> bool:
        """Whether something is asked for that lies between a near and a far plane."""
        by_distance = ("homography", "raycast", "cubemap", "tessellate", *UNSORTED, *RING_METHODS)
        return "zv" in channels or self.depth_bits is not None or self.method not in by_distance

    def cross_checks(self) -> Iterator[Complaint]:
        """Rays have neither a depth buffer nor several samples; depth buffers lie between planes."""
        if self.clip == "distance" and self.needs_planar_clip(()):
            what = "depth_bits" if self.depth_bits is not None else f"method: {self.method}"
            yield ("clip",), f"{what} needs a near and a far plane (expected planar or auto), got distance"
        if self.method == "raycast" and self.depth_bits is not None:
            yield ("depth_bits",), "rays have no depth buffer (expected no such key beside method: raycast)"
        if self.tessellate is not None and self.method != "vertex":
            yield ("tessellate",), f"belongs to method: vertex, got {self.method}"
        if self.method != "cubemap" and self.faces is not None:
            yield ("faces",), f"belongs to method: cubemap, got method: {self.method}"
        if self.method != "tessellate" and self.threshold is not None:
            yield ("threshold",), f"belongs to method: tessellate, got method: {self.method}"
        if self.method == "tessellate" and self.samples > 1:
            yield ("samples",), f"expected 1 beside method: tessellate, got {self.samples}"
        if self.method == "cubemap" and self.depth_bits is not None:
            yield ("depth_bits",), "a cube map has exact depth (expected no such key beside method: cubemap)"
        if self.method == "raycast" and self.samples > 1:
            yield ("samples",), f"expected 1 beside method: raycast, one ray a pixel, got {self.samples}"
        if self.method in ("raycast", "twopass", *UNSORTED) and self.shutter:
            yield ("shutter",), f"expected 0 beside method: {self.method}, got {self.shutter:g}"


class OutputSpec(Model):
    """What is written."""

    directory: AnyPath = Path("out")
    """Folder of the results, relative to the job."""
    quilts: bool = True
    """Write quilt pages."""
    facets: bool = True
    """Write one image a facet."""
    packed: bool = True
    """Write the pictures of one bit that a 360° light field display shows, packed."""
    tones: bool = False
    """Write what they are made of, an image of every mirror position."""
    channels: Annotated[tuple[Annotated[str, OneOf(tuple(CHANNELS))], ...], Listed, Field(min_length=1)] = (
        "rgba",
        "Z",
    )
    """Channels of every image."""
    compression: Annotated[str, OneOf(COMPRESSIONS)] = "zip"
    """OpenEXR compression."""
    stereo: Annotated[str, OneOf(STEREO)] = "files"
    """Two eyes' images: files of their own, or parts of one file."""
    parts: Annotated[str, OneOf(PARTS)] = "layers"
    """Channels of an image: layers of one part, or a part of the file each."""
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
        mattes = [name for name in self.channels if CHANNELS[name].matte]
        if mattes and self.compression not in LOSSLESS:
            words = f"{self.compression} alters the identities in {mattes[0]} (expected {either(LOSSLESS)})"
            yield ("compression",), words


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


def _scene_or_lightfield(schema: dict[str, Any]) -> None:
    """Either of the two is enough."""
    schema["required"].remove("scene")
    schema["anyOf"] = [{"required": ["scene"]}, {"required": ["lightfield"]}]


class JobFile(FileModel):
    """A render job."""

    @property
    def people(self) -> Mapping[str, ViewerSpec]:
        """Everybody who looks, by name; the only viewer has none."""
        if self.viewers is not None:
            return self.viewers
        if self.viewer is None:
            words = "is for a 360° light field display; this needs facets (expected viewer or viewers)"
            raise JobError(self.source.problem(("ring",), words))
        return {"": self.viewer}

    @property
    def is_stereo(self) -> bool:
        """Whether there are images for two eyes."""
        return any(spec.stereo is not None for spec in self.people.values())

    def cross_checks(self) -> Iterator[Complaint]:
        """One viewer or several, each facet for one; the canonical depth lies between two planes."""
        yield from exactly_one(self, "viewer", "viewers", *(("ring",) if self.ring is not None else ()))
        yield from self._ring_checks()
        if self.lightfield is not None and self.scene != self.lightfield:
            yield ("lightfield",), "cannot stand beside scene (expected one or the other)"
        if self.viewer is not None and self.viewer.facets is not None:
            yield ("viewer", "facets"), "belongs to one of several viewers (expected viewers: {NAME: …})"
        yield from _shared_facets(self.viewers or {})
        if (self.viewer or self.viewers) and self.is_stereo and self.output.stereo == "files":
            written = (("page", self.output.quilts), ("facet", self.output.facets))
            yield from self.output.names.lacking_eyes([kind for kind, wanted in written if wanted])
        if self.render.clip == "distance" and "zv" in self.output.channels:
            words = "zv lies between a near and a far plane (expected planar or auto), got distance"
            yield ("render", "clip"), words
        for index, name in enumerate(self.output.channels):
            if self.render.method == "twopass" and (CHANNELS[name].matte or name == "motion"):
                words = f"{name} cannot be resampled, which method: twopass does (expected another method)"
                yield ("output", "channels", index), words

    def _ring_checks(self) -> Iterator[Complaint]:
        """What belongs to a ring of viewers alone, and what does not go with it."""
        method = self.render.method
        if self.ring is None:
            if self.halftone is not None:
                yield ("halftone",), "belongs to a 360° light field display (expected no such key)"
            if self.lightfield is not None:
                yield ("lightfield",), "belongs to a 360° light field display (expected scene)"
            if method in ("exact", "vertex"):
                yield ("render", "method"), f"expected {either(METHODS)} beside viewer, got {method}"
            return
        if self.halftone is not None and self.halftone.before and self.lightfield is None:
            yield ("halftone", "before"), "is for photographs (expected `lightfield` and no scene beside it)"
        if "method" in self.render.model_fields_set and method not in RING_METHODS:
            yield ("render", "method"), f"expected {either(RING_METHODS)} beside ring, got {method}"
        if self.layout is not None:
            yield ("layout",), "belongs to a display of facets (expected no such key beside ring)"
        if self.render.scale != 1:
            words = "belongs to displays of facets (expected a smaller image of the display), got"
            yield ("render", "scale"), f"{words} {self.render.scale}"
        if self.lightfield is not None and self.render.samples > 1:
            words = f"expected 1 beside lightfield, whose pictures are filtered, got {self.render.samples}"
            yield ("render", "samples"), words
        if self.render.shutter:
            words = "expected 0 beside ring: a turn shows its frame's instant, got"
            yield ("render", "shutter"), f"{words} {self.render.shutter:g}"
        if self.render.double_sided == "file":
            yield ("render", "double_sided"), "expected all beside ring (or backface_culling), got file"
        if self.render.depth_bits is not None:
            yield ("render", "depth_bits"), "has no meaning on a ring of viewers (expected no such key)"
        if not (self.output.packed or self.output.tones):
            yield ("output",), "nothing to write (expected packed or tones to be true)"
        if "rgba" not in self.output.channels:
            yield ("output", "channels"), "expected rgba among them: light is made of it"

    @model_validator(mode="before")
    @classmethod
    def _content(cls, data: Any) -> Any:
        """A light field is what is to be seen, too: it stands in the scene's place."""
        if isinstance(data, dict) and "lightfield" in data and "scene" not in data:
            return {**data, "scene": data["lightfield"]}
        return data

    model_config = ConfigDict(json_schema_extra=_scene_or_lightfield)
    kind: ClassVar[str] = "quilt_job"
    copied: ClassVar[dict[str, str]] = {"scene": "lightfield"}
    """Keys that another one's value is copied to where they are absent."""

    quilt_job: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    display: YamlPath
    """Display file."""
    layout: LayoutChoice | None = None
    """Layout file, or how to pack; the display's own layout or the packing defaults when absent."""
    scene: ScenePath
    """Scene file, or a mesh, glTF or USD file."""
    lightfield: YamlPath | None = None
    """Light field file, photographs for a 360° light field display to show, instead of `scene`."""
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
    ring: RingSpec | None = None
    """Viewers all around a 360° light field display, instead of `viewer`."""
    halftone: HalftoneSpec | None = None
    """How tones become bits on a 360° light field display; the defaults when absent."""
    render: RenderSpec = RenderSpec()
    """How pixels are made."""
    output: OutputSpec = OutputSpec()
    """What is written."""
