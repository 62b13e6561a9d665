"""File names: what an image holds, and of which view, is in its name; the frame number comes last."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_NAME = re.compile(
    r"(?P<kind>[A-Za-z]+)_(?P<number>\d{1,9})(?:\.(?P<eye>left|right))?\.(?P<frame>-?\d{4,9})\.exr"
)


@dataclass(frozen=True)
class ImageName:
    """What the name of a file says.

    Attributes:
        kind: `page` or `facet`; of other programs' files, the word before the number.
        number: the page or facet id, from 1.
        frame: frame number.
        eye: `left` or `right`, empty where there is one eye.
    """

    kind: str
    number: int
    frame: int
    eye: str = ""


def frame_digits(frame: int) -> str:
    """A frame number as it ends a file name: a sign if negative, then four digits or more."""
    return f"{'-' if frame < 0 else ''}{abs(frame):04d}"


def quilt_path(out: Path, page: int, frame: int, eye: str = "") -> Path:
    """The file of a quilt's page (1-based) in a frame, for an eye where there are two."""
    return Path(out) / "quilt" / f"page_{page:02d}{_part(eye)}.{frame_digits(frame)}.exr"


def facet_path(out: Path, facet_id: int, frame: int, eye: str = "") -> Path:
    """The file of a facet's image (1-based id) in a frame, for an eye where there are two."""
    return Path(out) / "facets" / f"facet_{facet_id:04d}{_part(eye)}.{frame_digits(frame)}.exr"


def layout_path(out: Path) -> Path:
    """The layout that was used."""
    return Path(out) / "layout.yaml"


def _part(eye: str) -> str:
    return f".{eye}" if eye else ""


def name_of(path: Path) -> ImageName | None:
    """What the name of a file made by the above says; None of any other."""
    match = _NAME.fullmatch(path.name)
    if not match:
        return None
    return ImageName(match["kind"], int(match["number"]), int(match["frame"]), match["eye"] or "")
