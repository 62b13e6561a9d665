"""Columns by their names: what the numbers of a plain table mean, whoever named its columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from quiltcli.geometry import FloatArray, cross, normalized, quaternions

EYE = ("x", "y", "z")
LOOK_AT = ("look_at_x", "look_at_y", "look_at_z")
LOOK = ("look_x", "look_y", "look_z")
UP = ("up_x", "up_y", "up_z")
QUATERNION = ("qx", "qy", "qz", "qw")
HEADING = ("yaw_deg", "pitch_deg", "roll_deg")
HEADING_RAD = ("yaw_rad", "pitch_rad", "roll_rad")
ANGLES = ("rx_deg", "ry_deg", "rz_deg")
ANGLES_RAD = ("rx_rad", "ry_rad", "rz_rad")
GROUPS = (EYE, LOOK_AT, LOOK, UP, QUATERNION, HEADING, HEADING_RAD, ANGLES, ANGLES_RAD)
NAMES = ("frame", "time", *(name for group in GROUPS for name in group))
SHORT: Mapping[str, str] = {
    **dict(zip(("lx", "ly", "lz", "ux", "uy", "uz"), LOOK_AT + UP, strict=True)),
    **dict.fromkeys(("t", "timestamp", "seconds", "time_s", "time (seconds)", "time [s]"), "time"),
    **{
        f"{word}{axis}": axis for axis in EYE for word in ("t", "p", "pos_", "position_", "pos.", "position.")
    },
    **{f"q_{axis}": f"q{axis}" for axis in "xyzw"},
    **{f"rot_{axis}": f"q{axis}" for axis in "xyzw"},
}
_TURNS = (QUATERNION, HEADING, HEADING_RAD, ANGLES, ANGLES_RAD, LOOK_AT, LOOK)


def full_name(name: str) -> str:
    """The name a column is known by here."""
    name = name.strip().lower()
    return SHORT.get(name, name)


def missing_names(names: Sequence[str]) -> list[str]:
    """Columns that are missing beside others of their group, and of the place."""
    found = []
    for group in GROUPS:
        missing = [name for name in group if name not in names]
        if missing and (group is EYE or len(missing) < len(group)):
            found.append(missing[0])
    return found


def turn_groups(names: Sequence[str]) -> list[tuple[str, ...]]:
    """The groups of columns that say how the head is turned."""
    return [group for group in _TURNS if group[0] in names]


def rotations_of(
    names: Sequence[str], values: FloatArray, order: str | None, axes: FloatArray
) -> tuple[FloatArray | None, bool]:
    """Rotations (N, 4) from the columns of a table, and whether they are those of a camera.

    Yaw, pitch and roll are turns about the head's own axes up, right and back, one after the other, each
    anticlockwise as seen from where its axis points to.

    Args:
        names: of the columns.
        values: (N, C).
        order: in which angles about x, y and z turn; None for x, then y, then z.
        axes: (3, 3) rows that make x right, y up, z back of the file's axes.
    """
    column = {name: values[:, k] for k, name in enumerate(names)}

    def group(of: Sequence[str]) -> FloatArray:
        return np.stack([column[name] for name in of], axis=1)

    for turn in turn_groups(names):
        if turn == QUATERNION:
            return group(turn), False
        if turn in (HEADING, HEADING_RAD):
            angles = group(turn[::-1]) if turn == HEADING_RAD else np.radians(group(turn[::-1]))
            return _in_file(quaternions.from_euler(angles, "zxy"), axes), False
        if turn in (ANGLES, ANGLES_RAD):
            angles = group(turn) if turn == ANGLES_RAD else np.radians(group(turn))
            return angles_to_rotations(angles, order or "xyz"), False
        look = group(LOOK) if turn == LOOK else group(LOOK_AT) - group(EYE)
        up = group(UP) if UP[0] in names else np.broadcast_to(axes[1], look.shape)
        right = normalized(cross(look, up))
        back = -normalized(look)
        return quaternions.from_matrices(np.stack((right, cross(back, right), back), axis=-1)), True
    return None, False


def angles_to_rotations(angles: FloatArray, order: str) -> FloatArray:
    """Rotations (N, 4) of angles (N, 3) about x, y and z in radians, in the order that is stated."""
    if order == "vector":
        return quaternions.exponential(angles)
    return quaternions.from_euler(angles[:, ["xyz".index(name) for name in order]], order)


def _in_file(q: FloatArray, axes: FloatArray) -> FloatArray:
    """Rotations given with y up, in the file's axes: what `settle` will undo."""
    hand = float(np.sign(np.linalg.det(axes)))
    return np.concatenate((hand * (q[:, :3] @ axes), q[:, 3:]), axis=1)
