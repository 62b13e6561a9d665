"""Headers that are wrong are refused in words, before the library sees them."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import OutputError
from quiltcli.formats.exr import check
from quiltcli.formats.exr.header import plausible_frame
from quiltcli.formats.exr.image import read_exr, read_header, write_exr
from quiltcli.images.metadata import is_complete

TEXT = "quilt:depth"


@pytest.fixture
def image(tmp_path: Path) -> Path:
    """40 × 30 pixels with attributes of some types."""
    attributes = {TEXT: "planar", "framesPerSecond": Fraction(30, 1), "quilt:job": "ab", "quilt:frame": 3}
    channels = {"R": np.zeros((30, 40), np.float16), "Z": np.ones((30, 40), np.float32)}
    write_exr(tmp_path / "a.exr", channels, attributes)
    return tmp_path / "a.exr"


def value_at(data: bytes, name: str, kind: str) -> int:
    """Where the value of an attribute starts."""
    head = f"{name}\0{kind}\0".encode()
    return data.index(head) + len(head) + 4


def patched(path: Path, at: int, raw: bytes) -> str:
    data = bytearray(path.read_bytes())
    data[at : at + len(raw)] = raw
    path.write_bytes(data)
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    return str(caught.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("name", "kind", "offset", "raw", "expected"),
    [
        (TEXT, "string", 0, b"\xff", f"holds text that is not UTF-8: the attribute '{TEXT}' (byte 0xff in '\\xfflanar')"),
        (TEXT, "string", -4, struct.pack("<i", -1), f"has a broken header: the attribute '{TEXT}' has -1 bytes"),
        ("framesPerSecond", "rational", 4, bytes(4), "has a broken header: the attribute 'framesPerSecond' is 30/0"),
        ("compression", "compression", 0, b"\xc8", "has the compression 200, expected one from 0 to 13"),
        ("dataWindow", "box2i", 8, struct.pack("<ii", 2**31 - 1, 2**31 - 1),
         "has a broken header: its data window is from (0, 0) to (2147483647, 2147483647)"),
        ("dataWindow", "box2i", 8, struct.pack("<ii", 39, -1), "has a broken header: its data window is from (0, 0) to (39, -1)"),
        ("dataWindow", "box2i", 8, struct.pack("<ii", 39, 99_999), "is damaged: its data window needs 6,250 chunks, it has 2"),
        ("displayWindow", "box2i", 8, struct.pack("<ii", 99_999, 99_999),
         "has a display window of 100000×100000 pixels around 40×30, far more than it has pixels for"),
        ("channels", "chlist", 0, b"\xff", "holds text that is not UTF-8: the name of a channel (byte 0xff in '\\xff')"),
        ("channels", "chlist", 2, b"\x07", "has a broken header: the channel 'R' is of the pixel type 7"),
        ("channels", "chlist", 10, bytes(4), "has a broken header: the channel 'R' is sampled 0 by 1"),
        ("channels", "chlist", 18, b"R", "has a broken header: it has the channel 'R' twice"),
        ("channels", "chlist", 0, b"\0", "has no channels, expected one or more"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(
    image: Path, name: str, kind: str, offset: int, raw: bytes, expected: str
) -> None:
    assert patched(image, value_at(image.read_bytes(), name, kind) + offset, raw) == expected


def test_names_of_attributes_are_utf_8(image: Path) -> None:
    expected = "holds text that is not UTF-8: the name of an attribute (byte 0xff in '\\xffuilt:job')"
    assert patched(image, image.read_bytes().index(b"quilt:job\0string"), b"\xff") == expected


def test_a_header_without_windows(image: Path) -> None:
    assert patched(image, image.read_bytes().index(b"dataWindow"), b"otherWindo") == (
        "has a broken header: it has no attribute 'dataWindow'"
    )


def test_another_version(image: Path) -> None:
    assert patched(image, 4, b"\x03") == "is of version 3 of OpenEXR, expected 2"


def test_a_frame_whose_image_has_such_a_header_is_not_complete(image: Path) -> None:
    assert is_complete(image, "ab", 3)
    patched(image, value_at(image.read_bytes(), TEXT, "string"), b"\xff")
    assert not is_complete(image, "ab", 3)


def test_pixels_that_memory_cannot_hold_are_not_read(image: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "free_memory", lambda: 7199)
    assert read_header(image).data_window == ((0, 0), (39, 29))
    with pytest.raises(
        OutputError, match=r"has 1,200 pixels, which take 0.1 MB of memory, but 0.1 MB are free"
    ):
        read_exr(image)
    monkeypatch.setattr(check, "free_memory", lambda: 7200)
    assert read_exr(image).channels["Z"].all()


def test_an_empty_frame_of_a_large_page_is_plausible() -> None:
    assert plausible_frame((8192, 16384), (1, 1))
    assert not plausible_frame((8192, 16385), (1, 1))
    assert plausible_frame((100_000, 100_000), (12_500, 12_500))
