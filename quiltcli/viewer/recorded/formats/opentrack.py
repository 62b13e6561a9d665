"""CSV files of opentrack: `dt`, then raw, corrected, filtered and mapped TX, TY, TZ, Yaw, Pitch, Roll.

Lengths and signs are those of the tracker behind it, so they must be stated; angles are read where the
axes they turn about are.
"""

from __future__ import annotations

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.columns import angles_to_rotations
from quiltcli.viewer.recorded.tables import dialect_of, read_rows, take_lines
from quiltcli.viewer.recorded.take import Recording, wrong

_STAGES = ("raw", "corrected", "filtered", "mapped")
_PLACE, _TURN = ("TX", "TY", "TZ"), ("Pitch", "Yaw", "Roll")  # about x, y and z


def read_opentrack(spec: RecordedSpec) -> Recording:
    """Samples of an opentrack log; `subject` is the stage of its processing, raw where none is named.

    Raises:
        ViewerError: columns are missing.
    """
    stage = spec.subject or "raw"
    if stage not in _STAGES:
        words = f"expected raw, corrected, filtered or mapped for opentrack, got {stage!r}"
        raise ViewerError(spec.source.problem("subject", words))
    lines = take_lines(spec.file)
    dialect = dialect_of(lines)
    names = [name.lower() for name in dialect.cells(lines[0])] if lines else []
    columns = ["dt", *(f"{stage}{name}" for name in _PLACE + _TURN)]
    missing = [name for name in columns if name.lower() not in names]
    if missing:
        raise wrong(spec.file, f"there is no column {missing[0]!r} (expected a CSV file of opentrack)", 1, 1)
    wanted = [(names.index(name.lower()), name) for name in columns]
    rows = read_rows(spec.file, lines[1:], wanted, dialect, first=2, width=len(names), needed=1)
    if not len(rows.values):
        raise wrong(spec.file, "holds no samples")
    notices = []
    rotations = None
    if spec.rotation_order is not None:
        rotations = angles_to_rotations(np.radians(rows.values[:, 4:7]), spec.rotation_order)
    else:
        notices.append("its angles were left out, as their meaning is not stated (rotation_order)")
    if spec.rate is None:
        notices.append("its steps dt leave out the time between cycles: state rate where that is known")
    return Recording(
        subject=stage,
        positions=rows.values[:, 1:4],
        rotations=rotations,
        times=np.cumsum(rows.values[:, 0]) - rows.values[0, 0] if spec.rate is None else None,
        lines=rows.lines,
        notices=tuple(notices),
    )
