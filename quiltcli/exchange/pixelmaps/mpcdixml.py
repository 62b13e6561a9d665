"""The XML of an MPCDI archive, read: buffers, regions and files by name.

`Xresolution`, `XResolution` and `xResolution` are one attribute; an archive may be a zip, the bare
mpcdi.xml of an unpacked one, or the folder it is in.
"""

from __future__ import annotations

import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from quiltcli.errors import LayoutError, Problem
from quiltcli.exchange.pixelmaps.mpcdiwrite import XML
from quiltcli.exchange.pixelmaps.placing import entries
from quiltcli.exchange.pixelmaps.xmltext import parsed_xml
from quiltcli.formats.inputs import is_regular, name_fault, open_input
from quiltcli.formats.yaml.source import shorten
from quiltcli.geometry import FloatArray

_XML_BYTES = 32_000_000
_MOST_PIXELS = 1_000_000  # a side, as in layout files
_FARTHEST = 1e6  # of a rectangle, in pages


@dataclass(frozen=True)
class Archive:
    """Files of an MPCDI archive, by the names its XML uses; `packed` is None of an unpacked one."""

    path: Path
    packed: zipfile.ZipFile | None

    def has(self, name: str) -> bool:
        """Whether there is a file of this name."""
        if self.packed:
            return name in self.packed.namelist()
        return is_regular((self.path if self.path.is_dir() else self.path.parent) / name)

    def read(self, name: str, most: int) -> bytes:
        """Bytes of a file, `most` at most; a LayoutError when it is not there, longer, or cannot be read."""
        data = self._unpacked(name, most) if self.packed else self._file(name, most)
        if len(data) > most:
            words = f"{name} holds more than {most:,} bytes, which is more than it can mean"
            raise LayoutError(Problem(words, file=str(self.path)))
        return data

    def _unpacked(self, name: str, most: int) -> bytes:
        """Bytes of a member, one more than `most` if there are more: what a zip says is no proof."""
        assert self.packed is not None
        try:
            with self.packed.open(name) as member:
                return member.read(most + 1)
        except KeyError:
            raise LayoutError(Problem(f"has no file {name!r}", file=str(self.path))) from None
        except MemoryError:
            raise
        except Exception as error:  # each kind of compression raises errors of its own
            raise LayoutError(Problem(f"{name} is damaged ({_why(error)})", file=str(self.path))) from None

    def _file(self, name: str, most: int) -> bytes:
        """Bytes of a file of an unpacked archive, which lies in the archive's folder or below."""
        root = self.path if self.path.is_dir() else self.path.parent
        path = self.path if name == XML and root != self.path else root / name
        if not is_regular(path):
            raise LayoutError(Problem(f"has no file {name!r}", file=str(self.path)))
        if not path.resolve().is_relative_to(root.resolve()):
            words = f"names {name!r}, which lies outside its folder (expected a file beside {XML})"
            raise LayoutError(Problem(words, file=str(self.path)))
        with open_input(path, LayoutError) as file:
            return file.read(most + 1)


@contextmanager
def open_archive(path: Path) -> Iterator[Archive]:
    """Open an archive: a zip, the folder of an unpacked one, or the mpcdi.xml in it (LayoutError)."""
    if (not name_fault(path) and path.is_dir()) or (is_regular(path) and path.suffix.lower() == ".xml"):
        yield Archive(path, None)
        return
    with open_input(path, LayoutError) as file:
        try:
            packed = zipfile.ZipFile(file)
        except Exception:  # whatever the table of members makes it stumble over
            raise LayoutError(Problem("is no MPCDI archive, which is a zip file", file=str(path))) from None
        with packed:
            yield Archive(path, packed)


def _why(error: Exception) -> str:
    """What an unpacker has met, in a few words."""
    if isinstance(error, RuntimeError) and "password" in str(error):
        return "it is encrypted"
    if isinstance(error, NotImplementedError):
        return "its compression is unknown"
    return "it does not unpack"


@dataclass(frozen=True)
class Region:
    """A region: its buffer (0-based) with size, its own resolution, and its rectangle in pixels."""

    id: str
    page: int
    size: tuple[int, int]
    low: FloatArray
    extent: FloatArray


def parsed_root(archive: Archive) -> ElementTree.Element:
    """The root of mpcdi.xml, of any profile (LayoutError)."""
    text = archive.read(XML, _XML_BYTES)
    root = parsed_xml(text, XML, archive.path)
    if root.tag.lower() != "mpcdi":
        raise LayoutError(Problem(f"{XML} holds <{root.tag}>, expected <MPCDI>", file=str(archive.path)))
    return root


def read_root(archive: Archive) -> ElementTree.Element:
    """The root of mpcdi.xml, of the 2D media profile (LayoutError)."""
    root = parsed_root(archive)
    profile = attributes(root).get("profile", "")
    if profile.lower() != "2d":
        message = f"{XML} is of the profile {profile!r}, expected 2d (a media picture cut into regions)"
        raise LayoutError(Problem(message, file=str(archive.path)))
    return root


def attributes(element: ElementTree.Element) -> dict[str, str]:
    """Attributes by their names in small letters: versions 1 and 2 spell them differently."""
    return {name.lower(): value for name, value in element.attrib.items()}


def elements(element: ElementTree.Element, tag: str) -> Iterator[ElementTree.Element]:
    """Elements with this tag at any depth, capitals or not."""
    return (inner for inner in element.iter() if inner.tag.lower() == tag.lower())


def read_regions(root: ElementTree.Element, path: Path) -> tuple[list[tuple[int, int]], list[Region]]:
    """Sizes of the buffers, and all regions in the order of the file (LayoutError)."""
    pages: list[tuple[int, int]] = []
    regions: list[Region] = []
    problems: list[Problem] = []
    for buffer in elements(root, "buffer"):
        page = _numbers(buffer, ("xresolution", "yresolution"), int, path, problems)
        pages.append((int(page[0]), int(page[1])))
        for element in elements(buffer, "region"):
            own = _numbers(element, ("xresolution", "yresolution"), int, path, problems)
            place = _numbers(element, ("x", "y", "xsize", "ysize"), float, path, problems)
            box = np.array(place).reshape(2, 2) * pages[-1]
            name = attributes(element).get("id", "")
            regions.append(Region(name, len(pages) - 1, (int(own[0]), int(own[1])), box[0], box[1]))
    if not problems and not regions:
        problems.append(Problem(f"{XML} has no <region> in a <buffer>", file=str(path)))
    names = [region.id for region in regions]
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    problems += [Problem(f"{XML} has two regions {name!r}", file=str(path)) for name in twice]
    entries(path, problems)
    return pages, regions


def _numbers(
    element: ElementTree.Element, names: tuple[str, ...], kind: Any, path: Path, problems: list[Problem]
) -> list[float]:
    """Attributes of an element as numbers; what is missing or none is a problem and 1."""
    known, found = attributes(element), []
    for name in names:
        text = known.get(name)
        try:
            number = kind(text)
            good = 1 <= number <= _MOST_PIXELS if kind is int else abs(number) <= _FARTHEST
        except (TypeError, ValueError):
            number, good = 1, False
        if not good:
            what = f"a whole number from 1 to {_MOST_PIXELS}" if kind is int else "a number"
            got = "nothing" if text is None else repr(shorten(text))
            where = f"<{element.tag} id={known.get('id', '')!r}>"
            problems.append(Problem(f"{XML}: {where} has {got} as {name}, expected {what}", file=str(path)))
            number = 1
        found.append(number)
    return found
