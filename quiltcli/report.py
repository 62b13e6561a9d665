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

from quiltcli.wholefile import write_text

if TYPE_CHECKING:
    from rich.table import Table

_FORMAT = 1


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
        seconds: wall time by stage, in the order of the stages.
        warnings: sentences for the user.
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
    warnings: tuple[str, ...] = ()

    @property
    def settled_share(self) -> float:
        """Share of the triangles reaching a facet that the first pass settled, 0 to 1 (1 if none does)."""
        return self.settled / self.reaching if self.reaching else 1.0

    @property
    def replication(self) -> float:
        """Pairs per triangle that reaches a facet (0 if none does)."""
        return self.pairs / self.reaching if self.reaching else 0.0

    def timed(self, stage: str, work: Callable[[], object]) -> FrameRecord:
        """Do `work`; the record with the time it took under `stage`."""
        start = time.perf_counter()
        work()
        return replace(self, seconds={**self.seconds, stage: time.perf_counter() - start})

    def as_json(self) -> dict[str, Any]:
        """The record as `report.json` holds it."""
        entry = asdict(self)
        seconds, warnings = entry.pop("seconds"), entry.pop("warnings")
        shares = {"settled_share": self.settled_share, "replication": self.replication}
        return entry | shares | {"seconds": dict(seconds), "warnings": list(warnings)}


def write_report(path: Path, job_sha: str, version: str, records: Iterable[FrameRecord]) -> None:
    """Write `report.json`, whole or not at all, with one entry a frame, sorted by frame.

    Frames of the same job that the file already holds are kept, those rendered again are replaced:
    a sequence rendered in pieces ends with the same report as one rendered in one go, times apart.
    A report of another job is replaced. Raises OutputError.
    """
    with _alone_in(path.parent):
        frames = {entry["frame"]: entry for entry in _known_frames(path, job_sha)}
        frames |= {record.frame: record.as_json() for record in records}
        report = {
            "quilt_report": _FORMAT,
            "version": version,
            "job": job_sha,
            "frames": [frames[frame] for frame in sorted(frames)],
        }
        write_text(path, json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


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
    total = sum(_stage_seconds(records).values())
    lines.append(("time", f"{total:.2f} s, {total / len(records):.2f} s a frame"))
    lines += [(f"  {stage}", f"{seconds:.2f} s") for stage, seconds in _stage_seconds(records).items()]
    lines.append(("triangles", _range_text([record.triangles for record in records], "{:,}")))
    lines.append(
        ("settled in pass 1", _range_text([100 * record.settled_share for record in records], "{:.1f} %"))
    )
    lines.append(("replication", _range_text([record.replication for record in records], "{:.3f}")))
    lines.append(("lit facets", _range_text([record.lit_facets for record in records], "{:,}")))
    lines.append(("pixels that show it", _range_text([record.visible_pixels for record in records], "{:,}")))
    lines.append(("fill", _range_text([100 * record.fill for record in records], "{:.1f} %")))
    return lines


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
    return f"{len(numbers)} ({min(numbers)} to {max(numbers)})" if len(numbers) > 1 else f"1 ({numbers[0]})"


def _stage_seconds(records: Sequence[FrameRecord]) -> dict[str, float]:
    total: dict[str, float] = {}
    for record in records:
        for stage, seconds in record.seconds.items():
            total[stage] = total.get(stage, 0.0) + seconds
    return total


def _range_text(values: Sequence[float], form: str) -> str:
    low, high = form.format(min(values)), form.format(max(values))
    return low if low == high else f"{low} to {high}"
