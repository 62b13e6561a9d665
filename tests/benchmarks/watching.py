"""Looking into a frame from outside: the time of its stages, and how often things are done.

Functions of the program are wrapped for a while. Which, is one table: whoever moves one of them moves
its row.
"""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from types import GeneratorType
from typing import Any

from quiltcli.render import batch, buffers, crew
from quiltcli.shading import adaptive
from quiltcli.shading import aovs as channels
from quiltcli.visibility import draw as raster
from quiltcli.visibility import shares as binframe
from quiltcli.visibility.binning import pairs as binning
from quiltcli.visibility.draw import MixedTiles, WholeTiles

STAGES: tuple[tuple[object, str, str], ...] = (
    (crew, "bin_frame", "bin"),
    (binframe, "see_vertices", "bin: first pass"),
    (binning, "_second_pass", "bin: second pass"),
    (binframe, "block_keys", "prewarp"),
    (raster, "warp", "prewarp"),
    (raster, "draw_small", "small triangles"),
    (raster, "large_spans", "large triangles"),
    (raster, "draw_large", "large triangles"),
    (raster, "read_canvas", "visibility"),
    (WholeTiles, "split", "visibility"),
    (WholeTiles, "read", "visibility"),
    (MixedTiles, "hits", "visibility"),
    (adaptive, "is_smooth", "shade"),
    (adaptive, "shade", "shade"),
    (channels, "_halves_between", "shade"),
    (batch, "fill", "store"),
    (buffers, "clear", "clear"),
    (crew, "clear_blocks", "clear"),
)
"""Module or class, function, and the stage whose time it is."""


@contextmanager
def replaced(module: object, name: str, value: object) -> Iterator[None]:
    """A name of a module bound to something else for a while."""
    old = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, old)


class Stopwatch:
    """Seconds by stage; a stage's time does not include the stages it calls."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._running = ["rest"]
        self._since = time.perf_counter()

    def _turn(self) -> None:
        """Give the time since the last turn to the innermost stage."""
        now = time.perf_counter()
        self.seconds[self._running[-1]] += now - self._since
        self._since = now

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time of the block belongs to this stage."""
        self._turn()
        self._running.append(name)
        try:
            yield
        finally:
            self._turn()
            self._running.pop()

    def timed(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        """The function with its time given to a stage, a generator's with all its steps."""

        def steps(values: Iterator[Any]) -> Iterator[Any]:
            while True:
                with self.stage(name):
                    value = next(values, values)
                if value is values:
                    return
                yield value

        def call(*given: Any, **named: Any) -> Any:
            with self.stage(name):
                result = function(*given, **named)
            return steps(result) if isinstance(result, GeneratorType) else result

        return call


def stage_seconds(work: Callable[[], object]) -> dict[str, float]:
    """Seconds by stage of `work`, done in this process and this thread's time."""
    watch = Stopwatch()
    with ExitStack() as ends:
        for module, name, stage in STAGES:
            ends.enter_context(replaced(module, name, watch.timed(getattr(module, name), stage)))
        with watch.stage("rest"):
            work()
    return dict(watch.seconds)


@contextmanager
def counted(probes: Mapping[tuple[object, str], Callable[..., Mapping[str, int]]]) -> Iterator[Counter[str]]:
    """Sums of what probes say of every call: each is given the result and the arguments of its function."""
    sums: Counter[str] = Counter()

    def watched(function: Callable[..., Any], probe: Callable[..., Mapping[str, int]]) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            result = function(*given, **named)
            sums.update(probe(result, *given))
            return result

        return call

    with ExitStack() as ends:
        for (module, name), probe in probes.items():
            ends.enter_context(replaced(module, name, watched(getattr(module, name), probe)))
        yield sums
