"""Opening the files a user names: regular files only, and every refusal in words.

A device or a pipe where a file is expected would hang a run or never end; a name that no file system
takes is a mistake in the text that holds it, not a fault of this program.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from quiltcli.errors import Problem, QuiltError
from quiltcli.formats.noted import note_input

# A pipe without a writer must not hold the program up before it is known to be a pipe.
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def open_input(path: Path | str, error: type[QuiltError], kind: str = "") -> BinaryIO:
    """Open a regular file to read its bytes.

    Args:
        path: the file as the user named it.
        error: what is raised, of the family of `QuiltError`.
        kind: what kind of file was expected, with its article ("a mesh"), for the message.
    """
    if fault := name_fault(path):
        raise error(Problem(fault, file=shown_name(path)))
    try:
        handle = os.open(path, _FLAGS)
    except OSError as cause:
        raise error(Problem(_words(cause, kind), file=str(path))) from None
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(handle, "rb")
    os.close(handle)
    raise error(Problem(f"is {_kind(mode)} {_wanted(kind)}", file=str(path)))


def read_input(path: Path | str, error: type[QuiltError], kind: str = "") -> bytes:
    """All bytes of a regular file; arguments and errors as for `open_input`."""
    with open_input(path, error, kind) as file:
        try:
            data = file.read()
        except OSError as cause:
            raise error(Problem(_words(cause, kind), file=str(path))) from None
    note_input(path, data)
    return data


FOREIGN = (
    *(
        ".fbx",
        ".blend",
        ".dae",
        ".3ds",
        ".max",
        ".ma",
        ".mb",
        ".c4d",
    ),
    *(".3mf", ".x3d", ".wrl", ".step", ".stp", ".iges", ".igs", ".skp", ".lwo", ".hip", ".dxf", ".dwg"),
)
"""Suffixes of scenes that this program does not read, and that others export from."""


def foreign_fault(path: Path | str) -> str:
    """What to do with a file of another program's own format, empty for any other file."""
    suffix = Path(path).suffix.lower()
    return f"is a {suffix} file, which is not read (export as GLB)" if suffix in FOREIGN else ""


def check_input(path: Path | str, error: type[QuiltError], kind: str = "") -> None:
    """Raise unless a library that opens files by name will find a regular file there."""
    open_input(path, error, kind).close()


def name_fault(path: Path | str) -> str:
    """What keeps a text from being the name of any file, empty when nothing does."""
    text = os.fspath(path)
    if "\0" in text:
        return "a file name cannot hold a zero byte"
    try:
        encoded = [os.fsencode(part) for part in Path(text).parts]
    except UnicodeEncodeError:
        return "a file name cannot hold half of a surrogate pair"
    if any(len(part) > 255 for part in encoded):
        return "a file name is longer than 255 bytes"
    if sum(len(part) + 1 for part in encoded) > 4095:
        return "a path is longer than 4095 bytes"
    return ""


def shown_name(path: Path | str) -> str:
    """A name fit to stand in a message: printable, and not longer than a line."""
    text = os.fspath(path).replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()
    return text if len(text) <= 100 else f"{text[:48]}…{text[-48:]}"


def is_regular(path: Path) -> bool:
    """Whether there is a regular file of this name; False for a name no file can have."""
    return not name_fault(path) and path.is_file()


def _words(cause: OSError, kind: str) -> str:
    if isinstance(cause, FileNotFoundError) or cause.errno == errno.ENOTDIR:
        return f"no such file (expected {kind})" if kind else "no such file"
    if isinstance(cause, IsADirectoryError):
        return f"is a directory {_wanted(kind)}"
    if cause.errno == errno.ENXIO:  # a socket, which cannot be opened at all
        return f"is a socket {_wanted(kind)}"
    return f"cannot be read: {cause.strerror or cause}"


def _wanted(kind: str) -> str:
    return f"(expected {kind} file)" if kind else "(a file was expected)"


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a directory"
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "no regular file")
