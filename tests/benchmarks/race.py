"""Timing several ways to do one thing side by side.

All are timed in turn, round after round, so that whatever else the machine does falls on all of them;
what is reported are medians, and ratios are taken inside a round before their median is taken.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

import numpy as np

Contestants: TypeAlias = Mapping[str, Callable[[], object]]
Times: TypeAlias = dict[str, dict[str, list[float]]]
"""name → {"wall": seconds of each round, "cpu": processor seconds of all processes}."""


def race(
    contestants: Contestants,
    rounds: int,
    *,
    once: float = 20.0,
    cold: Collection[str] = (),
    brief: Collection[str] = (),
) -> Times:
    """Time every contestant `rounds` times, in turn, each time after one that does not count.

    So all are timed as in a sequence, where a frame follows a frame, and not after somebody else.

    Args:
        contestants: what to time.
        rounds: how often.
        once: seconds; what takes longer is timed only once.
        cold: those that have no use for a time before.
        brief: those that are timed once, as what they tell is beside the point.
    """
    times: Times = {name: {"wall": [], "cpu": []} for name in contestants}
    for _ in range(rounds):
        for name, run in contestants.items():
            before = times[name]["wall"]
            if before and (name in brief or before[0] > once):
                continue
            if name not in cold and name not in brief:
                run()
            wall, cpu = time.perf_counter(), processor_seconds()
            run()
            times[name]["wall"].append(time.perf_counter() - wall)
            times[name]["cpu"].append(processor_seconds() - cpu)
    return times


def seconds(times: Mapping[str, Any], name: str, clock: str = "wall") -> float:
    """Median of a contestant; NaN if it did not take part."""
    return median(times[name][clock]) if name in times else float("nan")


def ratio(
    times: Mapping[str, Any], ours: str | tuple[str, ...], theirs: str | tuple[str, ...], clock: str = "wall"
) -> float:
    """Median over the rounds of our time over theirs; several names are summed. NaN if one is missing."""
    ours, theirs = ((names,) if isinstance(names, str) else names for names in (ours, theirs))
    if not all(name in times for name in (*ours, *theirs)):
        return float("nan")
    rounds = max(len(times[name][clock]) for name in (*ours, *theirs))

    def total(names: tuple[str, ...], turn: int) -> float:
        return sum(float(times[name][clock][min(turn, len(times[name][clock]) - 1)]) for name in names)

    return median(total(ours, turn) / max(total(theirs, turn), 1e-9) for turn in range(rounds))


def processor_seconds() -> float:
    """Processor time of this process and its living children so far."""
    return time.process_time() + sum(_scheduled(pid) for pid in children(os.getpid()))


def children(pid: int) -> list[int]:
    """Processes started by a process and by those (none where /proc does not tell)."""
    found = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += [int(child) for child in path.read_text().split()]
        except OSError:
            continue
    return found + [below for child in found for below in children(child)]


def _scheduled(pid: int) -> float:
    """Seconds the threads of a process have run, to the nanosecond."""
    total = 0
    for path in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        try:
            total += int(path.read_text().split()[0])
        except (OSError, IndexError):
            continue
    return total * 1e-9


def crowding() -> float:
    """How much longer two processes take side by side than one alone: 1 where two cores are free."""
    loop = "import time\nt = time.perf_counter()\nfor _ in range(10**7): pass\nprint(time.perf_counter() - t)"

    def longest(count: int) -> float:
        command = [sys.executable, "-c", loop]
        runs = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(count)]
        return max(float(run.communicate()[0]) for run in runs)

    return longest(2) / longest(1)


def canary() -> float:
    """Microseconds to add 65 536 numbers, the best of many: 3 to 5 on an idle machine."""
    a = np.ones(65536)
    best = float("inf")
    for _ in range(200):
        start = time.perf_counter()
        np.add(a, a, out=a)
        best = min(best, time.perf_counter() - start)
    return best * 1e6
