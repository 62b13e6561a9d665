"""MPCDI: what an archive holds, what others may look like, and what is wrong with bad ones."""

from __future__ import annotations

import io
import json
import re
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from quiltcli.calibration.pattern import draw, piece
from quiltcli.calibration.pattern_files import page_pattern
from quiltcli.errors import LayoutError
from quiltcli.exchange.pixelmaps import read_map, write_map
from quiltcli.exchange.pixelmaps.mpcdiwrite import mpcdi_xml
from quiltcli.formats.pfm import PfmError, pfm_bytes, read_pfm
from quiltcli.layout import pixel_owners
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle
from tests.helpers.turned_layout import SIZE, TURN_NAMES, turned_display, turned_layout


def contents(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def repacked(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def written(tmp_path, layout=None, facets=None):
    path = tmp_path / "m.mpcdi"
    write_map(turned_layout() if layout is None else layout, facets, path)
    return path, contents(path)


def assert_same_maps(expected, actual):
    for key in ("facet", "page", "size", "quilt_from_facet", "origin", "du", "dv", "polygon", "pages"):
        np.testing.assert_array_equal(getattr(expected, key), getattr(actual, key), err_msg=key)


def said(path, facets=None):
    with pytest.raises(LayoutError) as caught:
        read_map(path, facets)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


# --- what is written ---


def test_the_xml_names_pages_regions_and_files():
    layout = placed(flat_display([rectangle(8, 6)], names=["a&b"]), [[[0, -1, 10], [1, 0, 2]]], (16, 32))
    text = mpcdi_xml(layout, flat_display([rectangle(8, 6)], names=["a&b"]))
    assert text.splitlines() == [
        '<?xml version="1.0" encoding="utf-8"?>',
        '<MPCDI profile="2d" geometry="1" level="1" color="1" version="2.0">',
        "  <display>",
        '    <buffer id="page_01" xResolution="16" yResolution="32">',
        '      <region id="facet_0001_a_b" xResolution="8" yResolution="6"'
        ' x="0.25" y="0.0625" xsize="0.375" ysize="0.25"/>',
        "    </buffer>",
        "  </display>",
        "  <files>",
        '    <fileset region="facet_0001_a_b">',
        "      <geometryWarpFile><path>facet_0001_a_b.pfm</path><interpolation>linear</interpolation>"
        "</geometryWarpFile>",
        "      <alphaMap><path>facet_0001_a_b_alpha.png</path><componentDepth>1</componentDepth>"
        "<bitDepth>8</bitDepth><gammaEmbedded>1.0</gammaEmbedded></alphaMap>",
        "    </fileset>",
        "  </files>",
        "</MPCDI>",
    ]


def test_version_1_differs_in_its_root_and_in_spelling():
    layout = turned_layout()
    new, old = mpcdi_xml(layout).splitlines(), mpcdi_xml(layout, version=1).splitlines()
    assert old[1] == '<MPCDI profile="2d" level="1" date="1980-01-01 00:00:00" version="1.0">'
    assert old[3] == '    <buffer id="page_01" Xresolution="64" Yresolution="24">'
    assert [line.lower() for line in old[2:]] == [line.lower() for line in new[2:]]


@pytest.mark.parametrize("turn", range(8), ids=TURN_NAMES)
def test_a_player_that_follows_the_warp_shows_the_facet_upright(tmp_path, turn):
    """The archive applied by hand, from its own numbers alone: nearest pixel of the page, times alpha."""
    layout = turned_layout()
    owners = pixel_owners(layout)
    _, files = written(tmp_path)
    root = ElementTree.fromstring(files["mpcdi.xml"])
    region = root.findall(".//region")[np.flatnonzero(np.argsort(layout.page, kind="stable") == turn)[0]]
    buffer = root.findall(".//buffer")[layout.page[turn]]
    label = region.get("id")
    assert label == f"facet_000{turn + 1}"
    width, height = int(buffer.get("xResolution")), int(buffer.get("yResolution"))
    header, data = files[f"{label}.pfm"].split(b"\n-1.000000\n", 1)
    assert header == b"PF\n%d %d" % tuple(SIZE)
    uv = np.frombuffer(data, "<f4").reshape(SIZE[1], SIZE[0], 3)[::-1]  # bottom row first
    x = (float(region.get("x")) + float(region.get("xsize")) * uv[:, :, 0]) * width
    y = (float(region.get("y")) + float(region.get("ysize")) * uv[:, :, 1]) * height
    page = page_pattern(layout, int(layout.page[turn]), "id", owners)
    media = np.dstack([page[c] for c in "RGB"])
    with Image.open(io.BytesIO(files[f"{label}_alpha.png"])) as image:
        alpha = np.asarray(image) / 255
    shown = media[np.floor(y).astype(int), np.floor(x).astype(int)] * alpha[:, :, None]
    np.testing.assert_array_equal(draw("id", piece(layout, turn, owners)), shown)
    assert not uv[:, :, 2].any()


def test_without_our_own_file_places_still_read(tmp_path):
    layout, facets = turned_layout(), turned_display()
    path, files = written(tmp_path)
    assert json.loads(files.pop("quilt.json"))["quilt_layout"] == 1
    repacked(path, files)
    assert_same_maps(layout, read_map(path, facets))
    assert said(path) == [
        "says nothing of where facets are in the world: it has no quilt.json; name the display"
    ]


# --- other programs' archives ---


@pytest.mark.parametrize("resolution", ["Xresolution", "XResolution", "XRESOLUTION"])
def test_both_dialects_are_read(tmp_path, resolution):
    path, files = written(tmp_path)
    text = files["mpcdi.xml"].decode()
    text = text.replace("xResolution", resolution).replace("yResolution", "Y" + resolution[1:])
    text = re.sub("<MPCDI .*>", '<MPCDI profile="2d" level="1" date="2014-01-01" version="1.0">', text)
    text = text.replace("bitDepth", "bitdepth").replace("<path>", "<path> ").replace("region=", "Region=")
    files["mpcdi.xml"] = text.encode()
    repacked(path, files)
    assert_same_maps(turned_layout(), read_map(path))


def test_an_unpacked_archive_is_read(tmp_path):
    layout = turned_layout()
    _, files = written(tmp_path)
    folder = tmp_path / "unpacked"
    folder.mkdir()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    for place in (folder, folder / "mpcdi.xml"):
        assert_same_maps(layout, read_map(place, format_name="mpcdi"))
    (folder / "mpcdi.xml").rename(folder / "foo.mpcdi.xml")
    assert_same_maps(layout, read_map(folder / "foo.mpcdi.xml"))


def test_regions_may_have_names_of_their_own(tmp_path):
    layout, facets = turned_layout([0, 2, 4]), turned_display([0, 2, 4])
    path, files = written(tmp_path, layout)
    del files["quilt.json"]
    text = files["mpcdi.xml"].decode()
    for row, name in ((1, "left"), (3, "right"), (2, "top")):
        text = text.replace(f'"facet_000{row}"', f'"{name}"')
    files["mpcdi.xml"] = text.encode()
    repacked(path, files)
    # By the order of the file: page 1 holds facets 1 and 3, page 2 facet 2.
    back = read_map(path, facets)
    order = [0, 2, 1]
    np.testing.assert_array_equal(layout.quilt_from_facet[order], back.quilt_from_facet)
    np.testing.assert_array_equal(layout.page[order], back.page)


def test_a_coarse_warp_in_big_endian_with_nan_is_the_same_place(tmp_path):
    layout, facets = turned_layout([3]), turned_display([3])
    path, files = written(tmp_path, layout)
    del files["quilt.json"]
    name = "facet_0001.pfm"
    turn = layout.quilt_from_facet[0]
    i, j = np.meshgrid((np.arange(4) + 0.5) / 4 * SIZE[0], (np.arange(3) + 0.5) / 3 * SIZE[1])
    x, y = (line[0] * i + line[1] * j + line[2] for line in turn)
    low = np.minimum(turn[:, :2] * SIZE, 0).sum(axis=1) + turn[:, 2]
    extent = np.abs(turn[:, :2]) @ SIZE
    warp = np.dstack(((x - low[0]) / extent[0], (y - low[1]) / extent[1], np.full_like(x, np.nan)))
    files[name] = b"PF 4 3\n1.0\n" + warp[::-1].astype(">f4").tobytes()
    repacked(path, files)
    assert_same_maps(layout, read_map(path, facets))


# --- what is wrong ---

BAD = {
    "not xml": (
        "mpcdi.xml",
        "<display>",
        "<display",
        "mpcdi.xml is not XML: not well-formed (invalid token)",
    ),
    "other root": ("mpcdi.xml", "MPCDI", "html", "mpcdi.xml holds <html>, expected <MPCDI>"),
    "other profile": (
        "mpcdi.xml",
        '"2d"',
        '"sl"',
        "mpcdi.xml is of the profile 'sl', expected 2d (a media picture cut into regions)",
    ),
    "no resolution": (
        "mpcdi.xml",
        ' xResolution="64"',
        "",
        "mpcdi.xml: <buffer id='page_01'> has nothing as xresolution,"
        " expected a whole number from 1 to 1000000",
    ),
    "odd number": (
        "mpcdi.xml",
        ' y="',
        ' y="q',
        "mpcdi.xml: <region id='facet_0001'> has 'q0.08333333333333333' as y, expected a number",
    ),
    "no warp": (
        "mpcdi.xml",
        '<fileset region="facet_0001">',
        '<fileset region="other">',
        "mpcdi.xml names no geometryWarpFile for the region 'facet_0001'",
    ),
    "twice": (
        "mpcdi.xml",
        'region id="facet_0001"',
        'region id="facet_0003"',
        "mpcdi.xml has two regions 'facet_0003'",
    ),
    "no header": (
        "facet_0001.pfm",
        "PF",
        "P6",
        "facet_0001.pfm starts with b'P6\\n13 9\\n-1.0', expected a PFM header such as 'PF 640 480 -1.0'",
    ),
    "other size": (
        "facet_0001.pfm",
        "13 9",
        "14 9",
        "facet_0001.pfm holds 1404 bytes, expected 1512 for 14×9 pixels",
    ),
    "our file broken": (
        "quilt.json",
        '"facets"',
        '"facet"',
        "quilt.json is not what quilt writes; without it the display is needed\n"
        "quilt.json: facets: missing key (places of the facets)\n"
        "quilt.json: facet: unknown key (did you mean 'facets'?)",
    ),
    "our file short": ("quilt.json", '"id": 1,', '"id": 91,', "quilt.json says nothing of facet 1"),
}


@pytest.mark.parametrize("case", BAD)
def test_archives_with_something_wrong(tmp_path, case):
    name, old, new, message = BAD[case]
    path, files = written(tmp_path)
    assert old.encode() in files[name]
    every = case == "other root"
    files[name] = files[name].replace(old.encode(), new.encode(), -1 if every else 1)
    repacked(path, files)
    found = said(path)
    assert [re.sub(r"^.*m\.mpcdi:\d+:\d+: ", "", line) for line in found] == message.splitlines()


def test_missing_files_are_told_together(tmp_path):
    path, files = written(tmp_path)
    del files["facet_0002.pfm"], files["facet_0005.pfm"]
    repacked(path, files)
    assert said(path) == ["has no file 'facet_0002.pfm'", "has no file 'facet_0005.pfm'"]
    del files["mpcdi.xml"]
    repacked(path, files)
    assert said(path) == ["has no file 'mpcdi.xml'"]
    path.write_bytes(b"no zip")
    assert said(path) == ["is no MPCDI archive, which is a zip file"]


def test_a_warp_that_bends_is_no_facet(tmp_path):
    path, files = written(tmp_path)
    warp = read_pfm(files["facet_0001.pfm"])
    warp[4, 6, 0] += 0.1
    files["facet_0001.pfm"] = pfm_bytes(warp)
    repacked(path, files)
    (message,) = said(path)
    wanted = r"facet_0001.pfm bends the region 'facet_0001' by up to 1\.\d+ pixels, expected an affine map"
    assert re.fullmatch(wanted + r" \(a flat facet\)", message)


def test_regions_of_another_size_than_the_displays_rasters(tmp_path):
    path, files = written(tmp_path, turned_layout([0]))
    del files["quilt.json"]
    repacked(path, files)
    assert said(path, flat_display([rectangle(5, 4)])) == [
        "the region 'facet_0001' is 13×9 pixels, facet 1 of flat.yaml 5×4"
    ]
    layout = placed(flat_display([rectangle(4, 3)] * 2), [moved(0, 0), moved(5, 0)])
    path, files = written(tmp_path, layout)
    del files["quilt.json"]
    repacked(path, files)
    assert said(path, flat_display([rectangle(4, 3)])) == [
        "facet 2 is not in flat.yaml, which has facets 1 to 1"
    ]


# --- PFM ---


def test_pfm_rows_run_from_the_bottom():
    image = np.arange(18, dtype=np.float32).reshape(2, 3, 3)
    data = pfm_bytes(image)
    assert data[:17] == b"PF\n3 2\n-1.000000\n"
    assert np.frombuffer(data[17:], "<f4")[:3].tolist() == [9, 10, 11]
    np.testing.assert_array_equal(image, read_pfm(data))


def test_pfm_of_one_channel_and_values_that_are_none():
    data = b"Pf\n2 1\n1\n" + np.array([np.nan, 4], ">f4").tobytes()
    assert read_pfm(data).tolist() == [[[0], [4]]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"PF\n0 2\n-1\n", "has the header 'PF\\n0 2\\n-1\\n', expected sizes and a scale other than 0"),
        (b"PF\n1 1\n0\n", "has the header 'PF\\n1 1\\n0\\n', expected sizes and a scale other than 0"),
        (b"PF\n1 1\n--\n", "has the header 'PF\\n1 1\\n--\\n', expected sizes and a scale other than 0"),
        (b"", "starts with b'', expected a PFM header such as 'PF 640 480 -1.0'"),
        (b"PF\n1 1\n-1\nabc", "holds 3 bytes, expected 12 for 1×1 pixels"),
    ],
)
def test_bytes_that_are_no_pfm(data, message):
    with pytest.raises(PfmError) as caught:
        read_pfm(data)
    assert str(caught.value) == message
