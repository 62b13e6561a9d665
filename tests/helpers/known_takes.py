"""Takes with known poses, asymmetric in all axes, and files that hold them, written from their descriptions.

Poses are in metres, right-handed with Y up, and a head that is not turned looks along −Z. Rotations are
SciPy's, which share no code with the program's own.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

COUNT, RATE = 9, 100.0
TIMES = np.arange(COUNT) / RATE
PLACES = np.stack((0.3 + 0.010 * TIMES * 50, 1.7 - 0.013 * TIMES * 50, -2.1 + 0.007 * TIMES * 50), axis=1)
TURNS = Rotation.from_euler(
    "YXZ", np.stack((30 + 9 * TIMES, -20 + 70 * TIMES, 10 - 50 * TIMES), axis=1), True
)
# World of a file with Z up: x right, y ahead, z up.
Z_UP = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def z_up() -> tuple[np.ndarray, Rotation]:
    """Places, and rotations of a body whose own axes are like the file's, where Z is up."""
    return Z_UP.apply(PLACES), Z_UP * TURNS * Z_UP.inv()


def number(value: float) -> str:
    return f"{value:.9f}"


def rows(*columns: np.ndarray, separator: str = ",") -> str:
    table = np.column_stack(columns)
    return "".join(separator.join(number(value) for value in row) + "\n" for row in table)


def csv_quaternions() -> str:
    places, turns = z_up()
    return "time,x,y,z,qx,qy,qz,qw\n" + rows(TIMES, 1000 * places, turns.as_quat())


def csv_heading() -> str:
    yaw_pitch_roll = TURNS.as_euler("YXZ", degrees=True)
    text = "frame;x;y;z;yaw_deg;pitch_deg;roll_deg\n" + rows(
        np.arange(COUNT) + 1, PLACES, yaw_pitch_roll, separator=";"
    )
    return text.replace(".", ",")


def csv_angles() -> str:
    return "t x y z rx_deg ry_deg rz_deg\n" + rows(
        TIMES, PLACES, TURNS.as_euler("xyz", degrees=True), separator=" "
    )


def csv_looks() -> str:
    look, up = TURNS.apply([0, 0, -1]), TURNS.apply([0, 1, 0])
    return "time,x,y,z,look_x,look_y,look_z,up_x,up_y,up_z\n" + rows(TIMES, PLACES, look, up)


def bare_csv() -> str:
    return rows(TIMES, PLACES, TURNS.as_quat())


def tum() -> str:
    return "# timestamp tx ty tz qx qy qz qw\n" + rows(
        1305031102 + TIMES, PLACES, TURNS.as_quat(), separator=" "
    )


def motive(units: str = "Length Units,Millimeters,", timecode: bool = False) -> str:
    extra = ["", "", "", "", "TimeCode"] if timecode else [""] * 5
    head = ["", "", "", "", "Frame"]
    second = ["Type", "Name", "ID", "", "Time (Seconds)"]
    columns: list[list[str]] = []
    for kind, name in (
        ("Rigid Body", "Wand"),
        ("Rigid Body", "Head"),
        ("Rigid Body Marker", "Head:Marker 1"),
        ("Marker", "Head"),
    ):
        if kind == "Rigid Body":
            columns += [[kind, name, "1", "Rotation", axis] for axis in "XYZW"]
        columns += [[kind, name, "1", "Position", axis] for axis in "XYZ"]
        if kind == "Rigid Body":
            columns.append([kind, name, "1", "Mean Marker Error", ""])
    titles = [head, second, *([extra] if timecode else []), *columns]
    text = "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.0,Export Frame Rate,100.0,"
    text += f"Rotation Type,Quaternion,{units}Coordinate Space,Global\n\n"
    text += "".join(",".join(title[k] for title in titles) + "\n" for k in range(5))
    wand = [9.0] * 8
    for k in range(COUNT):
        head_cells = [*TURNS[k].as_quat(), *(1000 * PLACES[k]), 0.2]
        markers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        cells = [number(value) for value in (*wand, *head_cells, *markers)]
        stamp = ["01:02:03:04"] if timecode else []
        text += ",".join([str(k), f"{TIMES[k]:.6f}", *stamp, *cells]) + "\n"
    return text


def vicon() -> str:
    places, turns = z_up()
    vectors = np.degrees(turns.as_rotvec())
    text = "Trajectories\n100\n,,Visitor:LFHD,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n\n"
    text += "Segments\n100\n,,Visitor:Head,,,,,,Visitor:Chest,,,,,\n"
    text += "Frame,Sub Frame" + ",RX,RY,RZ,TX,TY,TZ" * 2 + "\n,," + ",".join(["deg"] * 3 + ["mm"] * 3) * 1
    text += "," + ",".join(["deg"] * 3 + ["mm"] * 3) + "\n"
    for k in range(COUNT):
        cells = [number(value) for value in (*vectors[k], *(1000 * places[k]), *[7.0] * 6)]
        text += ",".join([str(k + 1), "0", *cells]) + "\n"
    return text


def trc() -> str:
    text = "PathFileType\t4\t(X/Y/Z)\ttake.trc\n"
    text += "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\n"
    text += f"100\t100\t{COUNT}\t2\tmm\t100\n"
    text += "Frame#\tTime\tchest\t\t\thead\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
    for k in range(COUNT):
        cells = [number(value) for value in (1, 2, 3, *(1000 * PLACES[k]))]
        text += "\t".join([str(k + 1), number(TIMES[k]), *cells]) + "\n"
    return text


def opentrack() -> str:
    stages = ("raw", "corrected", "filtered", "mapped")
    names = ["dt", *(f"{s}{n}" for s in stages for n in ("TX", "TY", "TZ", "Yaw", "Pitch", "Roll"))]
    angles = TURNS.as_euler("YXZ", degrees=True)
    steps = np.full(COUNT, 1 / RATE)
    filtered = np.column_stack((100 * PLACES, angles))
    other = np.full((COUNT, 6), 5.0)
    return ",".join(names) + "\n" + rows(steps, other, other, filtered, other)


def freed(order: str = "bare") -> bytes:
    places, _ = z_up()
    yaw, pitch, roll = TURNS.as_euler("YXZ", degrees=True).T
    data = b""
    if order == "pcap":
        data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)
    for k in range(COUNT):
        values = [-yaw[k] * 32768, pitch[k] * 32768, -roll[k] * 32768, *(places[k] * 1000 * 64)]
        packet = bytes([0xD1, 7]) + b"".join(round(v).to_bytes(3, "big", signed=True) for v in values)
        packet += bytes(8)
        packet += bytes([(0x40 - sum(packet)) & 0xFF])
        assert len(packet) == 29
        if order == "pcap":
            frame = bytes(34) + struct.pack(">HHHH", 40000, 40000, 37, 0) + packet
            micro = round(TIMES[k] * 1e6)
            data += struct.pack("<IIII", 100, micro, len(frame), len(frame)) + frame
        else:
            data += packet
    return data


def chan(with_frames: bool = True) -> str:
    angles = TURNS.as_euler("zxy", degrees=True)[:, [1, 2, 0]]
    columns = (PLACES * 100, angles, np.full(COUNT, 40.0))
    if with_frames:
        lines = rows(*columns, separator="\t").splitlines()
        return "# camera\n" + "".join(f"{k + 1}\t{line}\n" for k, line in enumerate(lines))
    return rows(*columns[:2], separator=" ")


def arkit_matrices() -> str:
    frames = []
    for k in range(COUNT):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = TURNS[k].as_matrix(), PLACES[k]
        frames.append({"timestamp": float(TIMES[k]), "transform": pose.T.ravel().tolist()})
    return json.dumps({"frames": frames})


def bren() -> str:
    poses = np.tile(np.eye(4), (COUNT, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = TURNS.as_matrix(), PLACES
    frames = {"timestamps": TIMES.tolist(), "transforms": poses.tolist(), "datas": []}
    return json.dumps({"render_data": {"fps": 60}, "camera_frames": frames})


def record3d() -> str:
    return json.dumps({"fps": RATE, "poses": np.column_stack((TURNS.as_quat(), PLACES)).tolist()})


def hfcs() -> str:
    # R = Rx·Ry·Rz of the angles with their signs reversed; 72 pixels to the inch.
    angles = -TURNS.as_euler("XYZ", degrees=True)
    pixels = PLACES * 1000 * 2.8352

    def keys(tag: str, values: np.ndarray) -> str:
        return "".join(
            f'<Key Type="1" Time="{k * 10}"><Value><{tag} X="{x:.9f}" Y="{y:.9f}" Z="{z:.9f}"/></Value></Key>'
            for k, (x, y, z) in enumerate(values.tolist())
        )

    return (
        '<?xml version="1.0"?><BiffCompositeShot Version="1"><CompositionAsset Version="1">'
        "<AudioVideoSettings><Width>1920</Width><Height>1080</Height><FrameRate>100</FrameRate>"
        "</AudioVideoSettings><Layers><CameraLayer><LayerBase><Name>Cam</Name><PropertyManager>"
        f"<position><Animation>{keys('FXPoint3_32f', pixels)}</Animation></position>"
        f"<orientation><Animation>{keys('Orientation3D', angles)}</Animation></orientation>"
        "</PropertyManager></LayerBase></CameraLayer></Layers></CompositionAsset></BiffCompositeShot>"
    )


def write_take(folder: Path, name: str, content: str | bytes) -> Path:
    """Write a take's file."""
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# Name of the file, what it holds, and what a job has to state of it; then what is not in it.
KNOWN: dict[str, tuple[str, Callable[[], str | bytes], dict[str, object]]] = {
    "csv, quaternions, mm, Z up": ("take.csv", csv_quaternions, {"units": "mm", "up_axis": "z"}),
    "csv, yaw pitch roll, decimal commas": (
        "take.csv", csv_heading, {"units": "m", "up_axis": "y", "rate": RATE}
    ),
    "csv, angles about fixed axes, blanks": ("take.txt", csv_angles, {"units": "m", "up_axis": "y"}),
    "csv, look and up": ("take.csv", csv_looks, {"units": "m", "up_axis": "y"}),
    "csv without names": (
        "take.csv", bare_csv,
        {"units": "m", "axes": ("x", "y", "z"), "columns": ("time", "x", "y", "z", "qx", "qy", "qz", "qw")},
    ),
    "tum": ("take.txt", tum, {"up_axis": "y"}),
    "motive": ("take.csv", motive, {"subject": "Head"}),
    "motive with time codes": ("take.csv", lambda: motive(timecode=True), {"subject": "Head"}),
    "motive, semicolons": (
        "take.csv", lambda: motive().replace(",", ";").replace(".", ","), {"subject": "Head"}
    ),
    "vicon": ("take.csv", vicon, {"subject": "Head", "rotation_order": "vector"}),
    "trc": ("take.trc", trc, {"subject": "head", "up_axis": "y"}),
    "opentrack": (
        "take.csv", opentrack, {"subject": "filtered", "units": "cm", "up_axis": "y", "rotation_order": "zxy"}
    ),
    "freed": ("take.freed", freed, {"rate": RATE}),
    "freed in a capture": ("take.pcap", lambda: freed("pcap"), {}),
    "chan of Nuke": ("take.chan", chan, {"units": "cm", "rate": RATE, "rotation_order": "zxy"}),
    "chan of TouchDesigner": (
        "take.chan", lambda: chan(with_frames=False),
        {
            "units": "cm", "rate": RATE, "rotation_order": "zxy",
            "columns": ("tx", "ty", "tz", "rx", "ry", "rz"),
        },
    ),
    "arkit matrices": ("take.json", arkit_matrices, {}),
    "tracky": ("take.bren", bren, {}),
    "record3d": ("take.json", record3d, {}),
    "hfcs": ("take.hfcs", hfcs, {}),
}  # fmt: skip
PLACES_ALONE = ("trc",)
