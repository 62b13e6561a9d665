import errno
import os
import resource
import shutil
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from quiltcli.errors import OutputError
from quiltcli.formats import whole
from quiltcli.formats.exr import image as exr
from quiltcli.formats.exr.image import Image, read_exr, read_header, write_exr
from quiltcli.formats.whole import make_folder, write_text
from tests.helpers.noise_images import noise, provenance

LOSSLESS = ("none", "rle", "zips", "zip", "piz", "zstd", "htj2k32", "htj2k256", "lj2k")


def assert_same_channels(expected, actual):
    assert sorted(expected) == sorted(actual)
    for name, pixels in expected.items():
        assert pixels.dtype == actual[name].dtype, name
        np.testing.assert_array_equal(pixels, actual[name], err_msg=name)


def said(caught):
    return str(caught.value)


# --- what is written is what is read ---


@pytest.mark.parametrize("compression", [name for name in LOSSLESS if name in exr.compressions()])
def test_lossless_compressions_keep_every_bit(tmp_path, compression):
    path, channels = tmp_path / "a.exr", noise()
    write_exr(path, channels, {}, compression)
    image = read_exr(path)
    assert_same_channels(channels, image.channels)
    assert compression == image.compression


@pytest.mark.parametrize("compression", list(exr.compressions()))
@pytest.mark.parametrize("height", [1, 33, 300])
def test_a_whole_file_has_no_fault_whatever_the_compression(tmp_path, compression, height):
    path = tmp_path / "a.exr"
    write_exr(path, noise(height), {}, compression.upper())
    assert exr.exr_fault(path) == ""


@pytest.mark.parametrize(
    "view",
    [
        lambda a: a[::-1],
        lambda a: a[:, ::-1],
        np.asfortranarray,
        lambda a: a.T,
        lambda a: a[::2, ::3],
        lambda a: np.broadcast_to(a[:1], a.shape),
    ],
    ids=["rows reversed", "columns reversed", "fortran", "transposed", "strided", "broadcast"],
)
def test_any_strides_are_written_as_seen(tmp_path, view):
    path = tmp_path / "a.exr"
    channels = {name: view(pixels) for name, pixels in noise().items()}
    write_exr(path, channels, {})
    assert_same_channels(channels, read_exr(path).channels)


def test_arguments_stay_as_they_were(tmp_path):
    channels, attributes = noise(), provenance()
    before = dict(channels), dict(attributes)
    write_exr(tmp_path / "a.exr", channels, attributes)
    assert list(before[0]) == list(channels)
    assert list(before[1]) == list(attributes)
    assert all(channels[name] is before[0][name] for name in channels)
    assert all(attributes[name] is before[1][name] for name in attributes)


def test_what_is_read_owns_its_memory(tmp_path):
    path, channels = tmp_path / "a.exr", noise()
    write_exr(path, channels, {})
    image = read_exr(path)
    image.channels["R"][:] = 0
    assert_same_channels(channels, read_exr(path).channels)
    assert all(pixels.flags.owndata for pixels in image.channels.values())


def test_attributes_read_can_be_written_again(tmp_path):
    first, second = tmp_path / "a.exr", tmp_path / "b.exr"
    foreign = {"worldToCamera": np.eye(4, dtype=np.float32), "multiView": ["left", "right"]}
    write_exr(first, noise(), provenance() | foreign)
    image = read_exr(first)
    write_exr(second, image.channels, image.attributes)
    assert first.read_bytes() == second.read_bytes()


def test_windows_are_kept(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), {}, data_window=((10, 20), (59, 59)), display_window=((0, 0), (99, 79)))
    image = read_exr(path)
    assert image.data_window == ((10, 20), (59, 59))
    assert image.display_window == ((0, 0), (99, 79))


def test_the_header_comes_without_pixels(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), {"quilt:page": 2})
    header = read_header(path)
    assert header.channels == {}
    assert header.attributes["quilt:page"] == 2
    assert header.data_window == ((0, 0), (49, 39))


def test_same_image_same_bytes(tmp_path):
    paths = [tmp_path / "a.exr", tmp_path / "b.exr"]
    for path in paths:
        write_exr(path, noise(), provenance())
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_order_of_channels_and_attributes_does_not_reach_the_file(tmp_path):
    channels, attributes = noise(), provenance()
    write_exr(tmp_path / "a.exr", channels, attributes)
    write_exr(tmp_path / "b.exr", dict(reversed(channels.items())), dict(reversed(attributes.items())))
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


# --- what cannot be written ---


def test_unknown_compression_lists_the_known(tmp_path):
    with pytest.raises(OutputError) as caught:
        write_exr(tmp_path / "a.exr", noise(), {}, "zipp")
    expected = f"compression 'zipp' is unknown, expected one of {', '.join(exr.compressions())}"
    assert expected == said(caught)
    assert {"none", "zip", "zips", "piz", "dwaa", "dwab", "pxr24", "b44", "rle"} <= set(exr.compressions())


def test_a_type_the_format_has_not(tmp_path):
    path = tmp_path / "a.exr"
    with pytest.raises(OutputError) as caught:
        write_exr(path, {"Z": np.zeros((2, 2))}, {})
    assert f"{path}: channel Z is float64, expected float16, float32 or uint32" == said(caught)


@pytest.mark.parametrize(
    "channels",
    [
        {},
        {"R": np.zeros((0, 3), np.float32)},
        {"R": np.zeros(4, np.float32)},
        {"R": np.zeros((2, 3), np.float32), "G": np.zeros((3, 2), np.float32)},
    ],
    ids=["none", "empty", "flat", "two shapes"],
)
def test_shapes_the_format_has_not(tmp_path, channels):
    path = tmp_path / "a.exr"
    with pytest.raises(OutputError) as caught:
        write_exr(path, channels, {})
    assert f"{path}: channels must share one shape (H, W) that is not empty" == said(caught)


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, Fraction(2**33, 3), Fraction(1, 2**33)])
def test_a_number_too_long_is_not_cut(tmp_path, value):
    path = tmp_path / "a.exr"
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(), {"quilt:frame": value})
    expected = f"{path}: quilt:frame: is {value}, expected an integer or a fraction of 32 bits"
    assert expected == said(caught)
    assert not list(tmp_path.iterdir())


def test_the_longest_numbers_come_back(tmp_path):
    path = tmp_path / "a.exr"
    attributes = {"a": 2**31 - 1, "b": -(2**31), "c": Fraction(2**31 - 1, 2**32 - 1), "d": np.int64(5)}
    write_exr(path, noise(), attributes)
    found = read_header(path).attributes
    assert attributes == {name: found[name] for name in attributes}


def test_a_folder_in_the_place_of_the_file(tmp_path):
    path = tmp_path / "a.exr"
    path.mkdir()
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(), {})
    assert f"{path}: is a folder, expected a file to write" == said(caught)
    assert [path] == list(tmp_path.iterdir())


def test_a_folder_that_is_not_there(tmp_path):
    path = tmp_path / "no" / "a.exr"
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(), {})
    assert f"{path}: cannot be written: No such file or directory" == said(caught)


def test_a_file_where_a_folder_should_be(tmp_path):
    blocker = tmp_path / "out"
    blocker.write_text("mine")
    with pytest.raises(OutputError) as caught:
        make_folder(blocker / "quilt")
    assert f"{blocker}: is a file, expected a folder" == said(caught)
    with pytest.raises(OutputError) as caught:
        write_exr(blocker / "a.exr", noise(), {})
    assert f"{blocker / 'a.exr'}: cannot be written: Not a directory" == said(caught)
    assert blocker.read_text() == "mine"


def test_a_read_only_folder(tmp_path, monkeypatch):
    # Root may write anywhere, so the refusal is the library's own sentence rather than a real folder's.
    path = tmp_path / "a.exr"

    def refuse(self, name):
        raise RuntimeError(f'Cannot open image file "{name}". Permission denied.')

    monkeypatch.setattr(OpenEXR.File, "write", refuse)
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(), {})
    assert f"{path}: cannot be written: Permission denied" == said(caught)
    monkeypatch.setattr("pathlib.Path.mkdir", lambda *a, **k: (_ for _ in ()).throw(denied()))
    with pytest.raises(OutputError) as caught:
        make_folder(tmp_path / "out")
    assert f"{tmp_path / 'out'}: cannot be written: Permission denied" == said(caught)


def denied():
    return PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@pytest.fixture
def small_disk():
    """No file may grow past 4 KB: the system refuses the write as it does on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk(tmp_path, monkeypatch):
    def full(path):
        place = path.with_name("full")
        place.symlink_to("/dev/full")
        return place, os.open(place, os.O_RDWR)

    path = tmp_path / "a.exr"
    monkeypatch.setattr(whole, "new_file_beside", full)
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(200, 300), {})
    assert f"{path}: cannot be written: No space left on device" == said(caught)
    assert not list(tmp_path.iterdir())


def test_a_disk_that_fills_midway_leaves_the_old_file(tmp_path, small_disk):
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    with pytest.raises(OutputError) as caught:
        write_exr(path, noise(200, 300), {})
    assert f"{path}: cannot be written: File too large" == said(caught)
    assert path.read_bytes() == b"old"
    assert [path] == list(tmp_path.iterdir())


def test_a_disk_that_fills_with_the_last_bytes(tmp_path, monkeypatch):
    # What the library holds back until its stream is destroyed may be lost without an error.
    path, write = tmp_path / "a.exr", OpenEXR.File.write

    def lossy(self, name):
        write(self, name)
        os.truncate(name, Path(name).stat().st_size - 1)

    monkeypatch.setattr(OpenEXR.File, "write", lossy)
    with pytest.raises(OutputError) as caught:
        write_exr(path, {"R": np.ones((4, 4), np.float16)}, {}, "none")
    expected = f"{path}: cannot be written: what reached the disk is truncated: 489 of 490 bytes"
    assert expected == said(caught)
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(self, name):
        Path(name).write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(OpenEXR.File, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_exr(tmp_path / "a.exr", noise(), {})
    assert not list(tmp_path.iterdir())


def test_text_files_are_whole_too(tmp_path, small_disk):
    path = tmp_path / "report.json"
    write_text(path, "one\n")
    with pytest.raises(OutputError) as caught:
        write_text(path, "two\n" * 5000)
    assert f"{path}: cannot be written: File too large" == said(caught)
    assert path.read_text() == "one\n"
    assert [path] == list(tmp_path.iterdir())


# --- what cannot be read ---


def test_a_file_that_is_not_there(tmp_path):
    path = tmp_path / "a.exr"
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: no such file (expected an EXR)" == said(caught)
    with pytest.raises(OutputError) as caught:
        read_exr(tmp_path)
    assert f"{tmp_path}: is a directory (expected an EXR file)" == said(caught)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "is empty, expected an OpenEXR image"),
        (b"P6 2 2 255 " + b"x" * 12, "is no OpenEXR image"),
        (b"v/1", "is truncated: it ends inside its header or chunk table, after 3 bytes"),
    ],
)
def test_a_file_of_another_kind(tmp_path, content, expected):
    path = tmp_path / "a.exr"
    path.write_bytes(content)
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: {expected}" == said(caught)


def test_every_truncation_is_found(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), provenance(), "zips")
    good = path.read_bytes()
    for size in [*range(0, 1200, 7), *range(1200, len(good), 97), len(good) - 1]:
        path.write_bytes(good[:size])
        assert exr.exr_fault(path).startswith(("is truncated: ", "is empty")), size
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: is truncated: {len(good) - 1} of {len(good)} bytes" == said(caught)


def test_a_chunk_table_never_filled_in(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), {})
    data = bytearray(path.read_bytes())
    table = data.index(b"type\0string\0") + 12 + 4 + len("scanlineimage") + 1
    data[table : table + 24] = bytes(24)
    path.write_bytes(data)
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: is unfinished: its chunk table is not filled in" == said(caught)


def test_damaged_pixels(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), {})
    data = bytearray(path.read_bytes())
    data[2000:2100] = b"x" * 100
    path.write_bytes(data)
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: is damaged: 0 of 1 parts can be read" == said(caught)


@pytest.mark.parametrize("tiled", [False, True])
def test_many_parts(tmp_path, tiled):
    path, parts = tmp_path / "a.exr", []
    for number in range(3):
        header = {"displayWindow": ((0, 0), (99, 99)), "compression": OpenEXR.ZIP_COMPRESSION}
        header["type"] = OpenEXR.tiledimage if tiled else OpenEXR.scanlineimage
        if tiled:
            header["tiles"] = OpenEXR.TileDescription()
            header["tiles"].xSize = header["tiles"].ySize = 16
        parts.append(OpenEXR.Part(header, noise(seed=number), f"part{number}"))
    OpenEXR.File(parts).write(str(path))
    images = exr.read_parts(path)
    assert [image.name for image in images] == ["part0", "part1", "part2"]
    for number, image in enumerate(images):
        assert_same_channels(noise(seed=number), image.channels)
    with pytest.raises(OutputError) as caught:
        read_exr(path)
    assert f"{path}: has 3 parts, expected an image of one part" == said(caught)
    good = path.read_bytes()
    for size in range(40, len(good), 211):
        path.write_bytes(good[:size])
        assert exr.exr_fault(path).startswith("is truncated: "), size


def test_records_are_frozen(tmp_path):
    write_exr(tmp_path / "a.exr", noise(), {})
    image = read_exr(tmp_path / "a.exr")
    assert isinstance(image, Image)
    with pytest.raises(AttributeError):
        image.name = "other"


def test_every_compression_a_job_may_name_is_known():
    from quiltcli.job.job import COMPRESSIONS

    assert set(COMPRESSIONS) <= set(exr.compressions())


def test_a_folder_that_goes_while_a_file_is_written_is_told_of_the_file(tmp_path, monkeypatch):
    folder = tmp_path / "out"
    folder.mkdir()

    class Vanishing:
        def write(self, name):
            shutil.rmtree(folder)

    monkeypatch.setattr(exr, "_library_file", lambda *given: Vanishing())
    with pytest.raises(OutputError) as caught:
        write_exr(folder / "a.exr", noise(), {})
    assert said(caught) == f"{folder}/a.exr: cannot be written: No such file or directory"
