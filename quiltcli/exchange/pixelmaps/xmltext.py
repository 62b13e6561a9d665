"""XML of pixel maps, read from bytes with errors that say where."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from quiltcli.errors import LayoutError, Problem


def parsed_xml(data: bytes, what: str, path: Path) -> ElementTree.Element:
    """The root of an XML text.

    Args:
        data: the text, in the encoding that it says.
        what: the file in an archive, or nothing, as the start of a sentence.
        path: the file or archive.

    Raises:
        LayoutError: it is none, or in an unknown encoding.
    """
    start = f"{what} " if what else ""
    try:
        return ElementTree.fromstring(data)
    except (LookupError, ValueError):
        raise LayoutError(Problem(f"{start}is in an unknown encoding", file=str(path))) from None
    except ElementTree.ParseError as error:
        line, column = error.position
        words = str(error).partition(":")[0]
        raise LayoutError(Problem(f"{start}is not XML: {words}", str(path), line, column + 1)) from None
