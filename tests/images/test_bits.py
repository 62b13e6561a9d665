"""`quilt unpack`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.cli.group import main
from quiltcli.errors import OutputError
from quiltcli.formats.bitplanes import pack, packed_name, read_packed, write_packed
from quiltcli.images.bits import packed_files, unpack_files
from quiltcli.images.diff import diff


def stream(folder: Path, order: str = "rgb", first: str = "lsb") -> np.ndarray:
    """Two packed pictures in a folder, and the bits in them."""
    bits = np.random.default_rng(5).random((48, 6, 5)) < 0.3
    folder.mkdir(parents=True)
    for number, packed in enumerate(pack(bits, order, first), start=1):
        write_packed(folder / packed_name(number), packed)
    return bits


@pytest.mark.parametrize("named", ["packed", "."])
def test_binary_pictures_come_out_of_a_folder_in_the_order_they_are_shown(tmp_path: Path, named: str) -> None:
    bits = stream(tmp_path / "packed", "brg", "msb")
    written = unpack_files([tmp_path / named], tmp_path / "bits", order="brg", bits="msb")
    assert [path.name for path in written[:2]] == ["bits.00000001.png", "bits.00000002.png"]
    for path, expected in zip(written, bits, strict=True):
        with Image.open(path) as image:
            assert image.mode == "1"
            np.testing.assert_array_equal(np.asarray(image), expected)


def test_a_picture_keeps_its_place_in_the_stream_when_it_comes_alone(tmp_path: Path) -> None:
    stream(tmp_path / "packed")
    written = unpack_files([tmp_path / "packed" / packed_name(2)], tmp_path / "bits")
    assert written[0].name == "bits.00000025.png"
    with pytest.raises(OutputError, match="exists already"):
        unpack_files([tmp_path / "packed" / packed_name(2)], tmp_path / "bits")
    assert len(unpack_files([tmp_path / "packed"], tmp_path / "bits", overwrite=True)) == 48


def test_files_that_have_no_place_in_a_stream_are_told(tmp_path: Path) -> None:
    stream(tmp_path / "packed")
    (tmp_path / "empty").mkdir()
    twin = tmp_path / "dvi.1.png"
    plain = tmp_path / "picture.png"
    with pytest.raises(OutputError) as caught:
        packed_files([tmp_path / "packed", twin, plain, tmp_path / "empty"])
    text = str(caught.value)
    assert "dvi.1.png: has the number of" in text
    assert "picture.png: has no number" in text
    assert "empty: has no packed pictures" in text


def test_the_command_says_what_it_wrote_and_refuses_unknown_orders(tmp_path: Path) -> None:
    stream(tmp_path / "packed")
    run = CliRunner().invoke(main, ["unpack", str(tmp_path / "packed"), "-o", str(tmp_path / "bits")])
    assert run.exit_code == 0
    assert "and 36 more in" in run.output
    args = ["unpack", str(tmp_path / "packed"), "-o", str(tmp_path / "b"), "--order", "rgx", "--bits", "both"]
    run = CliRunner().invoke(main, args)
    assert run.exit_code == 2
    assert "rgb, rbg" in run.output
    assert "lsb or msb" in run.output
    assert not (tmp_path / "b").exists()


def test_folders_of_packed_pictures_are_compared_bit_by_bit(tmp_path: Path) -> None:
    stream(tmp_path / "a" / "packed")
    stream(tmp_path / "b" / "packed")
    assert diff(tmp_path / "a", tmp_path / "b").code == 0
    path = tmp_path / "b" / "packed" / packed_name(2)
    packed = read_packed(path).copy()
    packed[3, 2, 1] ^= 4
    write_packed(path, packed)
    result = diff(tmp_path / "a", tmp_path / "b")
    assert [(file.name, file.code) for file in result.files] == [
        ("packed/dvi.00000001.png", 0),
        ("packed/dvi.00000002.png", 2),
    ]
    assert [row.first for row in result.files[1].channels if row.over] == [(2, 3)]
