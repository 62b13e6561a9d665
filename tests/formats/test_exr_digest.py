"""The seal on an EXR file: every wrong byte is found, wherever it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from quiltcli.formats.exr.digest import ATTRIBUTE, is_sealed
from quiltcli.formats.exr.image import read_exr, write_exr


@pytest.fixture(params=["none", "zip", "zstd", "dwaa"])
def sealed(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    channels = {name: rng.random((40, 30)).astype(np.float16) for name in "RGBA"}
    channels["Z"] = rng.random((40, 30)).astype(np.float32)
    write_exr(tmp_path / "a.exr", channels, {"quilt:job": "ab" * 32}, request.param)
    return tmp_path / "a.exr"


def test_a_flipped_bit_is_found_wherever_it_is(sealed: Path) -> None:
    good = sealed.read_bytes()
    assert is_sealed(sealed)
    places = {
        *range(700),
        *range(700, len(good), 41),
        len(good) - 1,
    }  # all of the header, and the chunk table
    for place in sorted(places):
        damaged = bytearray(good)
        damaged[place] ^= 1 << place % 8
        sealed.write_bytes(damaged)
        assert not is_sealed(sealed), place
    sealed.write_bytes(good)
    assert is_sealed(sealed)


def test_holes_ends_and_additions_are_found(sealed: Path) -> None:
    good = sealed.read_bytes()
    middle = len(good) // 2
    hole = good[:middle] + bytes(64) + good[middle + 64 :]
    for damaged in (hole, hole.replace(bytes(64), b"\xff" * 64), good[:-1], good + b"\0", b"", good[:300]):
        sealed.write_bytes(damaged)
        assert not is_sealed(sealed)
    assert not is_sealed(sealed.with_name("none.exr"))
    assert not is_sealed(sealed.parent)


def test_the_digest_is_an_attribute_that_others_read_and_this_program_keeps_to_itself(sealed: Path) -> None:
    text = OpenEXR.File(str(sealed)).header()[ATTRIBUTE]
    assert len(text) == 64
    assert set(text) <= set("0123456789abcdef")
    image = read_exr(sealed)
    assert set(image.attributes) == {
        "quilt:job",
        "screenWindowCenter",
        "screenWindowWidth",
        "pixelAspectRatio",
    }
    # An image made of another, attributes and all, has a seal of its own.
    write_exr(sealed, image.channels, {**image.attributes, ATTRIBUTE: text}, "zips")
    assert is_sealed(sealed)
    assert OpenEXR.File(str(sealed)).header()[ATTRIBUTE] != text


def test_an_image_of_another_program_has_no_seal(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    OpenEXR.File({}, {"R": np.zeros((4, 4), np.float16)}).write(str(path))
    assert not is_sealed(path)
