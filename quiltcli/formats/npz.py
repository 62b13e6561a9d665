"""NumPy's archives of arrays (`.npz`): numbers in columns, for what is too long to be text.

An archive is a zip of `.npy` files. They are read with bounds: what a member says of its length is held
against what there is before memory is taken, and nothing in it can be code.
"""

from __future__ import annotations

import io
import lzma
import math
import re
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from quiltcli.errors import Problem, QuiltError, raise_all
from quiltcli.formats.inputs import read_input

_MOST_BYTES = 4 << 30
_FIRST_DATE = (1980, 1, 1, 0, 0, 0)
_SPOILT = (
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError, OSError),
    *(ValueError, TypeError),
)
"""What reading a damaged archive may raise."""
# Versions 1 and 2 of the format, as NumPy writes numbers that are no records.
_HEADER = re.compile(
    rb"\x93NUMPY(?:\x01\x00(?P<length>..)|\x02\x00(?P<longer>....))\{'descr': '(?P<kind>[<>|][a-z]\d{1,2})', "
    rb"'fortran_order': (?P<fortran>True|False), 'shape': \((?P<shape>[\d, ]{0,60})\),? *\} *\n",
    re.DOTALL,
)


def npz_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """The archive of some arrays, uncompressed: the same arrays are the same bytes on every machine."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            npy.write_array(member, np.ascontiguousarray(array), version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", _FIRST_DATE), member.getvalue())
    return file.getvalue()


def read_npz(
    path: Path, wanted: Mapping[str, str], error: type[QuiltError]
) -> tuple[dict[str, NDArray[Any]], bytes]:
    """The arrays of an archive, and the bytes of the file.

    Args:
        path: the file as the user named it.
        wanted: the name of every array and the kind of its numbers, `i` for whole ones, `f` for any.
        error: what is raised, of the family of `QuiltError`.

    Raises:
        QuiltError: it is no such archive, or its arrays are others; every problem found is in it.
    """
    data = read_input(path, error, "a NumPy archive (.npz)")
    try:
        names, arrays = _unpacked(data, wanted)
    except _SPOILT as cause:
        words = "is no NumPy archive of numbers, or is damaged (expected an .npz file)"
        raise error(Problem(words, str(path))) from cause
    raise_all(error, _strangers(path, names, list(wanted)))
    raise_all(error, _odd_kinds(path, arrays, wanted))
    whole = {name: np.int64 if kind == "i" else np.float64 for name, kind in wanted.items()}
    return {name: array.astype(whole[name]) for name, array in arrays.items()}, data


def _unpacked(data: bytes, wanted: Mapping[str, str]) -> tuple[list[str], dict[str, NDArray[Any]]]:
    """The names of all members of an archive, and the arrays that are wanted (one of `_SPOILT`)."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
        if sum(item.file_size for item in members.values()) > _MOST_BYTES:
            raise ValueError("size")
        arrays = {name: _array(archive.read(members[name])) for name in wanted if name in members}
    return list(members), arrays


def _array(member: bytes) -> NDArray[Any]:
    """An array from a `.npy` file (ValueError).

    Read here and not by NumPy, whose reader hands what stands in the header to Python's parser.
    """
    match = _HEADER.match(member)
    if match is None:
        raise ValueError("header")
    kind, fortran, sides = match["kind"].decode(), match["fortran"] == b"True", match["shape"].split(b",")
    shape = tuple(int(side) for side in sides if side.strip())
    begin = match.end()
    length = int.from_bytes(match["length"] or match["longer"], "little")
    if begin != length + match.start("kind") - len(b"{'descr': '") or any(
        side > _MOST_BYTES for side in shape
    ):
        raise ValueError("length")
    count, dtype = math.prod(shape), np.dtype(kind)
    if len(member) - begin != count * dtype.itemsize:
        raise ValueError("length")
    return np.frombuffer(member, dtype, count, begin).reshape(shape, order="F" if fortran else "C")


def _strangers(path: Path, names: list[str], wanted: list[str]) -> list[Problem]:
    missing = [name for name in wanted if name not in names]
    other = [name for name in names if name not in wanted]
    found = [Problem(f"has no array {name!r} (expected {', '.join(wanted)})", str(path)) for name in missing]
    return found + [
        Problem(f"has an array that is not known (expected {', '.join(wanted)})", str(path), key=name[:60])
        for name in other[:5]
    ]


def _odd_kinds(path: Path, arrays: Mapping[str, NDArray[Any]], wanted: Mapping[str, str]) -> list[Problem]:
    found = []
    for name, array in arrays.items():
        kinds, words = ("iu", "whole numbers") if wanted[name] == "i" else ("fiu", "numbers")
        if array.dtype.kind not in kinds:
            message = f"is of the type {array.dtype} (expected {words})"
            found.append(Problem(message, str(path), key=name))
    return found
