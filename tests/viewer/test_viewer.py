from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from quiltcli.errors import QuiltError
from quiltcli.geometry.interpolation import smooth
from quiltcli.job import PathSpec, ViewerSpec
from quiltcli.viewer import viewer as viewers
from quiltcli.viewer.view import view_problems


def viewer_at(viewer, frame, depth="planar"):
    return viewers.viewer_at(viewer, frame, depth, 30.0)


def check_viewer(viewer, frames):
    how = SimpleNamespace(depth="planar")
    job = SimpleNamespace(people={"": viewer}, is_stereo=False, render=how, fps=30)
    return view_problems(job, frames)


def spec(**path: Any) -> ViewerSpec:
    return ViewerSpec(near=0.1, far=10.0, path=PathSpec.model_validate(path))


def keys(*frames_and_x: tuple[int, float], interpolation: str = "linear") -> ViewerSpec:
    keyframes = [{"frame": f, "position": [x, 0, 0], "look_at": [0, 0, -5]} for f, x in frames_and_x]
    return spec(keyframes=keyframes, interpolation=interpolation)


def eye_x(viewer: ViewerSpec, frame: int) -> float:
    return float(viewer_at(viewer, frame).eye[0])


def test_record() -> None:
    viewer = viewer_at(keys((1, 0.0)), 7, "radial")
    assert (viewer.frame, viewer.near, viewer.far, viewer.depth) == (7, 0.1, 10.0, "radial")
    assert viewer.look.tolist() == [0, 0, -1]
    assert viewer.up.tolist() == [0, 1, 0]
    assert viewer.camera_from_world.tolist() == np.eye(3).tolist()


def test_linear_between_and_held_outside() -> None:
    viewer = keys((1, 0.0), (5, 8.0))
    assert [eye_x(viewer, f) for f in (-9, 1, 2, 3, 5, 99)] == [0, 0, 2, 4, 8, 8]


def test_hold_waits_for_the_next_keyframe() -> None:
    viewer = keys((1, 0.0), (5, 8.0), interpolation="hold")
    assert [eye_x(viewer, f) for f in (0, 1, 4, 5, 6)] == [0, 0, 0, 8, 8]


def test_order_in_the_file_does_not_matter() -> None:
    assert eye_x(keys((5, 8.0), (1, 0.0)), 2) == 2


def test_smooth_goes_through_the_keyframes_and_along_parabolas() -> None:
    viewer = keys(*((f, f * f / 8) for f in (0, 2, 7, 11, 20)), interpolation="smooth")
    assert [eye_x(viewer, f) for f in range(21)] == pytest.approx([f * f / 8 for f in range(21)], abs=1e-12)


def test_smooth_has_no_kink() -> None:
    x = np.array([0.0, 1.0, 4.0, 6.0, 7.0])
    y = np.array([[0.0], [3.0], [-1.0], [2.0], [2.0]])
    h = 1e-6
    for at in x[1:-1]:
        before = (smooth(x, y, at) - smooth(x, y, at - h)) / h
        after = (smooth(x, y, at + h) - smooth(x, y, at)) / h
        assert before == pytest.approx(after, abs=1e-4)


def test_directions_are_interpolated_as_directions() -> None:
    viewer = spec(
        keyframes=[
            {"frame": 0, "position": [0, 0, 0], "look": [0, 0, -9]},
            {"frame": 2, "position": [0, 0, 0], "look": [1, 0, 0]},
        ]
    )
    half = math.sqrt(0.5)
    assert viewer_at(viewer, 1).look == pytest.approx([half, 0, -half])


@given(st.integers(-10, 10), st.tuples(*[st.floats(-5, 5)] * 3), st.tuples(*[st.floats(-1, 1)] * 3))
def test_camera_is_a_rotation(frame: int, eye: tuple[float, ...], up: tuple[float, ...]) -> None:
    assume(max(map(abs, up[:2])) > 1e-3)
    keyframe = {"frame": 0, "position": eye, "look": [0, 0, -1], "up": up}
    camera = viewer_at(spec(keyframes=[keyframe]), frame).camera_from_world
    assert camera @ camera.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(camera) == pytest.approx(1)


def test_orbit() -> None:
    viewer = spec(orbit={"center": [1, 1, 0], "radius": 2, "height": 0.5, "frames_per_turn": 8})
    places = {1: [1, 1.5, 2], 3: [3, 1.5, 0], 5: [1, 1.5, -2], 7: [-1, 1.5, 0]}
    for frame, place in places.items():
        assert viewer_at(viewer, frame).eye == pytest.approx(place)
    look = viewer_at(viewer, 3).look
    assert look == pytest.approx(np.array([-2, -0.5, 0]) / math.hypot(2, 0.5))


def test_orbit_repeats_to_the_bit_and_turns_backwards() -> None:
    viewer = spec(orbit={"center": [0, 0, 0], "radius": 1, "frames_per_turn": 7})
    assert viewer_at(viewer, 3).eye.tolist() == viewer_at(viewer, 3 + 7_000_000).eye.tolist()
    back = spec(orbit={"center": [0, 0, 0], "radius": 1, "frames_per_turn": -4})
    assert viewer_at(back, 2).eye == pytest.approx([-1, 0, 0])


def test_orbit_sweep_rests_at_its_ends() -> None:
    sweep = {"start_deg": -90, "end_deg": 90, "start_frame": 10, "end_frame": 20}
    viewer = spec(orbit={"center": [0, 0, 0], "radius": 1, "elevation_deg": 0, **sweep})
    for frame, place in {0: [-1, 0, 0], 10: [-1, 0, 0], 15: [0, 0, 1], 20: [1, 0, 0], 30: [1, 0, 0]}.items():
        assert viewer_at(viewer, frame).eye == pytest.approx(place, abs=1e-12)


def test_orbit_elevation() -> None:
    viewer = spec(orbit={"center": [0, 0, 0], "radius": 2, "elevation_deg": 30, "frames_per_turn": 9})
    assert viewer_at(viewer, 1).eye == pytest.approx([0, 1, math.sqrt(3)])


def test_a_view_that_turns_right_round_is_an_error() -> None:
    keyframes = [
        {"frame": 0, "position": [0, 0, 0], "look": [0, 0, -1]},
        {"frame": 2, "position": [0, 0, 0], "look": [0, 0, 1]},
    ]
    problems = check_viewer(spec(keyframes=keyframes), range(3))
    assert [str(p) for p in problems] == [
        "keyframes[0]: at frame 1 the viewer turns right round: there is no direction of view"
    ]


def test_eye_that_passes_its_target_is_an_error() -> None:
    keyframes = [{"frame": f, "position": [0, 0, z], "look_at": [0, 0, 0]} for f, z in ((0, 1), (2, -1))]
    problems = check_viewer(spec(keyframes=keyframes), range(3))
    assert [str(p) for p in problems] == [
        "keyframes[0]: at frame 1 the viewer is where it looks at: there is no direction of view"
    ]


def test_orbit_overhead_looks_along_up() -> None:
    viewer = spec(orbit={"center": [0, 0, 0], "radius": 2, "elevation_deg": 90, "frames_per_turn": 9})
    with pytest.raises(QuiltError) as caught:
        viewer_at(viewer, 1)
    assert str(caught.value) == "orbit: at frame 1 the viewer looks along up (turn up elsewhere)"


def track(folder: Path, text: str, **more: Any) -> ViewerSpec:
    (folder / "track.csv").write_text(text)
    return spec(csv={"file": str(folder / "track.csv"), **more})


def test_csv_by_position(tmp_path: Path) -> None:
    viewer = track(tmp_path, "# tracker\n2, 1,2,3, 1,2,0\n\n1,0,0,0,0,0,-1\n")
    assert viewer_at(viewer, 2).eye.tolist() == [1, 2, 3]
    assert viewer_at(viewer, 1).look.tolist() == [0, 0, -1]


def test_csv_by_header_in_any_order_and_units(tmp_path: Path) -> None:
    text = "Z,y,x,frame,ux,uy,uz,lx,ly,lz\n3000,2000,1000,5,1,0,0,1000,2000,0\n"
    viewer = viewer_at(track(tmp_path, text, units="mm"), 5)
    assert viewer.eye.tolist() == [1, 2, 3]
    assert viewer.look.tolist() == [0, 0, -1]
    assert viewer.up.tolist() == [1, 0, 0]


def test_csv_directions_and_aim_from_the_job(tmp_path: Path) -> None:
    directions = track(tmp_path, "frame,x,y,z,look_x,look_y,look_z\n1,5,5,5,0,0,-2\n")
    assert viewer_at(directions, 1).look.tolist() == [0, 0, -1]
    aimed = track(tmp_path, "frame,x,y,z\n1,0,0,5\n", look_at=[0, 0, 0])
    assert viewer_at(aimed, 1).look.tolist() == [0, 0, -1]


def test_csv_gap_is_filled_only_when_asked(tmp_path: Path) -> None:
    text = "1,0,0,0\n5,8,0,0\n"
    assert eye_x(track(tmp_path, text, look=[0, 0, -1], fill=True), 2) == 2


def test_csv_is_read_again_when_it_changes(tmp_path: Path) -> None:
    viewer = track(tmp_path, "1,0,0,0\n", look=[0, 0, -1])
    assert eye_x(viewer, 1) == 0
    track(tmp_path, "1,10,0,0\n")
    assert eye_x(viewer, 1) == 10


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "F: holds no rows (expected frame,x,y,z)"),
        ("frame,x,y,z\n", "F: holds no rows (expected frame,x,y,z)"),
        ("1|2|3|4\n", "F:1:1: expected 4, 7 or 10 columns, got 1 (separate the columns by commas)"),
        ("1,2,3\n", "F:1:1: expected 4, 7 or 10 columns, got 3"),
        ("1\n", "F:1:1: expected 4, 7 or 10 columns, got 1 (separate the columns by commas)"),
        ("1,0,0,0\n2,0,0\n", "F:2:1: expected 4 columns, got 3"),
        ("1,0,0,0\n2,0, ,0\n", "F:2:5: y is blank"),
        ("1,0,0,0\n2,0,nan,0\n", "F:2:5: y: expected a finite number, got nan"),
        ("1,0,0,0\n2,0, abc,0\n", "F:2:6: y: expected a number, got 'abc'"),
        ("1.5,0,0,0\n", "F:1:1: frame: expected a whole number, got '1.5'"),
        ("1,0,0,0\n01,0,0,0\n", "F:2:1: frame 1 is already given in line 1"),
        ("frame,x,y,zz\n1,0,0,0\n",
         "F:1:11: unknown column 'zz' (known: frame, x, y, z, look_at_x, look_at_y, look_at_z, look_x,"
         " look_y, look_z, up_x, up_y, up_z, qx, qy, qz, qw, yaw_deg, pitch_deg, roll_deg)\n"
         "F:1:1: there is no column 'z'"),
        ("frame,x,y,z,up_x,up_y\n1,0,0,0,0,1\n", "F:1:1: there is no column 'up_z'"),
        ("frame,x,y,z,x\n1,0,0,0,0\n", "F:1:13: column 'x' stands twice"),
        ("1,0,0,0\n5,0,0,0\n", "F:2:1: frame 3 is missing between 1 and 5 (add it, or set fill: true)"),
        ("1,0,0,0\n2,0,0,0\n", "csv: frame 3 is not in F (it holds frames 1 to 2)"),
        ("3,0,0,0,0,0,0\n", "csv: at frame 3 the viewer is where it looks at: there is no direction of view"),
    ],
)  # fmt: skip
def test_csv_message(text: str, message: str, tmp_path: Path) -> None:
    problems = check_viewer(track(tmp_path, text), [3])
    assert "\n".join(map(str, problems)).replace(str(tmp_path / "track.csv"), "F") == message


def test_csv_of_places_alone_has_no_aim_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(QuiltError, match=r"csv: .*track.csv holds positions only \(add look_at, a point"):
        viewer_at(track(tmp_path, "3,0,0,0\n"), 3)


def test_csv_tells_all_bad_rows_up_to_twenty(tmp_path: Path) -> None:
    rows = "1,0,0,0\n" + "".join(f"{f},x,,0\n" for f in range(2, 40))
    problems = check_viewer(track(tmp_path, rows), [1])
    assert len(problems) == 20
    assert [p.line for p in problems[:4]] == [2, 2, 3, 3]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_csv_of_any_spreadsheet(tmp_path: Path, separator: str) -> None:
    text = "# a path\n\nframe,x,y,z\n1,1.5,2,3\n".replace(",", separator)
    assert viewer_at(track(tmp_path, text, look=(0.0, 0.0, -1.0)), 1).eye.tolist() == [1.5, 2, 3]


def test_csv_with_decimal_commas(tmp_path: Path) -> None:
    text = "frame;x;y;z\n1;1,5;-2,25;3\n"
    assert viewer_at(track(tmp_path, text, look=(0.0, 0.0, -1.0)), 1).eye.tolist() == [1.5, -2.25, 3]


def test_csv_places_beyond_any_display(tmp_path: Path) -> None:
    found = check_viewer(track(tmp_path, "1,0,0,0,0,0,-1\n2,1e30,0,0,0,0,-1\n"), [1, 2])
    assert [problem.message for problem in found] == [
        "x: expected a number from -1000000000 to 1000000000, got 1e+30"
    ]
