"""Compare images: every part, every channel, and first of all what is not a number.

The verdict follows idiff of OpenImageIO (thresholds, percentages, exit codes), with two differences: all
parts are compared, and NaN or infinity must stand in the same places (idiff passes any image with a NaN).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.formats.exr.image import Image, read_parts
from quiltcli.formats.inputs import check_input, name_fault, shown_name
from quiltcli.geometry import BoolArray
from quiltcli.images.names import frame_digits
from quiltcli.images.window import whole_frame

MATCH, WARN, FAIL, SIZE, FILE = 0, 1, 2, 3, 4
VERDICTS = ("match", "warn", "fail", "size", "file error")

_BLOCK = 256  # rows compared at a time: bounded memory, and the sums of a file do not depend on the machine
_PACKED = "dvi.????????.png"
_FIELD = re.compile(r"#+|%0?\d*d")


@dataclass(frozen=True)
class Limits:
    """What is forgiven. A pixel differs by its worst channel; the defaults forgive nothing.

    Attributes:
        fail: largest difference that does not count as a failing pixel.
        fail_percent: share of failing pixels that is still no failure, percent.
        hard_fail: difference no single pixel may exceed.
        warn: as `fail`, for a warning.
        warn_percent: as `fail_percent`, for a warning.
    """

    fail: float = 0.0
    fail_percent: float = 0.0
    hard_fail: float = math.inf
    warn: float = 0.0
    warn_percent: float = 0.0


@dataclass(frozen=True)
class ChannelDiff:
    """How one channel of one part differs.

    Attributes:
        part: 0-based part of the file.
        channel: its name.
        maximum, mean, rms: of the absolute differences where both values are finite.
        over: pixels that differ by more than `Limits.fail`, or in finiteness.
        nonfinite: pixels where one value is not finite and the other is not the same.
        first: (x, y) of the first pixel over, None when there is none.
        code: the verdict on this channel alone, 0 to 2 as in `VERDICTS`.
    """

    part: int
    channel: str
    maximum: float
    mean: float
    rms: float
    over: int
    nonfinite: int
    first: tuple[int, int] | None
    code: int


@dataclass(frozen=True)
class FileDiff:
    """The verdict on a pair of files.

    Attributes:
        name: what the two have in common: relative path, frame or file name.
        code: exit code 0 to 4, as in `VERDICTS`.
        message: what kept the files from being compared, empty when they were.
        channels: one row for each channel of each part.
        note: what explains differences, empty where nothing is known to.
    """

    name: str
    code: int
    message: str
    channels: tuple[ChannelDiff, ...]
    note: str = ""


@dataclass(frozen=True)
class DiffResult:
    """The verdict on all pairs; `code` is the worst of theirs."""

    files: tuple[FileDiff, ...]

    @property
    def code(self) -> int:
        """Exit code: 0 match, 1 warn, 2 fail, 3 size, 4 file error."""
        return max(file.code for file in self.files)


def diff(a: str | Path, b: str | Path, limits: Limits | None = None) -> DiffResult:
    """Compare two images, two sequences (`page_01.####.exr`, `page_01.%04d.exr`) or two folders.

    Of folders all EXR files and packed pictures of a 360° light field display below them are compared,
    by their relative names. Whatever cannot be compared is a verdict (code 4), not an error.
    """
    for given in (a, b):
        if fault := name_fault(given):
            return _no_comparison(f"{shown_name(given)}: {fault}")
    found_a, found_b = _named_files(a), _named_files(b)
    if (found_a is None) != (found_b is None):
        one, other = (a, b) if found_a is None else (b, a)
        return _no_comparison(f"{one} is one image, but {other} is many; expected two of a kind")
    if found_a is None or found_b is None:
        return DiffResult((diff_files(Path(a), Path(b), limits, name=Path(a).name),))
    if not found_a and not found_b:
        return _no_comparison(f"no images in {a}, nor in {b}")
    names = sorted(found_a.keys() | found_b.keys())
    return DiffResult(tuple(_diff_named(name, found_a, found_b, limits) for name in names))


def _no_comparison(message: str) -> DiffResult:
    return DiffResult((FileDiff("", FILE, message, ()),))


def _named_files(given: str | Path) -> Mapping[str, Path] | None:
    """Files of a folder by relative name, of a sequence by frame; None of a single image."""
    path = Path(given)
    if path.is_dir():
        every = (file for kind in ("*.exr", _PACKED) for file in path.rglob(kind))
        files = (file for file in every if not file.name.startswith("."))
        return {file.relative_to(path).as_posix(): file for file in files}
    field = _FIELD.search(path.name)
    if not field:
        return None
    before, after = path.name[: field.start()], path.name[field.end() :]
    name = re.compile(f"{re.escape(before)}(-?\\d+){re.escape(after)}")
    matches = ((name.fullmatch(file.name), file) for file in path.parent.glob("*"))
    return {f"frame {frame_digits(int(match[1]))}": file for match, file in matches if match}


def _diff_named(name: str, a: Mapping[str, Path], b: Mapping[str, Path], limits: Limits | None) -> FileDiff:
    if name in a and name in b:
        return diff_files(a[name], b[name], limits, name=name)
    only = a[name] if name in a else b[name]
    return FileDiff(name, FILE, f"only {only} exists", ())


def diff_files(a: Path, b: Path, limits: Limits | None = None, *, name: str = "") -> FileDiff:
    """Compare two image files, part by part in file order."""
    limits = limits or Limits()
    name = name or str(a)
    try:
        parts_a, parts_b = read_image(a), read_image(b)
    except OutputError as error:
        return FileDiff(name, FILE, str(error), ())
    if wrong := _shape_difference(parts_a, parts_b):
        return FileDiff(name, SIZE, wrong, ())
    code, channels = MATCH, []
    for part, (image_a, image_b) in enumerate(zip(parts_a, parts_b, strict=True)):
        verdict, rows = diff_channels(*_same_window(image_a, image_b), limits, part)
        code = max(code, verdict)
        channels += rows
    return FileDiff(name, code, "", tuple(channels), _corrections_differ(parts_a[0], parts_b[0]))


def _corrections_differ(a: Image, b: Image) -> str:
    """What tells the light of two images apart where they were made for panels of another response."""
    first, second = (image.attributes.get("quilt:corrections") for image in (a, b))
    if first == second:
        return ""
    if first and second:
        return "made for panels of other corrections"
    return f"only the {'first' if first else 'second'} is corrected for its panels"


def _shape_difference(a: Sequence[Image], b: Sequence[Image]) -> str:
    """What keeps two images from being compared pixel by pixel, "" when nothing does."""
    if len(a) != len(b):
        return f"parts: {len(a)} against {len(b)}"
    for image_a, image_b in zip(a, b, strict=True):
        if image_a.channels.keys() != image_b.channels.keys():
            names = (", ".join(sorted(image.channels)) for image in (image_a, image_b))
            return "channels {} against {}".format(*names)
        if image_a.data_window != image_b.data_window and image_a.display_window != image_b.display_window:
            return f"pixels {_bounds(image_a)} against {_bounds(image_b)}"
    return ""


def _same_window(a: Image, b: Image) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, NDArray[Any]]]:
    """The channels of two images over one window: that of the pixels, else the whole frame."""
    if a.data_window == b.data_window:
        return a.channels, b.channels
    return whole_frame(a), whole_frame(b)


def _bounds(image: Image) -> str:
    (x0, y0), (x1, y1) = image.data_window
    return f"{x1 - x0 + 1}×{y1 - y0 + 1}" + (f" at ({x0}, {y0})" if x0 or y0 else "")


def diff_channels(
    a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]], limits: Limits, part: int = 0
) -> tuple[int, list[ChannelDiff]]:
    """Verdict and one row a channel for two images with the same channels and sizes."""
    height, width = next(iter(a.values())).shape
    failing, warning = np.zeros((height, width), bool), np.zeros((height, width), bool)
    rows = [_diff_channel(name, a[name], b[name], limits, part, failing, warning) for name in sorted(a)]
    worst, nonfinite = max(row.maximum for row in rows), sum(row.nonfinite for row in rows)
    over, warned = int(np.count_nonzero(failing)), int(np.count_nonzero(warning))
    return _verdict(limits, height * width, worst, nonfinite, over, warned), rows


def _verdict(limits: Limits, pixels: int, worst: float, nonfinite: int, over: int, warned: int) -> int:
    """The verdict on so many pixels, of which some are `over` the limit of failing, or of warning."""
    hard = worst > limits.hard_fail or (limits.hard_fail < math.inf and nonfinite > 0)
    if hard or over > limits.fail_percent / 100 * pixels:
        return FAIL
    return WARN if warned > limits.warn_percent / 100 * pixels else MATCH


def _diff_channel(
    name: str,
    a: NDArray[Any],
    b: NDArray[Any],
    limits: Limits,
    part: int,
    failing: BoolArray,
    warning: BoolArray,
) -> ChannelDiff:
    """The row of one channel; marks its pixels in `failing` and `warning`, which gather all channels'."""
    maximum = total = squares = 0.0
    over = warned = nonfinite = finite = 0
    first = None
    for y, apart, unlike in _blocks(a, b):
        fails = (apart > limits.fail) | unlike
        failing[y : y + len(apart)] |= fails
        warns = (apart > limits.warn) | unlike
        warning[y : y + len(apart)] |= warns
        warned += int(np.count_nonzero(warns))
        if first is None and fails.any():
            row, column = divmod(int(np.argmax(fails)), fails.shape[1])
            first = (column, y + row)
        over += int(np.count_nonzero(fails))
        nonfinite += int(np.count_nonzero(unlike))
        finite += apart.size - int(np.count_nonzero(unlike))
        maximum, total = max(maximum, float(apart.max())), total + float(apart.sum())
        squares += float(np.square(apart).sum())
    count = max(finite, 1)
    code = _verdict(limits, a.size, maximum, nonfinite, over, warned)
    rms = math.sqrt(squares / count)
    return ChannelDiff(part, name, maximum, total / count, rms, over, nonfinite, first, code)


def _blocks(a: NDArray[Any], b: NDArray[Any]) -> Iterator[tuple[int, NDArray[np.float64], BoolArray]]:
    """First row, absolute difference (0 where not finite) and mask of unlike finiteness, block by block."""
    for y in range(0, len(a), _BLOCK):
        left, right = a[y : y + _BLOCK].astype(np.float64), b[y : y + _BLOCK].astype(np.float64)
        finite = np.isfinite(left) & np.isfinite(right)
        unlike = ~finite & (left != right) & ~(np.isnan(left) & np.isnan(right))
        apart = np.abs(np.subtract(left, right, out=np.zeros_like(left), where=finite))
        yield y, apart, unlike


def read_image(path: Path) -> tuple[Image, ...]:
    """All parts of an image of any format; EXR is read strictly, others through OpenImageIO (OutputError)."""
    if path.suffix.lower() == ".exr":
        return read_parts(path)
    check_input(path, OutputError, "an image")
    import OpenImageIO

    file = OpenImageIO.ImageInput.open(str(path))
    if not file:
        raise OutputError(Problem(f"cannot be read: {OpenImageIO.geterror()}", file=str(path)))
    try:
        return tuple(_other_parts(path, file))
    finally:
        file.close()


def _other_parts(path: Path, file: Any) -> Iterator[Image]:
    part = 0
    while file.seek_subimage(part, 0):
        spec = file.spec()
        needed, free = 4 * spec.width * spec.height * spec.nchannels, free_memory()
        if free is not None and needed > free:
            words = f"has {spec.width:,}×{spec.height:,} pixels, which take {bytes_text(needed)} of memory"
            raise OutputError(Problem(f"{words}, but {bytes_text(free)} are free", file=str(path)))
        pixels = file.read_image(part, 0, 0, spec.nchannels, "float")
        if pixels is None:
            raise OutputError(Problem(f"cannot be read: {file.geterror()}", file=str(path)))
        window = ((spec.x, spec.y), (spec.x + spec.width - 1, spec.y + spec.height - 1))
        channels = {name: pixels[:, :, n] for n, name in enumerate(spec.channelnames)}
        yield Image(channels, {}, "none", window, window)
        part += 1


COLUMNS = (
    "file",
    "part",
    "channel",
    "verdict",
    "max",
    "mean",
    "rms",
    "pixels over",
    "not finite",
    "first pixel",
)


def diff_rows(result: DiffResult) -> list[tuple[str, ...]]:
    """The table a reader sees, in `COLUMNS`: a line for each channel, or one that says what went wrong."""
    rows: list[tuple[str, ...]] = []
    for file in result.files:
        if not file.channels:
            rows.append((file.name, "", "", VERDICTS[file.code], file.message, "", "", "", "", ""))
        for row in file.channels:
            figures = (f"{number:.6g}" for number in (row.maximum, row.mean, row.rms))
            first = f"{row.first[0]}, {row.first[1]}" if row.first else ""
            counts = (str(row.over), str(row.nonfinite), first)
            verdict = VERDICTS[row.code]
            rows.append((file.name, str(row.part), row.channel, verdict, *figures, *counts))
        if file.note:
            rows.append((file.name, "", "", "", file.note, "", "", "", "", ""))
        if file.channels and file.code > max(row.code for row in file.channels):
            # Shares of pixels are those of all channels together.
            rows.append((file.name, "", "together", VERDICTS[file.code], "", "", "", "", "", ""))
    return rows
