"""The faces of a USD stage as the faces of a display."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.corners import turned
from quiltcli.formats.mesh.mesh import PolygonMesh
from quiltcli.formats.usd.mesh import Asked, read_dress, read_faces, read_points
from quiltcli.formats.usd.places import Moment
from quiltcli.formats.usd.stage import library, open_stage
from quiltcli.formats.usd.walk import walk
from quiltcli.geometry import FloatArray, IntArray, offsets


def read_usd_mesh(path: Path) -> PolygonMesh:
    """Every polygon that a stage shows as its animation begins, in the order of its prims; metres, Y up.

    Copies that are mirrored are wound so that their front stays their front.

    Raises:
        MissingExtraError: the package of the extra `usd` is not installed.
        MeshError: the stage is wrong, or shows no polygon.
    """
    stage = open_stage(path)
    code = library().Usd.TimeCode
    time = code.EarliestTime() if stage.range is None else code(stage.range[0])
    moment = Moment(stage, time)
    vertices: list[FloatArray] = []
    corners: list[IntArray] = []
    counts: list[IntArray] = []
    uv: list[FloatArray] = []
    base = 0
    for piece in walk(stage, time).pieces:
        faces = read_faces(stage, piece.mesh, time)
        points = read_points(stage, piece.mesh, time, faces.corners.vertices)
        (found, _) = read_dress(stage, piece.mesh, faces, Asked(("st", "")), time, moving=False).uv
        pairs = np.full((len(faces.corners.vertex), 2), np.nan) if found is None else found.at_corners
        for place in (place for place in piece.places if moment.shown(place)):
            for matrix in stage.world @ moment.matrices(place):
                vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
                mirrored = np.linalg.det(matrix[:3, :3]) < 0
                order = turned(faces.start) if mirrored else np.arange(len(pairs))
                corners.append(faces.corners.vertex[order] + base)
                uv.append(pairs[order])
                counts.append(np.diff(faces.start))
                base += len(points)
    if not sum(map(len, counts)):
        raise MeshError(Problem("holds no polygons", str(path)))
    sizes, joined = np.concatenate(counts), np.concatenate(uv)
    return PolygonMesh(
        vertices=np.concatenate(vertices),
        corner_start=offsets(sizes),
        corners=np.concatenate(corners),
        uv=None if np.isnan(joined).all() else joined,
        names=("",) * len(sizes),
        lines=np.zeros(len(sizes), dtype=np.int64),
        path=str(path),
    )
