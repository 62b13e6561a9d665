"""Layouts whose facets stand in a file of columns: the same layout, and every wrong number is named."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import LayoutError
from quiltcli.formats.npz import npz_bytes
from quiltcli.job import check_file
from quiltcli.job.layout_columns import COLUMNS
from quiltcli.layout import file as module
from quiltcli.layout import read_layout, write_layout
from tests.helpers.flat_displays import flat_display, random_polygons
from tests.helpers.packed_layouts import pack

LAYOUT = pack(flat_display(random_polygons(9, 3, 20, seed=5)), "net", seconds=0.1)


@pytest.fixture
def path(tmp_path: Path, monkeypatch) -> Path:
    """A layout file with its columns beside it."""
    monkeypatch.setattr(module, "MOST_AS_TEXT", 3)
    write_layout(LAYOUT, tmp_path / "long.yaml")
    return tmp_path / "long.yaml"


def columns(path: Path):
    with np.load(path.with_name("long.columns.npz")) as archive:
        return {name: archive[name] for name in archive.files}


def rewrite(path: Path, arrays, sha=True) -> None:
    data = npz_bytes(arrays)
    path.with_name("long.columns.npz").write_bytes(data)
    text = path.read_text().splitlines()
    head = [line for line in text if not line.startswith("columns_sha256")]
    path.write_text("\n".join(head + [f"columns_sha256: {hashlib.sha256(data).hexdigest()}"] * sha) + "\n")


def said(path: Path) -> list[str]:
    return [str(problem).replace(f"{path.parent}/", "") for problem in check_file(path)]


def test_a_layout_comes_back_bit_for_bit_and_its_files_are_the_same_bytes_again(path, tmp_path):
    back = read_layout(path)
    for field in fields(back):
        one, other = getattr(LAYOUT, field.name), getattr(back, field.name)
        if isinstance(one, np.ndarray):
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    (tmp_path / "again").mkdir()
    write_layout(back, tmp_path / "again" / "long.yaml")
    again = (tmp_path / "again" / "long.columns.npz").read_bytes()
    assert again == path.with_name("long.columns.npz").read_bytes()


def test_few_facets_stand_in_the_file_itself(tmp_path):
    write_layout(LAYOUT, tmp_path / "short.yaml")
    assert [file.name for file in tmp_path.iterdir()] == ["short.yaml"]


def test_columns_by_hand_need_no_hash_and_other_widths_of_numbers_do(path):
    arrays = {name: values.astype(np.float32 if COLUMNS[name] == "f" else np.uint16)
              for name, values in columns(path).items()}  # fmt: skip
    rewrite(path, arrays, sha=False)
    assert np.allclose(read_layout(path).du, LAYOUT.du, rtol=1e-6)


def test_a_file_that_was_changed_is_told(path):
    arrays = columns(path)
    arrays["du"][0] *= 2
    path.with_name("long.columns.npz").write_bytes(npz_bytes(arrays))
    assert said(path) == [
        "long.columns.npz: is not the file that the layout was written with: their hashes differ "
        "(take columns_sha256 out of the layout if it was changed on purpose)"
    ]


@pytest.mark.parametrize(
    ("name", "row", "value", "expected"),
    [
        ("id", 2, 1, "id[2]: facet 1 already has a place, at id[0]"),
        ("id", 2, 0, "id[2]: 0 (expected a whole number from 1)"),
        ("page", 1, 7, "page[1]: there is no page 7 (the layout has 1 page)"),
        ("size", 3, 0, "size[3]: [0, 0] (expected 1 to 1000000 pixels a side)"),
        ("origin", 4, np.nan, "origin[4]: has a number that is not finite, or beyond 1e+09"),
        ("dv", 5, 0, "dv[5]: has no length (expected a step to the next pixel, metres)"),
        ("quilt_from_facet", 6, 0, "quilt_from_facet[6]: flattens the facet (its determinant is 0)"),
        ("polygon", 0, np.inf, "polygon[0]: has a number that is not finite, or beyond 1e+09"),
    ],
)
def test_every_wrong_number_is_named_by_its_column_and_row(path, name, row, value, expected):
    arrays = columns(path)
    arrays[name][row] = value
    rewrite(path, arrays)
    assert said(path) == [f"long.columns.npz: {expected}"]


def test_wrong_lengths_types_and_names(path):
    arrays = columns(path)
    arrays["corners"][0] += 1
    rewrite(path, arrays | {"du": arrays["du"][1:]})
    count = len(arrays["polygon"])
    assert said(path) == [
        "long.columns.npz: du: has the shape (8, 3) (expected (9, 3), a row for each id)",
        f"long.columns.npz: polygon: has the shape ({count}, 2) (expected ({count + 1}, 2), as corners says)",
    ]
    rewrite(path, arrays | {"page": arrays["page"].astype(float)})
    assert said(path) == ["long.columns.npz: page: is of the type float64 (expected whole numbers)"]
    del arrays["dv"]
    rewrite(path, arrays | {"dw": arrays["du"]})
    assert [line.partition(" (expected")[0] for line in said(path)] == [
        "long.columns.npz: has no array 'dv'",
        "long.columns.npz: dw: has an array that is not known",
    ]


def test_what_is_no_archive_of_numbers(path):
    beside = path.with_name("long.columns.npz")
    good = beside.read_bytes()
    damaged = "long.columns.npz: is no NumPy archive of numbers, or is damaged (expected an .npz file)"
    for spoilt in (
        b"",
        b"PK",
        good[:-40],
        good[: len(good) // 2],
        good.replace(b"'shape': (9", b"'shape': (8"),
    ):
        beside.write_bytes(spoilt)
        assert said(path) == [damaged]
    head = b"{'descr': '|O', 'fortran_order': False, 'shape': (1,), }".ljust(117) + b"\n"
    with zipfile.ZipFile(beside, "w") as archive:
        for name in COLUMNS:
            archive.writestr(f"{name}.npy", b"\x93NUMPY\x01\x00v\x00" + head + b"\x80" * 8)
    assert said(path) == [damaged]
    beside.unlink()
    assert said(path) == ["long.columns.npz: no such file (expected a NumPy archive (.npz))"]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("columns: ", "facets: []\ncolumns: ", "facets: expected at least 1"),
        ("columns: ", "#", "facets: missing key (places of the facets)"),
    ],
)
def test_facets_stand_in_one_place(path, old, new, expected):
    text = path.read_text()
    path.write_text(text.replace(old, new, 1))
    assert any(expected in line for line in said(path)), said(path)


def test_problems_of_the_layout_itself_name_the_row(path):
    arrays = columns(path)
    arrays["quilt_from_facet"][1] = arrays["quilt_from_facet"][0]
    rewrite(path, arrays)
    with pytest.raises(LayoutError, match=r"long\.columns\.npz: quilt_from_facet\[1\]"):
        read_layout(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"'shape': (9", b"'shape': ((9"),
        (b"'<f8'", b"'<q9'"),
        (b"'<f8'", b"[('a'"),
        (b"{'descr'", b"{'descr"),
        (b"(9, 3)", b"(9, 4)"),
        (b"(9, 3)", b"(9999999999999999, 3)"),
        (b"NUMPY\x01", b"NUMPY\x07"),
        (b"\x00v\x00", b"\x00w\x00"),
    ],
)
def test_a_header_that_is_not_numpys_is_never_run(old, new, path):
    beside = path.with_name("long.columns.npz")
    with zipfile.ZipFile(beside) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    assert old in members["du.npy"]
    members["du.npy"] = members["du.npy"].replace(old, new, 1)
    with zipfile.ZipFile(beside, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")  # no hash
    assert said(path) == [
        "long.columns.npz: is no NumPy archive of numbers, or is damaged (expected an .npz file)"
    ]
