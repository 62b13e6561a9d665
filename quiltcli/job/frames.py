"""Frame ranges (`1-240`, `1-9x2`, `1,5,20-30`), facet lists alike, and frame numbers in file names.

Ends are inclusive, `x` is the step, numbers may be negative, spaces do not matter. A number that is
named twice is an error: in a farm it would be rendered twice by two machines at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from quiltcli.errors import JobError

LIMIT = 1_000_000
_PART = re.compile(r"(-?\d{1,9})(?:-(-?\d{1,9}))?(?:x(\d{1,9}))?")
_COLON = re.compile(r"(?<=\d)\s*:\s*(?=\d)")
_FRAMES = "expected a frame range such as 1-240, 1-9x2 or 1,5,20-30"
_FACETS = "expected facet ids such as 3,7-9"


def parse_frames(text: str, *, colon: bool = False) -> tuple[int, ...]:
    """Frame numbers of a range, ascending.

    Args:
        text: the range.
        colon: whether a colon is a step too, as in Open Job Description: 1-9:2.

    Raises:
        JobError: the text is no range, goes backwards, or names a frame twice.
    """
    return _parse(_COLON.sub("x", text) if colon else text, "frame", _FRAMES)


def parse_facets(text: str) -> tuple[int, ...]:
    """Facet ids of a list such as `3,7-9`, ascending.

    Raises:
        JobError: the text is no list, names a facet twice, or an id below 1.
    """
    ids = _parse(text, "facet", _FACETS)
    if ids[0] < 1:
        raise JobError(f"there is no facet {ids[0]} (facet ids start at 1)")
    return ids


def format_frames(frames: Iterable[int]) -> str:
    """The shortest plain range text that `parse_frames` reads back to the same frames."""
    runs: list[list[int]] = []
    for frame in sorted(frames):
        if runs and _continues(runs[-1], frame):
            runs[-1].append(frame)
        else:
            runs.append([frame])
    return ",".join(map(_format_run, runs))


def frame_text(frame: int) -> str:
    """Frame number as it stands in file names: four digits or more, `0001`, `-0005`, `12345`."""
    return f"{'-' if frame < 0 else ''}{abs(frame):04d}"


def _continues(run: list[int], frame: int) -> bool:
    """Whether a frame is the next one at a run's step; a single frame has no step yet."""
    return len(run) == 1 or frame - run[-1] == run[1] - run[0]


def _format_run(run: list[int]) -> str:
    """One part of a range; a pair that is not adjacent reads better as two numbers."""
    step = run[1] - run[0] if len(run) > 1 else 1
    if len(run) == 1:
        return str(run[0])
    if len(run) == 2 and step > 1:
        return f"{run[0]},{run[1]}"
    return f"{run[0]}-{run[-1]}" + (f"x{step}" if step > 1 else "")


def _parse(text: str, what: str, expected: str) -> tuple[int, ...]:
    """Numbers of a range text, ascending and without repeats."""
    if not text.strip():
        raise JobError(f"the {what} range is empty ({expected})")
    seen: set[int] = set()
    for part in text.split(","):
        numbers = _parse_part(part, text, what, expected)
        twice = seen.intersection(numbers)
        if twice:
            raise JobError(f"{what} {min(twice)} is named twice in {text!r}")
        seen.update(numbers)
        if len(seen) > LIMIT:
            raise JobError(f"{text!r} names more than {LIMIT} {what}s")
    return tuple(sorted(seen))


def _parse_part(part: str, text: str, what: str, expected: str) -> range:
    """Numbers of one part between commas."""
    # Deadline steps with ":", OpenCue interleaves with it: half of the users would get other frames.
    if ":" in part:
        raise JobError(
            f"':' means different things to different farms, in {text!r} (write the step with x: 1-9x2)"
        )
    if re.search(r"\d\s+\d", part):
        raise JobError(f"cannot read {part.strip()!r} in {text!r} (separate numbers by commas)")
    match = _PART.fullmatch("".join(part.split()))
    if match is None:
        raise JobError(f"cannot read {part.strip()!r} in {text!r} ({expected})")
    first = int(match[1])
    last = int(match[2] or first)
    step = int(match[3] or 1)
    if last < first:
        raise JobError(f"{part.strip()!r} goes backwards (write {last}-{first})")
    if step < 1:
        raise JobError(f"the step of {part.strip()!r} is 0 (expected 1 or more)")
    return _limited(range(first, last + 1, step), text, what)


def _limited(numbers: range, text: str, what: str) -> range:
    """The range itself, unless it is too long to be meant."""
    if len(numbers) > LIMIT:
        raise JobError(f"{text!r} names more than {LIMIT} {what}s")
    return numbers
