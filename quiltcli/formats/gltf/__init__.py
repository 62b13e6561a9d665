"""glTF 2.0 files: bytes to records of arrays, strictly and within bounds."""

from __future__ import annotations

from quiltcli.formats.gltf.model import Gltf, Material, PunctualLight, TextureUse
from quiltcli.formats.gltf.read import read_gltf

__all__ = ["Gltf", "Material", "PunctualLight", "TextureUse", "read_gltf"]
