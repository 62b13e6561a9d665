"""Progress on stderr: a bar on a terminal, one plain line a frame anywhere else."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from quiltcli.render.report import FrameRecord
    from quiltcli.render.sequence import Listener


@dataclass(frozen=True)
class Progress:
    """What a run tells while it works.

    Attributes:
        begin: to be called with the number of frames to come.
        frame_done: to be called when a frame's files are all there.
        say: a line for the user between the frames.
    """

    begin: Callable[[int], None]
    frame_done: Callable[[FrameRecord], None]
    say: Callable[[str], None]


def watched(
    work: Callable[[Listener], list[FrameRecord]], form: str = "auto", *, planned: bool = False
) -> list[FrameRecord]:
    """Do what makes frames, with its progress on stderr; a signal that stops it ends the program.

    What many frames have warned of is said once they are done.

    Args:
        work: does it, and tells a listener.
        form: `auto`, or `openjd` for the lines that Open Job Description reads on stdout.
        planned: whether to say what the run will take of the machine where nobody watches, too.
    """
    from quiltcli.render.interrupt import Stopped
    from quiltcli.render.report import summary_warnings
    from quiltcli.render.sequence import Listener

    with progress() as plain:
        shown = _with_farm_lines(plain) if form == "openjd" else plain
        plan = shown.say if planned or sys.stderr.isatty() else lambda words: None
        try:
            records = work(Listener(shown.begin, shown.frame_done, shown.say, plan))
        except Stopped as stopped:
            shown.say(str(stopped))
            sys.exit(stopped.exit_code)
    for warning in summary_warnings(records):
        sys.stderr.write(f"warning: {warning}\n")
    return records


def _with_farm_lines(shown: Progress) -> Progress:
    """The same, and a share and a status on stdout after every frame."""
    frames = done = 0

    def begin(count: int) -> None:
        nonlocal frames
        frames = count
        shown.begin(count)

    def frame_done(record: FrameRecord) -> None:
        nonlocal done
        done += 1
        shown.frame_done(record)
        sys.stdout.write(f"openjd_progress: {100 * done / max(frames, 1):.1f}\n")
        sys.stdout.write(f"openjd_status: frame {_named(record)}, {done} of {frames}\n")
        sys.stdout.flush()

    return Progress(begin, frame_done, shown.say)


@contextlib.contextmanager
def progress(stream: TextIO | None = None) -> Iterator[Progress]:
    """Show the progress of a run on `stream` (stderr)."""
    stream = stream or sys.stderr
    with (_bar if stream.isatty() else _lines)(stream) as shown:
        yield shown


@contextlib.contextmanager
def _lines(stream: TextIO) -> Iterator[Progress]:
    frames = done = 0

    def begin(count: int) -> None:
        nonlocal frames
        frames = count

    def say(line: str) -> None:
        stream.write(f"{line}\n")
        stream.flush()

    def frame_done(record: FrameRecord) -> None:
        nonlocal done
        done += 1
        say(f"frame {_named(record)} ({done} of {frames}): {frame_line(record)}")

    yield Progress(begin, frame_done, say)


def _named(record: FrameRecord) -> str:
    """Frame, and eye where there are two."""
    return f"{record.frame}, {record.eye} eye" if record.eye else str(record.frame)


@contextlib.contextmanager
def _bar(stream: TextIO) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (TextColumn("rendering"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    last = TextColumn("{task.description}")
    with RichProgress(*columns, last, console=Console(file=stream)) as bar:
        task = bar.add_task("", total=None)

        def begin(count: int) -> None:
            bar.update(task, total=count)

        def frame_done(record: FrameRecord) -> None:
            bar.update(task, advance=1, description=f"frame {_named(record)}: {frame_line(record)}")

        def say(line: str) -> None:
            bar.console.print(line, markup=False, highlight=False)

        yield Progress(begin, frame_done, say)


def frame_line(record: FrameRecord) -> str:
    """A frame in a few words."""
    seconds = record.total_seconds
    words = f"{seconds:.2f} s, {record.lit_facets:,} lit facets, {record.visible_pixels:,} pixels"
    if record.warnings:
        words += f", {len(record.warnings)} warning" + ("s" if len(record.warnings) > 1 else "")
    return words
