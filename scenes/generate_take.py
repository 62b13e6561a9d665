"""Write the take of the CAVE's demonstration anew: what a motion-capture system might see of one visitor.

    python scenes/generate_take.py

Somebody with glasses that carry markers walks about a CAVE of 3 m and looks around. The tracker stands at
the CAVE's right wall and was calibrated there: its x axis goes to the CAVE's back, its origin is the middle
of the floor. It trembles by 0.8 mm and 0.2°, loses the glasses for 0.075 s, and once takes another thing
for them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

HERE = Path(__file__).parent
RATE, SECONDS = 120, 5
EYE_FROM_MARKER = np.array([0.0, -0.03, 0.04])
WORLD_FROM_TRACKER = Rotation.from_euler("y", -90, degrees=True)


def eyes() -> tuple[np.ndarray, np.ndarray, Rotation]:
    """Seconds, the place between the eyes and how the head is turned, in the world."""
    t = np.arange(RATE * SECONDS) / RATE
    way = 2 * np.pi * t / SECONDS
    places = np.stack(
        (0.45 * np.sin(way), 1.66 + 0.015 * np.sin(2 * np.pi * 1.1 * t), 0.35 + 0.3 * np.cos(way)), axis=1
    )
    angles = np.stack((30 * np.sin(way + 2), -6 + 7 * np.sin(2 * way), 4 * np.sin(way)), axis=1)
    return t, places, Rotation.from_euler("YXZ", angles, degrees=True)


def samples() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seconds, places (N, 3) and quaternions (N, 4) of the markers as tracked, lost ones not numbers."""
    t, places, turns = eyes()
    dice = np.random.default_rng(12)
    turns = turns * Rotation.from_rotvec(np.radians(0.2) * dice.standard_normal(places.shape))
    places = places - turns.apply(EYE_FROM_MARKER) + 0.0008 * dice.standard_normal(places.shape)
    back = WORLD_FROM_TRACKER.inv()
    places, q = back.apply(places), (back * turns).as_quat()
    places[301] += [0.4, -0.3, 0.2]
    places[180:189], q[180:189] = np.nan, np.nan
    return t, places, q


def motive_text() -> str:
    """The take as a CSV file of Motive."""
    facts = (
        "Format Version,1.23,Take Name,visitor,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,"
        f"Rotation Type,Quaternion,Total Exported Frames,{RATE * SECONDS},Length Units,Meters,"
        "Coordinate Space,Global"
    )
    rows = [
        ["", "Type", *["Rigid Body"] * 8],
        ["", "Name", *["Glasses"] * 8],
        ["", "ID", *["1"] * 8],
        ["", "", *["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error"],
        ["Frame", "Time (Seconds)", *"XYZW", *"XYZ", ""],
    ]
    for k, (time, place, q) in enumerate(zip(*samples(), strict=True)):
        cells = [""] * 8 if np.isnan(place[0]) else [*(f"{v:.5f}" for v in (*q, *place)), "0.0002"]
        rows.append([str(k), f"{time:.6f}", *cells])
    return "\n".join([facts, "", *(",".join(row) for row in rows)]) + "\n"


if __name__ == "__main__":
    (HERE / "visitor.csv").write_text(motive_text(), encoding="utf-8")
