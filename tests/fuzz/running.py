"""One input, run in a process of its own that may take so much time and memory and no more."""

# ruff: noqa: E501 - tables are easier to read unbroken

from __future__ import annotations

import os
import random
import re
import resource
import shlex
import shutil
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.mutations import mutated, setting
from tests.fuzz.seeds import JOB, KINDS, Kind, prepare

SECONDS = 5.0  # of processor time, a command
MEGABYTES = 1024  # beyond what the program takes before it has read anything
_WALL = 60.0
_ADDRESSES = 6 << 30
# What Python and its libraries say; the program has sentences of its own.
PYTHON = re.compile(
    r"a fault of its own|Traceback|\bWarning\b|RuntimeWarning|list index|NoneType|object is not|object has no"
    r"|could not convert|invalid literal|subscript|unhashable|sys\.set_int|out of bounds for|inhomogeneous"
    r"|unexpected keyword|codec can't|\[Errno|KeyError|local variable|division by zero|math domain"
    r"|maximum recursion|need at least one array|could not be broadcast|\bdtype\b|\bufunc\b|zero-size array"
    r"|too many values to unpack|not enough values|cannot convert float|<class|unsupported operand|\bNaN to integer"
)


# The decoder's own note beside the program's sentence; it goes past Python.
_DECODERS = re.compile(
    r"^Warning: Exception raised reading pixel data for part \d+ - [A-Z][\w ]+$", re.MULTILINE
)


@dataclass(frozen=True)
class Outcome:
    """What came of a command.

    Attributes:
        command: as typed, without `quilt`.
        code: its exit code, negative for a signal.
        output: all that it printed.
        seconds: processor time.
        megabytes: most memory, beyond that of the process it was forked from.
    """

    command: str
    code: int
    output: str
    seconds: float
    megabytes: float

    @property
    def fault(self) -> str:
        """Why this must not be, empty when it may."""
        if self.code < 0:
            name = signal.Signals(-self.code).name
            return f"killed by {name} after {self.seconds:.1f} s"
        if found := PYTHON.search(_DECODERS.sub("", self.output)):
            return f"says {found[0]!r}"
        if self.code not in (0, 1, 2, 3, 4):
            return f"exit code {self.code}"
        if self.seconds > SECONDS:
            return f"{self.seconds:.1f} s of processor time"
        if self.megabytes > MEGABYTES:
            return f"{self.megabytes:.0f} MB of memory"
        return ""


def run(arguments: Sequence[str], folder: Path, preloaded: int) -> Outcome:
    """Run a command in a child of this process, in a folder.

    Args:
        arguments: as typed, without `quilt`.
        folder: where it is typed.
        preloaded: kilobytes that this process takes.
    """
    log = folder / ".output"
    child = os.fork()
    if not child:
        _child(arguments, folder, log)
    end = time.monotonic() + _WALL
    while True:
        pid, status, used = os.wait4(child, os.WNOHANG)
        if pid:
            break
        if time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)
    code = os.waitstatus_to_exitcode(status)
    seconds = used.ru_utime + used.ru_stime
    output = log.read_text(encoding="utf-8", errors="replace")
    return Outcome(shlex.join(arguments), code, output, seconds, (used.ru_maxrss - preloaded) / 1024)


def _child(arguments: Sequence[str], folder: Path, log: Path) -> None:
    """Run the command and leave; never returns."""
    import warnings

    from quiltcli.cli import main

    code = 70
    try:
        handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for target, source in ((0, nothing), (1, handle), (2, handle)):
            os.dup2(source, target)
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
        resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        import sys

        # Streams that a test runner has put in place of the system's would swallow what is said.
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
        warnings.simplefilter("always")
        try:
            main.main(list(arguments), prog_name="quilt")
            code = 0
        except SystemExit as leave:
            code = leave.code if isinstance(leave.code, int) else 0 if leave.code is None else 1
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        import traceback

        os.write(2, traceback.format_exc().encode("utf-8", "backslashreplace"))
    finally:
        os._exit(code)


@dataclass(frozen=True)
class Finding:
    """An input that must not do what it does; `seed` makes it again."""

    kind: str
    seed: int
    command: str
    fault: str
    output: str


def examine(kind: Kind, seed: int, seeds: Path, folder: Path) -> list[Finding]:
    """Make the input of a seed, run its commands, and say what must not be; the folder is removed."""
    rng = random.Random(f"{kind.name} {seed}")
    prepare(seeds, folder, kind)
    os.mkfifo(folder / "pipe")
    commands = [shlex.split(command) for command in kind.commands]
    if kind.how == "set":
        commands = [[*words, "--set", setting(rng, JOB)] for words in commands]
    else:
        mutated(folder / kind.file, kind.how, rng)
    try:
        return list(_findings(kind, seed, commands, folder))
    finally:
        shutil.rmtree(folder)


def _findings(kind: Kind, seed: int, commands: list[list[str]], folder: Path) -> list[Finding]:
    preloaded = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found, good, imported = [], False, False
    for words in commands:
        made = words[-1] if words[0] == "check" else ""
        if made.startswith("l") and made != "layout.yaml" and not (folder / made).exists():
            continue
        outcome = run(words, folder, preloaded)
        fault = outcome.fault
        if not fault and imported and made and outcome.code:
            fault = "check refuses what was just written"
        if not fault and good and words[0] == "render" and outcome.code == 2 and kind.how == "yaml":
            fault = "render refuses what check accepts"
        if fault:
            found.append(Finding(kind.name, seed, outcome.command, fault, outcome.output))
            break
        good = good or (words[0] == "check" and words[1] == "job.yaml" and outcome.code == 0)
        imported = words[0] in ("import", "pack") and outcome.code == 0
    return found


def kind_of(name: str) -> Kind:
    """The kind of this name."""
    return next(kind for kind in KINDS if kind.name == name)
