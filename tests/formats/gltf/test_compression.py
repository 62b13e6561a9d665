"""Compressed geometry: read with the extras, and named where they lack."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from quiltcli.errors import MeshError
from tests.helpers.gltf_files import SQUARE, TWO, GltfFile, corners

DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"


def draco(data: bytes, *, plain: bool = False) -> GltfFile:
    """A square packed by Draco, with a plain copy beside it or without."""
    file = GltfFile()
    primitive = file.primitive()
    if not plain:
        for accessor in file.json["accessors"]:
            del accessor["bufferView"]
        file.json["extensionsRequired"] = [DRACO]
    packed = {"bufferView": file.view(data), "attributes": {"POSITION": 0}}
    file.node(mesh=file.mesh({**primitive, "extensions": {DRACO: packed}}))
    return file


def square_by_draco(positions=SQUARE) -> bytes:
    codec = pytest.importorskip("DracoPy")
    return bytes(codec.encode(np.array(positions, np.float32), np.array(TWO).reshape(2, 3)))


def meshopt(rows: bytes, order: bytes, *, fallback: bool = True) -> GltfFile:
    """A square whose positions and indices are packed by meshopt."""
    file = GltfFile()
    primitive = file.primitive()
    for view, (data, count, stride, mode) in zip(
        file.json["bufferViews"],
        ((rows, 4, 12, "ATTRIBUTES"), (order, 6, 2, "TRIANGLES")),
        strict=True,
    ):
        start = len(file.bytes)
        file.bytes += data
        packed = {"buffer": 0, "byteOffset": start, "byteLength": len(data)}
        view["extensions"] = {MESHOPT: {**packed, "byteStride": stride, "count": count, "mode": mode}}
        view["buffer"] = 1 if fallback else 0
    file.node(mesh=file.mesh(primitive))
    return file


def written(file: GltfFile, path, *, fallback: bool = True):
    """Write a file whose second buffer is a fallback that is not there."""
    import json

    from tests.helpers.gltf_files import glb

    buffers = [{"byteLength": len(file.bytes)}]
    if fallback:
        buffers.append({"byteLength": 60, "extensions": {MESHOPT: {"fallback": True}}})
    file.json["buffers"] = buffers
    path.write_bytes(glb(json.dumps(file.json).encode(), bytes(file.bytes)))
    return path


def square_by_meshopt() -> tuple[bytes, bytes]:
    codec = pytest.importorskip("meshopt")
    points = np.array(SQUARE, "<f4").view("u1").reshape(4, 12)
    rows = codec.encode_gltf_buffer(points, "ATTRIBUTES")
    return bytes(rows), bytes(codec.encode_gltf_buffer(np.array(TWO, np.uint32), "TRIANGLES"))


def test_draco(tmp_path):
    found = corners(draco(square_by_draco()).write(tmp_path / "m.glb"))
    assert found.shape == (2, 3, 3)
    assert sorted(map(tuple, np.unique(found.reshape(-1, 3), axis=0).round(3).tolist())) == sorted(SQUARE)


def test_meshopt(tmp_path):
    found = corners(written(meshopt(*square_by_meshopt()), tmp_path / "m.glb"))
    assert sorted(map(tuple, np.unique(found.reshape(-1, 3), axis=0).tolist())) == sorted(SQUARE)
    normal = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    assert normal.tolist() == [[0, 0, 1]] * 2


@pytest.mark.parametrize(("name", "extra"), [("DracoPy", "draco"), ("meshopt", "meshopt")])
def test_without_the_extra_the_message_says_what_to_do(tmp_path, monkeypatch, name, extra):
    monkeypatch.setitem(sys.modules, name, None)
    path = tmp_path / "m.glb"
    if extra == "draco":
        draco(b"DRACO").write(path)
    else:
        written(meshopt(b"\xa0" * 8, b"\xe0" * 8), path)
    with pytest.raises(MeshError) as caught:
        corners(path)
    assert str(caught.value).endswith(f"(export it uncompressed, or pip install 'quiltcli[{extra}]')")
    assert "needs KHR_draco_mesh_compression" in str(caught.value) or MESHOPT in str(caught.value)


def test_without_the_extra_a_plain_copy_is_read(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    monkeypatch.setitem(sys.modules, "meshopt", None)
    assert len(corners(draco(b"DRACO", plain=True).write(tmp_path / "a.glb"))) == 2
    file = meshopt(b"\xa0" * 8, b"\xe0" * 8, fallback=False)
    assert len(corners(written(file, tmp_path / "b.glb", fallback=False))) == 2


@pytest.mark.parametrize("share", [0.1, 0.4, 0.9])
def test_broken_bytes_are_named(tmp_path, share):
    data = square_by_draco()
    rows, order = square_by_meshopt()
    path = draco(data[: int(len(data) * share)]).write(tmp_path / "a.glb")
    with pytest.raises(MeshError, match="its bytes are not what Draco packs"):
        corners(path)
    path = written(meshopt(rows[: int(len(rows) * share)], order), tmp_path / "b.glb")
    with pytest.raises(MeshError, match="its bytes are not what meshopt packs"):
        corners(path)


def test_few_bytes_that_promise_much_are_refused(tmp_path):
    pytest.importorskip("meshopt")
    file = meshopt(b"\xa0" * 8, b"\xe0" * 8)
    file.json["bufferViews"][0]["extensions"][MESHOPT]["count"] = 10**9
    with pytest.raises(MeshError, match="1,000,000,000 rows of 12 bytes cannot come of 8 bytes"):
        corners(written(file, tmp_path / "a.glb"))
    pytest.importorskip("DracoPy")
    head = b"DRACO\x02\x02\x01\x01\x00\x00\x00" + b"\xff\xff\xff\xff\x0f" * 2
    with pytest.raises(MeshError, match="4,294,967,295 elements cannot come of 22 bytes"):
        corners(draco(head).write(tmp_path / "b.glb"))
