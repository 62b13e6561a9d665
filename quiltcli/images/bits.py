"""The pictures of one bit that are packed in pictures of 24, taken out again."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.bitplanes import BITS, ORDERS, PLANES, read_packed, stream_of, unpack, write_plane
from quiltcli.formats.whole import make_folder

_NUMBERED = re.compile(r".*?(\d{1,12})")


def packed_files(named: Sequence[Path]) -> list[tuple[str, int, Path]]:
    """Packed pictures by stream and number: those named, and those in folders that are named.

    Raises:
        OutputError: a folder without any, a name without a number, or a number that comes twice in a stream.
    """
    found: dict[tuple[str, int], Path] = {}
    problems: list[Problem] = []
    for path in named:
        inside = sorted(path.glob("*.png")) if path.is_dir() else [path]
        if not inside and (path / "packed").is_dir():
            inside = sorted((path / "packed").glob("*.png"))
        if not inside:
            problems.append(Problem("has no packed pictures (expected PNG files in it)", file=str(path)))
        for file in inside:
            match = _NUMBERED.fullmatch(file.stem)
            if match is None or int(match[1]) < 1:
                words = "has no number from 1 in its name, such as dvi.00000001.png"
                problems.append(Problem(words, file=str(file)))
                continue
            key = stream_of(file.name), int(match[1])
            if found.setdefault(key, file) != file:
                problems.append(Problem(f"has the number of {found[key]}", file=str(file)))
    raise_all(OutputError, problems)
    return [(*key, found[key]) for key in sorted(found)]


def plane_path(out: Path, number: int, stream: str = "") -> Path:
    """File of the picture of one bit that is shown as the `number`th of a stream, from 1."""
    return out / f"bits{stream and '_' + stream}.{number:08d}.png"


def unpack_files(
    named: Sequence[Path], out: Path, *, order: str = "rgb", bits: str = "lsb", overwrite: bool = False
) -> list[Path]:
    """Write the 24 pictures of one bit in each packed one; return the files.

    Packed picture k holds what is shown as the pictures 24 (k − 1) + 1 to 24 k.

    Args:
        named: packed pictures, or folders of them.
        out: folder, made if need be.
        order: the channels as they are shown.
        bits: which bit of a channel is shown first, `lsb` or `msb`.
        overwrite: replace files that exist.

    Raises:
        OutputError: a picture cannot be read, or a file is in the way.
    """
    raise_all(OutputError, _wrong(order, bits))
    files = packed_files(named)
    places = {path: [plane_path(out, k, stream) for k in _shown(number)] for stream, number, path in files}
    if not overwrite:
        taken = [path for row in places.values() for path in row if path.exists()]
        wanted = "exists already, expected to be told to overwrite it"
        raise_all(OutputError, [Problem(wanted, file=str(path)) for path in taken])
    for path in places:
        planes = unpack(read_packed(path)[None], order, bits)
        make_folder(out)  # only now: a damaged picture leaves no empty folder
        for place, plane in zip(places[path], planes, strict=True):
            write_plane(place, plane)
    return [path for row in places.values() for path in row]


def _shown(number: int) -> range:
    return range(PLANES * (number - 1) + 1, PLANES * number + 1)


def _wrong(order: str, bits: str) -> Iterator[Problem]:
    if order not in ORDERS:
        yield Problem(f"expected an order of the channels ({', '.join(ORDERS)}), got {order!r}")
    if bits not in BITS:
        yield Problem(f"expected {' or '.join(BITS)} as the bit that is shown first, got {bits!r}")
