"""Pictures of one bit in pictures of 24."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

from quiltcli.errors import OutputError
from quiltcli.formats.bitplanes import BITS, ORDERS, pack, packed_name, read_packed, unpack, write_packed


def noise(count: int) -> np.ndarray:
    return np.random.default_rng(24).random((count, 5, 7)) < 0.4


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("first", BITS)
def test_what_is_packed_comes_out_again(order: str, first: str) -> None:
    bits = noise(48)
    packed = pack(bits, order, first)
    assert packed.shape == (2, 5, 7, 3)
    np.testing.assert_array_equal(unpack(packed, order, first), bits)


def test_the_first_picture_is_the_first_bit_of_the_first_channel() -> None:
    bits = np.zeros((24, 1, 1), np.bool_)
    bits[0] = bits[9] = True  # the first of the first channel, the second of the second one
    assert pack(bits)[0, 0, 0].tolist() == [1, 2, 0]
    assert pack(bits, "brg")[0, 0, 0].tolist() == [2, 0, 1]
    assert pack(bits, "rgb", "msb")[0, 0, 0].tolist() == [128, 64, 0]


def test_a_last_picture_that_is_not_full_ends_dark() -> None:
    bits = noise(30)
    found = unpack(pack(bits))
    assert len(found) == 48
    np.testing.assert_array_equal(found[:30], bits)
    assert not found[30:].any()


def test_every_reader_gets_every_bit_and_no_colours_to_manage(tmp_path: Path) -> None:
    packed = pack(noise(24))[0]
    path = tmp_path / packed_name(1)
    write_packed(path, packed)
    assert path.name == "dvi.00000001.png"
    np.testing.assert_array_equal(read_packed(path), packed)
    with Image.open(path) as image:
        np.testing.assert_array_equal(np.asarray(image), packed)
        assert image.info == {}
    file = OpenImageIO.ImageInput.open(str(path))
    np.testing.assert_array_equal(file.read_image(OpenImageIO.UINT8), packed)
    file.close()
    data = path.read_bytes()
    assert not any(chunk in data for chunk in (b"iCCP", b"gAMA", b"sRGB", b"cHRM"))


def test_what_is_no_packed_picture_is_told(tmp_path: Path) -> None:
    gone, words, grey, cut = (tmp_path / f"{name}.png" for name in ("gone", "words", "grey", "cut"))
    words.write_text("no picture")
    Image.new("L", (4, 4)).save(grey)
    write_packed(cut, np.random.default_rng(1).integers(0, 255, (40, 40, 3), dtype=np.uint8))
    cut.write_bytes(cut.read_bytes()[:-600])
    for path, message in [
        (gone, "no such file"),
        (words, "is no picture"),
        (grey, "kind L, expected three channels"),
        (cut, "is damaged"),
    ]:
        with pytest.raises(OutputError, match=message) as caught:
            read_packed(path)
        assert str(path) in str(caught.value)
