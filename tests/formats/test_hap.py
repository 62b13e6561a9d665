"""HAP: blocks of DXT1 read by the definition and by FFmpeg."""

from fractions import Fraction

import numpy as np
import pytest

import quiltcli.formats.hap as module
from quiltcli.formats.hap import dxt1, hap_film, hap_frame


def decoded(data, height, width):
    """The picture of blocks, as the format is defined: one at a time."""
    picture = np.zeros((-(-height // 4) * 4, -(-width // 4) * 4, 3))
    across = picture.shape[1] // 4
    for at in range(len(data) // 8):
        block = data[8 * at : 8 * at + 8]
        first, second = int.from_bytes(block[:2], "little"), int.from_bytes(block[2:4], "little")
        colours = []
        for packed in (first, second):
            r, g, b = packed >> 11, packed >> 5 & 63, packed & 31
            colours.append(np.array([r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2], float))
        a, b = colours
        assert first > second or (first == second and block[4:] == bytes(4))
        palette = [a, b, (2 * a + b) / 3, (a + 2 * b) / 3]
        bits = int.from_bytes(block[4:], "little")
        for k in range(16):
            y, x = 4 * (at // across) + k // 4, 4 * (at % across) + k % 4
            picture[y, x] = palette[bits >> 2 * k & 3]
    return picture[:height, :width]


def test_flat_colours_are_as_near_as_five_and_six_bits_are():
    for colour in ((0, 0, 0), (255, 255, 255), (255, 0, 0), (10, 200, 77)):
        picture = np.full((4, 8, 3), colour, np.uint8)
        assert np.abs(decoded(dxt1(picture), 4, 8) - colour).max() <= 4


def test_two_colours_a_block_are_kept():
    """Values that 5 and 6 bits hold: the block has both, each in its place."""
    picture = np.zeros((4, 4, 3), np.uint8)
    picture[:, 1::2] = (255, 130, 8)
    assert np.array_equal(decoded(dxt1(picture), 4, 4), picture)


def test_ramps_in_any_direction_come_back():
    rng = np.random.default_rng(2)
    y, x = np.mgrid[0:48, 0:60]
    for _ in range(6):
        slope = rng.uniform(-2, 2, (2, 3))
        picture = np.clip(128 + (x[..., None] - 30) * slope[0] + (y[..., None] - 24) * slope[1], 0, 255)
        error = decoded(dxt1(picture.astype(np.uint8)), 48, 60) - picture
        assert 20 * np.log10(255 / np.sqrt((error**2).mean())) > 36


def test_sizes_that_are_no_multiple_of_four():
    picture = np.full((6, 10, 3), 247, np.uint8)
    data = dxt1(picture)
    assert len(data) == 2 * 3 * 8
    assert np.array_equal(decoded(data, 6, 10), picture)


def test_the_header_of_small_and_large_frames(monkeypatch):
    frame = hap_frame(np.zeros((8, 8, 3), np.uint8))
    assert frame[:4] == bytes([32, 0, 0, 0xAB])
    monkeypatch.setattr(module, "dxt1", lambda picture: bytes(1 << 24))
    large = hap_frame(np.zeros((8, 8, 3), np.uint8))
    assert large[:8] == bytes([0, 0, 0, 0xAB]) + (1 << 24).to_bytes(4, "little")
    assert len(large) == 8 + (1 << 24)


def test_ffmpeg_plays_it(tmp_path):
    av = pytest.importorskip("av")
    y, x = np.mgrid[0:62, 0:98]
    pictures = [
        np.stack([127 + 120 * np.sin(x / 20 + k), 2 * x, 4 * y], axis=-1).astype(np.uint8) for k in range(3)
    ]
    with hap_film(tmp_path / "a.mov", Fraction(30000, 1001)) as show:
        for picture in pictures:
            show(picture)
    with av.open(str(tmp_path / "a.mov")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.average_rate) == ("hap", Fraction(30000, 1001))
        assert (stream.width, stream.height, stream.frames) == (98, 62, 3)
        for frame, picture in zip(container.decode(video=0), pictures, strict=True):
            error = frame.to_ndarray(format="rgb24").astype(float) - picture
            assert 20 * np.log10(255 / np.sqrt((error**2).mean())) > 36
            # It rounds the steps between two colours, and their bits, in whole numbers.
            plain = decoded(dxt1(picture), 62, 98)
            assert np.abs(frame.to_ndarray(format="rgb24") - plain).max() < 2
