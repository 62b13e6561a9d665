"""Bytes that are packed by Draco or meshopt, unpacked by the extras of those names."""

from __future__ import annotations

import importlib.util
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.gltf.container import Container
from quiltcli.formats.gltf.json_values import Json
from quiltcli.geometry import IntArray

DRACO = "KHR_draco_mesh_compression"
MESHOPT = "EXT_meshopt_compression"
# No honest file shrinks more than this; a bomb does.
_MOST_GAIN = 4096
_MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
_FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL")


def meshopt_bytes(container: Container, view: Json) -> memoryview | None:
    """The bytes of a bufferView that meshopt has packed, None for one that it has not.

    Raises:
        MeshError: the extra is not installed and no unpacked copy is there, or the bytes are broken.
    """
    packed = view.extension(MESHOPT)
    if not packed:
        return None
    try:
        import meshopt
    except ImportError:
        buffer = container.json["buffers"].at(
            view["buffer"].index(container.json["buffers"].length(), "buffer")
        )
        if buffer["uri"] or (container.chunk is not None and not buffer.extension(MESHOPT)):
            return None
        raise packed.error(_needs(MESHOPT, "meshopt")) from None
    count, stride = packed["count"].whole(low=1), packed["byteStride"].whole(low=1, high=256)
    mode = packed["mode"].one_of(_MODES)
    data = container.view(packed)
    if count * stride > _MOST_GAIN * len(data):
        raise packed.error(f"{count:,} rows of {stride} bytes cannot come of {len(data):,} bytes")
    try:
        rows = meshopt.decode_gltf_buffer(
            bytes(data), count, stride, mode, packed["filter"].one_of(_FILTERS, "NONE")
        )
    except Exception as error:  # whatever the decoder meets in broken bytes
        raise packed.error("its bytes are not what meshopt packs") from error
    if mode != "ATTRIBUTES":
        rows = rows.astype("<u2" if stride == 2 else "<u4")
    plain = memoryview(np.ascontiguousarray(rows).tobytes())
    if len(plain) != count * stride:
        raise packed.error(f"holds {len(plain):,} bytes (expected {count * stride:,})")
    return plain


def _needs(extension: str, extra: str) -> str:
    return f"needs {extension} (export it uncompressed, or pip install 'quiltcli[{extra}]')"


@dataclass(frozen=True, eq=False)
class Unpacked:
    """A primitive that Draco had packed.

    Attributes:
        triangles: (T, 3) indices.
        attributes: (V, components) values as stored, by the attribute's name.
    """

    triangles: IntArray
    attributes: dict[str, NDArray[Any]]


def can_read_draco() -> bool:
    """Whether the extra is installed."""
    return importlib.util.find_spec("DracoPy") is not None


def draco_primitive(primitive: Json, data: memoryview) -> Unpacked:
    """A primitive from the bytes Draco has packed.

    Raises:
        MeshError: the extra is not installed, or the bytes are broken.
    """
    packed = primitive.extension(DRACO)
    try:
        import DracoPy
    except ImportError:
        raise packed.error(_needs(DRACO, "draco")) from None
    _check_draco_size(packed, bytes(data[:64]), len(data))
    try:
        mesh = DracoPy.decode(bytes(data))
        triangles = np.asarray(mesh.faces).reshape(-1, 3).astype(np.int64)
        stored = {int(a["unique_id"]): np.asarray(a["data"]) for a in mesh.attributes}
    except Exception as error:  # whatever the decoder meets in broken bytes
        raise packed.error("its bytes are not what Draco packs") from error
    attributes = {}
    for name in packed["attributes"].names():
        number = packed["attributes"][name].whole()
        if number not in stored:
            raise packed["attributes"][name].error(f"Draco's attribute {number} is not in its bytes")
        values = stored[number]
        attributes[name] = values.reshape(len(values), -1)
    return Unpacked(triangles, attributes)


def _check_draco_size(packed: Json, head: bytes, size: int) -> None:
    """Hold the counts in Draco's header against the bytes there are, before anything is allocated."""
    if head[:5] != b"DRACO" or len(head) < 12:
        raise packed.error("its bytes are not what Draco packs")
    flags = struct.unpack_from("<H", head, 9)[0]
    if flags & 0x8000:  # metadata come first, and would have to be walked through
        return
    at = 11 if head[8] == 0 else 12
    for _ in range(2):
        count, at = _varint(head, at)
        if count > _MOST_GAIN * size:
            raise packed.error(f"{count:,} elements cannot come of {size:,} bytes")


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of seven bits a byte, the lowest first, and where the next one starts."""
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at] if at < len(data) else 0
        value |= (byte & 0x7F) << shift
        at += 1
        if byte < 0x80:
            break
    return value, at
