"""A projector of three chips: red, green and blue are streams of pictures of one bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.ring.simulate import EyeOptions, look_at_display
from quiltcli.analysis.ring.verify import RingVerifyOptions, verify_turn
from quiltcli.errors import QuiltError
from quiltcli.formats.bitplanes import STREAMS, pack, read_packed, unpack, write_packed
from quiltcli.halftone import Sequel, halftone
from quiltcli.images.bits import unpack_files
from quiltcli.images.turns import turn_pictures
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.ring.walk import RingOptions, render_turns
from quiltcli.ring.picture import draw_picture
from quiltcli.ring.tones import tones_of
from tests.helpers.ring_job import ring_job

NAMES = sorted(f"dvi_{stream}.{k:08d}.png" for stream in STREAMS for k in (1, 2))


@pytest.fixture(scope="module")
def turn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    job = ring_job(tmp_path_factory.mktemp("streams"), positions=30, more="filters: rgb\n")
    render_turns(load_job(job), RingOptions(workers=2))
    return job


def packed(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "packed").iterdir())}


def test_each_colour_has_pictures_that_are_its_own_halftone(turn: Path) -> None:
    out = turn.parent / "out"
    assert sorted(packed(out)) == NAMES
    stage = set_ring_stage(load_job(turn))
    picture = draw_picture(stage.show(1), stage.rig.angle(25))
    tones = tones_of(stage.rig, [picture], stage.halftone)
    lit = picture.lit
    light = np.clip(picture.rgb()[lit], 0, 1).astype(np.float16)
    for k, stream in enumerate(STREAMS):
        assert np.array_equal(tones.values[k][lit], light[:, k])
        bits = unpack(read_packed(out / "packed" / f"dvi_{stream}.00000002.png")[None])[1]
        wanted = halftone(tones.values[k : k + 1], tones.inside, stage.halftone, Sequel([25]))[0]
        assert np.array_equal(bits, wanted)
    # The scene is not grey: what is compared differs from colour to colour.
    means = tones.values.astype(float).sum(axis=(1, 2))
    assert means.max() > 1.2 * means.min()


def test_one_wrong_bit_of_one_colour_is_found(turn: Path, tmp_path: Path) -> None:
    job = load_job(turn, [f"output.directory={tmp_path}"])
    render_turns(job, RingOptions(workers=1))
    assert packed(tmp_path) == packed(turn.parent / "out")
    assert verify_turn(job, RingVerifyOptions(everything=True)).passed
    path = tmp_path / "packed" / "dvi_green.00000001.png"
    bits = unpack(read_packed(path)[None])
    bits[3, 20, 20] ^= True
    write_packed(path, pack(bits)[0])
    assert verify_turn(job, RingVerifyOptions(everything=True)).bits_wrong == 1


def test_a_lost_picture_of_one_colour_is_drawn_again(turn: Path, tmp_path: Path) -> None:
    job = load_job(turn, [f"output.directory={tmp_path}"])
    render_turns(job, RingOptions(workers=1, positions=range(1, 26)))
    render_turns(job, RingOptions(workers=1, positions=range(26, 31)))
    whole = packed(turn.parent / "out")
    assert packed(tmp_path) == whole
    (tmp_path / "packed" / "dvi_blue.00000002.png").unlink()
    (record,) = render_turns(job, RingOptions(workers=1, resume=True))
    assert record.positions == 6
    assert packed(tmp_path) == whole


def test_an_eye_sees_colours(turn: Path) -> None:
    seen = look_at_display(load_job(turn), 1, EyeOptions(size=(64, 64), tones=True))
    assert seen.comparison is not None
    saturation = np.ptp(seen.picture.reshape(-1, 3), axis=1)
    assert saturation.max() > 0.1
    some = np.isfinite(seen.picture).all(axis=-1) & (seen.picture.sum(axis=-1) > 0.1)
    ratio = seen.picture[some].mean(axis=0) / seen.direct[some].mean(axis=0)
    assert ratio == pytest.approx(np.full(3, ratio.mean()), rel=0.1)


def test_sheets_and_unpacked_pictures_know_the_streams(turn: Path, tmp_path: Path) -> None:
    out = turn.parent / "out"
    labels, pictures = zip(*turn_pictures(out, 48, None), strict=True)
    assert len(labels) == 15  # every other position
    assert any(np.ptp(picture.reshape(-1, 3).astype(int), axis=1).max() > 100 for picture in pictures)
    files = unpack_files([out], tmp_path)
    assert len(files) == 3 * 2 * 24
    assert {path.name.split(".")[0] for path in files} == {f"bits_{stream}" for stream in STREAMS}


def test_streams_and_filters_of_sides_exclude_one_another(tmp_path: Path) -> None:
    sides = "sides: [{azimuth_deg: 0, filter: [1, 0.3, 0]}, {azimuth_deg: 180, filter: [0, 0.7, 0.6]}]\n"
    with pytest.raises(QuiltError, match="filters: cannot stand beside filters of sides"):
        load_job(ring_job(tmp_path, more=f"filters: rgb\n{sides}"))
