"""A recorded head, ready to be asked where it is: read, placed, cleaned and filtered once."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

from quiltcli.errors import ViewerError
from quiltcli.formats.noted import round_of_notes
from quiltcli.geometry import FloatArray
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.clean import Cleaned, Run, clean
from quiltcli.viewer.recorded.filters import filtered
from quiltcli.viewer.recorded.formats import read_recording
from quiltcli.viewer.recorded.placing import place
from quiltcli.viewer.recorded.resample import pose_at
from quiltcli.viewer.recorded.take import Take, settle

# Files give stamps to six decimals.
_STAMP = 2e-6


@dataclass(frozen=True)
class Head:
    """A take as a path.

    Attributes:
        take: every sample, of the eye in the world.
        cleaned: its runs of good samples.
        runs: the same, filtered.
    """

    take: Take
    cleaned: Cleaned
    runs: tuple[Run, ...]

    @cached_property
    def starts(self) -> list[float]:
        """Seconds at which the runs begin."""
        return [float(run.times[0]) for run in self.runs]

    @property
    def seconds(self) -> tuple[float, float]:
        """First and last second that it holds."""
        return self.starts[0], float(self.runs[-1].times[-1])


def read_head(spec: RecordedSpec) -> Head:
    """The head of a take; a file that has not changed is read once.

    Raises:
        QuiltError: the file cannot be read, or is not what the job says it is.
    """
    stat = spec.file.stat() if spec.file.is_file() else None
    return _read(spec, stat.st_mtime_ns if stat else 0, stat.st_size if stat else 0, round_of_notes())


@lru_cache(maxsize=8)
def _read(spec: RecordedSpec, changed: int, size: int, notes: int) -> Head:
    take = place(settle(read_recording(spec), spec), spec)
    cleaned = clean(take, spec.gaps)
    runs = tuple(filtered(run, spec.filter, cleaned.step, straight=take.is_curve) for run in cleaned.runs)
    return Head(take, cleaned, runs)


def take_notices(spec: RecordedSpec) -> Iterator[str]:
    """What should be known of a take by who renders with it; `quilt path` says all there is."""
    head = read_head(spec)
    for notice in head.take.notices:
        yield f"{spec.file}: {notice}"
    spikes, turns = head.cleaned.spikes, head.cleaned.turns
    if spikes.size:
        count = f"{spikes.size} samples" if spikes.size > 1 else "1 sample"
        words = f"left out, the first at second {spikes[0]:.3f}: away from all others and back at once"
        yield f"{spec.file}: {count} {words}"
    if turns.size:
        words = f"the head turns faster than any at second {turns[0]:.3f}, and stays so (a marker mistaken?)"
        yield f"{spec.file}: {words}"


def pose_of(
    head: Head, spec: RecordedSpec, seconds: float, fps: float
) -> tuple[FloatArray, FloatArray | None]:
    """Place (3,) and rotation (4,) or None at a second of the take.

    Raises:
        ViewerError: nothing was recorded then, and nothing may be made up.
    """
    straight = head.take.is_curve
    k = max(bisect_right(head.starts, seconds + _STAMP) - 1, 0)
    run = head.runs[k]
    if straight or run.times[0] - _STAMP <= seconds <= run.times[-1] + _STAMP:
        return pose_at(run, seconds, straight=straight)
    first, last = head.seconds
    if not first <= seconds <= last:
        words = (
            f"{spec.file} holds seconds {first:.3f} to {last:.3f}, frames {frame_of(spec, first, fps):.6g}"
            f" to {frame_of(spec, last, fps):.6g}, and nothing is extrapolated"
            " (render those, or set start or start_frame)"
        )
        raise ViewerError(spec.source.problem((), words))
    gap = head.cleaned.gaps[k]
    if gap.is_jump or spec.gaps.then == "hold":
        return pose_at(run, float(run.times[-1]))
    words = (
        f"{spec.file} has no good sample from second {gap.first:.3f} to {gap.last:.3f}, {gap.seconds:.3f} s"
        f" (at most {spec.gaps.fill:g} s are filled: raise gaps.fill, or set gaps.then: hold)"
    )
    raise ViewerError(spec.source.problem("gaps", words))


def frame_of(spec: RecordedSpec, seconds: float, fps: float) -> float:
    """The frame that shows a second of the take."""
    return spec.start_frame + (seconds - spec.start) * fps
