"""From wishes to a folder that is ready to render."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, build_facets, load_display
from quiltcli.errors import JobError, OutputError, Problem, raise_all
from quiltcli.exchange.newjob import texts
from quiltcli.exchange.newjob.arenas import settled
from quiltcli.exchange.newjob.figures import length_text
from quiltcli.exchange.newjob.kinds import check_wishes, kind_of
from quiltcli.exchange.newjob.plan import PAPER, draw_plan
from quiltcli.exchange.newjob.stand import Stand, stand_for
from quiltcli.exchange.newjob.wishes import Ball, Panel, Wishes
from quiltcli.formats.drawing.png import write_png
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.formats.yaml.source import Source
from quiltcli.job import DisplayFile, PackSpec, PanelSpec, ResolutionSpec
from quiltcli.job.frames import parse_frames
from quiltcli.job.model import MESHES, attach
from quiltcli.job.places import PlaceOnPage
from quiltcli.layout import Layout
from quiltcli.layout.file import layout_text
from quiltcli.layout.from_job import layout_for

_PLACE = re.compile(r"\s*([\w-]+)\s*=\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(0|90|180|270)\s*)?")
NAMES = ("display.yaml", "display.obj", "layout.yaml", "scene.yaml", "content.obj", "job.yaml", "plan.png")


@dataclass(frozen=True)
class NewJob:
    """A job that has not been written yet.

    Attributes:
        files: text of every file by name.
        facets: the display.
        layout: where its facets lie on the canvas; None without a canvas.
        stand: the viewer's spot.
    """

    files: dict[str, str]
    facets: Facets
    layout: Layout | None
    stand: Stand


def new_job(wishes: Wishes, folder: Path) -> NewJob:
    """Make the files of a job that is to lie in `folder`.

    Raises:
        JobError: figures that cannot be read, or that make no display.
        DisplayError, LayoutError: panels that are no facets, or do not fit the canvas.
    """
    check_wishes(wishes)
    wishes, kind = settled(wishes), kind_of(wishes)
    if kind.arrange is not None:
        wishes = kind.arrange(wishes)
    frames = parse_frames(wishes.frames)
    content = _content(wishes, folder)
    files, facets = _display(wishes, kind.build(wishes), folder)
    stand = stand_for(wishes, facets)
    layout = None
    if wishes.canvas is not None:
        method = "auto" if "display.obj" in files else "rects"
        pack = PackSpec(size=wishes.canvas, max_pages=1, padding=wishes.padding, method=method)
        layout = layout_for(pack, facets)
        files["layout.yaml"] = layout_text(layout, folder)
    files["scene.yaml"] = texts.scene_text(stand, content)
    if content is None:
        files["content.obj"] = texts.content_text()
    files["job.yaml"] = texts.job_text(wishes, stand, frames)
    return NewJob(files, facets, layout, stand)


def write_new_job(wishes: Wishes, folder: Path) -> list[Path]:
    """Write a new job into a folder, which is made if need be; the paths written, the plan last.

    Raises:
        OutputError: one of the files is there already, or cannot be written.
        QuiltError: as for `new_job`; nothing is written then.
    """
    raise_all(
        OutputError,
        (
            Problem("exists already (expected a folder without a job)", file=str(folder / name))
            for name in NAMES
            if (folder / name).exists()
        ),
    )
    job = new_job(wishes, folder)
    make_folder(folder)
    for name, text in job.files.items():
        write_text(folder / name, text)
    write_png(draw_plan(wishes.kind, job.facets, job.stand), folder / "plan.png", PAPER)
    return [folder / name for name in (*job.files, "plan.png")]


def _content(wishes: Wishes, folder: Path) -> str | None:
    """The content's file as the scene file will name it."""
    if wishes.scene is None:
        return None
    path = Path(wishes.scene)
    if path.suffix.lower() not in MESHES:
        raise JobError(f"--scene: expected a mesh ({', '.join(MESHES)}), got {wishes.scene!r}")
    if not path.is_file():
        raise JobError(f"--scene: no such file: {wishes.scene}")
    return Path(os.path.relpath(path, folder)).as_posix()


def _display(wishes: Wishes, built: tuple[Panel, ...] | Ball, folder: Path) -> tuple[dict[str, str], Facets]:
    """Files of the display, and its facets."""
    if isinstance(built, Ball):
        return _ball(wishes, built, folder)
    places = _places(wishes, [panel.name for panel in built])
    panels = tuple(_panel_spec(panel, places.get(panel.name)) for panel in built)
    spec = DisplayFile(panels=panels)
    attach(spec, Source(folder / "display.yaml"))
    notes = [f"{float(panel.raster.size[0]):.6g} × {float(panel.raster.size[1]):.6g} m" for panel in built]
    return {"display.yaml": texts.panels_text(wishes, spec, notes)}, load_display(spec)


def _panel_spec(panel: Panel, place: PlaceOnPage | None) -> PanelSpec:
    """A panel as the file has it: a pitch where its pixels are square, else a size."""
    across, down = (side / count for side, count in zip(panel.raster.size, panel.raster.pixels, strict=True))
    wide, high = map(length_text, panel.raster.size)
    x, y, z = (round(c, 12) + 0.0 for c in panel.at)
    return PanelSpec(
        name=panel.name,
        pixels=panel.raster.pixels,
        pitch=length_text(across) if across == down else None,
        size=None if across == down else (wide, high),
        at=(x, y, z),
        yaw_deg=round(panel.yaw_deg, 12) + 0.0,
        pitch_deg=panel.pitch_deg,
        place=place,
    )


def _ball(wishes: Wishes, ball: Ball, folder: Path) -> tuple[dict[str, str], Facets]:
    if wishes.places:
        raise JobError("--place: the pieces of a sphere have no names (expected --canvas alone)")
    mesh = PolygonMesh(
        vertices=np.round(np.array(ball.vertices), 12),
        corner_start=np.cumsum([0, *map(len, ball.faces)]),
        corners=np.array([corner for face in ball.faces for corner in face], dtype=np.int64),
        uv=None,
        names=("",) * len(ball.faces),
        lines=np.zeros(len(ball.faces), dtype=np.int64),
        path=str(folder / "display.obj"),
    )
    spec = DisplayFile(
        mesh=Path("display.obj"),
        viewing_side="back" if wishes.inside else "front",
        resolution=ResolutionSpec(pitch=length_text(ball.pitch)),
    )
    attach(spec, Source(folder / "display.yaml"))
    files = {"display.yaml": texts.ball_text(wishes, spec), "display.obj": texts.ball_mesh_text(ball)}
    return files, build_facets(mesh, spec)


def _places(wishes: Wishes, names: list[str]) -> dict[str, PlaceOnPage]:
    """Where panels are to lie on the canvas, by name."""
    if wishes.places and wishes.canvas is None:
        raise JobError("--place needs a canvas (expected --canvas 2112x1024, too)")
    places = {}
    for text in wishes.places:
        match = _PLACE.fullmatch(text)
        if match is None:
            raise JobError(f"--place: expected NAME=X,Y or NAME=X,Y,TURN, such as left=0,0,90, got {text!r}")
        if match[1] not in names:
            raise JobError(f"--place: there is no panel {match[1]!r} (known: {', '.join(names)})")
        places[match[1]] = PlaceOnPage(at=(int(match[2]), int(match[3])), rotate=float(match[4] or 0))
    return places
