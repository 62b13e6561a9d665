"""Names of files that are being written, by which a later run can tell whether their writer still lives.

`.NAME.MACHINE-BOOT-PID-START-RANDOM.tmp`: many machines and containers may write into one folder, in
which process numbers mean nothing by themselves. So a name says on which machine it was given, since
which start of it (and among which numbering of processes), by which process, started when. The last
part is random: nobody can foretell the name and put something of his own there.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import secrets
import socket
import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

_TOKEN = re.compile(r"\..+\.([0-9a-f]{8})-([0-9a-f]{8})-(\d+)-(\d+)-[0-9a-f]{16}\.tmp", re.DOTALL)
_OLD = re.compile(r"\..+\.\d+\.tmp", re.DOTALL)  # as version 0.1.0 named them
_UNKNOWN = "0" * 8
_LONGEST = 255  # bytes of a file name
_HOUR = 3600.0
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


@dataclass(frozen=True)
class _Process:
    """Who writes a file.

    Attributes:
        machine: hash of what tells a machine (and a numbering of processes on it) from others, whenever it
            was started; `_UNKNOWN` if nothing does.
        boot: hash of the machine's last start and of the numbering of processes.
        pid: number of the process.
        start: when it was started, in ticks since the machine was; 0 where nobody says.
    """

    machine: str
    boot: str
    pid: int
    start: int


def new_file_beside(path: Path) -> tuple[Path, int]:
    """Create a file of this process alone in the folder of `path`; its own path and a handle (OSError)."""
    place = path_beside(path)
    return place, os.open(place, _FLAGS, 0o666)


def path_beside(path: Path) -> Path:
    """A name in the folder of `path` that nobody has used or can foretell."""
    who = _process(os.getpid())
    end = f".{who.machine}-{who.boot}-{who.pid}-{who.start}-{secrets.token_hex(8)}.tmp"
    name = os.fsdecode(os.fsencode(path.name)[: _LONGEST - 1 - len(end)])
    return path.with_name(f".{name}{end}")


def remove_leftovers(folders: Iterable[Path]) -> int:
    """Remove what writers that are no more have left unfinished in some folders; how many files.

    Files of this machine go at once, those of others when nobody has written to them for an hour.
    What cannot be removed stays.
    """
    removed = 0
    for folder in folders:
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                with contextlib.suppress(OSError):
                    if _is_left_over(entry):
                        Path(entry.path).unlink()
                        removed += 1
    return removed


def _is_left_over(entry: os.DirEntry[str]) -> bool:
    """Whether an entry of a folder is a file that nobody will finish."""
    match = _TOKEN.fullmatch(entry.name)
    if not (match or _OLD.fullmatch(entry.name)) or not entry.is_file(follow_symlinks=False):
        return False
    if match:
        writer = _Process(match[1], match[2], int(match[3]), int(match[4]))
        here = _process(os.getpid())
        if writer.boot == here.boot:
            return not _lives(writer)
        if writer.machine == here.machine != _UNKNOWN:
            return True  # written before the machine was started anew
    return time.time() - entry.stat(follow_symlinks=False).st_mtime > _HOUR


def _lives(process: _Process) -> bool:
    """Whether a process of this machine is still there, and not another that has taken its number."""
    try:
        os.kill(process.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        pass  # it is somebody else's
    start, state = _start_of(process.pid)
    return state not in "ZX" and (not start or not process.start or start == process.start)


@lru_cache(maxsize=1)
def _process(pid: int) -> _Process:
    """This process; `pid` is its number, for a fork has another."""
    host = socket.gethostname()
    machine, boot = _text("/etc/machine-id"), _text("/proc/sys/kernel/random/boot_id")
    space = ""
    with contextlib.suppress(OSError):
        space = str(Path("/proc/self/ns/pid").readlink())
    named = _hash(host, machine, space) if machine else _UNKNOWN
    return _Process(named, _hash(boot or host, space), pid, _start_of(pid)[0])


def _start_of(pid: int) -> tuple[int, str]:
    """When a process was started and the letter of its state; 0 and "?" where nobody says (proc(5))."""
    fields = _text(f"/proc/{pid}/stat").rpartition(")")[2].split()
    return (int(fields[19]), fields[0]) if len(fields) > 19 else (0, "?")


def _text(path: str) -> str:
    """What a file of the system says, empty when there is none."""
    try:
        return Path(path).read_text(errors="replace").strip()
    except OSError:
        return ""


def _hash(*words: str) -> str:
    return hashlib.sha256("\n".join(words).encode("utf-8", "replace")).hexdigest()[:8]
