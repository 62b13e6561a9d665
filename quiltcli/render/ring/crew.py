"""Forked processes that share work on a turn; what they write lies in memory they share.

Each is told one piece of work at a time over a line of its own, and ends when its line does: also where
the process that forked it was killed.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

from quiltcli.ending import SIGNALS
from quiltcli.errors import CheckFailedError, Problem, QuiltError
from quiltcli.formats.exr.image import use_threads
from quiltcli.render.forking import wait_for_sleep
from quiltcli.render.workers import can_fork


@dataclass(frozen=True)
class _Fault:
    error: QuiltError | None
    text: str


def shared_out(
    work: Callable[[Any], Any], items: Sequence[Any], workers: int, check: Callable[[], None] = lambda: None
) -> Iterator[tuple[Any, Any]]:
    """Do `work` on all items; give each with what came of it, in the order in which they are done.

    Args:
        work: a function; what it changes must be memory that processes share.
        items: what to do it on.
        workers: processes; with one, or where none can be forked, this one does it all.
        check: called between pieces; what it raises ends the work.

    Raises:
        CheckFailedError: a worker ended.
        QuiltError: as `work` raised it.
    """
    if workers <= 1 or len(items) <= 1 or not can_fork():
        for item in items:
            check()
            yield item, work(item)
        return
    use_threads(0)  # a process that is forked beside OpenEXR's threads waits for them for ever
    context = multiprocessing.get_context("fork")
    lines: list[Any] = []
    crew: list[Any] = []
    try:
        for _ in range(min(workers, len(items))):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(work, theirs, [*lines, ours]), daemon=True)
            wait_for_sleep()
            process.start()
            theirs.close()
            lines.append(ours)
            crew.append(process)
        yield from _told(iter(items), lines, crew, check)
    finally:
        for line in lines:
            line.close()
        for process in crew:
            process.join()


def _told(
    items: Iterator[Any], lines: Sequence[Any], crew: Sequence[Any], check: Callable[[], None]
) -> Iterator[tuple[Any, Any]]:
    doing: dict[Any, Any] = {}
    for line in lines:
        _give(line, items, doing)
    while doing:
        check()
        ready: list[Any] = list(wait(list(doing), timeout=1.0))
        for line in ready:
            try:
                answer = line.recv()
            except (EOFError, OSError):
                raise _died(crew[lines.index(line)]) from None
            if isinstance(answer, _Fault):
                if answer.error is not None:
                    raise answer.error
                words = f"a worker failed:\n{answer.text}"
                raise RuntimeError(words)  # noqa: TRY004 — the type is right; it is the news that is bad
            item = doing.pop(line)
            _give(line, items, doing)
            yield item, answer


def _give(line: Any, items: Iterator[Any], doing: dict[Any, Any]) -> None:
    for item in items:
        with suppress(OSError):  # who has died is noticed when nothing comes back
            line.send(item)
        doing[line] = item
        return


def _died(process: Any) -> CheckFailedError:
    process.join(1)
    code = process.exitcode
    how = f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with code {code}"
    return CheckFailedError(Problem(f"a worker process {how}"))


def _serve(work: Callable[[Any], Any], line: Any, others: Iterable[Any]) -> None:
    """What a worker does until its line ends."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # the process that forked it is told too, and ends the line
    for other in others:
        other.close()
    answer: Any
    while True:
        try:
            item = line.recv()
        except (EOFError, OSError):
            os._exit(0)
        try:
            answer = work(item)
        except QuiltError as error:
            answer = _Fault(error, "")
        except Exception:
            answer = _Fault(None, traceback.format_exc())
        try:
            line.send(answer)
        except OSError:
            os._exit(0)
