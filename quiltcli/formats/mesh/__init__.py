"""Display meshes: files of polygons, read without splitting or reordering a single face."""

from __future__ import annotations

from quiltcli.formats.mesh.mesh import PolygonMesh
from quiltcli.formats.mesh.read import read_mesh

__all__ = ["PolygonMesh", "read_mesh"]
