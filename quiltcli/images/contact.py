"""Contact sheets: all images of a render side by side, small, each with its name.

Thumbnails are means of whole pixels, labels are drawn dot by dot: a sheet is the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.drawing.font import HEIGHT, text_mask, text_width
from quiltcli.images.names import names_in
from quiltcli.images.preview import Bytes, Look, display_values, image_colors, scaled_down, write_values
from quiltcli.images.turns import is_ring_output, turn_pictures
from quiltcli.job.frames import format_frames

MOST = 2000
"""Images a sheet takes: more are neither seen nor soon read."""
_GAP = 8
_PAPER, _INK = 34, 190


@dataclass(frozen=True)
class Sheet:
    """What a contact sheet shows, and how.

    Attributes:
        kind: `page` or `facet`; None for pages, or facets where there are no pages.
        frames: frame numbers; None for all, or the first alone where facets are shown.
        columns: images in a row; None for as many as make the sheet about 3 : 2.
        width: of a thumbnail's cell, pixels.
        look: how light becomes colour.
    """

    kind: str | None = None
    frames: Sequence[int] | None = None
    columns: int | None = None
    width: int = 240
    look: Look = field(default_factory=Look)


def contact_sheet(out: Path, picture: Path, sheet: Sheet | None = None) -> tuple[int, tuple[int, int]]:
    """Draw a contact sheet of a render's output folder.

    Returns:
        The number of images, and the sheet's width and height in pixels.

    Raises:
        OutputError: there are no such images, or too many, or they cannot be read or the sheet written.
    """
    sheet = sheet or Sheet()
    if is_ring_output(out):
        shown = list(turn_pictures(out, sheet.width, sheet.frames))
    else:
        shown = [(label, _thumbnail(path, sheet)) for label, path in chosen_images(out, sheet)]
    pixels = _laid_out([cell for _, cell in shown], [label for label, _ in shown], sheet)
    write_values(picture, pixels, sheet.look.view)
    return len(shown), (pixels.shape[1], pixels.shape[0])


def chosen_images(out: Path, sheet: Sheet) -> list[tuple[str, Path]]:
    """Label and file of every image on the sheet, by frame, then by page or facet (OutputError)."""
    known = sorted(
        names_in(out).found(out), key=lambda item: (item[0].kind, item[0].frame, item[0].number, item[0].eye)
    )
    kind = sheet.kind or ("page" if any(name.kind == "page" for name, _ in known) else "facet")
    known = [(name, path) for name, path in known if name.kind == kind]
    if not known:
        wrong = f"has no images of {kind}s (expected the folder that quilt render has written to)"
        raise OutputError(Problem(wrong, file=str(out)))
    there = sorted({name.frame for name, _ in known})
    wanted = set((there if kind == "page" else there[:1]) if sheet.frames is None else sheet.frames)
    if missing := sorted(wanted - set(there)):
        wrong = f"has no {kind}s of frame {missing[0]} (it has {format_frames(there)})"
        raise OutputError(Problem(wrong, file=str(out)))
    found = [
        (f"{kind} {name.number}, frame {name.frame}" + (f", {name.eye}" if name.eye else ""), path)
        for name, path in known
        if name.frame in wanted
    ]
    if len(found) > MOST:
        raise OutputError(
            Problem(f"has {len(found)} such images, more than {MOST} (choose frames)", str(out))
        )
    return found


def _thumbnail(path: Path, sheet: Sheet) -> Bytes:
    """An image, small enough for a cell that is as high as it is wide."""
    return display_values(scaled_down(image_colors(path), sheet.width), sheet.look).astype(np.uint8)


def _laid_out(cells: Sequence[Bytes], labels: Sequence[str], sheet: Sheet) -> Bytes:
    """The sheet's pixels (H, W, 3)."""
    wide = max(*(cell.shape[1] for cell in cells), *(text_width(label) for label in labels))
    high = max(cell.shape[0] for cell in cells) + _GAP + HEIGHT
    columns = sheet.columns or math.ceil(math.sqrt(len(cells) * 1.5 * high / wide))
    columns = min(columns, len(cells))
    rows = -(-len(cells) // columns)
    shape = (_GAP + rows * (high + 2 * _GAP), _GAP + columns * (wide + _GAP), 3)
    pixels = np.full(shape, _PAPER, dtype=np.uint8)
    for at, (cell, label) in enumerate(zip(cells, labels, strict=True)):
        row, column = divmod(at, columns)
        top, left = _GAP + row * (high + 2 * _GAP), _GAP + column * (wide + _GAP)
        # Images stand on one line, above their names.
        foot = top + high - _GAP - HEIGHT
        side = left + (wide - cell.shape[1]) // 2
        pixels[foot - cell.shape[0] : foot, side : side + cell.shape[1]] = cell
        mask = text_mask(label)
        side = left + (wide - mask.shape[1]) // 2
        pixels[foot + _GAP : foot + _GAP + HEIGHT, side : side + mask.shape[1]][mask] = _INK
    return pixels
