"""The walk from a job with a ring of viewers to its files.

A packed picture is complete when the report says that all its positions were drawn by the same job, and its
hash is the one that stands there; a run that is taken up again draws the positions of the others.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import CheckFailedError, JobError, OutputError, Problem, raise_all
from quiltcli.formats.bitplanes import packed_name
from quiltcli.formats.noted import noting_inputs
from quiltcli.formats.temporary import remove_leftovers
from quiltcli.formats.whole import make_folder
from quiltcli.images.metadata import is_complete
from quiltcli.job import JobFile, job_sha256
from quiltcli.render.interrupt import stop_between_frames
from quiltcli.render.ring.outputs import read_report, tones_path, viewers_json, write_report, write_settings
from quiltcli.render.ring.setup import RingStage, notices, set_ring_stage
from quiltcli.render.ring.turn import (
    Part,
    TurnRecord,
    draw_tones,
    file_hash,
    images_of,
    make_bits,
    new_sheets,
    number_of,
    positions_in,
    write_bits,
)
from quiltcli.ring.curve import Curve, User
from quiltcli.ring.elevation import plane_error
from quiltcli.ring.picture import Show
from quiltcli.ring.seen import slices_seen


@dataclass(frozen=True)
class RingOptions:
    """What the command line says beside the job.

    Attributes:
        frames: frames to render instead of the job's.
        folder: output folder instead of the job's.
        positions: numbers of mirror positions from 1, instead of all.
        resume: keep packed pictures that are complete and of the same job.
        overwrite: replace files that exist.
        workers: processes; 0 takes every core.
        dry_run: find every problem, write nothing.
        strict: take what is only worth a second look for a problem.
    """

    frames: Sequence[int] | None = None
    folder: Path | None = None
    positions: Sequence[int] | None = None
    resume: bool = False
    overwrite: bool = False
    workers: int = 0
    dry_run: bool = False
    strict: bool = False


def render_turns(
    job: JobFile, options: RingOptions | None = None, say: Callable[[str], None] = lambda words: None
) -> list[TurnRecord]:
    """Render turns of a job: packed pictures, on request the light of all positions, a report.

    Args:
        job: the job.
        options: what the command line says beside it.
        say: told of notices, and of every finished frame.

    Returns:
        The records of the frames that were drawn.

    Raises:
        QuiltError: bad input, found before anything is written.
        CheckFailedError: a file cannot be written.
        Stopped: a signal came; what was written is whole and reported.
    """
    options = options or RingOptions()
    frames = list(job.frames if options.frames is None else options.frames)
    _known_frames(job, frames)
    with noting_inputs():
        stage = set_ring_stage(job, frames)
        sha = job_sha256(job)
    positions = _chosen(stage, options.positions)
    folder = options.folder or job.output.directory
    report = read_report(folder, sha)
    parts = [_part(stage, folder, frame, positions, report, sha, options) for frame in frames]
    worth_a_word = [*stage.scene.notices, *notices(stage)]
    if options.strict and worth_a_word:
        raise JobError([*map(Problem, worth_a_word), Problem("--strict does not allow what is said above")])
    for words in worth_a_word:
        say(f"note: {words}")
    if options.dry_run:
        return []
    try:
        make_folder(folder)
        remove_leftovers([folder, folder / "packed", folder / "tones"])
        if any(part.positions for part in parts):
            write_settings(stage, folder)
        return _render(stage, folder, [part for part in parts if part.positions], report, sha, options, say)
    except OutputError as error:
        raise CheckFailedError(error.problems) from error


def _render(
    stage: RingStage,
    folder: Path,
    parts: Sequence[Part],
    report: dict[int, dict[str, Any]],
    sha: str,
    options: RingOptions,
    say: Callable[[str], None],
) -> list[TurnRecord]:
    workers, output = options.workers or os.cpu_count() or 1, stage.job.output
    for name, wanted in (("packed", output.packed), ("tones", output.tones)):
        if wanted:
            make_folder(folder / name)
    records = []
    with stop_between_frames(" between two mirror positions") as request:
        for count, part in enumerate(parts, start=1):
            start = time.perf_counter()
            show = stage.show(part.frame)
            known: Mapping[str, Any] = report.get(part.frame, {}).get("packed", {})
            sheets = new_sheets(stage.rig, len(part.positions))
            tones_in = folder if output.tones else None
            record = draw_tones(stage, show, part, sheets, workers, request.check, tones_in, sha)
            record.packed.update(known)
            if output.packed:
                _bits(stage, part, sheets, workers, folder, record, request.check, known, report, sha)
            record.seconds["turn"] = time.perf_counter() - start
            report[part.frame] = _entry(stage, show, record)
            write_report(folder, stage, sha, report)
            records.append(record)
            say(f"frame {part.frame} ({count} of {len(parts)}): {_line(record)}")
    return records


def _bits(
    stage: RingStage,
    part: Part,
    sheets: Any,
    workers: int,
    folder: Path,
    record: TurnRecord,
    check: Callable[[], None],
    known: Mapping[str, Any],
    report: dict[int, dict[str, Any]],
    sha: str,
) -> None:
    """Halftone, pack and write; the report knows every picture as soon as it is there."""
    start = time.perf_counter()
    make_bits(stage, part, sheets, workers, check)
    inside = np.maximum(np.count_nonzero(sheets.inside, axis=(1, 2)), 1)
    record.lit = (np.count_nonzero(sheets.bits, axis=(2, 3)).mean(axis=0) / inside).tolist()
    record.seconds["halftone"] = time.perf_counter() - start
    start = time.perf_counter()

    def done(name: str, entry: dict[str, object]) -> None:
        record.packed[name] = entry
        so_far = {**report.get(part.frame, {"frame": part.frame}), "packed": dict(record.packed)}
        write_report(folder, stage, sha, {**report, part.frame: so_far})

    write_bits(stage, part, sheets, workers, folder / "packed", known, done, check)
    record.packed = dict(sorted(record.packed.items()))
    record.seconds["pack and write"] = time.perf_counter() - start


def _entry(stage: RingStage, show: Show, record: TurnRecord) -> dict[str, Any]:
    """A frame as the report holds it."""
    counts = record.counts
    curve = show.curve
    viewers: list[Curve | User] = [curve, *curve.users]
    return {
        "frame": record.frame,
        "positions": record.positions,
        "triangles": record.triangles,
        "candidates": counts.candidates,
        "fragments": counts.fragments,
        "visible_pixels": counts.visible,
        "clipped_share": float(np.mean(record.clipped)),
        "lit_share": _spread(record.lit),
        "bend_pixels": counts.bend,
        "slices": [
            {"distance": distance, "images": slices_seen(stage.rig, distance)}
            for distance in (curve.distance, *(user.distance for user in curve.users))
        ],
        "plane_error": [
            {"height": each.height, "distance": each.distance, "pixels": _off(stage, each)}
            for each in viewers
        ],
        "viewers": viewers_json(curve),
        "seconds": record.seconds,
        "worker_seconds": counts.seconds,
        "packed": record.packed,
    }


def _off(stage: RingStage, viewer: Curve | User) -> float:
    """By how much planes are off for a viewer; cones are not."""
    return 0.0 if stage.rig.cone else plane_error(stage.rig, viewer.distance, viewer.height)


def _spread(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"least": min(values), "mean": float(np.mean(values)), "most": max(values)}


def _line(record: TurnRecord) -> str:
    lit = f", {100 * float(np.mean(record.lit)):.1f} % lit" if record.lit else ""
    clipped = float(np.mean(record.clipped))
    cut = f", {100 * clipped:.1f} % brighter than white" if clipped > 0.0005 else ""
    drawn = f"{record.positions} mirror positions, {record.counts.visible:,} pixels"
    return f"{drawn}{lit}{cut}, {record.seconds['turn']:.1f} s"


def _known_frames(job: JobFile, frames: Sequence[int]) -> None:
    """Packed pictures are numbered by the job's frames: no others have a number."""
    others = [frame for frame in frames if frame not in job.frames]
    if others:
        raise JobError(
            job.source.problem(("frames",), f"does not hold frame {others[0]}, which is asked for")
        )


def _chosen(stage: RingStage, positions: Sequence[int] | None) -> list[int]:
    """Positions from 0."""
    if positions is None:
        return list(stage.positions)
    if stage.halftone.angle and len(set(positions)) < stage.rig.positions:
        raise JobError("--positions: with halftone.angle a picture needs all that come before it in the turn")
    for number in positions:
        if not 1 <= number <= stage.rig.positions:
            most = stage.rig.positions
            raise JobError(f"--positions: there is no mirror position {number} (there are 1 to {most})")
    return sorted({number - 1 for number in positions})


def _part(
    stage: RingStage,
    folder: Path,
    frame: int,
    positions: Sequence[int],
    report: Mapping[int, Mapping[str, Any]],
    sha: str,
    options: RingOptions,
) -> Part:
    """What of a frame is to be drawn (OutputError: files are in the way)."""
    number, output = stage.job.frames.index(frame), stage.job.output
    known = report.get(frame, {}).get("packed", {})
    wanted = set(positions)
    problems, finished = [], set()
    unfinished: set[int] = set()
    for stream, image in product(stage.rig.streams, range(images_of(stage))):
        path = folder / "packed" / packed_name(number_of(stage, number, image), stream)
        inside = [position for position in positions_in(stage, image) if position in wanted]
        if not inside or not output.packed:
            continue
        entry = known.get(path.name, {})
        sound = bool(entry) and entry.get("sha256") == file_hash(path)
        have = {int(position) - 1 for position in entry.get("positions", ())} if sound else set()
        if isinstance(known, dict) and not sound:
            known.pop(path.name, None)
        finished |= have & set(inside)
        unfinished |= set(inside) - have
        # A picture that has other positions only is added to.
        if (
            path.exists()
            and not options.resume
            and not options.overwrite
            and (not sound or have & set(inside))
        ):
            problems.append(path)
    finished -= unfinished
    on_disk = set()
    for position in positions if output.tones else ():
        paths = [tones_path(folder, number, position, side) for side in range(len(stage.rig.sides))]
        if options.resume and all(is_complete(path, sha, frame) for path in paths):
            on_disk.add(position)
        else:
            finished.discard(position)
        if not options.resume and not options.overwrite:
            problems += [path for path in paths if path.exists()]
    if not output.packed:
        finished |= on_disk
    if problems:
        more = f" and {len(problems) - 1} more" if len(problems) > 1 else ""
        words = f"exists already{more} (use --resume to keep finished pictures, --overwrite to replace them)"
        raise_all(OutputError, [Problem(words, file=str(problems[0]))])
    if stage.halftone.angle and finished < wanted:
        finished = set()
    kept = [position for position in positions if not (options.resume and position in finished)]
    return Part(frame, number, kept, frozenset(on_disk))
