"""A seal on an OpenEXR file: a hash of all its bytes in its own header, so that one wrong byte is found.

The attribute `quilt:digest` holds the SHA-256, hexadecimal, of the file as it is with the character 0
in all 64 places of the digest. Decoding the pixels would find less: those that are not compressed have no
redundancy, and much of a header may be anything. It would take longer, too. A program that copies the
attributes of an image into another one breaks the seal, and rightly so.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import BinaryIO

ATTRIBUTE = "quilt:digest"
BLANK = "0" * 64
_MARK = ATTRIBUTE.encode() + b"\0string\0" + len(BLANK).to_bytes(4, "little")
_HEADER = 1 << 20  # bytes at a file's beginning in which the attribute must lie
_PIECE = 1 << 20


def seal(path: Path) -> None:
    """Put the digest of a file that was written with a blank one into its place (OSError)."""
    with path.open("r+b") as file:
        at = _place(file)
        assert at is not None, f"no attribute {ATTRIBUTE} was written"
        digest = _digest(file, at)
        file.seek(at)
        file.write(digest)


def is_sealed(path: Path) -> bool:
    """Whether every byte of a file is as it was when it was sealed; False for files that never were."""
    try:
        with path.open("rb") as file:
            at = _place(file)
            if at is None:
                return False
            file.seek(at)
            return file.read(len(BLANK)) == _digest(file, at)
    except OSError:
        return False


def _place(file: BinaryIO) -> int | None:
    """Where the digest lies in a file; None when it has none."""
    file.seek(0)
    found = file.read(_HEADER).find(_MARK)
    return found + len(_MARK) if found >= 0 else None


def _digest(file: BinaryIO, at: int) -> bytes:
    """The digest of a file in which it lies at `at`."""
    total = hashlib.sha256()
    file.seek(0)
    total.update(file.read(at))
    total.update(BLANK.encode())
    file.seek(at + len(BLANK))
    while piece := file.read(_PIECE):
        total.update(piece)
    return total.hexdigest().encode()
