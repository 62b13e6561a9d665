"""Stereo images of a render as files for stereo hardware."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from quiltcli.errors import JobError, OutputError, Problem, raise_all
from quiltcli.formats.exr.image import Image, part_names, write_exr
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import Float32Array
from quiltcli.images.layers import read_view
from quiltcli.images.names import frame_digits, names_in
from quiltcli.images.stereo.anaglyph import MATRICES, anaglyph, luma
from quiltcli.images.stereo.packing import (
    PACKINGS,
    TURNS,
    Raster,
    interleaved,
    own_raster,
    with_sync_line,
)
from quiltcli.images.window import whole_frame
from quiltcli.job.frames import format_frames
from quiltcli.layout import Layout, pixel_owners, read_layout

EYES = ("left", "right")
MODES = ("anaglyph", *PACKINGS, *TURNS, "sequential", "rgb-frames")


@dataclass(frozen=True)
class StereoOptions:
    """How two eyes' images become one, or one after the other.

    Attributes:
        mode: one of `MODES`.
        kind: `page` or `facet`.
        frames: the only frames; None for all there are.
        matrix: of an anaglyph, a name of `MATRICES`.
        swap: take the left eye's image for the right's and the other way round.
        sync_line: draw the blue line that shutter glasses follow.
        overwrite: replace files that exist.
    """

    mode: str
    kind: str = "page"
    frames: Sequence[int] | None = None
    matrix: str = "dubois-red-cyan"
    swap: bool = False
    sync_line: bool = False
    overwrite: bool = False


@dataclass(frozen=True)
class Pair:
    """The images of two eyes: page or facet, frame, and the file and part of either."""

    number: int
    frame: int
    files: tuple[tuple[Path, str], tuple[Path, str]]


def write_stereo(out: Path, folder: Path, options: StereoOptions) -> list[Path]:
    """Make one image of each pair of a render's output folder, or a sequence of them; return the files.

    Raises:
        JobError: the options do not go together.
        OutputError: there are no images of two eyes, a file is missing or in the way, or cannot be written.
    """
    if options.sync_line and options.mode != "sequential":
        raise JobError(f"--sync-line goes with --as sequential, not with {options.mode}")
    pairs = find_pairs(out, options)
    if not options.overwrite:
        names = (folder / name for pair in pairs for name in _names(pair, options))
        raise_all(OutputError, _in_the_way(names))
    make_folder(folder)
    layout = _layout_of(out) if options.mode in TURNS and options.kind == "page" else None
    written: list[Path] = []
    for pair in pairs:
        for name, image, attributes in _made(pair, options, layout):
            write_exr(folder / name, image, attributes)
            written.append(folder / name)
    if options.mode == "rgb-frames":
        written += _write_rgb_frames(pairs, folder, options)
    return written


def find_pairs(out: Path, options: StereoOptions) -> list[Pair]:
    """The pairs of images that a folder holds, by number, then by frame (OutputError if there are none)."""
    kind = options.kind
    found: dict[tuple[int, int], dict[str, tuple[Path, str]]] = {}
    for name, path in names_in(out).found(out):
        if name.kind != kind or (options.frames is not None and name.frame not in options.frames):
            continue
        parts = (name.eye,) if name.eye else part_names(path)
        eyes = dict.fromkeys(part.partition(".")[0] for part in parts if part.partition(".")[0] in EYES)
        for eye in eyes:
            found.setdefault((name.number, name.frame), {})[eye] = (path, "" if name.eye else eye)
    missing = sorted({frame for (_, frame), eyes in found.items() if set(eyes) != set(EYES)})
    if missing:
        words = f"frames {format_frames(missing)} have {kind}s of one eye only"
        raise OutputError(Problem(words, file=str(out)))
    if not found:
        of = f" at frames {format_frames(options.frames)}" if options.frames else ""
        words = f"has no {kind}s of two eyes{of} (expected what a job with viewer.stereo has rendered)"
        raise OutputError(Problem(words, file=str(out)))
    order = ("right", "left") if options.swap else EYES
    return [Pair(*key, (found[key][order[0]], found[key][order[1]])) for key in sorted(found)]


def _names(pair: Pair, options: StereoOptions) -> list[str]:
    """Names of the files that come of one pair; none where frames are joined across pairs."""
    if options.mode == "rgb-frames":
        return []
    frames = [2 * pair.frame - 1, 2 * pair.frame] if options.mode == "sequential" else [pair.frame]
    return [_name(options.kind, pair.number, frame) for frame in frames]


def _name(kind: str, number: int, frame: int) -> str:
    digits = 2 if kind == "page" else 4
    return f"{kind}_{number:0{digits}}.{frame_digits(frame)}.exr"


def _in_the_way(paths: Iterator[Path]) -> Iterator[Problem]:
    for path in paths:
        if path.exists():
            yield Problem("exists already (use --overwrite to replace it)", file=str(path))
            return


def _made(
    pair: Pair, options: StereoOptions, layout: Layout | None
) -> Iterator[tuple[str, Mapping[str, Float32Array], dict[str, object]]]:
    """Name, channels and attributes of every image that comes of a pair."""
    if options.mode == "rgb-frames":
        return
    images = [_light(path, part) for path, part in pair.files]
    left, right = (light for _, light in images)
    attributes = _attributes(images[0][0], options)
    names = _names(pair, options)
    if options.mode == "sequential":
        rate = 2 * Fraction(str(attributes.get("framesPerSecond", 30)))
        for frame, (name, light, eye) in enumerate(zip(names, (left, right), EYES, strict=True)):
            shown = with_sync_line(light, eye) if options.sync_line else light
            numbered = {"framesPerSecond": rate, "quilt:frame": 2 * pair.frame - 1 + frame, "view": eye}
            yield name, _channels(shown), attributes | numbered
        return
    if options.mode == "anaglyph":
        light = anaglyph(left[:3], right[:3], MATRICES[options.matrix])
        light = np.concatenate((light, np.maximum(left[3:], right[3:])))
    elif options.mode in TURNS:
        raster = own_raster(*left.shape[1:]) if layout is None else page_raster(layout, pair.number - 1)
        light = interleaved(left, right, options.mode, raster)
    else:
        light = PACKINGS[options.mode](left, right)
    yield names[0], _channels(light), attributes


def page_raster(layout: Layout, page: int) -> Raster:
    """Which column and row of its own facet each pixel of a page is; the page's own outside of all facets."""
    width, height = layout.pages[page].tolist()
    first = layout.page_offset[page]
    owner = np.abs(pixel_owners(layout)[first : first + width * height].reshape(height, width))
    column, row = (np.broadcast_to(a, (height, width)).copy() for a in np.indices((height, width))[::-1])
    for place in np.flatnonzero(layout.page == page):
        y, x = np.nonzero(owner == layout.facet[place])
        facet_from_quilt = np.linalg.inv(np.vstack((layout.quilt_from_facet[place], [0, 0, 1])))
        at = facet_from_quilt @ np.stack((x + 0.5, y + 0.5, np.ones(x.size)))
        column[y, x], row[y, x] = np.floor(at[:2]).astype(np.int64)
    return Raster(column, row)


def _layout_of(out: Path) -> Layout:
    """The layout that a render has left beside its images."""
    return read_layout(out / "layout.yaml")


def _light(path: Path, part: str) -> tuple[Image, Float32Array]:
    """An image, and its red, green, blue and alpha (4, H, W)."""
    image = read_view(path, part)
    channels = whole_frame(image)
    if missing := [name for name in "RGB" if name not in channels]:
        raise OutputError(Problem(f"lacks the channels {', '.join(missing)}", file=str(path)))
    alpha = channels["A"] if "A" in channels else np.ones_like(channels["R"])
    return image, np.stack([*(channels[name] for name in "RGB"), alpha]).astype(np.float32)


def _channels(light: Float32Array) -> dict[str, Float32Array]:
    """Half floats of light (4, H, W), by channel."""
    return dict(zip("RGBA", light.astype(np.float16), strict=True))


def _attributes(image: Image, options: StereoOptions) -> dict[str, object]:
    """What is true of the new image, too: all but what told one eye from the other."""
    apart = ("view", "multiView", "quilt:eye", "quilt:pose")
    kept = {name: value for name, value in image.attributes.items() if name not in apart}
    return kept | {"quilt:stereo": options.mode}


def _write_rgb_frames(pairs: Sequence[Pair], folder: Path, options: StereoOptions) -> list[Path]:
    """Three successive grey frames of the sequence left, right, left … in red, green and blue of one."""
    written = []
    for number in dict.fromkeys(pair.number for pair in pairs):
        stream = [file for pair in pairs if pair.number == number for file in pair.files]
        for at in range(0, len(stream), 3):
            images = [_light(*file) for file in stream[at : at + 3]]
            grey = [luma(light[:3]) for _, light in images]
            grey += [np.zeros_like(grey[0])] * (3 - len(grey))  # the last may be short of a frame or two
            light = np.stack([*grey, np.ones_like(grey[0])])
            attributes = _attributes(images[0][0], options)
            rate = Fraction(str(attributes.get("framesPerSecond", 30))) * Fraction(2, 3)
            frame = at // 3 + 1
            path = folder / _name(options.kind, number, frame)
            if path.exists() and not options.overwrite:
                raise_all(OutputError, _in_the_way(iter([path])))
            write_exr(path, _channels(light), attributes | {"framesPerSecond": rate, "quilt:frame": frame})
            written.append(path)
    return written
