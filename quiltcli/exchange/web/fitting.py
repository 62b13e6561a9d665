"""Pictures for a page that is to stay small: the best coding with which all frames fit."""

from __future__ import annotations

from collections.abc import Sequence

from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.errors import OutputError
from quiltcli.exchange.web.folder import Folder
from quiltcli.exchange.web.frames import ViewOptions, frame_images
from quiltcli.exchange.web.textures import Coding, Picture, codings, page_picture

_BASE64 = 4 / 3


def fitting_pictures(
    folder: Folder, frames: Sequence[int], options: ViewOptions, room: float
) -> tuple[Coding, list[list[Picture]]]:
    """Pictures of every page of every frame, in at most `room` bytes of text altogether.

    Raises:
        OutputError: they do not fit however small they are made.
    """
    first = frame_images(folder, frames[0])
    for coding in codings(options.texture):
        pictures = [_pages(first, coding, options)]
        # Most codings are ruled out by one frame, before the others are read.
        if _length(pictures) * len(frames) > 1.05 * room:
            continue
        pictures += [_pages(frame_images(folder, frame), coding, options) for frame in frames[1:]]
        if _length(pictures) <= room:
            return coding, pictures
    raise OutputError(
        f"{len(frames)} frames do not fit into a page of {options.size:g} MB (take fewer with -f, or allow"
        " more with --max-mb)"
    )


def _pages(shown: Shown, coding: Coding, options: ViewOptions) -> list[Picture]:
    count = len(shown.layout.pages)
    return [page_picture(shown, page, coding, options.view, options.exposure) for page in range(count)]


def _length(pictures: Sequence[Sequence[Picture]]) -> float:
    """Length of the pictures as text, bytes."""
    return _BASE64 * sum(len(each.data) + 32 for pages in pictures for each in pages)
