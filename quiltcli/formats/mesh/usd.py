"""The faces of a USD stage as the faces of a display."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.corners import turned
from quiltcli.formats.mesh.mesh import PolygonMesh
from quiltcli.formats.usd.mesh import Asked, read_dress, read_faces, read_points
from quiltcli.formats.usd.places import Moment
from quiltcli.formats.usd.stage import library, open_stage, understood
from quiltcli.formats.usd.walk import walk
from quiltcli.geometry import FloatArray, IntArray, offsets

MOST_CORNERS = 2**24


def read_usd_mesh(path: Path) -> PolygonMesh:
    """Every polygon that a stage shows as its animation begins, in the order of its prims; metres, Y up.

    Copies that are mirrored are wound so that their front stays their front.

    Raises:
        MissingExtraError: the package of the extra `usd` is not installed.
        MeshError: the stage is wrong, or shows no polygon.
    """
    stage = open_stage(path)
    with understood(path):
        code = library().Usd.TimeCode
        moment = Moment(stage, code.EarliestTime() if stage.range is None else code(stage.range[0]))
        with np.errstate(all="ignore"):  # places may be anything
            copies = list(_copies(moment))
    if not any(len(one.counts) for one in copies):
        raise MeshError(Problem("holds no polygons", str(path)))
    counts = np.concatenate([one.counts for one in copies])
    base = offsets([len(one.points) for one in copies])
    pairs = np.concatenate([one.uv for one in copies])
    return PolygonMesh(
        vertices=np.concatenate([one.points for one in copies]),
        corner_start=offsets(counts),
        corners=np.concatenate([one.corners + first for one, first in zip(copies, base, strict=False)]),
        uv=None if np.isnan(pairs).all() else pairs,
        names=("",) * len(counts),
        lines=np.zeros(len(counts), dtype=np.int64),
        path=str(path),
    )


class _Copy(NamedTuple):
    """A mesh in one of its places: points (V, 3), corners (C,) of faces with counts (F,), their uv (C, 2)."""

    points: FloatArray
    corners: IntArray
    counts: IntArray
    uv: FloatArray


def _copies(moment: Moment) -> Iterator[_Copy]:
    """All meshes in all their places."""
    stage, time, total = moment.stage, moment.time, 0
    for piece in walk(stage, time).pieces:
        faces = read_faces(stage, piece.mesh, time)
        points = read_points(stage, piece.mesh, time, faces.corners.vertices)
        (found, _) = read_dress(stage, piece.mesh, faces, Asked(("st", "")), time, moving=False).uv
        corner = faces.corners.vertex
        uv = np.full((len(corner), 2), np.nan) if found is None else found.at_corners
        for place in (place for place in piece.places if moment.shown(place)):
            matrices = stage.world @ moment.matrices(place)
            total += len(matrices) * max(len(corner), len(points))
            if total > MOST_CORNERS:
                words = f"and all before it have {total:,} corners (expected at most {MOST_CORNERS:,})"
                raise stage.error(piece.prim, words)
            for matrix in matrices:
                mirrored = np.linalg.det(matrix[:3, :3]) < 0
                order = turned(faces.start) if mirrored else np.arange(len(corner))
                there = points @ matrix[:3, :3].T + matrix[:3, 3]
                yield _Copy(there, corner[order], np.diff(faces.start), uv[order])
