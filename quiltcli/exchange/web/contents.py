"""What goes into a page beside its pictures: everything the page's script reads, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from quiltcli.exchange.web.folder import Folder
from quiltcli.exchange.web.frames import ASPECT, FrameView, ViewOptions, eye_path
from quiltcli.exchange.web.ghost import Ghost
from quiltcli.exchange.web.html import packed
from quiltcli.exchange.web.mesh import DisplayMesh
from quiltcli.images.preview import tone_map
from quiltcli.viewer.viewer import Viewer

# As `quilt simulate` draws them: what is around, and screens that are off, edge-on and face-on.
_GREYS = np.array([[0.05, 0.052, 0.056], [0.035 * 0.25] * 3, [0.035] * 3])


def page_data(
    folder: Folder, mesh: DisplayMesh, seen: Sequence[FrameView], ghost: Ghost | None, options: ViewOptions
) -> dict[str, Any]:
    """The data of a page; positions are single precision, from the middle of the display.

    `frames` have no `pages` yet: URLs of a picture a page. Nor has the whole `pages`: the quilt
    pixels that each page's picture spans.
    """
    job, facets = folder.stage.job, folder.stage.facets
    return {
        "display": display_name(folder),
        "fps": float(job.fps),
        "aspect": ASPECT,
        "radius": mesh.radius,
        "centre": mesh.centre.tolist(),
        "greys": tone_map(_GREYS[None], options.view, options.exposure)[0].tolist(),
        "nearest": options.nearest,
        "mesh": _mesh_data(mesh),
        "names": list(facets.names) if any(facets.names) else [],
        "sizes": folder.stage.layout.size.tolist(),
        "path": packed((eye_path(folder) - mesh.centre).astype(np.float32)),
        "ghost": _ghost_data(ghost),
        "frames": [
            {**_frame_data(frame, mesh), **_carried(folder, seen[0].viewer, frame.viewer, mesh)}
            for frame in seen
        ],
    }


def display_name(folder: Folder) -> str:
    """What the display is called: its file's name."""
    return folder.stage.job.display.stem


def _mesh_data(mesh: DisplayMesh) -> dict[str, Any]:
    curved = {}
    if mesh.bent.any():
        curved = {
            "bent": packed(mesh.bent.astype(np.uint8)),
            "facing": packed(mesh.facing),
            "edges": packed(mesh.edges.astype(np.uint32)),
        }
    return {
        "position": packed(mesh.position),
        "quilt": packed(mesh.quilt),
        "start": packed(mesh.start.astype(np.uint32)),
        "triangles": packed(mesh.triangles.astype(np.uint32)),
        "facet": packed(mesh.facet.astype(np.uint32)),
        "page": packed(mesh.page),
        "normal": packed(mesh.normal),
        "both": mesh.both_sides,
        **curved,
    }


def _ghost_data(ghost: Ghost | None) -> dict[str, str] | None:
    if ghost is None:
        return None
    return {
        "position": packed(ghost.position),
        "color": packed(np.rint(ghost.color * 255).astype(np.uint8)),
        "triangles": packed(ghost.triangles.astype(np.uint32)),
    }


def _carried(folder: Folder, first: Viewer, viewer: Viewer, mesh: DisplayMesh) -> dict[str, Any]:
    """How a projection has gone along with the viewer since the first frame: a 4 × 4 matrix, by columns."""
    charts = [chart for chart in folder.stage.facets.charts if chart is not None and not chart.stands]
    if not charts:
        return {}
    matrix = np.eye(4)
    if charts[0].follows == "view":
        matrix[:3, :3] = viewer.camera_from_world.T @ first.camera_from_world
    matrix[:3, 3] = viewer.eye - mesh.centre - matrix[:3, :3] @ (first.eye - mesh.centre)
    return {"carried": matrix.T.reshape(-1).tolist()}


def _frame_data(frame: FrameView, mesh: DisplayMesh) -> dict[str, Any]:
    """Directions as the camera needs them: the viewer's own, and those that frame the display."""
    viewer, camera = frame.viewer, frame.camera
    return {
        "frame": viewer.frame,
        "eye": (viewer.eye - mesh.centre).tolist(),
        "look": viewer.look.tolist(),
        "up": viewer.up.tolist(),
        "camera": {"look": camera.look.tolist(), "up": camera.up.tolist(), "fov": frame.fov},
        "lit": packed(frame.lit.astype(np.uint8)),
        "heat": frame.heat.url if frame.heat else None,
        "figures": [list(figure) for figure in frame.figures],
    }
