"""Ctrl-C and SIGTERM: finish the frame that is under way, then stop."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from quiltcli.ending import ECHO_SECONDS, SIGNALS


class Stopped(Exception):  # noqa: N818 — no error: the user asked for it
    """Raised between two frames after a signal, or at once after a second one.

    Attributes:
        exit_code: 128 plus the signal's number, as a shell would report it.
    """

    def __init__(self, number: int, when: str = "") -> None:
        super().__init__(f"stopped by {signal.Signals(number).name}{when}")
        self.exit_code = 128 + number


class StopRequest:
    """Whether a signal has asked the run to stop."""

    def __init__(self, when: str) -> None:
        self.number = 0
        self._when = when

    def check(self) -> None:
        """Raise `Stopped` if a signal has come."""
        if self.number:
            raise Stopped(self.number, self._when)


@contextmanager
def stop_between_frames(when: str = " after a whole frame") -> Iterator[StopRequest]:
    """Hold the first Ctrl-C or SIGTERM back until `check`; a second one interrupts at once.

    A second SIGTERM within a second is the first one's echo. `when` is said of the end.
    """
    request = StopRequest(when)
    came = 0.0

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal came
        echo = request.number == number == signal.SIGTERM and time.monotonic() - came < ECHO_SECONDS
        if request.number and not echo:
            raise Stopped(number)
        request.number, came = number, time.monotonic()

    if threading.current_thread() is not threading.main_thread():
        yield request  # signals reach only the main thread
        return
    before: dict[int, Any] = {}
    try:
        for number in SIGNALS:
            before[number] = signal.signal(number, note)
        yield request
    finally:
        for restored, handler in before.items():
            signal.signal(restored, handler)
