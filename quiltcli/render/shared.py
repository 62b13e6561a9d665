"""Arrays in memory that a process and its forked workers share, and that may grow while they live.

Memory that is mapped before a fork is shared for nothing, but it cannot grow, and a scene that moves may.
So every array lies in an unnamed file in memory; workers that were forked before it was made are sent
its descriptor over the line they are told their work on. Nothing has a name that could be left behind.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from multiprocessing import reduction
from typing import Any

import numpy as np
from numpy.typing import NDArray

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Handle:
    """Where a shared array is.

    Attributes:
        number: of its memory; a new one when the array has outgrown the old.
        dtype: its type.
        shape: its shape.
    """

    number: int
    dtype: str
    shape: Shape


@dataclass(frozen=True)
class _Memory:
    number: int
    descriptor: int
    bytes: mmap.mmap


class SharedArrays:
    """The arrays by name, on the side of the process that makes them."""

    def __init__(self) -> None:
        self._memory: dict[str, _Memory] = {}
        self._handles: dict[str, Handle] = {}
        self._made = 0

    def reserve(self, name: str, shape: Shape, dtype: Any) -> NDArray[Any]:
        """An array of this shape; what it holds is not known. It grows by half more than it must."""
        dtype = np.dtype(dtype)
        count = int(np.prod(shape))
        need = max(count * dtype.itemsize, 1)
        if name not in self._memory or len(self._memory[name].bytes) < need:
            grown = need if name not in self._memory else need + need // 2
            self._memory[name] = self._new_memory(grown, self._memory.pop(name, None))
        memory = self._memory[name]
        self._handles[name] = Handle(memory.number, dtype.str, tuple(shape))
        return np.frombuffer(memory.bytes, dtype=dtype, count=count).reshape(shape)

    def put(self, name: str, values: NDArray[Any]) -> NDArray[Any]:
        """A copy of `values` that everybody sees."""
        shared = self.reserve(name, values.shape, values.dtype)
        np.copyto(shared, values)
        return shared

    def handles(self, names: Iterable[str]) -> dict[str, Handle]:
        """Where some of the arrays are."""
        return {name: self._handles[name] for name in names}

    def send(self, connection: Any, handles: Mapping[str, Handle], known: set[int]) -> None:
        """Tell a worker where arrays are, with descriptors of the memory that it does not know yet."""
        new = sorted({handle.number for handle in handles.values()} - known)
        connection.send((dict(handles), new))
        descriptors = {memory.number: memory.descriptor for memory in self._memory.values()}
        for number in new:
            reduction.send_handle(connection, descriptors[number], None)
            known.add(number)

    def close(self) -> None:
        """Give up the descriptors; the memory goes with the last array in it."""
        for memory in self._memory.values():
            os.close(memory.descriptor)
        self._memory = {}

    def _new_memory(self, size: int, old: _Memory | None) -> _Memory:
        if old is not None:
            os.close(old.descriptor)
        descriptor = os.memfd_create("quilt", os.MFD_CLOEXEC)
        os.ftruncate(descriptor, size)
        self._made += 1
        return _Memory(self._made, descriptor, mmap.mmap(descriptor, size))


class AttachedArrays:
    """The same arrays on the side of a worker."""

    def __init__(self) -> None:
        self._memory: dict[int, mmap.mmap] = {}
        self._handles: dict[str, Handle] = {}

    def receive(self, connection: Any) -> dict[str, NDArray[Any]]:
        """The arrays that the other side has sent; memory nobody needs any more is let go."""
        handles, new = connection.recv()
        for number in new:
            descriptor = reduction.recv_handle(connection)
            self._memory[number] = mmap.mmap(descriptor, os.fstat(descriptor).st_size)
            os.close(descriptor)
        self._handles |= handles
        needed = {handle.number for handle in self._handles.values()}
        self._memory = {number: memory for number, memory in self._memory.items() if number in needed}
        return {name: self._array(handle) for name, handle in handles.items()}

    def _array(self, handle: Handle) -> NDArray[Any]:
        count = int(np.prod(handle.shape))
        flat = np.frombuffer(self._memory[handle.number], dtype=np.dtype(handle.dtype), count=count)
        return flat.reshape(handle.shape)
