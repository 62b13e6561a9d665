from __future__ import annotations

import contextlib
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quiltcli.errors import QuiltError
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.head import pose_of, read_head
from quiltcli.viewer.recorded.take import Take
from tests.helpers import known_takes as known
from tests.helpers.gltf_files import GltfFile
from tests.helpers.known_takes import COUNT, KNOWN, PLACES, PLACES_ALONE, RATE, TIMES, TURNS, write_take


def take_of(path: Path, **stated: Any) -> Take:
    return read_head(RecordedSpec(file=path, **stated)).take


def message(path: Path, **stated: Any) -> str:
    with pytest.raises(QuiltError) as caught:
        take_of(path, **stated)
    return str(caught.value).replace(str(path), "F")


# FreeD's own steps: 1/64 mm and 1/32768 degree; stamps of a capture are whole microseconds.
STEPS = {"freed": (8e-6, 5e-7), "freed in a capture": (8e-6, 5e-7)}


@pytest.mark.parametrize("name", KNOWN)
def test_a_known_take_comes_back(name: str, tmp_path: Path) -> None:
    file, content, stated = KNOWN[name]
    take = take_of(write_take(tmp_path, file, content()), **stated)
    near, turned = STEPS.get(name, (1e-6, 1e-6))
    assert take.times - take.times[0] == pytest.approx(TIMES, abs=1e-6)
    assert np.abs(take.positions - PLACES).max() < near
    assert not take.lost.any()
    if name in PLACES_ALONE:
        assert take.rotations is None
        return
    assert take.rotations is not None
    assert (Rotation.from_quat(take.rotations) * TURNS.inv()).magnitude().max() < turned


def test_a_camera_in_a_file_with_z_up_keeps_its_own_axes(tmp_path: Path) -> None:
    # A camera that Blender exports without a change of axes: only the world is turned.
    turns = known.Z_UP * TURNS
    places = known.Z_UP.apply(PLACES)
    angles = turns.as_euler("xyz", degrees=True)
    lines = known.rows(places, angles, separator=" ").splitlines()
    path = write_take(tmp_path, "take.chan", "".join(f"{k} {line}\n" for k, line in enumerate(lines, 1)))
    take = take_of(path, units="m", rate=RATE, rotation_order="xyz", up_axis="z")
    assert np.abs(take.positions - PLACES).max() < 1e-6
    assert (Rotation.from_quat(take.rotations) * TURNS.inv()).magnitude().max() < 1e-6


def test_left_handed_axes_mirror_turns_along(tmp_path: Path) -> None:
    # x right, y up, z ahead: a turn's matrix has the third row and column negated.
    mirror = np.diag([1.0, 1.0, -1.0])
    turns = Rotation.from_matrix(mirror @ TURNS.as_matrix() @ mirror)
    text = "time,x,y,z,qx,qy,qz,qw\n" + known.rows(TIMES, PLACES @ mirror, turns.as_quat())
    take = take_of(write_take(tmp_path, "take.csv", text), units="m", axes=("x", "y", "-z"))
    assert np.abs(take.positions - PLACES).max() < 1e-6
    assert (Rotation.from_quat(take.rotations) * TURNS.inv()).magnitude().max() < 1e-6


@pytest.mark.parametrize("name", ["csv, quaternions, mm, Z up", "motive", "vicon"])
def test_a_blank_sample_is_lost_and_no_zero(name: str, tmp_path: Path) -> None:
    file, content, stated = KNOWN[name]
    text = content()
    assert isinstance(text, str)
    lines = text.splitlines()
    cells = lines[-3].split(",")
    kept = 1 if name.startswith("csv") else 2
    lines[-3] = ",".join([*cells[:kept], *[""] * (len(cells) - kept)])
    take = take_of(write_take(tmp_path, file, "\n".join(lines)), **stated)
    assert np.flatnonzero(take.lost).tolist() == [COUNT - 3]
    assert np.isnan(take.positions[COUNT - 3]).all()


def test_a_rotation_of_zeros_is_a_lost_sample(tmp_path: Path) -> None:
    text = "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,0\n1,1,1,1,0,0,0,1\n"
    assert take_of(write_take(tmp_path, "t.csv", text), units="m", up_axis="y").lost.tolist() == [True, False]


def test_broken_freed_packets_are_left_out_and_counted(tmp_path: Path) -> None:
    data = bytearray(known.freed())
    data[40] ^= 0xFF
    take = take_of(write_take(tmp_path, "take.freed", bytes(data)), rate=RATE)
    assert len(take.times) == COUNT - 1
    assert take.notices == ("1 packets with a wrong sum left out",)


@pytest.mark.parametrize(
    ("name", "without", "words"),
    [
        ("csv, quaternions, mm, Z up", "units",
         "units: F does not say what it is measured in (state units: m, cm, mm, in, ft or metres)"),
        ("csv, quaternions, mm, Z up", "up_axis",
         "up_axis: F does not say which way is up (state up_axis: y or z, or axes)"),
        ("csv, yaw pitch roll, decimal commas", "rate",
         "rate: F has no times (state rate, its samples a second)"),
        ("csv without names", "columns",
         "columns: F has no line of names (state columns, such as [time, x, y, z, qx, qy, qz, qw])"),
        ("tum", "up_axis", "up_axis: F does not say which way is up (state up_axis: y or z, or axes)"),
        ("trc", "up_axis", "up_axis: F does not say which way is up (state up_axis: y or z, or axes)"),
        ("trc", "subject", "subject: F holds 2 markers: 'chest', 'head' (state which)"),
        ("motive", "subject", "subject: F holds 2 rigid bodies: 'Wand', 'Head' (state which)"),
        ("vicon", "subject",
         "subject: F holds 3 subjects: 'Visitor:LFHD', 'Visitor:Head', 'Visitor:Chest' (state which)"),
        ("opentrack", "units",
         "units: F does not say what it is measured in (state units: m, cm, mm, in, ft or metres)"),
        ("freed", "rate", "rate: F has no times (state rate, its samples a second)"),
        ("chan of Nuke", "units",
         "units: F does not say what it is measured in (state units: m, cm, mm, in, ft or metres)"),
        ("chan of TouchDesigner", "columns",
         "format: the format of F is not plain from its name and first lines (state format)"),
    ],
)  # fmt: skip
def test_what_is_not_settled_must_be_stated(name: str, without: str, words: str, tmp_path: Path) -> None:
    file, content, stated = KNOWN[name]
    path = write_take(tmp_path, file, content())
    assert message(path, **{key: value for key, value in stated.items() if key != without}) == words


def test_everything_that_is_missing_is_said_at_once(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take.csv", "frame,x,y,z\n1,0,0,0\n2,0,0,0\n")
    assert [line.split(":")[0] for line in message(path).splitlines()] == ["units", "up_axis", "rate"]


def test_motive_without_units_is_refused_and_with_others_too(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take.csv", known.motive(units=""))
    assert message(path, subject="Head").startswith("units: F does not say what it is measured in")
    assert np.abs(take_of(path, subject="Head", units="mm").positions - PLACES).max() < 1e-6
    path = write_take(tmp_path, "units.csv", known.motive())
    words = "units: F says itself that its unit is 0.001 m (leave units out)"
    assert message(path, subject="Head", units="m") == words


def test_a_wrong_subject_is_told_with_those_there_are(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take.csv", known.motive())
    assert message(path, subject="Haed").endswith("named 'Haed' (did you mean 'Head'?)")
    path = write_take(tmp_path, "take.trc", known.trc())
    words = "subject: F has no markers named 'nose' (it holds 'chest', 'head')"
    assert message(path, subject="nose", up_axis="y") == words


def test_angles_without_a_stated_order_are_left_out(tmp_path: Path) -> None:
    take = take_of(write_take(tmp_path, "take.chan", known.chan()), units="cm", rate=RATE)
    assert take.rotations is None
    assert "rotation_order" in take.notices[0]
    take = take_of(write_take(tmp_path, "take.csv", known.vicon()), subject="Head")
    assert take.rotations is None
    assert np.abs(take.positions - PLACES).max() < 1e-6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,x,y,z\n0,1,2,abc\n", "F:2:7: z: expected a number, got 'abc'"),
        ("time,x,y,z\n,1,2,3\n", "F:2:1: time is blank"),
        ("time,x,y,z\n0,1,2\n", "F:2:1: expected 4 columns, got 3"),
        ("time,x,y,z\n0,1,2,inf\n", "F:2:7: z: expected a finite number, got inf"),
        ("time,x,y\n0,1,2\n", "F:1:1: there is no column 'z'"),
        ("time,x,y,z,yaw,pitch,roll\n0,1,2,3,0,0,0\n",
         "F:1:1: column 'yaw' has no unit (name it yaw_deg or yaw_rad)\n"
         "F:1:1: column 'pitch' has no unit (name it pitch_deg or pitch_rad)\n"
         "F:1:1: column 'roll' has no unit (name it roll_deg or roll_rad)"),
        ("time,x,y,z\n", "F: holds no samples"),
        ("time,x,y,z\n0,,,\n1,,,\n", "F: every sample of head is lost"),
        ("time,x,y,z\n1,0,0,0\n0.5,0,0,0\n", "F:3: its time goes back from 1.000000 to 0.500000 s"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_file_is_told_where(text: str, words: str, tmp_path: Path) -> None:
    assert message(write_take(tmp_path, "take.csv", text), units="m", up_axis="y") == words


def test_other_columns_are_left_out_with_a_word(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take.csv", "time,x,y,z,confidence\n0,1,2,3,0.5\n")
    assert take_of(path, units="m", up_axis="y").notices == ("columns left out: confidence",)


_BITS = (
    b",",
    b"\n",
    b";",
    b"nan",
    b"1e400",
    b"-",
    b'"',
    b"\0",
    b"\xff",
    b"\n\n",
    b"99999999999999",
    b"[",
    b"null",
)


@pytest.mark.parametrize("name", KNOWN)
def test_a_damaged_take_is_read_or_refused(name: str, tmp_path: Path) -> None:
    file, content, stated = KNOWN[name]
    whole = content()
    dice = random.Random(name)
    for k in range(25):
        data = bytearray(whole if isinstance(whole, bytes) else whole.encode())
        for _ in range(dice.choice((1, 1, 3, 10))):
            at = dice.randrange(len(data) + 1)
            kind = dice.randrange(4)
            if kind == 0:
                data[at : at + 1] = bytes([dice.randrange(256)])
            elif kind == 1:
                del data[at : at + dice.randrange(1, 60)]
            elif kind == 2:
                data[at:at] = dice.choice(_BITS)
            else:
                del data[at:]
        (tmp_path / str(k)).mkdir()
        with contextlib.suppress(QuiltError):
            take_of(write_take(tmp_path / str(k), file, bytes(data)), **stated)


def test_xml_with_entities_is_refused(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take.hfcs", '<!DOCTYPE x [<!ENTITY a "b">]><x>&a;</x>')
    assert message(path) == "F: defines entities (expected the plain XML that CamTrackAR writes)"


def test_usd_cameras_come_with_their_parents_units_and_axes(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    from pxr import Gf, UsdGeom

    path = tmp_path / "take.usda"
    stage = usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.SetTimeCodesPerSecond(RATE)
    rig = UsdGeom.Xform.Define(stage, "/rig")
    rig.AddTranslateOp().Set(Gf.Vec3d(7, -5, 3))
    op = UsdGeom.Camera.Define(stage, "/rig/head").AddTransformOp()
    turns, places = known.Z_UP * TURNS, 100 * known.Z_UP.apply(PLACES) - (7, -5, 3)
    for k in range(COUNT):
        pose = np.eye(4)
        pose[:3, :3], pose[3, :3] = turns[k].as_matrix().T, places[k]
        op.Set(Gf.Matrix4d(pose.tolist()), k)
    stage.GetRootLayer().Save()
    hold_curve(path)


def hold_curve(path: Path, **stated: Any) -> None:
    """The curve of a file goes through the known poses at their times."""
    spec = RecordedSpec(file=path, **stated)
    head = read_head(spec)
    poses = [pose_of(head, spec, float(time), RATE) for time in TIMES]
    assert np.abs(np.stack([place for place, _ in poses]) - PLACES).max() < 1e-6
    found = Rotation.from_quat(np.stack([turn for _, turn in poses if turn is not None]))
    assert (found * TURNS.inv()).magnitude().max() < 1e-6


def test_a_gltf_camera_comes_with_the_nodes_above_it(tmp_path: Path) -> None:
    # A rig that is moved, turned and scaled, the camera's own animation below it.
    rig, scale = Rotation.from_euler("xyz", [20, -30, 40], degrees=True), 0.5
    file = GltfFile()
    places = rig.inv().apply(PLACES - (1, -2, 0.5)) / scale
    turns = rig.inv() * TURNS
    camera = file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1})
    head = file.node(name="head", camera=camera)
    other = file.node(name="rig", children=[head], translation=[1, -2, 0.5], rotation=rig.as_quat().tolist(),
                      scale=[scale] * 3)  # fmt: skip
    file.add("scenes", nodes=[other])
    file.animation(head, "translation", TIMES, places)
    file.animation(head, "rotation", TIMES, turns.as_quat())
    path = file.write(tmp_path / "take.glb")
    hold_curve(path)
    hold_curve(path, subject="head")
    assert "did you mean 'head'?" in message(path, subject="haed")


def test_a_gltf_node_whose_parent_turns_goes_round(tmp_path: Path) -> None:
    file = GltfFile()
    arm = file.node(name="head", translation=[0, 0, 2])
    hub = file.node(name="hub", children=[arm])
    file.add("scenes", nodes=[hub])
    turn = [[0, 0, 0, 1], [0, np.sqrt(0.5), 0, np.sqrt(0.5)]]
    file.animation(hub, "rotation", [0.0, 1.0], turn)
    spec = RecordedSpec(file=file.write(tmp_path / "take.glb"), subject="head")
    place, rotation = pose_of(read_head(spec), spec, 0.371, RATE)
    angle = np.radians(90 * 0.371)
    assert place == pytest.approx([2 * np.sin(angle), 0, 2 * np.cos(angle)], abs=3e-6)
    assert rotation == pytest.approx([0, np.sin(angle / 2), 0, np.cos(angle / 2)], abs=1e-6)
    # Before and after its keys a curve rests.
    assert pose_of(read_head(spec), spec, 9.0, RATE)[0] == pytest.approx([2, 0, 0], abs=1e-6)


def test_rows_are_read_in_time_that_grows_with_them(tmp_path: Path) -> None:
    import time

    spent = []
    for count in (20_000, 80_000):
        line = "0.01,1,2,3\n"
        path = write_take(tmp_path, f"{count}.csv", "time,x,y,z\n" + line * count)
        start = time.process_time()
        take_of(path, units="m", up_axis="y")
        spent.append(time.process_time() - start)
    assert spent[1] < 10 * spent[0]
