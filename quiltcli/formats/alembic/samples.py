"""Meshes of an archive at a time: samples, and what lies between them.

Times are in seconds. Samples are asked for by the time at which they were taken, as a whole number given to
the library may mean seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.formats.alembic.archive import Archive, Piece, library
from quiltcli.formats.corners import Carried, Corners, CornersError, Dress, Faces, carried, dressed, faces_of
from quiltcli.geometry import FloatArray, IntArray

_NEAR = 1e-4
_SCOPES = {
    "kConstantScope": "constant",
    "kUniformScope": "uniform",
    "kVaryingScope": "varying",
    "kVertexScope": "vertex",
    "kFacevaryingScope": "faceVarying",
}


@dataclass(frozen=True)
class Between:
    """Where a time lies among samples.

    Attributes:
        one: selects the sample at or before it.
        other: the next.
        share: of the way from the one to the other.
    """

    one: Any
    other: Any
    share: float


def between(sampling: Any, count: int, seconds: float) -> Between:
    """The samples around a time."""
    times = sampling.getSampleTime
    first = int(sampling.getFloorIndex(seconds, count)) if count > 1 else 0
    following = min(first + 1, count - 1)
    start, end = float(times(first)), float(times(following))
    share = min(max((seconds - start) / (end - start), 0.0), 1.0) if end > start else 0.0
    # A frame's time may fall short of its sample's by a rounding.
    if share > 1 - _NEAR:
        return Between(_at(end), _at(end), 0.0)
    return Between(_at(start), _at(end), 0.0 if share < _NEAR else share)


def _at(seconds: float) -> Any:
    selector = library().Abc.ISampleSelector
    return selector(float(seconds), selector.TimeIndexType.kNearIndex)


def held(piece: Piece, seconds: float) -> Any:
    """Selects the sample of a mesh that is shown until the next."""
    return between(piece.schema.getTimeSampling(), piece.schema.getNumSamples(), seconds).one


def world(piece: Piece, seconds: float) -> FloatArray:
    """World from mesh (4, 4); matrices are linear between their samples."""
    result = np.eye(4)
    for schema in piece.xforms:
        span = between(schema.getTimeSampling(), schema.getNumSamples(), seconds)
        own = _matrix(schema, span.one)
        if span.share:
            own = (1 - span.share) * own + span.share * _matrix(schema, span.other)
        result = result @ own if schema.getInheritsXforms(span.one) else own
    return result


def _matrix(schema: Any, selector: Any) -> FloatArray:
    """A matrix that acts on columns; Alembic's act on rows."""
    given = schema.getValue(selector).getMatrix()
    return np.array([[given[row][column] for row in range(4)] for column in range(4)], dtype=np.float64)


def shown(piece: Piece, seconds: float) -> bool:
    """Whether neither a mesh nor anything above it is hidden."""
    selector = library().Abc.ISampleSelector
    # A moment later, as a frame's time may fall short of its sample's.
    moment = selector(float(seconds) + 1e-5, selector.TimeIndexType.kFloorIndex)
    return not library().AbcGeom.IsAncestorInvisible(piece.object, moment)


def read_faces(archive: Archive, piece: Piece, seconds: float) -> Faces:
    """The faces of a mesh, which Alembic winds clockwise.

    Raises:
        MeshError: counts and indices do not fit one another, or name positions that are not there.
    """
    sample = _sample(archive, piece, held(piece, seconds))
    counts, indices = _whole(sample.getFaceCounts()), _whole(sample.getFaceIndices())
    vertices = len(sample.getPositions())
    if counts.size and counts.min() < 0:
        raise archive.error(piece, f"has a face of {counts.min()} corners")
    if counts.sum() != indices.size:
        raise archive.error(piece, f"has {indices.size:,} indices of corners (expected {counts.sum():,})")
    outside = (indices < 0) | (indices >= vertices)
    if outside.any():
        words = f"names position {indices[outside][0]} of {vertices:,}"
        raise archive.error(piece, f"{words} (expected 0 to {vertices - 1:,})")
    return faces_of(counts, indices, vertices, np.zeros(0, np.int64), left_handed=True)


def read_points(archive: Archive, piece: Piece, seconds: float, expected: int) -> FloatArray:
    """Positions (V, 3) of a mesh, linear between samples of one number of them where faces stay the same.

    Raises:
        MeshError: there are not as many as expected.
    """
    schema = piece.schema
    span = between(schema.getTimeSampling(), schema.getNumSamples(), seconds)
    points = _numbers(_sample(archive, piece, span.one).getPositions(), 3)
    if len(points) != expected:
        raise archive.error(piece, f"has {len(points):,} positions at {seconds:g} s (expected {expected:,})")
    if span.share and not changes_faces(piece):
        following = _numbers(_sample(archive, piece, span.other).getPositions(), 3)
        if len(following) == len(points):
            return (1 - span.share) * points + span.share * following
    return points


def changes_faces(piece: Piece) -> bool:
    """Whether a mesh may have other faces at other times."""
    return str(piece.schema.getTopologyVariance()) == "kHeterogenousTopology"


def read_normals(archive: Archive, piece: Piece, corners: Corners, seconds: float) -> Carried | None:
    """Normals of a mesh's corners; None without any."""
    if not hasattr(piece.schema, "getNormalsParam"):
        return None
    return _param(archive, piece, piece.schema.getNormalsParam(), corners, 3, seconds)


def read_dress(archive: Archive, piece: Piece, faces: Faces, seconds: float, *, moving: bool) -> Dress:
    """What a mesh's corners carry: texture coordinates, and the first colours among what else is there.

    Raises:
        MeshError: values do not fit the mesh.
    """
    corners = faces.corners
    uv = _param(archive, piece, piece.schema.getUVsParam(), corners, 2, seconds)
    color, opacity = _colors(archive, piece, corners, seconds)
    normals = read_normals(archive, piece, corners, seconds)
    return dressed((uv, None), color, opacity, normals, moving=moving)


def _colors(
    archive: Archive, piece: Piece, corners: Corners, seconds: float
) -> tuple[Carried | None, Carried | None]:
    geom = library().AbcGeom
    others = piece.schema.getArbGeomParams()
    for header in others.propertyheaders if others.valid() else ():
        if geom.IC3fGeomParam.matches(header):
            param = geom.IC3fGeomParam(others, header.getName())
            return _param(archive, piece, param, corners, 3, seconds), None
        if geom.IC4fGeomParam.matches(header):
            param = geom.IC4fGeomParam(others, header.getName())
            four = _param(archive, piece, param, corners, 4, seconds)
            if four is not None:
                rest = Carried(four.values[:, 3:], four.row, four.by_face)
                return Carried(four.values[:, :3], four.row, four.by_face), rest
    return None, None


def _param(
    archive: Archive, piece: Piece, param: Any, corners: Corners, width: int, seconds: float
) -> Carried | None:
    """Values of a parameter; None where there is none."""
    if not param.valid() or not param.getNumSamples():
        return None
    selector = between(param.getTimeSampling(), param.getNumSamples(), seconds).one
    indexed = param.isIndexed()
    sample = param.getIndexedValue(selector) if indexed else param.getExpandedValue(selector)
    scope = _SCOPES.get(str(param.getScope()), "vertex")
    indices = _whole(sample.getIndices()) if indexed else None
    try:
        return carried(_numbers(sample.getVals(), width), scope, corners, width, indices)
    except CornersError as error:
        raise archive.error(piece, f"its {param.getName()} {error}") from None


def set_rows(archive: Archive, piece: Piece, faces: Faces, seconds: float) -> IntArray:
    """The set of faces (F,) that each face is in, as `Piece.materials` numbers them.

    Raises:
        MeshError: a set names a face that is not there.
    """
    result = np.zeros(faces.corners.faces, dtype=np.int64)
    for number, name in enumerate(piece.materials):
        schema = piece.schema.getFaceSet(name).getSchema()
        span = between(schema.getTimeSampling(), schema.getNumSamples(), seconds)
        rows = _whole(schema.getValue(span.one).getFaces())
        outside = (rows < 0) | (rows >= len(result))
        if outside.any():
            raise archive.error(
                piece, f"its set {name[:60]!r} names face {rows[outside][0]} of {len(result):,}"
            )
        result[rows] = number + 1
    return result[faces.number]


def _sample(archive: Archive, piece: Piece, selector: Any) -> Any:
    try:
        return piece.schema.getValue(selector)
    except RuntimeError as error:
        words = " ".join(str(error).split())[:200]
        raise archive.error(piece, f"has a sample that cannot be read: {words}") from None


def _numbers(values: Any, width: int) -> FloatArray:
    return np.array(values, dtype=np.float64).reshape(-1, width)


def _whole(values: Any) -> IntArray:
    return np.array(values, dtype=np.int64).reshape(-1)
