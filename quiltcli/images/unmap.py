"""Cut facet images out of quilts that exist as files, whoever made them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.channels import BACKGROUND
from quiltcli.errors import OutputError, Problem, raise_all
from quiltcli.formats.exr.image import Image, read_header, write_exr
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import facet_from_world
from quiltcli.images.facets import cut_facet, page_of
from quiltcli.images.layers import read_view
from quiltcli.images.metadata import facet_attributes
from quiltcli.images.names import facet_path, name_of
from quiltcli.images.window import frame_size, whole_frame
from quiltcli.job.job import LOSSLESS
from quiltcli.layout import Layout, pixel_owners

_FRAME = re.compile(r".*\.(-?\d{1,9})")


@dataclass(frozen=True)
class QuiltFile:
    """A quilt image on disk: which page (0-based) of which frame it is."""

    path: Path
    page: int
    frame: int


def unmap(
    quilts: Sequence[Path],
    layout: Layout,
    out: Path,
    *,
    overwrite: bool = False,
    background: Mapping[str, float] = BACKGROUND,
) -> list[Path]:
    """Write the image of every facet on the given pages to `out`/facets; return the files.

    Channels and attributes are those of the quilt, and its compression if that is lossless
    (else zip); `quilt:facet` and
    `quilt:facet_from_world` are added. All files are looked at before the first is written.

    Args:
        quilts: page images. Page and frame are taken from names like `page_01.0001.exr`, else from
            the attributes `quilt:page` and `quilt:frame`; a layout of one page needs no page.
        layout: where the facets are.
        out: folder, made if need be.
        overwrite: replace files that exist.
        background: value by channel outside a facet's polygon, 0 where not named.

    Raises:
        OutputError: a quilt cannot be read, does not fit the layout, or a file is in the way.
    """
    files = _inspected(quilts, layout)
    if not overwrite:
        raise_all(OutputError, _in_the_way(files, layout, out))
    owners = pixel_owners(layout)
    maps = facet_from_world(layout.origin, layout.du, layout.dv)
    written = []
    for file in files:
        image = read_view(file.path)
        pixels = whole_frame(image, background)
        make_folder(facet_path(out, 1, 1).parent)  # only now: a damaged quilt leaves no empty folder
        page_owners = page_of(owners, layout, file.page)
        # Pixels that were lossily stored once are not to lose again.
        compression = image.compression if image.compression in LOSSLESS else "zip"
        shared = {name: value for name, value in image.attributes.items() if name != "quilt:page"}
        for row in np.flatnonzero(layout.page == file.page):
            facet = int(layout.facet[row])
            path = facet_path(out, facet, file.frame)
            cut = cut_facet(pixels, layout, int(row), page_owners, background)
            write_exr(path, cut, shared | facet_attributes(facet, maps[row]), compression)
            written.append(path)
    return written


def _inspected(quilts: Sequence[Path], layout: Layout) -> list[QuiltFile]:
    """The files in the order given, every one readable, of its page's size and given once."""
    files: list[QuiltFile] = []
    problems: list[Problem] = []
    seen: dict[tuple[int, int], Path] = {}
    for path in quilts:
        try:
            file = _identified(path, layout)
        except OutputError as error:
            problems += error.problems
            continue
        first = seen.setdefault((file.page, file.frame), path)
        if first is not path:
            same = f"is page {file.page + 1} of frame {file.frame}, and so is {first}"
            problems.append(Problem(same, file=str(path)))
        files.append(file)
    raise_all(OutputError, problems)
    return files


def _identified(path: Path, layout: Layout) -> QuiltFile:
    header = read_header(path)
    page, frame = _page_number(path, header, layout), _frame_number(path, header)
    if not 1 <= page <= len(layout.pages):
        raise OutputError(
            Problem(f"is page {page}, the layout has pages 1–{len(layout.pages)}", file=str(path))
        )
    size = frame_size(header)
    width, height = layout.pages[page - 1]
    if size != (width, height):
        wrong = f"is {size[0]}×{size[1]} pixels, page {page} of the layout is {width}×{height}"
        raise OutputError(Problem(wrong, file=str(path)))
    return QuiltFile(path, page - 1, frame)


def _page_number(path: Path, header: Image, layout: Layout) -> int:
    named = name_of(path)
    if named and named.kind == "page":
        return named.number
    known = header.attributes.get("quilt:page", 1 if len(layout.pages) == 1 else None)
    if not isinstance(known, int):
        wanted = "expected a name like page_01.0001.exr or the attribute quilt:page"
        raise OutputError(Problem(f"does not say which page it is, {wanted}", file=str(path)))
    return known


def _frame_number(path: Path, header: Image) -> int:
    match = _FRAME.fullmatch(path.stem)
    known = int(match[1]) if match else header.attributes.get("quilt:frame")
    if not isinstance(known, int):
        wanted = "expected a name like page_01.0001.exr or the attribute quilt:frame"
        raise OutputError(Problem(f"does not say which frame it is, {wanted}", file=str(path)))
    return known


def _in_the_way(files: Sequence[QuiltFile], layout: Layout, out: Path) -> Iterator[Problem]:
    for file in files:
        for facet in layout.facet[layout.page == file.page]:
            path = facet_path(out, int(facet), file.frame)
            if path.exists():
                yield Problem("exists already, expected to be told to overwrite it", file=str(path))
                return
