"""From an output folder to the files: the page, and the model beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from quiltcli.errors import OutputError, Problem
from quiltcli.exchange.web.contents import display_name, page_data
from quiltcli.exchange.web.fitting import fitting_pictures
from quiltcli.exchange.web.folder import Folder, chosen_frames, open_folder
from quiltcli.exchange.web.frames import FrameView, ViewOptions, eye_path, frame_view
from quiltcli.exchange.web.ghost import Ghost, ghost
from quiltcli.exchange.web.html import page
from quiltcli.exchange.web.mesh import DisplayMesh, display_mesh
from quiltcli.exchange.web.model import model
from quiltcli.exchange.web.textures import Coding, Picture, extents, factor
from quiltcli.formats.whole import make_folder, whole_file, write_text
from quiltcli.job.frames import format_frames
from quiltcli.viewer.view import views_at

MOST_FRAMES = 24
"""Frames a page holds unless one asks for more."""


@dataclass(frozen=True)
class Written:
    """What was written.

    Attributes:
        page, model: the files; no model where none was wanted.
        lines: label and text of what there is to say of them.
    """

    page: Path
    model: Path | None
    lines: tuple[tuple[str, str], ...]


def view(
    path: Path,
    frames: Sequence[int] | None = None,
    output: Path | None = None,
    options: ViewOptions | None = None,
) -> Written:
    """Write a page, and a model, of frames in the output folder `path`.

    Args:
        path: what a render has left.
        frames: the frames; all there are, or `MOST_FRAMES` of them, where None.
        output: the page, `view.html` in the folder where None; the model has its name, with .glb.
        options: what the page is to hold.

    Raises:
        QuiltError: bad input, images that are missing, or a file that cannot be written.
    """
    options = options or ViewOptions()
    output = output or path / "view.html"
    if output.suffix.lower() not in (".html", ".htm"):
        raise OutputError(Problem("a page's name must end in .html", file=str(output)))
    folder = open_folder(path)
    numbers = chosen_frames(folder, frames, MOST_FRAMES)
    first = views_at(folder.stage.job, numbers[0])[0].viewer
    mesh = display_mesh(folder.stage.facets, folder.stage.layout, first)
    shade = ghost(folder.stage.scene, mesh.centre, options.ghost)
    seen = [frame_view(folder, number, options.errors) for number in numbers]
    make_folder(output.parent)
    coding, pictures = _write_page(output, folder, mesh, seen, shade, options)
    lines = [("page", f"{output} ({output.stat().st_size / 1e6:.1f} MB)")]
    written = output.with_suffix(".glb") if options.model else None
    if written is not None:
        _write_model(written, folder, mesh, seen[0], shade, coding, pictures)
        lines += [("model", f"{written} ({written.stat().st_size / 1e6:.1f} MB), frame {numbers[0]}")]
    lines += [
        ("frames", _frame_words(folder, numbers)),
        ("pictures", _picture_words(folder, coding)),
        ("scene", _ghost_words(shade, len(folder.stage.scene.triangles))),
    ]
    return Written(output, written, tuple(lines))


def _write_page(
    output: Path,
    folder: Folder,
    mesh: DisplayMesh,
    seen: Sequence[FrameView],
    shade: Ghost | None,
    options: ViewOptions,
) -> tuple[Coding, list[Picture]]:
    """Write the page; the coding of its pictures, and those of the first frame."""
    data = page_data(folder, mesh, seen, shade, options)
    title = f"{display_name(folder)} · frame {seen[0].viewer.frame}"
    room = options.size * 1e6 - len(page(title, data).encode())
    numbers = [frame.viewer.frame for frame in seen]
    coding, pictures = fitting_pictures(folder, numbers, options, room)
    data["pages"] = extents(folder.stage.layout, coding.side).tolist()
    for entry, pages in zip(data["frames"], pictures, strict=True):
        entry["pages"] = [each.url for each in pages]
    write_text(output, page(title, data))
    return coding, pictures[0]


def _write_model(
    output: Path,
    folder: Folder,
    mesh: DisplayMesh,
    seen: FrameView,
    shade: Ghost | None,
    coding: Coding,
    pictures: list[Picture],
) -> None:
    spans = extents(folder.stage.layout, coding.side)
    data = model(mesh, seen.lit, pictures, spans, seen.camera, seen.fov, eye_path(folder), shade)
    with whole_file(output) as temporary:
        temporary.write_bytes(data)


def _frame_words(folder: Folder, numbers: Sequence[int]) -> str:
    """Which frames, and how many there are when not all are taken."""
    if len(numbers) == len(folder.frames):
        return format_frames(numbers)
    return f"{len(numbers)} of {len(folder.frames)}: {format_frames(sorted(numbers))} (-f takes others)"


def _picture_words(folder: Folder, coding: Coding) -> str:
    by = max(factor(page, coding.side) for page in folder.stage.layout.pages.tolist())
    return f"{coding}, {'at full size' if by == 1 else f'reduced to 1/{by}'}"


def _ghost_words(shade: Ghost | None, triangles: int) -> str:
    if shade is None:
        return f"left out ({triangles:,} triangles)"
    thinned = f"{len(shade.triangles):,} of {triangles:,} triangles, thinned"
    return thinned if shade.cells else f"{triangles:,} triangles"
