"""An eye on a scheduler and its workers, while results are waited for.

A farm goes wrong in silence: tasks wait for workers that nobody has started, or that are all dead. So
the scheduler is asked every few seconds who works for it. It is asked in the background, for one that
does not answer must not hold up a user who wants to stop.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from quiltcli.errors import CheckFailedError
from quiltcli.render.interrupt import StopRequest

_LOOK_SECONDS = 0.25
_ASK_SECONDS = 2.0
_SILENT_SECONDS = 6.0  # without a worker until it is said, and
_AGAIN_SECONDS = 60.0  # until it is said again


class Watch:
    """What is known of a farm.

    Attributes:
        workers: addresses of the workers when the scheduler was last asked.
    """

    def __init__(self, client: Any, address: str, request: StopRequest, say: Callable[[str], None]) -> None:
        self.workers: list[str] = []
        self._client, self._address = client, address
        self._request, self._say = request, say
        self._answer: Future[Any] | None = None
        self._asked = float("-inf")
        self._manned = time.monotonic()  # when there were workers last
        self._said = float("-inf")

    def await_workers(self, waiting: int) -> list[str]:
        """The workers, once there are any; `waiting` is the number of views that wait for them.

        Raises:
            CheckFailedError: the scheduler is gone.
            Stopped: a signal came.
        """
        while not self.workers:
            self._look(waiting)
            time.sleep(_LOOK_SECONDS)
        return self.workers

    def finished(self, futures: Sequence[Any], waiting: int = 0) -> Iterator[Any]:
        """The futures as they end, well or not; `waiting` views more wait for them. Errors as above."""
        done: SimpleQueue[Any] = SimpleQueue()
        for future in futures:
            future.add_done_callback(done.put)
        for left in range(len(futures), 0, -1):
            yield self._next(done, waiting or left)

    def _next(self, done: SimpleQueue[Any], waiting: int) -> Any:
        while True:
            self._look(waiting)
            with suppress(Empty):
                future = done.get(timeout=_LOOK_SECONDS)
                self._look(waiting)  # a lost connection ends all futures at once
                return future

    def _look(self, waiting: int) -> None:
        """Ask when it is time to, say what is amiss, and raise when it is past mending."""
        self._request.check()
        if self._client.status != "running":
            words = f"the scheduler is gone: {_views(waiting)} not done (--resume draws what is missing)"
            raise CheckFailedError(f"--scheduler {self._address}: {words}")
        now = time.monotonic()
        if self._answer is not None and self._answer.done():
            with suppress(Exception):  # the next one may be better
                self.workers = sorted(self._answer.result())
                self._manned = now if self.workers else self._manned
            self._answer = None
        if self._answer is None and now - self._asked >= _ASK_SECONDS:
            asking = self._client.scheduler.ncores()
            self._answer = asyncio.run_coroutine_threadsafe(asking, self._client.loop.asyncio_loop)
            self._asked = now
        if now - self._manned > _SILENT_SECONDS and now - self._said > _AGAIN_SECONDS:
            self._say(self._amiss(waiting, now))
            self._said = now

    def _amiss(self, waiting: int, now: float) -> str:
        """What to say when there has been no worker for a while."""
        if self._answer is not None and now - self._asked > _SILENT_SECONDS:
            return f"the scheduler {self._address} does not answer: {_views(waiting)} waiting"
        return (
            f"the scheduler {self._address} has no workers: {_views(waiting)} waiting"
            f" (dask worker {self._address} starts some; Ctrl-C ends this)"
        )


def _views(count: int) -> str:
    return f"{count:,} frames are" if count != 1 else "1 frame is"
