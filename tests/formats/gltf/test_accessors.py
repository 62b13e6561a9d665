"""Accessors: every way in which a file may store its numbers."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.container import read_container
from quiltcli.formats.gltf.json_values import Json
from tests.helpers.gltf_files import CODES, SQUARE, TWO, GltfFile, corners


def values(file: GltfFile, path: Path, kind: str, index: int = 0):
    container = read_container(file.write(path / "m.glb"))
    return Accessors(container).floats(Json(index, "here", "m.glb"), kind)


def message(file: GltfFile, path: Path) -> str:
    with pytest.raises(MeshError) as caught:
        corners(file.write(path / "m.glb"))
    return str(caught.value).replace(f"{path}/", "")


@pytest.mark.parametrize("dtype", list(CODES))
def test_every_component_type(tmp_path, dtype):
    file = GltfFile()
    file.accessor([[1, 2], [3, 100]], dtype)
    assert values(file, tmp_path, "VEC2").tolist() == [[1, 2], [3, 100]]


@pytest.mark.parametrize(
    ("dtype", "stored", "expected"),
    [
        ("i1", [-128, -127, 0, 127], [-1, -1, 0, 1]),
        ("u1", [0, 51, 255, 1], [0, 0.2, 1, 1 / 255]),
        ("i2", [-32768, -32767, 0, 32767], [-1, -1, 0, 1]),
        ("u2", [0, 13107, 65535, 1], [0, 0.2, 1, 1 / 65535]),
    ],
)
def test_normalized_integers_span_0_or_minus_1_to_1(tmp_path, dtype, stored, expected):
    file = GltfFile()
    file.accessor(np.reshape(stored, (4, 1)), dtype, normalized=True)
    np.testing.assert_array_equal(
        values(file, tmp_path, "SCALAR")[:, 0], np.array(expected, dtype=np.float64)
    )


def test_a_stride_steps_over_other_numbers(tmp_path):
    file = GltfFile()
    view = file.view(np.arange(12, dtype="<f4").tobytes(), byteStride=16)
    file.add("accessors", bufferView=view, byteOffset=4, componentType=5126, count=3, type="VEC2")
    assert values(file, tmp_path, "VEC2").tolist() == [[1, 2], [5, 6], [9, 10]]


def test_columns_of_small_matrices_start_at_fours(tmp_path):
    file = GltfFile()
    view = file.view(bytes([1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0]))
    file.add("accessors", bufferView=view, componentType=5121, count=1, type="MAT3")
    assert values(file, tmp_path, "MAT3").tolist() == [[1, 2, 3, 4, 5, 6, 7, 8, 9]]


def test_no_buffer_view_means_zeros(tmp_path):
    file = GltfFile()
    file.add("accessors", componentType=5126, count=3, type="VEC3")
    assert values(file, tmp_path, "VEC3").tolist() == [[0, 0, 0]] * 3


@pytest.mark.parametrize("based", [True, False])
def test_sparse_values_replace_some(tmp_path, based):
    file = GltfFile()
    where, given = file.view(bytes([0, 2])), file.view(struct.pack("<2f", 7, 9))
    sparse = {
        "count": 2,
        "indices": {"bufferView": where, "componentType": 5121},
        "values": {"bufferView": given},
    }
    if based:
        file.accessor([1.0, 2.0, 3.0, 4.0], sparse=sparse)
    else:
        file.add("accessors", componentType=5126, count=4, type="SCALAR", sparse=sparse)
    found = values(file, tmp_path, "SCALAR")[:, 0].tolist()
    assert found == ([7, 2, 9, 4] if based else [7, 0, 9, 0])


def broken(**change) -> GltfFile:
    """A square whose positions' accessor is changed."""
    file = GltfFile()
    file.node(mesh=file.mesh())
    file.json["accessors"][0].update(change)
    return file


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"count": 5}, "accessors[0]: ends at byte 60 of a buffer view of 48 bytes"),
        ({"byteOffset": 40}, "accessors[0]: ends at byte 88 of a buffer view of 48 bytes"),
        ({"byteOffset": -4}, "accessors[0].byteOffset: expected a whole number from 0, got -4"),
        ({"count": 0}, "accessors[0].count: expected a whole number from 1, got 0"),
        ({"count": 2**40}, "expected at most 67,108,864"),
        ({"count": 2**24 + 3, "bufferView": None}, "16,777,219 elements without a buffer view"),
        ({"componentType": 5130}, "accessors[0].componentType: expected 5120 or 5121 or"),
        ({"type": "VEC2"}, "accessors[0].type: expected VEC3, got 'VEC2'"),
        ({"bufferView": 9}, "accessors[0].bufferView: expected buffer view, 0 to 1, got 9"),
        ({"sparse": {"count": 9}}, "accessors[0].sparse.count: expected a whole number from 1 to 4, got 9"),
    ],
)
def test_accessors_beyond_their_bytes_are_named(tmp_path, change, words):
    assert words in message(broken(**change), tmp_path)


def test_a_stride_shorter_than_an_element(tmp_path):
    file = broken()
    file.json["bufferViews"][0]["byteStride"] = 4
    assert message(file, tmp_path) == "m.glb: accessors[0]: elements of 12 bytes are 4 bytes apart"


def test_a_view_beyond_its_buffer(tmp_path):
    file = broken()
    file.json["bufferViews"][0]["byteLength"] = 1000
    assert message(file, tmp_path) == "m.glb: bufferViews[0]: ends at byte 1,000 of a buffer of 60 bytes"


def test_an_index_beyond_the_vertices(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(SQUARE, [0, 1, 9])))
    found = message(file, tmp_path)
    assert found == "m.glb: meshes[0].primitives[0].indices: names vertex 9 of 4 (expected 0 to 3)"


def test_a_vertex_that_is_nowhere_is_an_error_where_it_is_used(tmp_path):
    points = [*SQUARE, (np.nan, 0, 0)]
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(points, TWO)))
    assert len(corners(file.write(tmp_path / "m.glb"))) == 2
    file.node(mesh=file.mesh(file.primitive(points, [0, 1, 4])))
    words = "meshes[1].primitives[0].attributes.POSITION: vertex 4 is (nan, 0, 0) (expected finite numbers)"
    assert message(file, tmp_path) == f"m.glb: {words}"


def test_attributes_of_different_lengths(tmp_path):
    file = GltfFile()
    normal = file.accessor([(0, 0, 1)] * 3)
    file.node(mesh=file.mesh(file.primitive(attributes={"NORMAL": normal})))
    words = "meshes[0].primitives[0].attributes.NORMAL: has 3 elements for 4 vertices"
    assert message(file, tmp_path) == f"m.glb: {words}"
