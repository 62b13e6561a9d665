"""Small glTF files, written by hand: each test says which bytes it means."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
TWO = [0, 1, 2, 0, 2, 3]


class GltfFile:
    """A document under construction; every method that adds something gives back its index."""

    def __init__(self, **top: Any) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, **top}
        self.bytes = bytearray()

    def add(self, kind: str, **entry: Any) -> int:
        """Append an entry to one of the document's lists."""
        entries = self.json.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def view(self, data: bytes, **more: Any) -> int:
        """Append bytes to the buffer, as a view of their own."""
        self.bytes += bytes(-len(self.bytes) % 4)
        start = len(self.bytes)
        self.bytes += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **more)

    def accessor(self, values: ArrayLike, dtype: str = "f4", **more: Any) -> int:
        """Append an array, one row an element."""
        array: NDArray[Any] = np.asarray(values, dtype="<" + dtype)
        width = array.size // len(array)
        view = self.view(array.tobytes())
        entry = {"bufferView": view, "componentType": CODES[dtype], "count": len(array)}
        return self.add("accessors", **{**entry, "type": KINDS[width], **more})

    def primitive(self, positions: ArrayLike = SQUARE, indices: ArrayLike | None = TWO, **more: Any) -> dict:
        """A primitive of triangles; `attributes` are added to its positions."""
        attributes = {"POSITION": self.accessor(positions), **more.pop("attributes", {})}
        found: dict[str, Any] = {"attributes": attributes, **more}
        if indices is not None:
            found["indices"] = self.accessor(indices, "u2")
        return found

    def mesh(self, *primitives: dict, **more: Any) -> int:
        """A mesh, of one square where nothing else is said."""
        return self.add("meshes", primitives=list(primitives or [self.primitive()]), **more)

    def node(self, **entry: Any) -> int:
        """A node."""
        return self.add("nodes", **entry)

    def animation(self, node: int, path: str, times: ArrayLike, values: ArrayLike, **more: Any) -> int:
        """A clip of one channel; `interpolation` and `name` as the format has them."""
        width_one = path == "weights"
        output = self.accessor(np.ravel(values) if width_one else values)
        sampler = {"input": self.accessor(times), "output": output}
        if "interpolation" in more:
            sampler["interpolation"] = more.pop("interpolation")
        channel = {"sampler": 0, "target": {"node": node, "path": path}}
        return self.add("animations", channels=[channel], samplers=[sampler], **more)

    def write(self, path: Path) -> Path:
        """Write the file, its bytes in the binary chunk or in the text."""
        if path.suffix == ".gltf":
            text = base64.b64encode(self.bytes).decode()
            return self.write_text(path, uri=f"data:application/octet-stream;base64,{text}")
        if self.bytes:
            self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        path.write_bytes(glb(json.dumps(self.json).encode(), bytes(self.bytes)))
        return path

    def write_text(self, path: Path, uri: str) -> Path:
        """Write the document alone; its bytes are elsewhere."""
        if self.bytes:
            self.json["buffers"] = [{"byteLength": len(self.bytes), "uri": uri}]
        path.write_text(json.dumps(self.json))
        return path


def glb(text: bytes, chunk: bytes = b"", version: int = 2) -> bytes:
    """A binary file of a JSON text and a chunk."""
    text += b" " * (-len(text) % 4)
    chunk += bytes(-len(chunk) % 4)
    parts = struct.pack("<II", len(text), 0x4E4F534A) + text
    if chunk:
        parts += struct.pack("<II", len(chunk), 0x004E4942) + chunk
    return b"glTF" + struct.pack("<II", version, 12 + len(parts)) + parts


def one_square(**node: Any) -> GltfFile:
    """A file of one node that shows a square."""
    file = GltfFile()
    file.node(mesh=file.mesh(), **node)
    return file


def corners(path: Path, **playing: Any) -> NDArray[np.float64]:
    """Corners (T, 3, 3) of all triangles that a file shows, at rest or at a `time` of its animations."""
    from quiltcli.scene.importers.gltf import read_gltf_parts

    parts = read_gltf_parts(path, **playing)
    return np.concatenate([part.vertices[part.triangles] for part in parts])
