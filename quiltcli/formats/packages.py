"""Files inside of packages: `scene.usdz[textures/wood.png]` is one of a USDZ, a zip without compression."""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path

from quiltcli.errors import Problem, QuiltError
from quiltcli.formats.inputs import read_input

_PACKED = re.compile(r"(?P<package>.*\.usdz)\[(?P<name>[^\[\]]+)\]", re.IGNORECASE | re.DOTALL)


def read_file(path: Path | str, error: type[QuiltError], kind: str = "") -> bytes:
    """All bytes of a file, or of one inside of a package.

    Args:
        path: of the file, or of the package with the file's name in brackets.
        error: what is raised, of the family of `QuiltError`.
        kind: what kind of file was expected, with its article, for the message.
    """
    found = _PACKED.fullmatch(str(path))
    if found is None:
        return read_input(path, error, kind)
    data = read_input(found["package"], error, "a package")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as package:
            entry = package.getinfo(found["name"])
            if entry.compress_type != zipfile.ZIP_STORED:
                raise error(Problem("is compressed (expected a file that is stored as it is)", str(path)))
            return package.read(entry)
    except KeyError:
        raise error(
            Problem(f"no such file in the package (expected {kind or 'a file'})", str(path))
        ) from None
    except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError) as cause:
        raise error(Problem(f"cannot be read: {cause}", str(path))) from None
