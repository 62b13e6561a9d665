"""Files that appear whole or not at all.

Everything the program leaves is written beside its place under a name that starts with a dot and
ends in `.tmp`, flushed to the disk and renamed when it is complete. A reader never meets half a file,
and a crash leaves nothing but a file that no sequence or folder reader takes for a result, and that
the next run removes.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.temporary import new_file_beside, path_beside

# What file systems answer that cannot flush a file or a folder by itself.
_NO_FLUSH = {errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF}


def write_problem(path: Path, cause: OSError | RuntimeError) -> Problem:
    """What kept `path` from being written, in the words of the system.

    OpenEXR reports a failed system call as a RuntimeError that ends in the system's sentence; the
    name it mentions is that of the temporary file, which means nothing to a user.
    """
    said = cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause)
    said = said.rpartition('". ')[2].rstrip(".")
    return Problem(f"cannot be written: {said}", file=str(path))


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a new, empty file to write to; it becomes `path` if the block ends well, else it is removed.

    Its bytes are on the disk before it gets its name; that the name is, too, takes `sync_folder`.

    Raises:
        OutputError: the file, or the folder around it, cannot be written.
    """
    if path.is_dir():
        raise OutputError(Problem("is a folder, expected a file to write", file=str(path)))
    try:
        temporary, handle = new_file_beside(path)
        try:
            yield temporary
            _flush(handle)  # what was written through other handles, too
            temporary.replace(path)
        finally:
            os.close(handle)
            with contextlib.suppress(OSError):
                temporary.unlink()
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(write_problem(path, error)) from error


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8 with bare newlines, whole or not at all (OutputError)."""
    write_whole(path, text.encode())


def write_whole(path: Path, data: bytes) -> None:
    """Write `data`, whole or not at all (OutputError)."""
    with whole_file(path) as temporary:
        temporary.write_bytes(data)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file of bytes, whole or not at all (OutputError if that fails)."""
    with whole_file(path) as temporary:
        temporary.write_bytes(data)


def link_whole(source: Path, path: Path) -> None:
    """Make `path` the same file as `source`, by a hard link; a copy where there can be none (OutputError)."""
    temporary = path_beside(path)
    try:
        os.link(source, temporary)
    except OSError:  # another kind of file system, or one that has enough links to this file
        with whole_file(path) as copied:
            shutil.copyfile(source, copied)
        return
    try:
        temporary.replace(path)
    except OSError as error:
        raise OutputError(write_problem(path, error)) from error
    finally:
        # A rename between two names of one file does nothing, and leaves both.
        with contextlib.suppress(OSError):
            temporary.unlink()


def sync_folder(path: Path) -> None:
    """Have the names of the files in a folder on the disk, not only in memory (OutputError)."""
    if os.name == "nt":  # which opens no folders
        return
    try:
        handle = os.open(path, os.O_RDONLY)
        try:
            _flush(handle)
        finally:
            os.close(handle)
    except OSError as error:
        raise OutputError(write_problem(path, error)) from error


def _flush(handle: int) -> None:
    """Have what was written to a file on the disk, where its file system can."""
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in _NO_FLUSH:
            raise


def remove_file(path: Path) -> None:
    """Remove a file; do nothing when there is none (OutputError)."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        words = f"cannot be removed: {error.strerror}"
        raise OutputError(Problem(words, file=str(path))) from error


def make_folder(path: Path) -> None:
    """Make the folder `path` and those above it; do nothing when it is there already (OutputError)."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        for step in (path, *path.parents):
            if step.exists() and not step.is_dir():
                raise OutputError(Problem("is a file, expected a folder", file=str(step))) from error
        raise OutputError(write_problem(path, error)) from error
