"""Turns of the mirror from a job to its files: the same bytes whoever draws them, and however."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import JobError, OutputError, SceneError, ViewerError
from quiltcli.formats.bitplanes import read_packed, unpack
from quiltcli.formats.exr.cryptomatte import identities
from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.ring import setup, turn
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.ring.walk import RingOptions, render_turns
from quiltcli.ring.picture import Picture, Show, draw_picture
from quiltcli.ring.tones import tones_of
from tests.helpers.ring_job import ring_job


def packed(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "packed").iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two turns of two packed pictures each, drawn by one process."""
    job = ring_job(tmp_path_factory.mktemp("whole"), positions=48, frames="3-4", tones=True)
    render_turns(load_job(job), RingOptions(workers=1))
    return job.parent / "out"


def test_files_are_numbered_through_the_job(whole: Path) -> None:
    assert list(packed(whole)) == [f"dvi.{k:08d}.png" for k in (1, 2, 3, 4)]
    tones = sorted(path.name for path in (whole / "tones").iterdir())
    assert tones[0] == "turn_0001.0001.exr"
    assert tones[-1] == "turn_0002.0048.exr"
    assert len(tones) == 96
    report = json.loads((whole / "report.json").read_text())
    assert [entry["frame"] for entry in report["frames"]] == [3, 4]
    assert report["timing"]["rpm"] == 6000
    assert 0.01 < report["frames"][0]["lit_share"]["mean"] < 0.9
    assert load_job(whole / "job.yaml").ring == load_job(whole.parent / "job.yaml").ring


def test_light_is_written_with_what_it_takes_to_use_it(whole: Path) -> None:
    image = read_exr(whole / "tones" / "turn_0002.0013.exr")
    assert {name: str(values.dtype) for name, values in image.channels.items()} == {
        **dict.fromkeys("RGBA", "float16"),
        "Z": "float32",
    }
    told = image.attributes
    assert told["quilt:frame"] == 4
    assert told["quilt:mirror_deg"] == pytest.approx(90)
    assert told["quilt:reflection"] == "plane"
    assert json.loads(str(told["quilt:viewers"])) == {"height": 0.4, "distance": 1.0, "users": []}
    matrix = np.array(str(told["quilt:projector"]).split(), dtype=float).reshape(3, 4)
    assert matrix[0, 0] == pytest.approx(48 * 0.6 / 0.13)
    seen = image.channels["A"] > 0
    assert 0.1 < seen.mean() < 0.7
    assert 0.9 < float(image.channels["Z"][seen].min()) < 1.1


def test_bits_are_the_halftone_of_tones(whole: Path) -> None:
    bits = unpack(read_packed(whole / "packed" / "dvi.00000002.png")[None])
    stage = set_ring_stage(load_job(whole.parent / "job.yaml"))
    show = stage.show(3)
    tones = tones_of(stage.rig, [draw_picture(show, stage.rig.angle(24))], stage.halftone)
    assert np.array_equal(bits[0], turn.halftone(tones.values, tones.inside, stage.halftone)[0])
    mean = float(tones.values[0][tones.inside].mean(dtype=float))
    assert bits[0][tones.inside].mean() == pytest.approx(mean, abs=0.02)
    assert not bits[0][~tones.inside].any()


@pytest.mark.parametrize("workers", [2, 3])
def test_workers_make_the_same_bytes(whole: Path, tmp_path: Path, workers: int) -> None:
    render_turns(load_job(whole.parent / "job.yaml"), RingOptions(folder=tmp_path, workers=workers))
    assert packed(tmp_path) == packed(whole)
    for path in sorted((whole / "tones").iterdir())[::7]:
        assert path.read_bytes() == (tmp_path / "tones" / path.name).read_bytes()


def test_parts_make_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    job = load_job(whole.parent / "job.yaml", ["output.tones=false"])
    for part in (range(1, 49, 3), range(2, 49, 3), range(3, 49, 3)):
        render_turns(job, RingOptions(folder=tmp_path, positions=part, workers=1))
    assert packed(tmp_path) == packed(whole)
    with pytest.raises(OutputError, match="exists already and 1 more"):
        render_turns(job, RingOptions(folder=tmp_path, workers=1))
    assert render_turns(job, RingOptions(folder=tmp_path, workers=1, resume=True)) == []


def test_a_stopped_run_is_taken_up_again(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, usual = load_job(whole.parent / "job.yaml", ["output.tones=false"]), turn.write_packed

    def dying(path: Path, picture: np.ndarray) -> None:
        if path.name == "dvi.00000002.png":
            raise KeyboardInterrupt
        usual(path, picture)

    monkeypatch.setattr(turn, "write_packed", dying)
    with pytest.raises(KeyboardInterrupt):
        render_turns(job, RingOptions(folder=tmp_path, workers=1))
    monkeypatch.setattr(turn, "write_packed", usual)
    damaged = tmp_path / "packed" / "dvi.00000003.png"
    damaged.write_bytes(b"")
    records = render_turns(job, RingOptions(folder=tmp_path, workers=2, resume=True))
    assert [record.positions for record in records] == [24, 48]
    assert packed(tmp_path) == packed(whole)


def test_light_that_a_stopped_run_has_written_is_not_drawn_again(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, usual, drawn = load_job(whole.parent / "job.yaml"), turn.draw_picture, []

    def dying(show: Show, angle: float, side: int = 0) -> Picture:
        drawn.append(angle)
        if len(drawn) == 21:
            raise KeyboardInterrupt
        return usual(show, angle, side)

    monkeypatch.setattr(turn, "draw_picture", dying)
    with pytest.raises(KeyboardInterrupt):
        render_turns(job, RingOptions([3], tmp_path, workers=1))
    assert not any((tmp_path / "packed").iterdir())
    (tmp_path / "tones" / "turn_0001.0004.exr").write_bytes(b"damaged")
    (record,) = render_turns(job, RingOptions([3], tmp_path, workers=1, resume=True))
    # Twenty were there, one of them has been spoilt since: 48 − 19, and the one at which the first run ended.
    assert len(drawn) == 21 + 29
    assert record.positions == 48
    wanted = {name: data for name, data in packed(whole).items() if name in packed(tmp_path)}
    assert packed(tmp_path) == wanted
    for path in (tmp_path / "tones").iterdir():
        assert path.read_bytes() == (whole / "tones" / path.name).read_bytes()


def test_a_changed_job_is_drawn_again(whole: Path, tmp_path: Path) -> None:
    render_turns(
        load_job(whole.parent / "job.yaml", ["output.tones=false"]), RingOptions([3], tmp_path, workers=1)
    )
    other = load_job(whole.parent / "job.yaml", ["output.tones=false", "ring.height=0.5"])
    (record,) = render_turns(other, RingOptions([3], tmp_path, workers=1, resume=True))
    assert record.positions == 48
    assert packed(tmp_path) != {
        name: data for name, data in packed(whole).items() if name in packed(tmp_path)
    }


@pytest.mark.parametrize("method", ["raycast", "vertex"])
def test_other_methods_show_nearly_the_same(whole: Path, tmp_path: Path, method: str) -> None:
    job = load_job(whole.parent / "job.yaml", [f"render.method={method}"])
    render_turns(job, RingOptions([3], tmp_path, (1, 13), workers=1))
    for number in (1, 13):
        name = f"tones/turn_0001.{number:04d}.exr"
        mine, theirs = (read_exr(folder / name).channels["Z"] for folder in (tmp_path, whole))
        same = np.isfinite(mine) & np.isfinite(theirs)
        assert (np.isfinite(mine) != np.isfinite(theirs)).sum() <= (0 if method == "raycast" else 8)
        assert (np.abs(mine[same] - theirs[same]) <= 2e-6 * theirs[same] + 1e-6).mean() > 0.99


def test_samples_are_averaged(whole: Path, tmp_path: Path) -> None:
    job = load_job(whole.parent / "job.yaml", ["render.samples=4"])
    render_turns(job, RingOptions([3], tmp_path, (1,), workers=1))
    smooth, sharp = (
        read_exr(folder / "tones" / "turn_0001.0001.exr").channels for folder in (tmp_path, whole)
    )
    assert set(np.unique(sharp["A"])) == {0, 1}
    assert set(np.unique(smooth["A"])) == {0, 0.25, 0.5, 0.75, 1}
    assert np.array_equal(smooth["Z"], sharp["Z"])
    assert abs(float(smooth["G"].mean(dtype=float)) - float(sharp["G"].mean(dtype=float))) < 0.01


def test_both_halves_of_a_tent_are_lit_by_their_own_side(tmp_path: Path) -> None:
    sides = (
        "sides: [{azimuth_deg: 0, ridge: 0.0325, filter: [1, .254, .018]},"
        " {azimuth_deg: 180, ridge: 0.0325, filter: [.001, .768, .604]}]"
    )
    job = ring_job(tmp_path, more=sides, tones=True)
    render_turns(load_job(job), RingOptions(workers=1))
    first = read_exr(tmp_path / "out" / "tones" / "turn_0001.0001.exr").channels["A"] > 0
    second = read_exr(tmp_path / "out" / "tones" / "turn_0001.side2.0001.exr").channels["A"] > 0
    assert first.any()
    assert second.any()
    assert not (first & second).any()
    # At 0° the first side serves +X, and lies in the picture's right half.
    assert np.nonzero(first)[1].min() >= 23
    assert np.nonzero(second)[1].max() <= 24


def test_dwelling_is_made_up_for(tmp_path: Path) -> None:
    job = ring_job(tmp_path)
    plain, even = (
        set_ring_stage(load_job(job, [f"halftone={{compensate: {how}}}"])) for how in ("none", "dwell")
    )
    picture = draw_picture(plain.show(1), plain.rig.angle(5))
    before = tones_of(plain.rig, [picture], plain.halftone).values[0]
    after = tones_of(even.rig, [picture], even.halftone, even.shortest).values[0]
    lit = before > 0.05
    share = after[lit].astype(float) / before[lit]
    assert 0.8 < share.min() < share.max() <= 1.001


def test_frames_and_positions_that_do_not_exist_are_told(whole: Path, tmp_path: Path) -> None:
    job = load_job(whole.parent / "job.yaml")
    with pytest.raises(JobError, match="does not hold frame 9"):
        render_turns(job, RingOptions([9], tmp_path))
    with pytest.raises(JobError, match="no mirror position 49"):
        render_turns(job, RingOptions([3], tmp_path, (49,)))
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ("ring.distance=0.03", "reaches 0.04.* m from the axis, and viewers stand at 0.03 m"),
        (
            "ring.users=[{azimuth_deg: 0, height: 0, distance: 1}, {azimuth_deg: 9, height: 1, distance: 1}]",
            r"users\[1\]: at frame 3, users\[0\] and users\[1\] hold azimuths that overlap",
        ),
        (
            "ring.users=[{azimuth_deg: 0, height: 0, distance: 0.2, hold_deg: 1, blend_deg: 2}]",
            "curve is too steep",
        ),
    ],
)
def test_impossible_viewers_are_told(whole: Path, tmp_path: Path, sets: str, words: str) -> None:
    with pytest.raises((SceneError, ViewerError), match=words):
        render_turns(load_job(whole.parent / "job.yaml", [sets]), RingOptions([3], tmp_path))
    assert not any(tmp_path.iterdir())


def test_what_is_worth_a_word_is_refused_where_that_is_wanted(whole: Path, tmp_path: Path) -> None:
    job, told = load_job(whole.parent / "job.yaml"), []
    render_turns(job, RingOptions([3], tmp_path / "out", dry_run=True), told.append)
    assert [words for words in told if "gap" in words]
    with pytest.raises(JobError, match="--strict does not allow what is said above") as error:
        render_turns(job, RingOptions([3], tmp_path / "out", strict=True))
    assert [f"note: {problem.message}" for problem in error.value.problems[:-1]] == told
    assert not any(tmp_path.iterdir())


def test_heads_come_from_a_recorded_path(tmp_path: Path) -> None:
    job = ring_job(tmp_path, frames="1-2")
    heads = tmp_path / "heads.csv"
    heads.write_text("frame,user,x,y,z\n1,a,0.6,0.1,0\n1,b,-0.5,0.2,0\n2,a,0,0.1,0.6\n2,b,-0.5,0.3,0\n")
    stage = set_ring_stage(load_job(job, [f"ring.heads={heads}"]))
    users = stage.show(2).curve.users
    assert [(round(math.degrees(u.azimuth)), u.height, u.distance) for u in users] == [
        (90, 0.1, 0.6),
        (180, 0.3, 0.5),
    ]
    with pytest.raises(ViewerError, match="has no row for frame 3"):
        set_ring_stage(load_job(job, [f"ring.heads={heads}", "frames=3"]))
    heads.write_text("frame,user,x,y,z\n1,a,0.6,0.1\n1,b,0,0,0\n1,c,1,0,0\n1,c,1,0,0\n")

    with pytest.raises(ViewerError) as error:
        set_ring_stage(load_job(job, [f"ring.heads={heads}"]))
    assert [problem.line for problem in error.value.problems] == [2, 3, 5]


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ("render.shutter=0.5", "render.shutter: expected 0 beside ring"),
        ("render.double_sided=file", "render.double_sided: expected all beside ring"),
        ("render.scale=1/2", "render.scale: belongs to displays of facets"),
    ],
)
def test_what_a_turn_does_not_do_is_refused_once(whole: Path, sets: str, words: str) -> None:
    with pytest.raises(JobError, match=words) as error:
        load_job(whole.parent / "job.yaml", [sets])
    assert len(error.value.problems) == 1


def test_shadows_and_occlusion_are_as_the_job_wants_them(tmp_path: Path) -> None:
    path = ring_job(tmp_path)
    scene = tmp_path / "scene.yaml"
    # A leaf over the ball, which keeps the lamp's light from all of it.
    (tmp_path / "leaf.obj").write_text(
        "v -.06 .2 -.06\nv .06 .2 -.06\nv .06 .2 .06\nv -.06 .2 .06\nf 1 4 3\nf 1 3 2\n"
    )
    lamp = "{type: directional, shadows: true, direction: [0, -1, 0], color: [1, 1, 1]}"
    scene.write_text(
        "quilt_scene: 1\nobjects: [{mesh: ball.obj}, {mesh: leaf.obj}]\n"
        f"lights: [{lamp}, {{type: ambient, color: [0.2, 0.2, 0.2]}}]\n"
    )

    def light(*sets: str) -> float:
        stage = set_ring_stage(load_job(path, sets))
        picture = draw_picture(stage.show(1), stage.rig.angle(2))
        return float(picture.rgb()[:, :, 1].mean(dtype=float))

    shaded, plain = light(), light("render.shadows=false")
    assert plain > 1.2 * shaded
    assert light("render.ambient_occlusion={distance: 1}", "render.shadows=false") < 0.995 * plain


def test_pictures_that_do_not_fit_into_memory_are_refused(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(setup, "free_memory", lambda: 800_000)
    with pytest.raises(JobError, match=r"48 pictures of 48×48 would take 0\.885 MB of memory, but 0\.8 MB"):
        render_turns(load_job(whole.parent / "job.yaml"), RingOptions(folder=tmp_path))


def test_edges_of_vertices_bend_as_far_as_they_may(whole: Path) -> None:
    def wrong(most: str) -> int:
        stages = [
            set_ring_stage(load_job(whole.parent / "job.yaml", ["display=" + str(fine), *sets]))
            for sets in (["render.method=exact"], ["render.method=vertex", f"render.tessellate={most}"])
        ]
        exact, straight = (draw_picture(stage.show(3), 0.3).buffers["Z"] for stage in stages)
        return int(np.count_nonzero(np.isfinite(exact) != np.isfinite(straight)))

    fine = whole.parent / "fine.yaml"
    fine.write_text((whole.parent / "turn.yaml").read_text().replace("[48, 48]", "[512, 512]"))
    assert wrong("5") > 4 * wrong("0.01")


@pytest.mark.parametrize("samples", [1, 4])
def test_mattes_add_up_to_what_is_seen(tmp_path: Path, samples: int) -> None:
    sets = ["output.channels=[rgba, cryptoobject]", f"render.samples={samples}"]
    job = load_job(ring_job(tmp_path, tones=True), sets)
    render_turns(job, RingOptions(workers=1, positions=[6]))
    image = read_exr(tmp_path / "out" / "tones" / "turn_0001.0006.exr")
    alpha = image.channels["A"].astype(float)
    assert 0.1 < alpha.mean() < 0.7
    share = sum(image.channels[f"CryptoObject{k:02d}.{c}"].astype(float) for k in range(3) for c in "GA")
    assert np.abs(share - alpha).max() < 1e-3
    (name,) = set_ring_stage(job).scene.objects
    whole = alpha == 1
    assert (image.channels["CryptoObject00.R"][whole] == identities([name])[0]).all()
    manifest = next(value for key, value in image.attributes.items() if key.endswith("/manifest"))
    assert name in json.loads(str(manifest))
