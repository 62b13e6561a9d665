"""Display meshes: files of polygons, read without splitting or reordering a single face."""

from __future__ import annotations

from quiltcli.meshfile.mesh import PolygonMesh
from quiltcli.meshfile.read import read_mesh

__all__ = ["PolygonMesh", "read_mesh"]
