"""The sequences in a render's output folder: of each page or facet and eye, its frames in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.image import part_names, read_exr, read_header
from quiltcli.images.names import facet_names_in, names_in
from quiltcli.images.turns import is_ring_output
from quiltcli.images.window import frame_size, whole_frame
from quiltcli.job.frames import format_frames
from quiltcli.viewer.view import EYES


@dataclass(frozen=True)
class Reel:
    """A sequence.

    Attributes:
        name: `page_01`, the facet's name or `facet_0001`; with two eyes `page_01.left`.
        eye: `left` or `right`, empty where there is one eye.
        size: width and height, pixels.
        fps: frames a second.
        frames: numbers, ascending; those of all reels.
        files: file and part by frame; none of a frame in which a facet was left out, since it is not lit.
    """

    name: str
    eye: str
    size: tuple[int, int]
    fps: Fraction
    frames: tuple[int, ...]
    files: dict[int, tuple[Path, str]]

    def light(self, frame: int) -> NDArray[Any]:
        """Light (H, W, 3) of a frame; black where there is no image (OutputError)."""
        if frame not in self.files:
            return np.zeros((self.size[1], self.size[0], 3), dtype=np.float32)
        path, part = self.files[frame]
        channels = whole_frame(read_exr(path, part))
        if missing := [name for name in "RGB" if name not in channels]:
            raise OutputError(Problem(f"lacks the channels {', '.join(missing)}", file=str(path)))
        light = np.stack([channels[name] for name in "RGB"], axis=-1)
        if light.shape[:2] != self.size[::-1]:
            words = f"is {light.shape[1]}×{light.shape[0]} pixels, others are {self.size[0]}×{self.size[1]}"
            raise OutputError(Problem(words, file=str(path)))
        return light


def reels_of(out: Path, kind: str, frames: Sequence[int] | None = None) -> list[Reel]:
    """The reels of pages or facets (`page`, `facet`) in a folder.

    Raises:
        OutputError: there are none, or frames of a page are missing.
    """
    found: dict[tuple[int, str], dict[int, tuple[Path, str]]] = {}
    known: set[int] = set()
    for name, path in names_in(out).found(out):
        if name.kind != kind:
            continue
        known.add(name.frame)
        if frames is not None and name.frame not in frames:
            continue
        eyes = (name.eye,) if name.eye else tuple(part for part in part_names(path) if part in EYES) or ("",)
        for eye in eyes:
            part = eye if not name.eye else ""
            found.setdefault((name.number, eye), {})[name.frame] = (path, part)
    every = sorted({frame for files in found.values() for frame in files})
    if missing := sorted(set(frames or ()) - set(every)):
        words = f"has no {kind}s of frames {format_frames(missing)}"
        raise OutputError(Problem(words + (f" (it has {format_frames(known)})" if known else ""), str(out)))
    if not found:
        words = f"has no images of {kind}s (expected the folder that quilt render has written to)"
        if is_ring_output(out):
            words = "is of a spinning mirror, which has no films (expected quilt simulate or quilt view)"
        raise OutputError(Problem(words, file=str(out)))
    if gaps := sorted(set(range(every[0], every[-1] + 1, _step(every))) - set(every)):
        words = f"lacks frames {format_frames(gaps)} between others (choose frames with -f)"
        raise OutputError(Problem(words, file=str(out)))
    names = facet_names_in(out) if kind == "facet" else ()
    return [_reel(kind, *key, every, found[key], names) for key in sorted(found)]


def _step(frames: Sequence[int]) -> int:
    return min((b - a for a, b in pairwise(frames)), default=1)


def _reel(
    kind: str,
    number: int,
    eye: str,
    every: Sequence[int],
    files: dict[int, tuple[Path, str]],
    names: Sequence[str],
) -> Reel:
    first = next(iter(files.values()))[0]
    header = read_header(first)
    missing = sorted(set(every) - set(files))
    if missing and kind == "page":
        words = f"page {number} has no image of frames {format_frames(missing)}, others have"
        raise OutputError(Problem(words, file=str(first.parent)))
    known = names[number - 1] if number <= len(names) else f"{kind}_{number:0{2 if kind == 'page' else 4}}"
    name = known + (f".{eye}" if eye else "")
    fps = Fraction(str(header.attributes.get("framesPerSecond", 30)))
    return Reel(name, eye, frame_size(header), fps, tuple(every), files)
