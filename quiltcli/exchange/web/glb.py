"""A writer of binary glTF 2.0: arrays and pictures in, one file out."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.exchange.web.textures import Picture

VERTICES, INDICES = 34962, 34963  # what a buffer view is for
LINE_STRIP, TRIANGLES = 3, 4
NEAREST, LINEAR, CLAMP = 9728, 9729, 33071
_TYPES = {(np.dtype(np.float32)): 5126, (np.dtype(np.uint8)): 5121, (np.dtype(np.uint32)): 5125}
_SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class Gltf:
    """A document that grows; every `add` returns the index of what was added."""

    def __init__(self, generator: str) -> None:
        self.root: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}}
        self.binary = bytearray()

    def add(self, kind: str, **entry: Any) -> int:
        """Add to one of the document's lists, such as `materials`."""
        entries = self.root.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def view(self, data: bytes, **entry: Any) -> int:
        """Add bytes, aligned to four, as a buffer view."""
        start = len(self.binary)
        self.binary += data + bytes(-len(data) % 4)
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **entry)

    def array(self, values: NDArray[Any], target: int, *, bounds: bool = False, unit: bool = False) -> int:
        """Add an accessor of (n,) or (n, 2 to 4) float32, uint8 or uint32.

        Args:
            values: the array; rows must fill whole words.
            target: `VERTICES` or `INDICES`.
            bounds: whether to say the least and greatest values, as positions must.
            unit: whether integers stand for 0 to 1.
        """
        rows = values.reshape(len(values), -1)
        more: dict[str, Any] = {"normalized": True} if unit else {}
        if bounds:
            more |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        little = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        return self.add(
            "accessors",
            bufferView=self.view(little.tobytes(), target=target),
            componentType=_TYPES[values.dtype],
            count=len(values),
            type=_SHAPES[rows.shape[1]],
            **more,
        )

    def image(self, picture: Picture) -> int:
        """Add a picture."""
        return self.add("images", bufferView=self.view(picture.data), mimeType=picture.kind)

    def unlit(self, name: str, **entry: Any) -> int:
        """Add a material that shows exactly its colour."""
        extension = "KHR_materials_unlit"
        self.root["extensionsUsed"] = [extension]
        return self.add("materials", name=name, extensions={extension: {}}, **entry)

    def bytes(self, roots: Sequence[int]) -> bytes:
        """The file; `roots` are the nodes at the top of its one scene."""
        document = {
            **self.root,
            "scene": 0,
            "scenes": [{"nodes": list(roots)}],
            "buffers": [{"byteLength": len(self.binary)}],
        }
        text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.binary)
        head = struct.pack("<4sIII4s", b"glTF", 2, total, len(text), b"JSON")
        return head + text + struct.pack("<I4s", len(self.binary), b"BIN\0") + bytes(self.binary)
