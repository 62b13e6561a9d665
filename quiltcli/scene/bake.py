"""One object of the scene, from the parts of its mesh to clean triangles with normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, dot, normalized
from quiltcli.job.model import FARTHEST
from quiltcli.scene.importers.part import Part
from quiltcli.scene.normals import CREASE_DEG, corner_sums, face_normals, smoothed

# Height over length below which a triangle is a line.
_THINNEST = 1e-12


@dataclass(frozen=True)
class Baked:
    """Triangles of one object.

    Attributes:
        vertices: (V, 3) world metres, each used by some triangle.
        triangles: (T, 3) indices.
        normals: (V, 3) unit.
        colors: (V, 3) linear, or None where no part has any.
        flat: whether triangles are shaded with their own normals.
        part: (T,) index of the part each triangle came from.
        infinite: triangles dropped for a vertex that is NaN, infinite or beyond `FARTHEST`.
        empty: triangles dropped for having no area.
        opacities: (V,) alpha, or None where no part has any.
        uv: (V, 2) texture coordinates, NaN where a part has none, or None where no part has any.
        uv1: (V, 2) those of the second set, likewise.
        turns: (V, 3) how tangents of the files lie, or None where no part has any.
        source: (V,) the vertex of the joined parts each one is a copy of.
        group: (V,) numbers that vertices of one computed normal share, -1 where the file gives one.
    """

    vertices: FloatArray
    triangles: IntArray
    normals: Float32Array
    colors: Float32Array | None
    flat: bool
    part: IntArray
    infinite: int
    empty: int
    source: IntArray
    group: IntArray
    uv: FloatArray | None = None
    opacities: Float32Array | None = None
    uv1: FloatArray | None = None
    turns: Float32Array | None = None


def bake(parts: Sequence[Part], mode: str = "auto") -> Baked:
    """Join the parts of an object, drop what cannot be drawn and settle the normals.

    Args:
        parts: already in world space.
        mode: `auto` takes the file's normals and finds smooth ones, split at creases, where there
            are none; `smooth` finds them everywhere and never splits; `flat` gives every triangle
            its own.
    """
    base = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([_wound(part) + start for part, start in zip(parts, base, strict=False)])
    owner = np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts])
    infinite, empty = _broken(vertices, triangles)
    keep = np.flatnonzero(~(infinite | empty))
    # No triangle that is kept has such a vertex, but sums over all vertices would meet it.
    vertices = np.where((np.abs(vertices) <= FARTHEST).all(axis=1)[:, None], vertices, 0.0)
    triangles, owner = triangles[keep], owner[keep]

    given = _given_normals(parts) if mode == "auto" else np.zeros_like(vertices)
    colors, uv, uv1 = _given_colors(parts), *given_uv(parts)
    opacities, turns = given_opacities(parts), given_turns(parts)
    source, triangles, normals, group = _with_normals(
        vertices,
        triangles,
        given,
        180.0 if mode != "auto" else CREASE_DEG,
        keep_sources=any(values is not None for values in (colors, uv, uv1, opacities, turns)),
    )
    return Baked(
        vertices=vertices[source],
        triangles=triangles,
        normals=normals,
        colors=None if colors is None else colors[source],
        flat=mode == "flat",
        part=owner,
        infinite=int(np.count_nonzero(infinite)),
        empty=int(np.count_nonzero(empty)),
        uv=None if uv is None else uv[source],
        uv1=None if uv1 is None else uv1[source],
        source=source,
        group=group,
        opacities=None if opacities is None else opacities[source],
        turns=None if turns is None else turns[source],
    )


def reposed(baked: Baked, vertices: FloatArray, normals: FloatArray) -> tuple[FloatArray, Float32Array]:
    """Vertices (V, 3) and unit normals (V, 3) of an object whose parts have moved; its triangles stay.

    Vertices that shared a computed normal share one again; creases stay where they were.

    Args:
        baked: the object.
        vertices: of all its parts after one another.
        normals: theirs, of any length, zero where the file gives none.
    """
    moved = vertices[baked.source]
    given = normalized(normals[baked.source])
    # Where the file's normal is lost on the way, the triangles around must do.
    own = (baked.group >= 0) | ~given.any(axis=1)
    if own.any():
        face = normalized(face_normals(moved, baked.triangles))
        # Vertices without a group have one of their own, beyond all others.
        group = np.where(baked.group >= 0, baked.group, baked.group.max() + 1 + np.arange(len(moved)))
        _, row = np.unique(group, return_inverse=True)
        sums = corner_sums(row[baked.triangles.ravel()], moved, baked.triangles, face)
        given[own] = normalized(sums[row[own]])
    return moved, given.astype(np.float32)


def _wound(part: Part) -> IntArray:
    """Triangles with the winding that a mirrored placement turned put right."""
    return part.triangles[:, ::-1] if part.mirrored else part.triangles


def _broken(vertices: FloatArray, triangles: IntArray) -> tuple[BoolArray, BoolArray]:
    """Triangles (T,) with a vertex that is nowhere, and the other ones that have no area."""
    with np.errstate(all="ignore"):
        # A corner after another: what all three together take of memory takes time, too.
        a, b, c = (vertices.take(corner, axis=0) for corner in triangles.T)
        length = np.zeros(len(triangles))
        for one, other in ((a, b), (b, c), (c, a)):
            edge = other - one
            np.maximum(length, dot(edge, edge), out=length)
        normal = face_normals(vertices, triangles)
        area = np.sqrt(dot(normal, normal))
        near = (np.abs(vertices) <= FARTHEST).all(axis=1)
        infinite = ~(near.take(triangles).all(axis=1) & np.isfinite(area))
        return infinite, ~infinite & ~(area > _THINNEST * length)


def _given_normals(parts: Sequence[Part]) -> FloatArray:
    """Unit normals (V, 3) of the files, zero for a vertex that has none."""
    found = [np.zeros_like(p.vertices) if p.normals is None else p.normals for p in parts]
    normals = np.concatenate(found)
    with np.errstate(all="ignore"):
        good = np.isfinite(dot(normals, normals))
    normals[~good] = 0.0
    return normalized(normals)


def _given_colors(parts: Sequence[Part]) -> Float32Array | None:
    if all(part.colors is None for part in parts):
        return None
    return np.concatenate(
        [np.ones(p.vertices.shape, np.float32) if p.colors is None else p.colors for p in parts]
    )


def given_opacities(parts: Sequence[Part] | Sequence[Baked]) -> Float32Array | None:
    """Alpha (V,) of all, 1 where some have none; None where none has."""
    if all(part.opacities is None for part in parts):
        return None
    given = [np.ones(len(p.vertices), np.float32) if p.opacities is None else p.opacities for p in parts]
    return np.concatenate(given)


def given_turns(parts: Sequence[Part] | Sequence[Baked]) -> Float32Array | None:
    """How tangents of files lie (V, 3), as those that are made where some have none; None where none has."""
    if all(part.turns is None for part in parts):
        return None
    as_made = np.array([[1, 0, 1]], dtype=np.float32)
    return np.concatenate(
        [np.repeat(as_made, len(p.vertices), axis=0) if p.turns is None else p.turns for p in parts]
    )


def given_uv(parts: Sequence[Part] | Sequence[Baked]) -> tuple[FloatArray | None, FloatArray | None]:
    """Texture coordinates (V, 2) of both sets, NaN where some have none; None where none has."""
    sets = [[part.uv for part in parts], [part.uv1 for part in parts]]
    counts = [len(part.vertices) for part in parts]
    first, second = (_joined_uv(values, counts) for values in sets)
    return first, second


def _joined_uv(values: Sequence[FloatArray | None], counts: Sequence[int]) -> FloatArray | None:
    if all(uv is None for uv in values):
        return None
    pairs = zip(values, counts, strict=True)
    return np.concatenate([np.full((count, 2), np.nan) if uv is None else uv for uv, count in pairs])


def _with_normals(
    vertices: FloatArray, triangles: IntArray, given: FloatArray, crease_deg: float, *, keep_sources: bool
) -> tuple[IntArray, IntArray, Float32Array, IntArray]:
    """Sources (V,), triangles (T, 3), normals (V, 3), given or computed, and groups (V,) of the latter."""
    usable = dot(given, given) > 0
    has_own = usable[triangles].all(axis=1)
    own, other = np.flatnonzero(has_own), np.flatnonzero(~has_own)
    used, corners = _compact(triangles[own], len(vertices))
    result = np.empty_like(triangles)
    result[own] = corners
    normals = given[used].astype(np.float32)
    if not other.size:
        return used, result, normals, np.full(len(used), -1)
    found = smoothed(vertices, triangles[other], crease_deg, keep_sources=keep_sources)
    result[other] = found.triangles + len(used)
    source = np.concatenate((used, found.source))
    group = np.concatenate((np.full(len(used), -1), found.group))
    return source, result, np.concatenate((normals, found.normals)), group


def _compact(triangles: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """The vertices that are used, ascending, and the triangles with indices into those."""
    used = np.zeros(count, dtype=np.bool_)
    used[triangles] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[triangles]
