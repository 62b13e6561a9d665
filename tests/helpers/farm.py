"""A farm on this machine: a scheduler and ordinary workers, each a group of processes that can be killed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

DASK = [sys.executable, "-m", "dask"]
QUILT = [sys.executable, "-m", "quiltcli"]


class Farm:
    """A scheduler and its workers; a context manager that ends them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self.workers: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        local = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
        self.scheduler = self._started([*DASK, "scheduler", *local], "scheduler.log")
        wait_until(lambda: file.exists() and file.read_text().strip().endswith("}"))
        self.address: str = json.loads(file.read_text())["address"]

    def __enter__(self) -> Farm:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            kill(process)

    def start_workers(self, count: int) -> None:
        """Start `dask worker`s as anybody would, with their nannies."""
        for _ in range(count):
            log = f"worker_{len(self.workers)}.log"
            how = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(self._folder / log[:-4])]
            self.workers.append(
                self._started([*DASK, "worker", self.address, "--host", "127.0.0.1", *how], log)
            )

    def render(self, *arguments: str) -> subprocess.Popen[str]:
        """`quilt render job.yaml --scheduler …` in the folder, under way."""
        command = [*QUILT, "render", "job.yaml", "--scheduler", self.address, *arguments]
        pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(
            command, cwd=self._folder, env=self._environment, start_new_session=True, **pipes
        )

    def _started(self, command: list[str], log: str) -> subprocess.Popen[bytes]:
        with (self._folder / log).open("wb") as said:
            return subprocess.Popen(
                command,
                stdout=said,
                stderr=subprocess.STDOUT,
                cwd=self._folder,
                env=self._environment,
                start_new_session=True,
            )


def kill(process: subprocess.Popen[Any]) -> None:
    """Kill a process and all its children, without a word."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def wait_until(true: Callable[[], object], seconds: float = 60) -> None:
    """Wait for something to become true."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it has not come true"
        time.sleep(0.05)
