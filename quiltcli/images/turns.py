"""Small pictures of what a 360° light field display shows in a turn, for contact sheets."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.bitplanes import PLANES, STREAMS, read_packed, stream_of, unpack
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import BoolArray
from quiltcli.images.preview import Bytes, block_means, srgb
from quiltcli.job.load import load_mirror_file
from quiltcli.job.mirror import KIND, MirrorDisplayFile

MOST = 24
"""Mirror positions a sheet shows of a turn."""


def is_ring_output(out: Path) -> bool:
    """Whether a folder holds the turns of a display with a spinning mirror."""
    try:
        report = json.loads(read_input(out / "report.json", OutputError))
    except (ValueError, RecursionError, OutputError):
        return False
    return isinstance(report, dict) and report.get("kind") == KIND


def frames_in(out: Path) -> tuple[int, ...]:
    """Frames whose turns a folder holds (OutputError)."""
    report = json.loads(read_input(out / "report.json", OutputError))
    return tuple(int(entry["frame"]) for entry in report["frames"])


def turn_pictures(out: Path, width: int, frames: Sequence[int] | None) -> Iterator[tuple[str, Bytes]]:
    """Labels and small pictures (h, w, 3) of up to 24 mirror positions of each turn.

    Args:
        out: folder of a render.
        width: most pixels of a picture's sides.
        frames: frame numbers; the first one when None.

    Raises:
        OutputError: there are no such frames or pictures.
    """
    display = load_mirror_file(out / "display.yaml")
    report = json.loads(read_input(out / "report.json", OutputError))
    there = frames_in(out)
    for frame in there[:1] if frames is None else frames:
        if frame not in there:
            raise OutputError(Problem(f"has no turn of frame {frame}", str(out)))
        packed = next(entry["packed"] for entry in report["frames"] if int(entry["frame"]) == frame)
        there_now = {path.name for path in (out / "packed").glob("*.png")}
        drawn = {name: entry["positions"] for name, entry in packed.items() if name in there_now}
        if not drawn:
            words = "has no packed pictures (a job writes them where output.packed is true)"
            raise OutputError(Problem(words, str(out)))
        yield from _of_turn(out, display, frame, drawn, width)


def _of_turn(
    out: Path, display: MirrorDisplayFile, frame: int, drawn: Mapping[str, Sequence[int]], width: int
) -> Iterator[tuple[str, Bytes]]:
    """Labels and pictures of some of the positions, from 1, that are drawn in packed pictures."""
    packing, turn = display.packing, display.rotation
    sign = -1 if turn.direction == "decreasing" else 1
    # The streams of a picture have names of the same end, and positions that all of them show.
    streams: dict[str, list[str]] = {}
    for name in sorted(drawn, key=lambda name: [*("", *STREAMS)].index(stream_of(name))):
        streams.setdefault(name.split(".", 1)[1], []).append(name)
    common = {end: set.intersection(*(set(drawn[n]) for n in names)) for end, names in streams.items()}
    shown = [(position, end) for end in sorted(streams) for position in sorted(common[end])]
    read: tuple[str, BoolArray] | None = None
    for position, end in shown[:: max(math.ceil(len(shown) / MOST), 1)]:
        if read is None or read[0] != end:
            packed = np.stack([read_packed(out / "packed" / name) for name in streams[end]])
            planes = unpack(packed, packing.order, packing.bits)
            read = end, planes.reshape(len(packed), PLANES, *planes.shape[1:])
        bits = np.moveaxis(read[1][:, (position - 1) % PLANES], 0, -1)
        factor = max(math.ceil(max(bits.shape) / width), 1)
        small = srgb(block_means(bits.astype(np.float32), factor))
        angle = turn.first_deg + sign * 360 * (position - 1) / turn.positions
        picture = np.rint(255 * small).astype(np.uint8).repeat(3 // small.shape[2], axis=2)
        yield f"{position}, {angle:.4g} DEG, frame {frame}", picture
