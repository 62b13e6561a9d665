"""Displays as MPCDI archives of points in the world, out and in."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.formats.pfm import pfm_bytes, read_pfm
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import SURFACES

X, Y = np.meshgrid(np.arange(48) + 0.5, np.arange(32) + 0.5)


def run(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, [str(word) for word in words])
    return result.exit_code, result.output + result.stderr


def charts(path: Path):
    return load_display(load_display_file(path)).charts


def archive(folder: Path) -> Path:
    (folder / "d.yaml").write_text(
        f"quilt_display: 1\nsurfaces:\n- {{name: left wall, {SURFACES['cylinder']}, pixels: [48, 32]}}\n"
        f"- {{{SURFACES['bezier']}, pixels: [48, 32], at: [0, 3, 0], mask: mask.png}}\n"
    )
    mask = np.full((32, 48), 255, np.uint8)
    mask[:, :5] = 0
    Image.fromarray(mask).save(folder / "mask.png")
    code, said = run("export", folder / "d.yaml", "-o", folder / "d.mpcdi")
    assert code == 0, said
    return folder / "d.mpcdi"


def changed(path: Path, old: str, new: str) -> Path:
    """The archive with another mpcdi.xml."""
    with zipfile.ZipFile(path) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    assert old in members["mpcdi.xml"].decode()
    members["mpcdi.xml"] = members["mpcdi.xml"].decode().replace(old, new).encode()
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in members.items():
            packed.writestr(name, data)
    return path


def test_surfaces_go_out_and_come_back_as_the_same_pixels(tmp_path: Path) -> None:
    code, said = run("import", archive(tmp_path), "-o", tmp_path / "back.yaml")
    assert code == 0, said
    assert "2 surfaces in" in said
    for first, second in zip(charts(tmp_path / "d.yaml"), charts(tmp_path / "back.yaml"), strict=True):
        there = np.ones(X.shape, dtype=bool) if first.mask is None else first.mask
        assert np.abs(first.points(X, Y) - second.points(X, Y))[:, there].max() < 3e-7
        if first.mask is not None:
            assert (second.mask == first.mask).all()
        middle = np.s_[:, 4:-4, 8:-4]
        assert (first.normals(X, Y) * second.normals(X, Y))[middle].sum(axis=0).min() > 0.99


def test_the_same_display_gives_the_same_bytes(tmp_path: Path) -> None:
    first = archive(tmp_path).read_bytes()
    assert archive(tmp_path).read_bytes() == first


def test_rows_are_written_bottom_first_and_marked_in_metres(tmp_path: Path) -> None:
    with zipfile.ZipFile(archive(tmp_path)) as packed:
        text = packed.read("mpcdi.xml").decode()
        raw = packed.read("facet_0001_left_wall.pfm")
    assert '<MPCDI profile="a3"' in text
    assert "<geometricUnit>m</geometricUnit>" in text
    values = np.frombuffer(raw[-48 * 32 * 12 :], "<f4").reshape(32, 48, 3)
    assert values[0, 0, 1] < values[-1, 0, 1]  # the first row in the file is the lowest
    assert read_pfm(raw)[0, 0, 1] == values[-1, 0, 1]


def test_units_and_shader_lamps_are_read(tmp_path: Path) -> None:
    path = changed(archive(tmp_path), "<geometricUnit>m<", "<geometricUnit>yd<")
    changed(path, 'profile="a3"', 'profile="sl"')
    assert run("import", path, "-o", tmp_path / "back.yaml")[0] == 0
    first, second = charts(tmp_path / "d.yaml")[0], charts(tmp_path / "back.yaml")[0]
    assert np.abs(first.points(X, Y) * 0.9144 - second.points(X, Y)).max() < 1e-6


def test_regions_of_a_buffer_keep_their_places(tmp_path: Path) -> None:
    path = archive(tmp_path)
    with zipfile.ZipFile(path) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    lines = members["mpcdi.xml"].decode().splitlines()
    regions = [line for line in lines if "<region" in line]
    buffer = '    <buffer id="b" Xresolution="96" Yresolution="32">'
    regions = [
        r.replace('x="0"', f'x="{k / 2}"').replace('xsize="1"', 'xsize="0.5"') for k, r in enumerate(regions)
    ]
    at = lines.index("  <display>")
    text = [*lines[: at + 1], buffer, *regions, "    </buffer>", *lines[lines.index("  </display>") :]]
    members["mpcdi.xml"] = "\n".join(text).encode()
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in members.items():
            packed.writestr(name, data)
    assert run("import", path, "-o", tmp_path / "back.yaml")[0] == 0
    facets = load_display(load_display_file(tmp_path / "back.yaml"))
    assert facets.places is not None
    assert facets.places.corner.tolist() == [[0, 0], [48, 0]]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<geometricUnit>m<", "<geometricUnit>cubit<", "is measured in 'cubit' (expected one of mm, cm, dm"),
        ('Xresolution="48"', 'Xresolution="96"', "has 96×32 pixels, and its warp"),
        ("<path>facet_0001_left_wall.pfm", "<path>none.pfm", "has no file 'none.pfm'"),
        ("geometryWarpFile", "warp", "has no geometryWarpFile"),
        ('profile="a3"', 'profile="3d"', "is of the profile '3d', expected 2d"),
    ],
)
def test_what_is_wrong_with_an_archive_is_said(old: str, new: str, words: str, tmp_path: Path) -> None:
    code, said = run("import", changed(archive(tmp_path), old, new), "-o", tmp_path / "back.yaml")
    assert code == 2
    assert words in said
    assert not (tmp_path / "back.yaml").exists()


def test_a_blend_is_left_to_the_player(tmp_path: Path) -> None:
    path = archive(tmp_path)
    with zipfile.ZipFile(path) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    Image.fromarray(np.full((32, 48), 128, np.uint8)).save(tmp_path / "soft.png")
    members["facet_0001_left_wall_alpha.png"] = (tmp_path / "soft.png").read_bytes()
    points = read_pfm(members["facet_0001_left_wall.pfm"]).copy()
    points[3, 4] = np.nan
    members["facet_0001_left_wall.pfm"] = pfm_bytes(points)
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in members.items():
            packed.writestr(name, data)
    code, said = run("import", path, "-o", tmp_path / "back.yaml")
    assert code == 0, said
    assert "blends; the player does that" in said
    assert not charts(tmp_path / "back.yaml")[0].mask[3, 4]  # a pixel without a point is none


def test_a_projection_stands_nowhere(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("quilt_display: 1\nprojection: {kind: equirect, pixels: [64, 32]}\n")
    code, said = run("export", tmp_path / "p.yaml", "-o", tmp_path / "p.mpcdi")
    assert code == 2
    assert "is a projection, which goes along with the eye" in said
