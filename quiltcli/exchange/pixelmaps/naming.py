"""Names of facets and pages in files that other tools read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

_LABEL = re.compile(r"facet_(\d{1,9})(?:_(.*))?(?!\d)")
_PAGE = re.compile(r"(.*)_page_(\d{2,})")


def facet_label(facet: int, names: Sequence[str] = ()) -> str:
    """`facet_0007`, or `facet_0007_top` when it has a name: one word, without signs that tools trip over.

    No `_v`, `_region`, `_frame` or `_proxy` is made here; media servers read meaning into those.
    """
    name = names[facet - 1] if facet <= len(names) else ""
    word = re.sub(r"[^\w.-]+", "_", name).strip("_")
    return f"facet_{facet:04d}" + (f"_{word}" if word else "")


def parse_label(label: str) -> tuple[int, str] | None:
    """Id and name of a `facet_label`, whatever follows it; None of any other name."""
    match = _LABEL.match(label)
    if match is None or int(match[1]) < 1:
        return None
    return int(match[1]), match[2] or ""


def page_files(path: Path, pages: int) -> list[Path]:
    """The file of each page: `path` itself for one page, else `NAME_page_01.SUFFIX` and so on."""
    if pages == 1:
        return [path]
    return [path.with_name(f"{path.stem}_page_{page:02d}{path.suffix}") for page in range(1, pages + 1)]


def existing_pages(path: Path) -> list[Path]:
    """The files `page_files` made that are there: of `path` itself, or of the family of its pages."""
    match = _PAGE.fullmatch(path.stem)
    if path.exists() and match is None:
        return [path]
    stem = match[1] if match else path.stem
    found: list[Path] = []
    while (page := path.with_name(f"{stem}_page_{len(found) + 1:02d}{path.suffix}")).exists():
        found.append(page)
    return found if path in found or not path.exists() else [path]
