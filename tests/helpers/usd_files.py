"""Small USD stages, written as text: each test says what it means."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))


def needs_usd() -> None:
    """Skip without the extra."""
    pytest.importorskip("pxr.Usd", reason="the extra usd is not installed")


def stage(path: Path, *body: str, **meta: Any) -> Path:
    """Write a stage in metres, with Y up; other metadata as the format has them, None for none."""
    found = {"metersPerUnit": 1, "upAxis": '"Y"', **meta}
    lines = [f"    {name} = {value}" for name, value in found.items() if value is not None]
    path.write_text("#usda 1.0\n(\n" + "\n".join(lines) + "\n)\n" + "\n".join(body) + "\n")
    return path


def mesh(
    name: str = "square",
    points: Sequence[Sequence[float]] | str = SQUARE,
    counts: Sequence[int] = (4,),
    indices: Sequence[int] | None = None,
    more: str = "",
    meta: str = "",
) -> str:
    """A mesh prim, of one square where nothing else is said; points may be text, with samples."""
    corners = range(sum(counts)) if indices is None else indices
    given = points if isinstance(points, str) else f"point3f[] points = {listed(points)}"
    return (
        f'def Mesh "{name}" ({meta})\n{{\n{given}\n'
        f"int[] faceVertexCounts = {list(counts)}\nint[] faceVertexIndices = {list(corners)}\n"
        f'uniform token subdivisionScheme = "none"\n{more}\n}}\n'
    )


def listed(rows: Sequence[Sequence[float]]) -> str:
    """Tuples as the format has them."""
    return f"[{', '.join(str(tuple(row)) for row in rows)}]"


def xform(name: str, *body: str, ops: str = "", order: str = "", meta: str = "") -> str:
    """An Xform prim with operations, and prims in it."""
    named = f"uniform token[] xformOpOrder = [{order}]" if order else ""
    return f'def Xform "{name}" ({meta})\n{{\n{ops}\n{named}\n' + "\n".join(body) + "\n}\n"


def moved(name: str, by: Sequence[float], *body: str) -> str:
    """An Xform prim that moves what is in it."""
    ops = f"double3 xformOp:translate = {tuple(by)}"
    return xform(name, *body, ops=ops, order='"xformOp:translate"')


def material(name: str, *inputs: str, nodes: str = "") -> str:
    """A UsdPreviewSurface with these inputs, and nodes of its network beside it."""
    lines = "\n".join(inputs)
    return (
        f'def Material "{name}"\n{{\ntoken outputs:surface.connect = </{name}/surface.outputs:surface>\n'
        f'def Shader "surface"\n{{\nuniform token info:id = "UsdPreviewSurface"\n{lines}\n'
        "token outputs:surface\n}\n"
        f"{nodes}\n}}\n"
    )


def bound(name: str) -> dict[str, str]:
    """What binds a mesh to a material."""
    return {
        "meta": 'prepend apiSchemas = ["MaterialBindingAPI"]',
        "more": f"rel material:binding = </{name}>",
    }


def parts_of(path: Path, seconds: float | None = None, after: str = "hold"):
    """The parts of a stage at rest or at a time."""
    from quiltcli.scene.importers.model import Playing
    from quiltcli.scene.importers.usd import read_usd_model

    return read_usd_model(path).parts(seconds, Playing(after=after))


def corners(path: Path, seconds: float | None = None, after: str = "hold") -> NDArray[np.float64]:
    """Corners (T, 3, 3) of all triangles that a stage shows."""
    found = parts_of(path, seconds, after)
    return np.concatenate([part.vertices[part.triangles] for part in found] or [np.empty((0, 3, 3))])


def notices(path: Path) -> tuple[str, ...]:
    """What is said of a stage."""
    from quiltcli.scene.importers.usd import read_usd_model

    return read_usd_model(path).notices
