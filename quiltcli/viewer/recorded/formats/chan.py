"""`.chan` files: Nuke's and Blender's with a frame number first, TouchDesigner's and Houdini's without.

Numbers are separated by blanks; `#` begins a comment. Neither kind says what lengths are measured in or
in which order three angles turn; the second does not even name its columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded import columns
from quiltcli.viewer.recorded.formats.own import read_named
from quiltcli.viewer.recorded.tables import Dialect, read_rows, take_lines
from quiltcli.viewer.recorded.take import Y_UP, Recording, wrong

_NAMES = ("frame", "tx", "ty", "tz", "rx", "ry", "rz")
_BLANKS = Dialect("")


def read_chan(spec: RecordedSpec) -> Recording:
    """Samples of a `.chan` file whose first column is the frame, as Nuke writes it; cameras look along −z.

    Raises:
        ViewerError: a line has neither seven nor eight numbers.
    """
    lines = take_lines(spec.file)
    width = _width(lines)
    if width not in (7, 8):
        words = f"expected 7 or 8 numbers a line (frame, place, angles, angle of view), got {width}"
        raise wrong(spec.file, f"{words}; one that has no frames is of format touchdesigner")
    rows = read_rows(spec.file, lines, list(enumerate(_NAMES)), _BLANKS, width=width, needed=1)
    rotations = None
    if spec.rotation_order is not None:
        rotations = columns.angles_to_rotations(np.radians(rows.values[:, 4:7]), spec.rotation_order)
    left = ("its angles were left out, as their order is not stated (rotation_order; Nuke's own is zxy)",)
    return Recording(
        subject="camera",
        positions=rows.values[:, 1:4],
        rotations=rotations,
        times=None,
        frames=rows.values[:, 0],
        lines=rows.lines,
        axes=Y_UP,
        is_camera=True,
        notices=left if rotations is None else (),
    )


def read_touchdesigner(spec: RecordedSpec) -> Recording:
    """Samples of a `.chan` file that holds nothing but values: a row a frame, its columns named by the job.

    Raises:
        ViewerError: the columns are not named, or a line has not as many.
    """
    if spec.columns is None:
        words = f"{spec.file} does not name its columns (state them, such as [tx, ty, tz, rx, ry, rz])"
        raise ViewerError(spec.source.problem("columns", words))
    plain = {f"r{axis}": f"r{axis}_deg" for axis in "xyz"}
    names = [columns.full_name(plain.get(name.lower(), name)) for name in spec.columns]
    found = read_named(spec, take_lines(spec.file), names, _BLANKS, 0)
    return Recording(
        subject="camera",
        positions=found.positions,
        rotations=found.rotations,
        times=found.times,
        frames=found.frames,
        lines=found.lines,
        axes=Y_UP,
        is_camera=True,
        notices=found.notices,
    )


def has_frames(lines: Sequence[str]) -> bool:
    """Whether the first numbers of the lines count frames, one by one, beside six or seven more."""
    first = [line.split() for line in lines if line.strip() and not line.lstrip().startswith("#")][:20]
    if not first or len(first[0]) not in (7, 8):
        return False
    try:
        numbers = [int(words[0]) for words in first]
    except ValueError:
        return False
    return all(b == a + 1 for a, b in pairwise(numbers))


def _width(lines: Sequence[str]) -> int:
    good = (line.split() for line in lines if line.strip() and not line.lstrip().startswith("#"))
    return len(next(good, []))
