"""Before a process is forked: the threads of libraries must sleep.

A fork has all memory of its process, locks as well, but only the thread that forked it: a lock that another
thread held just then is held for ever. Libraries whose threads sleep hold none. TBB, on which Embree
builds, puts its threads to sleep under such a lock a moment after the work is done.
"""

from __future__ import annotations

import threading
import time
from pathlib import Path

_PATIENCE = 1.0  # seconds
_TASKS = Path("/proc/self/task")


def wait_for_sleep() -> None:
    """Come back when all other threads of this process sleep, or when they do not want to.

    Where the system does not tell, after the time in which threads that have nothing to do fall asleep.
    """
    until = time.monotonic() + _PATIENCE
    try:
        while _is_busy() and time.monotonic() < until:
            time.sleep(0.001)
    except OSError:
        time.sleep(0.005)


def _is_busy() -> bool:
    me = str(threading.get_native_id())
    return any(_runs(task) for task in _TASKS.iterdir() if task.name != me)


def _runs(task: Path) -> bool:
    try:
        # After the name, which is in brackets and may hold anything, comes the state.
        return (task / "stat").read_text(errors="replace").rpartition(")")[2].split()[0] != "S"
    except FileNotFoundError:  # it has ended
        return False
