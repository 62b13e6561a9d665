"""Accessors: typed arrays over the bytes of buffers (glTF 2.0, section 3.6.2)."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.gltf.compression import meshopt_bytes
from quiltcli.formats.gltf.container import Container
from quiltcli.formats.gltf.json_values import Json
from quiltcli.geometry import FloatArray, IntArray

AnyArray: TypeAlias = NDArray[Any]

MOST_ELEMENTS_FROM_NOTHING = 2**24
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
# Columns and rows of an element.
_SHAPES = {
    "SCALAR": (1, 1),
    "VEC2": (1, 2),
    "VEC3": (1, 3),
    "VEC4": (1, 4),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}


class Accessors:
    """The accessors of a file, each decoded once, when it is asked for."""

    def __init__(self, container: Container) -> None:
        self._container = container
        self._list = container.json["accessors"]
        self._views: dict[int, memoryview] = {}
        self._raw: dict[int, AnyArray] = {}

    def entry(self, index: Json) -> Json:
        """The accessor that `index` names."""
        return self._list.at(index.index(self._list.length(), "accessor"))

    def count(self, index: Json) -> int:
        """Number of elements of an accessor, which its bytes need not hold up to."""
        return self.entry(index)["count"].whole(low=1)

    def floats(self, index: Json, *kinds: str) -> FloatArray:
        """Elements (N, components) as float64, integers that are `normalized` brought to -1 … 1.

        Raises:
            MeshError: the accessor is of none of the `kinds`, or broken.
        """
        raw, entry = self._kind(index, kinds)
        return as_floats(raw, normalized=entry["normalized"].flag())

    def whole(self, index: Json, *kinds: str) -> IntArray:
        """Elements (N, components) of an accessor of unsigned integers."""
        raw, entry = self._kind(index, kinds)
        if raw.dtype.kind != "u":
            raise entry["componentType"].expected("unsigned integers (5121, 5123 or 5125)")
        return raw.astype(np.int64)

    def view(self, index: Json) -> memoryview:
        """The bytes of the bufferView that `index` names, decompressed."""
        views = self._container.json["bufferViews"]
        at = index.index(views.length(), "buffer view")
        if at not in self._views:
            view = views.at(at)
            plain = meshopt_bytes(self._container, view)
            self._views[at] = self._container.view(view) if plain is None else plain
        return self._views[at]

    def _kind(self, index: Json, kinds: tuple[str, ...]) -> tuple[AnyArray, Json]:
        entry = self.entry(index)
        if entry["type"].text() not in kinds:
            raise entry["type"].expected(" or ".join(kinds))
        at = int(index.value)
        if at not in self._raw:
            self._raw[at] = self._decoded(entry)
        return self._raw[at], entry

    def _decoded(self, entry: Json) -> AnyArray:
        """Elements (N, components) as they are stored."""
        code = entry["componentType"].whole()
        if code not in _TYPES:
            raise entry["componentType"].expected(" or ".join(map(str, _TYPES)))
        dtype, count = np.dtype(_TYPES[code]), entry["count"].whole(low=1)
        columns, rows = _SHAPES[entry["type"].one_of(tuple(_SHAPES))]
        if entry["bufferView"]:
            view = self._container.json["bufferViews"].at(
                entry["bufferView"].index(self._container.json["bufferViews"].length(), "buffer view")
            )
            stride = view["byteStride"].whole(0, high=252)
            data = self.view(entry["bufferView"])
            values = _elements(entry, data, entry["byteOffset"].whole(0), dtype, count, columns, rows, stride)
        elif count > MOST_ELEMENTS_FROM_NOTHING:
            raise entry["count"].error(
                f"{count:,} elements without a buffer view (expected at most {MOST_ELEMENTS_FROM_NOTHING:,})"
            )
        else:
            values = np.broadcast_to(np.zeros(1, dtype), (count, columns * rows))
        return self._with_sparse(entry, values, dtype, columns, rows) if entry["sparse"] else values

    def _with_sparse(
        self, entry: Json, values: AnyArray, dtype: np.dtype[Any], columns: int, rows: int
    ) -> AnyArray:
        """The values with some of them replaced."""
        sparse = entry["sparse"]
        count = sparse["count"].whole(low=1, high=len(values))
        where, given = sparse["indices"], sparse["values"]
        code = where["componentType"].whole()
        if code not in (5121, 5123, 5125):
            raise where["componentType"].expected("5121, 5123 or 5125")
        places = _elements(
            where, self.view(where["bufferView"]), where["byteOffset"].whole(0), np.dtype(_TYPES[code]), count
        )[:, 0].astype(np.int64)
        if places.max() >= len(values):
            raise where.error(f"names element {places.max()} of {len(values)}")
        patch = _elements(
            given, self.view(given["bufferView"]), given["byteOffset"].whole(0), dtype, count, columns, rows
        )
        result = np.array(values)
        result[places] = patch
        return result


def as_floats(raw: AnyArray, *, normalized: bool) -> FloatArray:
    """Stored numbers as float64: f = max(c / greatest, -1) for normalized integers (section 3.6.2.2)."""
    with np.errstate(invalid="ignore"):  # a NaN that signals becomes one that does not
        values = raw.astype(np.float64)
    if normalized and raw.dtype.kind in "iu":
        values /= np.iinfo(raw.dtype).max
        np.maximum(values, -1.0, out=values)
    return values


def _elements(
    entry: Json,
    data: memoryview,
    offset: int,
    dtype: np.dtype[Any],
    count: int,
    columns: int = 1,
    rows: int = 1,
    stride: int = 0,
) -> AnyArray:
    """Elements (count, columns·rows) over the bytes of a view, without a copy where they are in order."""
    # A matrix's columns each start at a multiple of four bytes.
    step = rows * dtype.itemsize
    column = step if columns == 1 else -(-step // 4) * 4
    size = column * (columns - 1) + step
    stride = stride or (column * columns if columns > 1 else step)
    if stride < size:
        raise entry.error(f"elements of {size} bytes are {stride} bytes apart")
    end = offset + stride * (count - 1) + size
    if end > len(data):
        raise entry.error(f"ends at byte {end:,} of a buffer view of {len(data):,} bytes")
    shape, strides = (count, columns, rows), (stride, column, dtype.itemsize)
    return np.ndarray(shape, dtype, data, offset, strides).reshape(count, columns * rows)
