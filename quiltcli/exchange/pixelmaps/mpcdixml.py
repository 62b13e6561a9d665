"""The XML of an MPCDI archive, read: buffers, regions and files by name.

`Xresolution`, `XResolution` and `xResolution` are one attribute; an archive may be a zip, the bare
mpcdi.xml of an unpacked one, or the folder it is in.
"""

from __future__ import annotations

import zipfile
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
from quiltcli.geometry import FloatArray


@dataclass(frozen=True)
class Archive:
    """Files of an MPCDI archive, by the names its XML uses; `packed` is None of an unpacked one."""

    path: Path
    packed: zipfile.ZipFile | None

    def read(self, name: str) -> bytes:
        """Bytes of a file, a LayoutError when it is not there or cannot be read."""
        try:
            if self.packed:
                return self.packed.read(name)
            if self.path.is_dir():
                return (self.path / name).read_bytes()
            return (self.path if name == XML else self.path.with_name(name)).read_bytes()
        except (KeyError, FileNotFoundError):
            raise LayoutError(Problem(f"has no file {name!r}", file=str(self.path))) from None
        except (OSError, RuntimeError, NotImplementedError, zipfile.BadZipFile) as error:
            raise LayoutError(Problem(f"{name} cannot be read: {error}", file=str(self.path))) from None


@contextmanager
def open_archive(path: Path) -> Iterator[Archive]:
    """Open an archive: a zip, the folder of an unpacked one, or the mpcdi.xml in it (LayoutError)."""
    if path.is_dir() or (path.is_file() and path.suffix.lower() == ".xml"):
        yield Archive(path, None)
        return
    try:
        packed = zipfile.ZipFile(path)
    except OSError as error:
        raise LayoutError(Problem(f"cannot be read: {error.strerror}", file=str(path))) from None
    except zipfile.BadZipFile:
        raise LayoutError(Problem("is no MPCDI archive, which is a zip file", file=str(path))) from None
    with packed:
        yield Archive(path, packed)


@dataclass(frozen=True)
class Region:
    """A region: its buffer (0-based) with size, its own resolution, and its rectangle in pixels."""

    id: str
    page: int
    size: tuple[int, int]
    low: FloatArray
    extent: FloatArray


def read_root(archive: Archive) -> ElementTree.Element:
    """The root of mpcdi.xml, of the 2D media profile (LayoutError)."""
    try:
        root = ElementTree.fromstring(archive.read(XML))
    except ElementTree.ParseError as error:
        line, column = error.position
        text = str(error).partition(":")[0]
        raise LayoutError(Problem(f"{XML} is not XML: {text}", str(archive.path), line, column + 1)) from None
    if root.tag.lower() != "mpcdi":
        raise LayoutError(Problem(f"{XML} holds <{root.tag}>, expected <MPCDI>", file=str(archive.path)))
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
    twice = sorted({name for name in names if names.count(name) > 1}) if len({*names}) < len(names) else []
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
            good = np.isfinite(number) and (number >= 1 or kind is float)
        except (TypeError, ValueError):
            number, good = 1, False
        if not good:
            what = "a whole number from 1" if kind is int else "a number"
            got = "nothing" if text is None else repr(text)
            where = f"<{element.tag} id={known.get('id', '')!r}>"
            problems.append(Problem(f"{XML}: {where} has {got} as {name}, expected {what}", file=str(path)))
            number = 1
        found.append(number)
    return found
