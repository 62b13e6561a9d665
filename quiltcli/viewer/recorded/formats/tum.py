"""TUM text, as SLAM programs write it: `timestamp tx ty tz qx qy qz qw` a line, metres, `#` comments.

Which way is up, and whether the pose is a camera's, differs from one program to the next.
"""

from __future__ import annotations

from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.tables import Dialect, read_rows, take_lines
from quiltcli.viewer.recorded.take import Recording, wrong

_NAMES = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")


def read_tum(spec: RecordedSpec) -> Recording:
    """Samples of a TUM trajectory.

    Raises:
        ViewerError: a line has not eight numbers.
    """
    rows = read_rows(
        spec.file, take_lines(spec.file), list(enumerate(_NAMES)), Dialect(""), width=len(_NAMES), needed=1
    )
    if not len(rows.values):
        raise wrong(spec.file, "holds no samples")
    return Recording(
        subject="head",
        positions=rows.values[:, 1:4],
        rotations=rows.values[:, 4:8],
        times=rows.values[:, 0],
        lines=rows.lines,
        metres=1.0,
    )
