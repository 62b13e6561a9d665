"""A process is forked while other threads sleep."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from quiltcli.render import forking
from quiltcli.render.forking import wait_for_sleep


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="the system does not tell of threads")
def test_a_thread_that_works_is_waited_for() -> None:
    ends = time.monotonic() + 0.2

    def work() -> None:
        while time.monotonic() < ends:
            sum(range(1000))

    thread = threading.Thread(target=work)
    thread.start()
    wait_for_sleep()
    assert time.monotonic() >= ends
    thread.join()


def test_threads_that_never_sleep_are_not_waited_for_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forking, "_PATIENCE", 0.05)
    monkeypatch.setattr(forking, "_is_busy", lambda: True)
    start = time.monotonic()
    wait_for_sleep()
    assert 0.05 <= time.monotonic() - start < 1


def test_where_the_system_does_not_tell_there_is_a_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forking, "_TASKS", Path("/nowhere"))
    start = time.monotonic()
    wait_for_sleep()
    assert 0.005 <= time.monotonic() - start < 1
