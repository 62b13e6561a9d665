"""How the program ends when it is told to: quietly, and with the code that a shell expects.

Only the entry point arms this; a library leaves the signals to the program that uses it. Before a
command runs, and after it, there is nothing to clean up, and a signal ends the program on the spot,
where an exception might be told with a traceback or be lost. While a command runs a signal is an
exception, so that what is half written is removed. A render holds signals back by itself.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)
# In which a second SIGTERM is the first: `timeout` sends one to the process, one to its group.
ECHO_SECONDS = 1.0
_armed: list[int] = []  # signals that this module answers


class Ended(KeyboardInterrupt):
    """A signal has come.

    Attributes:
        exit_code: 128 plus its number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.exit_code = 128 + number


def end_at_once() -> None:
    """From now on a signal ends the program on the spot; signals that are ignored stay so."""
    for number in SIGNALS:
        if number in _armed or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _leave)
            _armed.append(number)


def end_by_error() -> None:
    """From now on a signal is an exception; does nothing where `end_at_once` has not been asked for."""
    came: dict[int, float] = {}

    def raised(number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        echo = number == signal.SIGTERM and now - came.get(number, -ECHO_SECONDS) < ECHO_SECONDS
        came[number] = now
        if not echo:
            raise Ended(number)

    def lost(unraisable: Any) -> None:
        """An exception that Python can only print: in a finalizer, say."""
        if isinstance(unraisable.exc_value, Ended):
            os._exit(unraisable.exc_value.exit_code)
        sys.__unraisablehook__(unraisable)

    for number in set(_armed):
        signal.signal(number, raised)
        sys.unraisablehook = lost


def ended(error: BaseException) -> int:
    """The exit code of a signal that an error comes from, whatever was made of it; 0 when it does not."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, KeyboardInterrupt):
            return int(getattr(seen, "exit_code", 128 + signal.SIGINT))
        seen = seen.__cause__ or seen.__context__
    return 0


def _leave(number: int, frame: FrameType | None) -> None:
    os._exit(128 + number)
