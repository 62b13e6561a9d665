"""Pixel maps from anywhere: whatever is in them, the answer is a sentence, soon, and no layout that `check` refuses."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import os
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.check import check_files
from quiltcli.errors import QuiltError
from quiltcli.exchange.pixelmaps import read_map, write_map
from quiltcli.formats.pfm import PfmError, read_pfm
from quiltcli.layout import write_layout
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.turned_layout import turned_layout

LAYOUT = turned_layout([0])


def said(path: Path, **how: object) -> str:
    with pytest.raises(QuiltError) as caught:
        read_map(path, **how)  # type: ignore[arg-type]
    return str(caught.value).replace(f"{path}: ", "")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    write_map(LAYOUT, None, tmp_path / "m.mpcdi")
    return tmp_path / "m.mpcdi"


def contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def with_member(path: Path, name: str, data: bytes, kind: int = zipfile.ZIP_DEFLATED) -> Path:
    """The archive with other bytes in one of its members."""
    files = contents(path) | {name: data}
    with zipfile.ZipFile(path, "w") as archive:
        for member, content in files.items():
            archive.writestr(member, content, kind)
    return path


def edited(path: Path, name: str, old: str, new: str) -> Path:
    text = contents(path)[name].decode()
    assert old in text
    return with_member(path, name, text.replace(old, new).encode())


# --- archives ---


@pytest.mark.parametrize("kind", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_streams_that_do_not_unpack(archive: Path, kind: int) -> None:
    noise = np.random.default_rng(1).integers(0, 256, 4000, dtype=np.uint8).tobytes()
    with_member(archive, "facet_0001.pfm", noise, kind)
    data = bytearray(archive.read_bytes())
    at = data.index(b"facet_0001.pfm") + len("facet_0001.pfm")
    data[at : at + 1000] = b"\xff" * 1000
    archive.write_bytes(data)
    assert said(archive) == "facet_0001.pfm is damaged (it does not unpack)"


def test_members_longer_than_they_can_mean(archive: Path) -> None:
    with_member(archive, "facet_0001.pfm", bytes(20_000_000))
    assert said(archive) == "facet_0001.pfm holds more than 4,194,304 bytes, which is more than it can mean"


@pytest.mark.parametrize("name", ["../outside.pfm", "/etc/hostname"])
def test_warps_of_an_unpacked_archive_lie_in_its_folder(archive: Path, name: str) -> None:
    folder = archive.with_name("unpacked")
    folder.mkdir()
    for member, data in contents(archive).items():
        (folder / member).write_bytes(data.replace(b"facet_0001.pfm", name.encode()))
    (archive.parent / "outside.pfm").write_bytes((folder / "facet_0001.pfm").read_bytes())
    expected = f"names {name!r}, which lies outside its folder (expected a file beside mpcdi.xml)"
    assert said(folder, format_name="mpcdi") == expected
    assert said(folder / "mpcdi.xml", format_name="mpcdi") == expected


def test_a_warp_that_is_a_pipe_is_no_file(archive: Path) -> None:
    folder = archive.with_name("unpacked")
    folder.mkdir()
    for member, data in contents(archive).items():
        (folder / member).write_bytes(data)
    (folder / "facet_0001.pfm").unlink()
    os.mkfifo(folder / "facet_0001.pfm")
    assert said(folder, format_name="mpcdi") == "has no file 'facet_0001.pfm'"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('encoding="utf-8"', 'encoding="uf-8"', "mpcdi.xml is in an unknown encoding"),
        ('xResolution="13"', 'xResolution="3000000000"',
         "mpcdi.xml: <region id='facet_0001'> has '3000000000' as xresolution,"
         " expected a whole number from 1 to 1000000"),
        ('xResolution="13"', f'xResolution="{"9" * 5000}"',
         f"mpcdi.xml: <region id='facet_0001'> has '{'9' * 39}…' as xresolution,"
         " expected a whole number from 1 to 1000000"),
    ],
)  # fmt: skip
def test_what_the_xml_cannot_mean(archive: Path, old: str, new: str, expected: str) -> None:
    assert said(edited(archive, "mpcdi.xml", old, new)) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('"padding": 0', '"padding": "x"', "padding: expected a whole number, got the text 'x'"),
        ('"size": [13, 9]', '"size": [13, 1099511627776]', "facets[0].size[1]: must be at most 1000000, got 1099511627776"),
        ('"polygon": [[', '"polygon": [[5], [', "facets[0].polygon[0]: expected 2 numbers, got 1"),
        ('"origin": [', '"origin": ["x", ', "facets[0].origin: expected 3 numbers, got 4"),
        ('"quilt_from_facet": [[', '"quilt_from_facet": [["x", ', "facets[0].quilt_from_facet[0]: expected 3 numbers, got 4"),
    ],
)  # fmt: skip
def test_what_quilt_json_cannot_mean(archive: Path, old: str, new: str, expected: str) -> None:
    lines = said(edited(archive, "quilt.json", old, new)).splitlines()
    assert lines == [
        "quilt.json is not what quilt writes; without it the display is needed",
        f"quilt.json: {expected}",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[" * 100_000, "nests its values too deeply"),
        ('{"a": ' + "1" * 5000 + "}", "holds a number of 5,000 digits, more than any that is meant"),
        ("\xff", "is not JSON: it is not UTF-8 text"),
    ],
)
def test_json_that_python_would_stumble_over(archive: Path, text: str, expected: str) -> None:
    raw = text.encode("latin-1")
    (archive.parent / "m.json").write_bytes(raw)
    assert said(archive.with_name("m.json")) == expected
    assert said(with_member(archive, "quilt.json", raw)) == f"quilt.json {expected}"


@pytest.mark.parametrize("header", [b"PF\n" + b"1" * 5000 + b" 1\n-1\n", b"PF\n1 1\n1" + b"0" * 5000 + b"\n"])
def test_pictures_of_sizes_that_python_would_stumble_over(header: bytes) -> None:
    with pytest.raises(PfmError, match="expected a PFM header such as"):
        read_pfm(header + bytes(12))


# --- tables ---

HEAD = "id,page,x,y,width,height,page_width,page_height\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,1,0,0,4,99999999999999999999,16,16", "2: height: found '99999999999999999999', expected a whole number from -1000000000 to 1000000000"),
        ("1,1,0,nan,4,3,16,16", "2: y: found 'nan', expected a whole number"),
        ("1,1,1e400,0,4,3,16,16", "2: x: found '1e400', expected a whole number from -1000000000 to 1000000000"),
        ("1,999999999,0,0,4,3,16,16", "2: page: found 999999999, expected at most 100000"),
        ("-1,1,0,0,4,3,16,16", "2: id: found -1, but facets count from 1"),
        (f'1,1,"{"x" * 200_000}",0,4,3,16,16', "2: has a cell longer than any table of panels needs (is a quote left open?)"),
    ],
)  # fmt: skip
def test_cells_that_no_number_can_be(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "m.csv").write_text(HEAD + text)
    lines = said(tmp_path / "m.csv", facets=flat_display([rectangle(4, 3)])).splitlines()
    assert lines[0].removeprefix(f"{tmp_path / 'm.csv'}:") == expected


def test_a_column_that_stands_twice(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("id,x,y,x,width,height\n1,0,0,5,4,3\n")
    found = said(tmp_path / "m.csv", facets=flat_display([rectangle(4, 3)]), size=(16, 16))
    assert found.endswith("m.csv:1: the column 'x' stands 2 times, expected once")


@pytest.mark.parametrize("name", ["=1+1", "+x", "-x", "@SUM(A1)", " =1", "'=1"])
def test_names_that_a_spreadsheet_would_run_are_written_harmlessly(tmp_path: Path, name: str) -> None:
    facets = flat_display([rectangle(4, 3), rectangle(4, 3)], names=[name, "it's"])
    layout = placed(facets, [moved(0, 0), moved(5, 0)])
    write_map(layout, facets, tmp_path / "m.csv")
    text = (tmp_path / "m.csv").read_text()
    assert ",'" in text
    assert not any(
        cell.lstrip().startswith(("=", "+", "@")) for line in text.splitlines() for cell in line.split(",")
    )
    assert ",it's," in text
    (tmp_path / "named.csv").write_text(text.replace("id,", "number,", 1))
    assert (
        read_map(tmp_path / "named.csv", facets).quilt_from_facet.tolist() == layout.quilt_from_facet.tolist()
    )


# --- what is imported can be checked ---


@pytest.mark.parametrize("suffix", ["csv", "mpcdi"])
def test_what_is_imported_is_what_check_accepts(tmp_path: Path, suffix: str) -> None:
    write_map(LAYOUT, None, tmp_path / f"m.{suffix}")
    write_layout(read_map(tmp_path / f"m.{suffix}"), tmp_path / "layout.yaml")
    assert check_files([tmp_path / "layout.yaml"]) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"pages": np.array([[2_000_000, 24]], np.int32)}, "pages[0].size[0]: must be at most 1000000, got 2000000"),
        ({"du": LAYOUT.du * 1e-11, "dv": LAYOUT.dv * 1e-11}, "facets[0].du: a direction must not be zero"),
        ({"origin": LAYOUT.origin + 9e9}, "origin_x: found '9000000000', expected a number from -1000000000 to 1000000000"),
    ],
)  # fmt: skip
def test_what_check_would_refuse_is_not_imported(
    tmp_path: Path, change: dict[str, np.ndarray], expected: str
) -> None:
    write_map(replace(LAYOUT, **change), None, tmp_path / "m.csv")
    assert said(tmp_path / "m.csv").splitlines()[0].endswith(expected)
