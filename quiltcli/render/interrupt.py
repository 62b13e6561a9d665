"""Ctrl-C and SIGTERM: finish the frame that is under way, then stop."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


class Stopped(Exception):  # noqa: N818 — no error: the user asked for it
    """Raised between two frames after a signal.

    Attributes:
        exit_code: 128 plus the signal's number, as a shell would report it.
    """

    def __init__(self, number: int) -> None:
        super().__init__(f"stopped by {signal.Signals(number).name} after a whole frame")
        self.exit_code = 128 + number


class StopRequest:
    """Whether a signal has asked the run to stop."""

    def __init__(self) -> None:
        self.number = 0

    def check(self) -> None:
        """Raise `Stopped` if a signal has come."""
        if self.number:
            raise Stopped(self.number)


@contextmanager
def stop_between_frames() -> Iterator[StopRequest]:
    """Hold the first Ctrl-C or SIGTERM back until `check`; a second one interrupts at once."""
    request = StopRequest()

    def note(number: int, frame: FrameType | None) -> None:
        if request.number:
            raise Stopped(number)
        request.number = number

    if threading.current_thread() is not threading.main_thread():
        yield request  # signals reach only the main thread
        return
    before: dict[int, Any] = {}
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, note)
        yield request
    finally:
        for restored, handler in before.items():
            signal.signal(restored, handler)
