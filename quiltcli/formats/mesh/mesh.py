"""The polygon mesh record, the builder every reader fills, and the checks all formats share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.geometry import BoolArray, FloatArray, IntArray, segments

MOST_PROBLEMS = 50


@dataclass(frozen=True)
class PolygonMesh:
    """V vertices and F polygons, in file order, in the file's own units.

    Attributes:
        vertices: (V, 3) float64 positions.
        corner_start: (F+1,) offsets into `corners`.
        corners: (C,) vertex index of every corner, 0-based, in the winding of the file.
        uv: (C, 2) texture coordinates of the corners, v up; NaN for a corner without any;
            None when no corner has one.
        names: F names, empty where the file gives none.
        lines: (F,) line of the file each face stands on, 0 where lines mean nothing.
        path: the file as the user named it, for messages.
    """

    vertices: FloatArray
    corner_start: IntArray
    corners: IntArray
    uv: FloatArray | None
    names: tuple[str, ...]
    lines: IntArray
    path: str

    @property
    def count(self) -> int:
        """Number of faces, F."""
        return len(self.names)


@dataclass
class MeshBuilder:
    """What a reader has gathered so far; `finish` checks it and makes the mesh."""

    path: str
    vertices: list[Sequence[float]] = field(default_factory=list)
    vertex_lines: list[int] = field(default_factory=list)
    faces: list[Sequence[int]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    uv: list[Sequence[Sequence[float]] | None] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)

    def problem(self, message: str, line: int = 0) -> None:
        """Note something wrong at this line and go on."""
        self.problems.append(Problem(message, self.path, line))

    def add_vertex(self, position: Sequence[float], line: int = 0) -> None:
        """Append one vertex."""
        self.vertices.append(position)
        self.vertex_lines.append(line)

    def add_face(
        self,
        corners: Sequence[int],
        line: int = 0,
        uv: Sequence[Sequence[float]] | None = None,
        name: str = "",
    ) -> None:
        """Append one face with 0-based `corners`; `uv` holds one pair a corner or is None."""
        self.faces.append(corners)
        self.lines.append(line)
        self.uv.append(uv)
        self.names.append(name)

    def finish(self) -> PolygonMesh:
        """Check what was gathered and make the mesh.

        Raises:
            MeshError: with every problem found, up to `MOST_PROBLEMS`.
        """
        if not self.problems:
            self._check_sizes()
        if not self.problems:
            self._check_vertices()
            self._check_faces()
        raise_problems(self.problems, self.path)
        counts = np.fromiter(map(len, self.faces), np.int64, len(self.faces))
        start = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts)))
        return PolygonMesh(
            vertices=np.array(self.vertices, dtype=np.float64).reshape(-1, 3),
            corner_start=start,
            corners=np.concatenate([np.asarray(f, dtype=np.int64) for f in self.faces]),
            uv=self._corner_uv(start),
            names=tuple(self.names),
            lines=np.array(self.lines, dtype=np.int64),
            path=self.path,
        )

    def _check_sizes(self) -> None:
        if not self.vertices and not self.faces:
            self.problem("the mesh is empty (expected vertices and faces)")
        elif not self.faces:
            self.problem(f"the mesh has {len(self.vertices)} vertices but no faces (expected one or more)")
        for index, corners in enumerate(self.faces):
            if len(corners) < 3:
                self.problem(
                    f"face {index + 1} has {len(corners)} corners (expected 3 or more)", self.lines[index]
                )

    def _check_vertices(self) -> None:
        bad = ~np.isfinite(np.array(self.vertices, dtype=np.float64).reshape(-1, 3)).all(axis=1)
        for index in np.flatnonzero(bad):
            found = ", ".join(f"{c:g}" for c in self.vertices[index])
            self.problem(
                f"vertex {index + 1} is ({found}) (expected finite numbers)", self.vertex_lines[index]
            )

    def _check_faces(self) -> None:
        counts = np.fromiter(map(len, self.faces), np.int64, len(self.faces))
        flat = np.fromiter((c for face in self.faces for c in face), np.int64, int(counts.sum()))
        row, _ = segments(np.concatenate(([0], np.cumsum(counts))))
        outside: BoolArray = (flat < 0) | (flat >= len(self.vertices))
        for place in np.flatnonzero(outside):
            face = int(row[place])
            self.problem(
                f"face {face + 1} names vertex {flat[place] + 1} (expected 1 to {len(self.vertices)})",
                self.lines[face],
            )

    def _corner_uv(self, start: IntArray) -> FloatArray | None:
        if not any(pairs is not None for pairs in self.uv):
            return None
        result = np.full((int(start[-1]), 2), np.nan)
        for face, pairs in enumerate(self.uv):
            if pairs is not None:
                result[start[face] : start[face + 1]] = pairs
        return result


def raise_problems(problems: Sequence[Problem], path: str) -> None:
    """Raise a `MeshError` with the first `MOST_PROBLEMS` problems and the count of the rest."""
    if not problems:
        return
    shown = list(problems[:MOST_PROBLEMS])
    if len(problems) > MOST_PROBLEMS:
        shown.append(Problem(f"and {len(problems) - MOST_PROBLEMS} problems more", path))
    raise MeshError(shown)


def one_face_groups(groups: Sequence[str]) -> list[str]:
    """Names of faces from the name of the group each is in: only a group of one face names it."""
    size: dict[str, int] = {}
    for group in groups:
        size[group] = size.get(group, 0) + 1
    return [group if size[group] == 1 else "" for group in groups]
