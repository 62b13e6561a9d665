"""What happened in each frame: the record, `report.json`, and the summary table."""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quiltcli.formats.whole import sync_folder, write_text

if TYPE_CHECKING:
    from rich.table import Table

_FORMAT = 1


class Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time the block takes to the stage's."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class FrameRecord:
    """Counts, times and warnings of one frame; the figures are those the method's paper reports.

    Attributes:
        frame: frame number.
        triangles: scene triangles that went into binning.
        reaching: those of them that reach a facet.
        pairs: (triangle, facet) pairs after binning.
        settled: triangles that the first pass of binning settled.
        lit_facets: facets whose lit side faces the eye.
        visible_pixels: quilt pixels inside facets that show the scene.
        fill: share of the quilt's pixels that lie inside facets, 0 to 1.
        seconds: wall time by stage, in the order of the stages: `load` what all frames share, in the
            first; those of drawing; `write`, while the next frame is drawn; `wait`, what drawing waited
            for that.
        wall_seconds: from the end of the frame before to the end of this one: the frames' sum is the run's.
        write_seconds: time in the writer's threads, all together, by what they did.
        warnings: sentences for the user.
        eye: `left` or `right`, empty where there is one eye.
        binned: whether the method sorts triangles to the display's facets; otherwise the figures of that
            mean nothing.
        corrections: what making up for the panels asked of them, `corrections.Headroom` as JSON; None
            where nothing was corrected.
    """

    frame: int
    triangles: int
    reaching: int
    pairs: int
    settled: int
    lit_facets: int
    visible_pixels: int
    fill: float
    seconds: Mapping[str, float] = field(default_factory=dict)
    wall_seconds: float = 0.0
    write_seconds: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    eye: str = ""
    binned: bool = True
    corrections: Mapping[str, Any] | None = None

    @property
    def settled_share(self) -> float:
        """Share of the triangles reaching a facet that the first pass settled, 0 to 1 (1 if none does)."""
        return self.settled / self.reaching if self.reaching else 1.0

    @property
    def replication(self) -> float:
        """Pairs per triangle that reaches a facet (0 if none does)."""
        return self.pairs / self.reaching if self.reaching else 0.0

    @property
    def total_seconds(self) -> float:
        """Wall time of the frame; of all its stages where nobody has looked at the clock."""
        return self.wall_seconds or sum(self.seconds.values())

    def after(self, stage: str, seconds: float) -> FrameRecord:
        """The record with a stage before all others, if it took any time."""
        return replace(self, seconds={stage: seconds, **self.seconds}) if seconds else self

    def written(self, write: Callable[[], Mapping[str, float]]) -> FrameRecord:
        """Do `write`, which tells seconds by what it did; the record with the time it took."""
        start = time.perf_counter()
        parts = write()
        seconds = {**self.seconds, "write": time.perf_counter() - start}
        return replace(self, seconds=seconds, write_seconds=parts)

    def done(self, waited: float, wall: float) -> FrameRecord:
        """The record of a frame whose files are all there, drawing having waited for them."""
        return replace(self, seconds={**self.seconds, "wait": waited}, wall_seconds=wall)

    def as_json(self) -> dict[str, Any]:
        """The record as `report.json` holds it."""
        entry = asdict(self)
        warnings = entry.pop("warnings")
        times = {name: entry.pop(name) for name in ("wall_seconds", "seconds", "write_seconds")}
        eye = {"eye": eye} if (eye := entry.pop("eye")) else {}
        binned = {"binned": entry.pop("binned")}
        corrections = entry.pop("corrections")
        told = {} if corrections is None else {"corrections": corrections}
        shares = {"settled_share": self.settled_share, "replication": self.replication}
        return (
            {"frame": entry.pop("frame")}
            | eye
            | entry
            | binned
            | shares
            | times
            | told
            | {"warnings": list(warnings)}
        )


def together(records: Sequence[FrameRecord]) -> FrameRecord:
    """One record of parts of a frame that were drawn one after the other, each on facets of its own."""
    first, *others = records
    for record in others:
        counts = ("reaching", "pairs", "settled", "lit_facets", "visible_pixels")
        first = replace(
            first,
            **{name: getattr(first, name) + getattr(record, name) for name in counts},
            triangles=max(first.triangles, record.triangles),
            seconds=_summed((first.seconds, record.seconds)),
            warnings=tuple(dict.fromkeys((*first.warnings, *record.warnings))),
        )
    return first


def write_report(path: Path, job_sha: str, version: str, records: Iterable[FrameRecord]) -> None:
    """Write `report.json`, whole or not at all, with one entry a frame and eye, sorted by them.

    Frames of the same job that the file already holds are kept, those rendered again are replaced:
    a sequence rendered in pieces ends with the same report as one rendered in one go, times apart.
    A report of another job is replaced. Raises OutputError.
    """
    with _alone_in(path.parent):
        frames = {_key(entry): entry for entry in _known_frames(path, job_sha)}
        frames |= {_key(entry): entry for entry in (record.as_json() for record in records)}
        report = {
            "quilt_report": _FORMAT,
            "version": version,
            "job": job_sha,
            "frames": [frames[key] for key in sorted(frames)],
        }
        write_text(path, json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
        sync_folder(path.parent)


def _key(entry: Mapping[str, Any]) -> tuple[int, str]:
    """What tells the entry from all others: frame and eye."""
    return entry["frame"], str(entry.get("eye", ""))


def known_views(path: Path, job_sha: str) -> set[tuple[int, str]]:
    """Frame and eye of all that an existing report of the same job has an entry of."""
    return {_key(entry) for entry in _known_frames(path, job_sha)}


def _known_frames(path: Path, job_sha: str) -> list[dict[str, Any]]:
    """Entries of an existing report of the same job; none if there is no such thing."""
    try:
        report = json.loads(path.read_bytes())
        same_job = report["quilt_report"] == _FORMAT and report["job"] == job_sha
        return [entry for entry in report["frames"] if isinstance(entry["frame"], int)] if same_job else []
    except (OSError, ValueError, TypeError, KeyError):
        return []


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Wait for other processes that update a report in `folder`.

    The lock is on the folder itself, so nothing is left behind that could block a later run. Where
    the file system has no locks the update goes ahead without.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        yield  # writing will say what is wrong with the folder
        return
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def summary(records: Sequence[FrameRecord]) -> list[tuple[str, str]]:
    """Lines (label, value) of the summary of a run; several frames are summed or given as a range."""
    if not records:
        return [("frames", "0")]
    lines = [("frames", _frames_text(records))]
    total = sum(record.total_seconds for record in records)
    lines.append(("time", f"{total:.2f} s, {total / len(records):.2f} s a frame"))
    words = {"write": " meanwhile", "wait": " for what is written"}
    for stage, seconds in _summed(record.seconds for record in records).items():
        lines.append((f"  {stage}", f"{seconds:.2f} s{words.get(stage, '')}"))
    lines.append(("triangles", _range_text([record.triangles for record in records], "{:,}")))
    if binned := [record for record in records if record.binned and record.reaching]:
        settled = [100 * record.settled_share for record in binned]
        lines.append(("settled in pass 1", _range_text(settled, "{:.1f} %")))
        lines.append(("replication", _range_text([record.replication for record in binned], "{:.3f}")))
    lines.append(("lit facets", _range_text([record.lit_facets for record in records], "{:,}")))
    lines.append(("pixels that show it", _range_text([record.visible_pixels for record in records], "{:,}")))
    lines.append(("fill", _range_text([100 * record.fill for record in records], "{:.1f} %")))
    lines += _headroom([record.corrections for record in records if record.corrections])
    return lines


def _headroom(found: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """What corrections asked of the panels, in two lines; nothing where nothing was corrected."""
    shares = [100 * one["over"] / one["pixels"] for one in found if one["pixels"]]
    if not shares:
        return []
    most = max(one["brightest"] for one in found)
    fits = min(one["fits"] for one in found if one["fits"] is not None)
    lines = [
        ("light wanted", f"up to {most:.3g} times what the panels can give (room for it: level {fits:g})"),
        ("pixels beyond that", _range_text(shares, "{:.2f} %")),
    ]
    return lines[:1] if most <= 1 else lines


def summary_warnings(records: Sequence[FrameRecord]) -> list[str]:
    """Each warning once, in the order it came, with the number of frames it was given in."""
    times = Counter(warning for record in records for warning in record.warnings)
    return [
        warning if count == len(records) == 1 else f"{warning} ({count} of {len(records)} frames)"
        for warning, count in times.items()
    ]


def summary_table(records: Sequence[FrameRecord]) -> Table:
    """The summary as a rich table."""
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table(box=SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for line in summary(records):
        table.add_row(*line)
    return table


def _frames_text(records: Sequence[FrameRecord]) -> str:
    numbers = [record.frame for record in records]
    frames, eyes = len(set(numbers)), ", two eyes" * any(record.eye for record in records)
    which = f"{min(numbers)} to {max(numbers)}" if frames > 1 else str(numbers[0])
    return f"{frames} ({which}{eyes})"


def _summed(times: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Seconds by stage, of all frames together, in the order the stages come."""
    total: dict[str, float] = {}
    for seconds in times:
        for stage, each in seconds.items():
            total[stage] = total.get(stage, 0.0) + each
    return total


PROFILE_COLUMNS = ("stage", "seconds", "share", "a frame")


def profile_rows(records: Sequence[FrameRecord]) -> list[tuple[str, ...]]:
    """Where the time of a run went, in `PROFILE_COLUMNS`.

    First the stages that follow one another and add up to the run; then the writer, who works while
    the next frame is drawn; then what its threads did, in seconds of all of them.
    """
    stages = _summed(record.seconds for record in records)
    wall = sum(record.total_seconds for record in records)
    writing = stages.pop("write", 0.0)
    parts = _summed(record.write_seconds for record in records)
    stages["other"] = max(wall - sum(stages.values()), 0.0)
    rows = [(name, seconds, wall) for name, seconds in stages.items()]
    rows += [("run", wall, wall), ("write, meanwhile", writing, wall)]
    rows += [(f"  {name}", seconds, sum(parts.values())) for name, seconds in parts.items()]
    return [
        (
            name,
            f"{seconds:.3f}",
            f"{100 * seconds / whole if whole else 0:.1f} %",
            f"{seconds / len(records):.4f}",
        )
        for name, seconds, whole in rows
    ]


def _range_text(values: Sequence[float], form: str) -> str:
    low, high = form.format(min(values)), form.format(max(values))
    return low if low == high else f"{low} to {high}"
