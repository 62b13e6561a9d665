"""The outside of a glTF file: chunks, texts, buffers and where they lie."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf import read_gltf
from quiltcli.formats.gltf.container import files_beside
from tests.helpers.gltf_files import GltfFile, corners, glb, one_square


def message(path: Path) -> str:
    with pytest.raises(MeshError) as caught:
        read_gltf(path)
    return str(caught.value).replace(f"{path.parent}/", "")


@pytest.mark.parametrize("name", ["m.glb", "m.gltf"])
def test_a_square_is_two_triangles(tmp_path, name):
    found = corners(one_square().write(tmp_path / name))
    assert found[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert len(found) == 2


@pytest.mark.parametrize("uri", ["my wall #1 100%.bin", "my%20wall%20%23%31%20100%25.bin"])
def test_a_buffer_beside_the_file_may_have_any_name(tmp_path, uri):
    file = one_square()
    (tmp_path / "my wall #1 100%.bin").write_bytes(file.bytes)
    path = file.write_text(tmp_path / "m.gltf", uri)
    assert len(corners(path)) == 2
    assert files_beside(path) == [tmp_path / "my wall #1 100%.bin"]


def test_a_binary_file_may_keep_its_buffers_elsewhere(tmp_path):
    file = one_square()
    (tmp_path / "b.bin").write_bytes(file.bytes)
    file.write_text(tmp_path / "m.gltf", "b.bin")
    path = tmp_path / "m.glb"
    path.write_bytes(glb((tmp_path / "m.gltf").read_bytes()))
    assert len(corners(path)) == 2
    assert files_beside(path) == [tmp_path / "b.bin"]


@pytest.mark.parametrize("uri", ["/etc/passwd", "file:///etc/passwd", "http://a/b.bin", "\\\\host\\b.bin"])
def test_nothing_is_fetched_from_elsewhere(tmp_path, uri):
    found = message(one_square().write_text(tmp_path / "m.gltf", uri))
    assert "buffers[0].uri" in found
    assert found.endswith("is not a path relative to the file (nothing else is read)")


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("gone.bin", "'gone.bin' is missing beside it"),
        ("a%00b.bin", "'a%00b.bin' is no file name"),
        ("x" * 300, "cannot be read: File name too long"),
        ("data:x", "is a 'data:' URI without a comma"),
        ("data:;base64,@@@@", "its base64 text is broken"),
        ("fifo", "'fifo' is not a file"),
    ],
)
def test_a_buffer_that_cannot_be_had_is_named(tmp_path, uri, words):
    os.mkfifo(tmp_path / "fifo")
    found = message(one_square().write_text(tmp_path / "m.gltf", uri))
    assert found.startswith("m.gltf: buffers[0].uri: ")
    assert words in found


def test_a_buffer_shorter_than_promised(tmp_path):
    (tmp_path / "b.bin").write_bytes(b"123")
    found = message(one_square().write_text(tmp_path / "m.gltf", "b.bin"))
    assert found == "m.gltf: buffers[0].byteLength: 60 bytes, but only 3 are there"


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("m.gltf", glb(b"{}"), "m.gltf: is binary glTF (name it .glb)"),
        ("m.glb", b'  {"asset": {}}', "m.glb: is glTF as text (name it .gltf)"),
        ("m.glb", b"solid", "m.glb: cannot be read as GLB: it is none"),
        ("m.glb", glb(b"{}", version=1), "m.glb: is glTF 1 (only glTF 2 is read)"),
        ("m.gltf", b'{"asset": {"version": "1.0"}}', "asset.version: is glTF 1.0 (only glTF 2 is read)"),
        ("m.gltf", b'{"asset": {"version": "2.9", "minVersion": "2.9"}}', "needs glTF 2.9 (glTF 2.0 is read)"),
        ("m.gltf", b"{}", "asset.version: is missing (only glTF 2 is read, and its files say so)"),
        ("m.gltf", b"[]", "m.gltf: expected an object, got a list of 0"),
        ("m.gltf", b'{"a": 1,}', "m.gltf:1:9: is not JSON: expecting property name enclosed in double quotes"),
        ("m.gltf", '{"ä": 1}'.encode("latin-1"), "m.gltf: is not UTF-8 text: byte 0xe4 at 2"),
        ("m.gltf", b"[" * 100_000, "m.gltf: its JSON text is nested too deeply"),
        ("m.gltf", b"[" + b"9" * 5000 + b"]", "m.gltf: its JSON text holds a number of thousands of digits"),
    ],
)  # fmt: skip
def test_files_that_are_something_else(tmp_path, name, data, words):
    (tmp_path / name).write_bytes(data)
    assert message(tmp_path / name).endswith(words)


@pytest.mark.parametrize("share", [0.02, 0.2, 0.5, 0.9, 0.99])
def test_a_file_cut_off(tmp_path, share):
    path = one_square().write(tmp_path / "m.glb")
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    found = message(path)
    assert "damaged or incomplete" in found or "it is none" in found


def test_a_byte_order_mark_does_no_harm(tmp_path):
    path = one_square().write(tmp_path / "m.gltf")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert len(corners(path)) == 2


def test_a_key_that_stands_twice_is_told(tmp_path):
    path = one_square().write(tmp_path / "m.gltf")
    path.write_text(path.read_text().replace('"nodes":', '"nodes": 3, "nodes":'))
    assert read_gltf(path).notices == ("the key 'nodes' stands twice in one object (the last counts)",)


def test_nan_where_nobody_looks_does_no_harm(tmp_path):
    file = one_square()
    file.json["accessors"][0]["min"] = [float("nan")] * 3
    assert len(corners(file.write(tmp_path / "m.gltf"))) == 2
    file.json["nodes"][0]["translation"] = [0, float("nan"), 0]
    found = message(file.write(tmp_path / "n.gltf"))
    assert found == "n.gltf: nodes[0].translation[1]: expected a finite number, got nan"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"nodes": 3}, "nodes: expected a list, got 3"),
        ({"nodes": [3]}, "nodes[0]: expected an object, got 3"),
        ({"nodes": [{"mesh": True}]}, "nodes[0].mesh: expected mesh, 0 to 0, got true"),
        ({"nodes": [{"mesh": -1}]}, "nodes[0].mesh: expected mesh, 0 to 0, got -1"),
        ({"nodes": [{"mesh": 0.5}]}, "nodes[0].mesh: expected mesh, 0 to 0, got 0.5"),
        ({"nodes": [{"mesh": 10**400}]}, "nodes[0].mesh: expected mesh, 0 to 0, got a number beyond 64 bits"),
        ({"nodes": [{"mesh": 0, "scale": [1, 2]}]}, "scale: expected a list of 3 numbers, got a list of 2"),
        ({"nodes": [{"mesh": 0, "scale": [1, 2, 10**400]}]}, "nodes[0].scale[2]: expected a finite number"),
        ({"scene": "hello", "scenes": [{}]}, "scene: expected scene, 0 to 0, got 'hello'"),
        ({"meshes": [{"primitives": [{"attributes": [], "indices": 0}]}]}, "attributes: expected an object"),
        ({"meshes": [{"primitives": [{"indices": 0}]}]}, "attributes.POSITION: is missing"),
        ({"nodes": [{"mesh": 0, "extensions": []}]}, "nodes[0].extensions: expected an object, got a list of 0"),
        ({"extensionsRequired": ["ACME_shape"]}, "extensionsRequired[0]: needs ACME_shape, which is not read"),
        ({"extensionsRequired": ["KHR_texture_basisu"]}, "KTX2 images are not read (export them as PNG or JPEG)"),
    ],
)  # fmt: skip
def test_values_of_the_wrong_kind_are_named(tmp_path, change, words):
    file = one_square()
    file.json.update(json.loads(json.dumps(change)))
    found = message(file.write(tmp_path / "m.glb"))
    assert words in found


def test_an_index_written_as_a_float_is_one(tmp_path):
    file = one_square()
    file.json["nodes"][0]["mesh"] = 0.0
    assert len(corners(file.write(tmp_path / "m.glb"))) == 2


def test_what_the_scene_does_not_use_may_be_broken(tmp_path):
    file = one_square()
    file.add("accessors", count="many")
    file.add("meshes", primitives=7)
    file.add("materials", name=[])
    assert len(corners(file.write(tmp_path / "m.glb"))) == 2


def test_unknown_extensions_are_told(tmp_path):
    file = GltfFile(extensionsUsed=["ACME_glow", "KHR_mesh_quantization"])
    file.node(mesh=file.mesh())
    assert read_gltf(file.write(tmp_path / "m.glb")).notices == ("the extension ACME_glow is not read",)
