"""One turn of the mirror: pictures of its positions, their tones, bits, and packed pictures of 24.

    positions ── draw, tones (workers) ──▶ tones, inside     in memory that workers share
    runs of positions ── halftone (workers) ──▶ bits
    packed pictures ── pack, write (workers) ──▶ files

A picture of one bit depends on its own tones alone (but where `halftone.angle` hands errors on), so neither
the number of workers nor how a turn is cut into parts makes any difference.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.bitplanes import PLANES, pack, packed_name, read_packed, unpack, write_packed
from quiltcli.geometry import BoolArray
from quiltcli.halftone import Sequel, halftone
from quiltcli.render.ring.crew import shared_out
from quiltcli.render.ring.outputs import read_tones, tones_path, write_tones
from quiltcli.render.ring.setup import RingStage
from quiltcli.render.workers import shared_array
from quiltcli.ring.picture import Counts, Show, draw_picture
from quiltcli.ring.rig import Rig
from quiltcli.ring.tones import tones_of


@dataclass(frozen=True)
class Part:
    """Some positions of a frame's turn.

    Attributes:
        frame: frame number.
        number: of the frame among the job's, from 0: packed pictures are numbered through.
        positions: numbers of mirror positions from 0, ascending.
        on_disk: those of them whose light an earlier run has written; it is read, not drawn.
    """

    frame: int
    number: int
    positions: Sequence[int]
    on_disk: frozenset[int] = frozenset()


@dataclass
class TurnRecord:
    """What was done for a frame.

    Attributes:
        frame: frame number.
        positions: how many mirror positions were drawn.
        triangles: of the scene.
        counts: what was done to see and to shade, all positions together.
        clipped: share of the mirror's pixels that were brighter than white, by position.
        lit: share of the mirror's pixels that are on, by position; empty where no bits were made.
        seconds: wall time by stage.
        packed: hash of every packed picture by name, and which of its pictures are drawn.
    """

    frame: int
    positions: int
    triangles: int
    counts: Counts = field(default_factory=Counts)
    clipped: list[float] = field(default_factory=list)
    lit: list[float] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    packed: dict[str, dict[str, object]] = field(default_factory=dict)


@dataclass(frozen=True)
class Sheets:
    """A part's tones and bits, in shared memory.

    Attributes:
        tones: (C, N, H, W) 0 to 1, by stream.
        inside: (N, H, W) pixels that light the mirror.
        bits: (C, N, H, W) pixels that are on.
    """

    tones: NDArray[np.float16]
    inside: BoolArray
    bits: BoolArray


def new_sheets(rig: Rig, count: int) -> Sheets:
    """Memory for so many positions."""
    streams, shape = len(rig.streams), (count, rig.size[1], rig.size[0])
    length = count * rig.size[0] * rig.size[1]
    tones = shared_array(streams * length, np.float16).reshape(streams, *shape)
    bits = shared_array(streams * length, np.bool_).reshape(streams, *shape)
    return Sheets(tones, shared_array(length, np.bool_).reshape(shape), bits)


def draw_tones(
    stage: RingStage,
    show: Show,
    part: Part,
    sheets: Sheets,
    workers: int,
    check: Callable[[], None] = lambda: None,
    tones_in: Path | None = None,
    job_sha: str = "",
) -> TurnRecord:
    """Draw positions into a part's sheets.

    Args:
        stage: what turns share.
        show: the frame's scene and viewers.
        part: what to draw.
        sheets: written to.
        workers: processes.
        check: called between positions.
        tones_in: output folder where every position's light is written as EXR; None for nowhere.
        job_sha: written into those.
    """
    record = TurnRecord(part.frame, len(part.positions), show.mesh.count)

    def one(row: int) -> tuple[Counts, float]:
        position, counts = part.positions[row], Counts()
        angle, there = stage.rig.angle(position), tones_in is not None and position in part.on_disk
        sides = range(len(stage.rig.sides))
        if tones_in is not None and there:
            pictures = [read_tones(tones_in, stage, part.number, position, side) for side in sides]
        else:
            pictures = [draw_picture(show, angle, side) for side in sides]
        start = time.perf_counter()
        tones = tones_of(stage.rig, pictures, stage.halftone, stage.shortest)
        sheets.tones[:, row], sheets.inside[row] = tones.values, tones.inside
        for picture in pictures:
            counts.add(picture.counts)
        counts.seconds["tones"] = time.perf_counter() - start
        if tones_in is not None and not there:
            start = time.perf_counter()
            for side, picture in enumerate(pictures):
                path = tones_path(tones_in, part.number, position, side)
                write_tones(path, stage, show, picture, part.frame, position, job_sha)
            counts.seconds["write tones"] = time.perf_counter() - start
        return counts, tones.clipped

    start, clipped = time.perf_counter(), {}
    for row, (counts, share) in shared_out(one, range(len(part.positions)), workers, check):
        record.counts.add(counts)
        clipped[row] = share
    record.clipped = [clipped[row] for row in sorted(clipped)]
    record.seconds["draw"] = time.perf_counter() - start
    return record


def make_bits(
    stage: RingStage, part: Part, sheets: Sheets, workers: int, check: Callable[[], None] = lambda: None
) -> None:
    """Halftone a part's tones; each worker takes a run of positions."""
    spec, step = stage.halftone, np.degrees(stage.rig.step)

    def one(run: tuple[int, int]) -> None:
        rows = slice(*run)
        sequel = Sequel(part.positions[rows], step)
        for tones, bits in zip(sheets.tones, sheets.bits, strict=True):
            bits[rows] = halftone(tones[rows], sheets.inside[rows], spec, sequel)

    count = len(part.positions)
    # An error that is handed on goes through all positions in order.
    cuts = np.linspace(0, count, (1 if spec.angle else min(workers, count)) + 1).astype(int).tolist()
    for _ in shared_out(one, list(pairwise(cuts)), workers, check):
        pass


def write_bits(
    stage: RingStage,
    part: Part,
    sheets: Sheets,
    workers: int,
    folder: Path,
    known: Mapping[str, Mapping[str, object]],
    done: Callable[[str, dict[str, object]], None],
    check: Callable[[], None] = lambda: None,
) -> None:
    """Pack a part's bits and write the pictures.

    Args:
        stage: what turns share.
        part: what was drawn.
        sheets: its bits.
        workers: processes.
        folder: of the packed pictures.
        known: of those that hold some of their pictures already, which; they keep them.
        done: told of each picture that is written.
        check: called between pictures.
    """
    packing = stage.display.packing
    row_of = {position: row for row, position in enumerate(part.positions)}

    def one(which: tuple[int, int]) -> tuple[str, dict[str, object]]:
        stream, image = which
        name = packed_name(number_of(stage, part.number, image), stage.rig.streams[stream])
        drawn, bits = positions_in(stage, image), sheets.bits[stream]
        planes = np.zeros((PLANES, *bits.shape[1:]), dtype=np.bool_)
        before = [int(str(position)) for position in known.get(name, {}).get("positions", [])]  # type: ignore[attr-defined]
        if before:
            planes[:] = unpack(read_packed(folder / name)[None], packing.order, packing.bits)
        for position in drawn:
            if position in row_of:
                planes[position % PLANES] = bits[row_of[position]]
        write_packed(folder / name, pack(planes, packing.order, packing.bits)[0])
        every = sorted({*before, *(p + 1 for p in drawn if p in row_of)})
        return name, {"positions": every, "sha256": file_hash(folder / name)}

    images = sorted({position // PLANES for position in part.positions})
    pictures = [(stream, image) for stream in range(len(stage.rig.streams)) for image in images]
    for _, (name, entry) in shared_out(one, pictures, workers, check):
        done(name, entry)


def images_of(stage: RingStage) -> int:
    """Packed pictures a turn."""
    return -(-stage.rig.positions // PLANES)


def number_of(stage: RingStage, number: int, image: int) -> int:
    """Number of a packed picture, from 1, running through the job: of a frame's number and an image in it."""
    return number * images_of(stage) + image + 1


def positions_in(stage: RingStage, image: int) -> list[int]:
    """Mirror positions in a packed picture, from 0."""
    return [p for p in range(PLANES * image, PLANES * (image + 1)) if p < stage.rig.positions]


def file_hash(path: Path) -> str:
    """Hash of a file, hexadecimal; empty where there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
