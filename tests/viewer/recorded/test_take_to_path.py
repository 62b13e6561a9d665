from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quiltcli.errors import QuiltError
from quiltcli.job import PathSpec, RecordedSpec, ViewerSpec
from quiltcli.viewer.recorded.head import Head, read_head, take_notices
from quiltcli.viewer.viewer import Viewer, viewer_at

RATE = 100.0


def rows(times: np.ndarray, places: np.ndarray, turns: Rotation | None = None) -> str:
    names = "time,x,y,z" + (",qx,qy,qz,qw" if turns is not None else "")
    table = np.column_stack((times, places, *([turns.as_quat()] if turns is not None else [])))
    return names + "\n" + "".join(",".join(repr(float(v)) for v in row) + "\n" for row in table)


def spec_of(folder: Path, text: str, **stated: Any) -> RecordedSpec:
    path = folder / "take.csv"
    path.write_text(text)
    return RecordedSpec.model_validate({"file": str(path), "units": "m", "up_axis": "y", **stated})


def head_of(folder: Path, text: str, **stated: Any) -> Head:
    return read_head(spec_of(folder, text, **stated))


def at(spec: RecordedSpec, frame: float, fps: float = RATE) -> Viewer:
    path = PathSpec.model_validate({"recorded": spec})
    return viewer_at(ViewerSpec(near=0.1, far=10.0, path=path), frame, "radial", fps, lambda: np.zeros(3))


def walk(count: int = 21) -> tuple[np.ndarray, np.ndarray]:
    times = np.arange(count) / RATE
    return times, np.stack((0.5 * times, 1.7 + 0.1 * times, -0.2 * times), axis=1)


def message(spec: RecordedSpec, frame: float) -> str:
    with pytest.raises(QuiltError) as caught:
        at(spec, frame)
    return str(caught.value).replace(str(spec.file), "F")


def test_a_frame_shows_its_second_of_the_take(tmp_path: Path) -> None:
    times, places = walk()
    spec = spec_of(tmp_path, rows(times, places), start=0.05, start_frame=11)
    assert at(spec, 11).eye == pytest.approx(places[5], abs=1e-12)
    assert at(spec, 13, fps=50).eye == pytest.approx(places[9], abs=1e-12)
    assert at(spec, 11.5).eye == pytest.approx((places[5] + places[6]) / 2, abs=1e-12)


def test_stamps_are_stretched_from_the_first_on_then_shifted(tmp_path: Path) -> None:
    times, places = walk()
    spec = spec_of(tmp_path, rows(1e9 + times, places), time_scale=2, time_offset=-1e9 - 0.045)
    assert read_head(spec).take.times == pytest.approx(2 * times - 0.045, abs=1e-6)


def test_the_world_comes_before_the_eye_on_its_marker(tmp_path: Path) -> None:
    turn = Rotation.from_euler("YXZ", [40, -25, 15], degrees=True)
    world = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)
    spec = spec_of(
        tmp_path,
        rows(np.array([0.0, 0.01]), np.array([[1.0, 2.0, 3.0]] * 2), Rotation.concatenate([turn, turn])),
        world_from_tracker={"translate": [5, 6, 7], "rotate_deg": [10, 20, 30], "scale": 2},
        eye_from_marker=[0.01, 0.08, -0.075],
    )
    expected = world.apply([2, 4, 6]) + [5, 6, 7] + (world * turn).apply([0.01, 0.08, -0.075])
    viewer = at(spec, 1)
    assert viewer.eye == pytest.approx(expected, abs=1e-9)
    assert viewer.look == pytest.approx((world * turn).apply([0, 0, -1]), abs=1e-9)
    assert viewer.up == pytest.approx((world * turn).apply([0, 1, 0]), abs=1e-9)


def test_a_marker_may_be_turned_on_the_head(tmp_path: Path) -> None:
    still = Rotation.identity(2)
    spec = spec_of(
        tmp_path,
        rows(np.array([0.0, 0.01]), np.zeros((2, 3)), still),
        eye_from_marker={"rotate_deg": [0, 90, 0]},
    )
    assert at(spec, 1).look == pytest.approx([-1, 0, 0], abs=1e-12)


def test_an_eye_beside_a_marker_needs_to_know_how_that_is_turned(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, rows(*walk()), eye_from_marker=[0, 0.1, 0])
    words = "turns with the marker, and F does not say how that is turned"
    assert message(spec, 1) == f"recorded.eye_from_marker: {words}" or message(spec, 1).endswith(words)


def test_short_gaps_are_filled_and_long_ones_named(tmp_path: Path) -> None:
    times, places = walk(101)
    kept = np.ones(101, dtype=bool)
    kept[20:25] = False
    kept[50:80] = False
    spec = spec_of(tmp_path, rows(times[kept], places[kept]))
    assert at(spec, 23).eye == pytest.approx(places[22], abs=1e-12)
    words = (
        "F has no good sample from second 0.490 to 0.800, 0.310 s (at most 0.1 s are filled: raise gaps.fill,"
        " or set gaps.then: hold)"
    )
    assert message(spec, 60).endswith(words)
    held = spec_of(tmp_path, rows(times[kept], places[kept]), gaps={"then": "hold"})
    assert at(held, 60).eye == pytest.approx(places[49], abs=1e-12)
    filled = spec_of(tmp_path, rows(times[kept], places[kept]), gaps={"fill": 0.5})
    assert at(filled, 60).eye == pytest.approx(places[59], abs=1e-12)


def test_lost_samples_make_a_gap_as_absent_ones_do(tmp_path: Path) -> None:
    times, places = walk(101)
    places[50:80] = np.nan
    text = rows(times, places).replace("nan", "")
    assert "from second 0.490 to 0.800" in message(spec_of(tmp_path, text), 60)


def test_nothing_is_extrapolated(tmp_path: Path) -> None:
    times, places = walk()
    spec = spec_of(tmp_path, rows(times, places), start=-0.05)
    words = (
        "F holds seconds 0.000 to 0.200, frames 6 to 26, and nothing is extrapolated"
        " (render those, or set start or start_frame)"
    )
    assert message(spec, 5).endswith(words)
    assert message(spec, 27).endswith(words)
    assert at(spec, 6).eye == pytest.approx(places[0])
    assert at(spec, 26).eye == pytest.approx(places[-1])


def test_doubled_stamps_become_their_mean(tmp_path: Path) -> None:
    times, places = walk(4)
    times[2] = times[1]
    head = head_of(tmp_path, rows(times, places))
    assert head.cleaned.doubled == 1
    assert at(spec_of(tmp_path, rows(times, places)), 2).eye == pytest.approx((places[1] + places[2]) / 2)


def test_a_sample_that_jumps_away_and_back_is_lost(tmp_path: Path) -> None:
    times, places = walk(41)
    bad = places.copy()
    bad[20] += [0.5, 0, 0]
    spec = spec_of(tmp_path, rows(times, bad))
    assert read_head(spec).cleaned.spikes == pytest.approx([0.2])
    assert at(spec, 21).eye == pytest.approx(places[20], abs=1e-12)


def test_a_sample_that_is_turned_away_alone_is_lost(tmp_path: Path) -> None:
    times, places = walk(41)
    angles = np.stack((40 * times, np.zeros(41), np.zeros(41)), axis=1)
    angles[20, 1] = 120  # a swapped marker, in one sample
    head = head_of(tmp_path, rows(times, places, Rotation.from_euler("yxz", angles, degrees=True)))
    assert head.cleaned.spikes == pytest.approx([0.2])
    assert head.cleaned.turns.size == 0
    (notice,) = take_notices(spec_of(tmp_path, (tmp_path / "take.csv").read_text()))
    assert notice.endswith(
        "take.csv: 1 sample left out, the first at second 0.200: away from all others and back at once"
    )
    spec = spec_of(tmp_path, (tmp_path / "take.csv").read_text(), filter={"kind": "none"})
    look = at(spec, 21).look  # straight along the way from one neighbour to the other
    assert look == pytest.approx([-math.sin(math.radians(8)), 0, -math.cos(math.radians(8))], abs=1e-9)
    wide = spec_of(tmp_path, (tmp_path / "take.csv").read_text(), gaps={"jump_deg": 20000})
    assert read_head(wide).cleaned.spikes.size == 0


def test_a_turn_that_stays_is_told(tmp_path: Path) -> None:
    times, places = walk(41)
    angles = np.zeros((41, 3))
    angles[20:, 0] = 170
    spec = spec_of(tmp_path, rows(times, places, Rotation.from_euler("yxz", angles, degrees=True)))
    assert read_head(spec).cleaned.turns == pytest.approx([0.2])
    assert read_head(spec).cleaned.spikes.size == 0
    (notice,) = take_notices(spec)
    assert "the head turns faster than any at second 0.200" in notice


def test_a_rate_that_is_not_that_of_the_stamps_is_told(tmp_path: Path) -> None:
    times, places = walk()
    text = rows(np.round(times, 3), places)
    assert list(take_notices(spec_of(tmp_path, text, rate=101))) == []
    (notice,) = take_notices(spec_of(tmp_path, text, rate=120))
    assert notice.endswith(
        "is said by the job to have 120 samples a second, but its stamps come 100 a second"
    )


def test_a_name_for_a_head_that_has_none_is_wrong(tmp_path: Path) -> None:
    times, places = walk()
    with pytest.raises(QuiltError, match="holds one head, which has no name"):
        head_of(tmp_path, rows(times, places), subject="Visitor")


def test_a_jump_that_stays_is_told_and_not_smoothed_over(tmp_path: Path) -> None:
    times, places = walk(81)
    places[40:] += [0.5, 0, 0]
    head = head_of(tmp_path, rows(times, places), filter="savitzky_golay")
    [jump] = head.cleaned.jumps
    assert (jump.first, jump.last) == pytest.approx((0.39, 0.40))
    assert np.concatenate([run.positions for run in head.runs]) == pytest.approx(places, abs=1e-9)


def test_frames_between_samples_lie_on_curves(tmp_path: Path) -> None:
    times = np.arange(41) / 20
    places = np.stack((times**2, 1 - times, 0 * times), axis=1)
    turns = Rotation.from_rotvec(np.outer(times, [0.3, 0.9, -0.4]))
    spec = spec_of(tmp_path, rows(times, places, turns), gaps={"jump": 30})
    viewer = at(spec, 11.3, fps=10)
    assert viewer.eye == pytest.approx([1.03**2, 1 - 1.03, 0], abs=1e-9)
    assert viewer.look == pytest.approx(
        Rotation.from_rotvec([0.309, 0.927, -0.412]).apply([0, 0, -1]), abs=1e-9
    )


def test_curves_of_rotations_have_no_kink(tmp_path: Path) -> None:
    times = np.arange(30) / 10
    angles = np.stack((np.sin(3 * times), np.cos(2 * times), 0.4 * times), axis=1)
    spec = spec_of(tmp_path, rows(times, 0 * angles, Rotation.from_euler("xyz", angles)))
    h = 1e-4
    looks = [at(spec, 11 + d, fps=10).look for d in (-h, 0, h)]
    assert (looks[1] - looks[0]) / h == pytest.approx((looks[2] - looks[1]) / h, abs=2e-3)


def test_a_file_is_read_once_and_again_when_it_changes(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, rows(*walk()))
    assert read_head(spec) is read_head(spec)
    before = read_head(spec)
    spec = spec_of(tmp_path, rows(*walk(22)))
    assert read_head(spec) is not before


def test_the_job_may_say_where_a_turned_head_looks(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, rows(*walk(2), Rotation.identity(2)), look=[1, 0, 0])
    assert at(spec, 1).look.tolist() == [1, 0, 0]


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"filter": {"kind": "rts", "window": 0.2}}, "belongs to savitzky_golay, and the filter is rts"),
        ({"axes": ["x", "y", "-y"]}, "names one axis twice"),
        ({"world_from_tracker": {"scale": [1, 2, 1]}}, "bends the take"),
        ({"world_from_tracker": {"scale": [1, 1, -1]}}, "mirrors the take"),
        ({"axes": ["x", "y", "z"]}, "cannot stand beside axes"),
    ],
)
def test_impossible_wishes_are_told(stated: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=words):
        spec_of(tmp_path, rows(*walk()), **stated)


def test_keyframes_with_orientations_turn_evenly() -> None:
    turn = Rotation.from_rotvec([0, math.radians(80), 0])
    keys = [
        {"frame": 1, "position": [0, 0, 0], "orientation": [0, 0, 0, 1]},
        {"frame": 5, "position": [4, 0, 0], "orientation": (-turn.as_quat()).tolist()},
    ]
    for interpolation in ("linear", "smooth"):
        path = PathSpec.model_validate({"keyframes": keys, "interpolation": interpolation})
        viewer = viewer_at(ViewerSpec(near=0.1, far=10.0, path=path), 2, "planar", RATE)
        expected = Rotation.from_rotvec([0, math.radians(20), 0]).apply([0, 0, -1])
        assert viewer.look == pytest.approx(expected, abs=1e-12)
        assert viewer.up == pytest.approx([0, 1, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("names", "row", "words"),
    [
        ("time|x|y|z", "0|1|2|3", "F:1:1: the columns are separated by bars (expected commas, "),
        ("time x y z", "0 0,1 2,5 3,5", "F:1:1: the columns are separated by blanks (expected commas, "),
        ("time;x;y;z", "0,1,2,3", "F:2:1: columns separated by commas under names separated by semicolons "),
        ("time,x,y,z", "0;1,5;2,5;3", "F:2:1: columns separated by semicolons under names separated by "),
        ("time,x,y,z", "0,0,1,2,5,3,5", "F:2:1: 7 cells under 4 names: are commas decimal points here? "),
    ],
)  # fmt: skip
def test_what_separates_columns_is_told_by_its_name(names: str, row: str, words: str, tmp_path: Path) -> None:
    spec = spec_of(tmp_path, f"{names}\n{row}\n")
    assert message(spec, 1).startswith(words)


def test_tabs_may_stand_beside_decimal_commas(tmp_path: Path) -> None:
    head = head_of(tmp_path, "time\tx\ty\tz\n0,00\t1,5\t2\t3\n0,01\t1,5\t2\t3\n")
    assert head.take.positions.tolist() == [[1.5, 2, 3]] * 2
