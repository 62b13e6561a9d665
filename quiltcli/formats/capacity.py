"""How much memory and disk there is, to say so before a run fails for want of it."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from quiltcli.errors import JobError

# Left to the system, the interpreter and what is not worth counting.
_RESERVE = 256 << 20
_PROC = Path("/proc")
_GROUP = Path("/sys/fs/cgroup")


_SIZE = re.compile(r"(\d{1,12}(?:\.\d{1,6})?)\s*([KMGT]?)(i?)B?", re.IGNORECASE)
_limit: int | None = None


def read_bytes(text: str) -> int:
    """Bytes of a size such as `8GB`, `512 MiB` or a plain number.

    Raises:
        JobError: it is no size.
    """
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        raise JobError(f"expected a size such as 8GB or 512MiB, got {text!r}")
    power = " KMGT".index(match[2].upper() or " ")
    return int(float(match[1]) * (1024 if match[3] else 1000) ** power)


def limit_memory(most: int | None) -> None:
    """Let this process and those that it starts take at most so many bytes; None for all there are."""
    global _limit  # noqa: PLW0603 # of the process, as what it measures
    _limit = most


def free_memory() -> int | None:
    """Bytes that this process may still take, None where nothing tells.

    The least of what the system has available, what the control group leaves and what the limit of the
    address space leaves (`ulimit -v`), but for a reserve; and of what `limit_memory` does, as it is said.
    """
    told = (_system(), _control_group(), _address_space())
    known = [limit - _RESERVE for limit in told if limit is not None]
    allowed = _allowed()
    known += [] if allowed is None else [allowed]
    return max(min(known), 0) if known else None


def _allowed() -> int | None:
    """What the user allows, but for what is taken already."""
    used = dict(_fields(_PROC / "self" / "status")).get("VmRSS", 0)
    return None if _limit is None else _limit - used


def free_disk(path: Path) -> int | None:
    """Bytes free where `path` is or will be, None where nothing tells."""
    for folder in (path, *path.absolute().parents):
        try:
            return shutil.disk_usage(folder).free
        except OSError:
            continue
    return None


def bytes_text(count: float) -> str:
    """`12.3 GB`, in thousands as disks are sold; small sizes in MB."""
    return (
        f"{count / 1e9:,.{1 if count < 1e11 else 0}f} GB"
        if count >= 1e9
        else f"{max(count / 1e6, 0.1):.3g} MB"
    )


def _fields(path: Path) -> Iterator[tuple[str, int]]:
    """Names and byte counts of a file of lines such as `MemAvailable:   123 kB`."""
    try:
        lines = path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return
    for line in lines:
        name, _, rest = line.partition(":")
        number = rest.split()[:1]
        if number and number[0].isdigit():
            yield name, int(number[0]) * 1024


def _system() -> int | None:
    available = dict(_fields(_PROC / "meminfo")).get("MemAvailable")
    if available is None and hasattr(os, "sysconf") and "SC_AVPHYS_PAGES" in os.sysconf_names:
        available = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return available


def _control_group() -> int | None:
    """What a container may still take: version 2 of control groups, then version 1."""
    for limit, used in (
        ("memory.max", "memory.current"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
    ):
        try:
            texts = [(_GROUP / name).read_text(encoding="ascii").strip() for name in (limit, used)]
        except OSError:
            continue
        # Version 1 writes "no limit" as a number near 2^63.
        if all(text.isdigit() for text in texts) and int(texts[0]) < 1 << 60:
            return int(texts[0]) - int(texts[1])
    return None


def _address_space() -> int | None:
    try:
        import resource
    except ImportError:  # not a Unix
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    used = dict(_fields(_PROC / "self" / "status")).get("VmSize")
    return None if limit == resource.RLIM_INFINITY or used is None else limit - used
