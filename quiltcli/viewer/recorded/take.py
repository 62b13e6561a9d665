"""What a file of a tracker holds, before and after its units and axes are known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import Problem, ViewerError
from quiltcli.geometry import BoolArray, FloatArray, IntArray, quaternions
from quiltcli.job import RecordedSpec

Y_UP = np.eye(3)
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


_ANYWHERE = 1e12


@dataclass(frozen=True)
class Recording:
    """N samples as the file has them.

    Attributes:
        subject: whose they are.
        positions: (N, 3) in the file's units and axes, not numbers where lost.
        rotations: (N, 4) x, y, z, w in the file's axes, or None.
        times: (N,) seconds, or None where the file has none.
        frames: (N,) frame numbers, frame 1 being second 0, for files that have them instead of times.
        lines: (N,) 1-based lines of the samples, or None where lines mean nothing.
        metres: length of a unit, where the file or its format settles it.
        settled: whether the file itself states its units, so that others are a contradiction.
        axes: (3, 3) rows that make x right, y up, z back of the file's axes, where the format settles them.
        is_camera: whether the rotations' own axes are a camera's, y up and looking along −z, whatever
            the axes of the file; otherwise they are like those of the file.
        rate: samples a second as the file states it.
        is_curve: whether the samples are the knots of a curve that somebody made, straight between them,
            and not what an instrument saw: it has neither gaps nor jumps, and its ends are held.
        notices: what of the file was left out, or should be known.
    """

    subject: str
    positions: FloatArray
    rotations: FloatArray | None
    times: FloatArray | None
    frames: FloatArray | None = None
    lines: IntArray | None = None
    metres: float | None = None
    settled: bool = False
    axes: FloatArray | None = None
    is_camera: bool = False
    rate: float | None = None
    is_curve: bool = False
    notices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Take:
    """N samples in metres, right-handed, Y up.

    Attributes:
        times: (N,) seconds.
        positions: (N, 3) metres, not numbers where lost.
        rotations: (N, 4) x, y, z, w from local, which looks along −Z with Y up, to the take's space; or None.
        lost: (N,) samples that were not seen.
        subject: whose samples they are.
        path: the file.
        lines: (N,) 1-based lines of the samples, or None.
        is_curve: as for a recording.
        notices: what should be known of it.
    """

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray | None
    lost: BoolArray
    subject: str
    path: Path
    lines: IntArray | None = field(default=None, repr=False)
    is_curve: bool = False
    notices: tuple[str, ...] = ()

    def problem(self, row: int, words: str) -> Problem:
        """A problem at a sample."""
        return Problem(words, str(self.path), 0 if self.lines is None else int(self.lines[row]))


def settle(recording: Recording, spec: RecordedSpec) -> Take:
    """A take in metres with Y up, from what the file settles and what is stated.

    Raises:
        ViewerError: units, axes or times are settled by neither, or units by both and otherwise.
    """
    axes = spec.axis_map if spec.axis_map is not None else recording.axes
    metres = recording.metres if recording.settled or spec.metres is None else spec.metres
    problems = list(_unsettled(recording, spec, axes, metres))
    times = recording.times
    rate = spec.rate or recording.rate
    if times is None and rate is None:
        words = f"{spec.file} has no times (state rate, its samples a second)"
        problems.append(spec.source.problem("rate", words))
    if problems or axes is None or metres is None:
        raise ViewerError(problems)
    if times is None:
        assert rate is not None
        count = recording.frames
        times = np.arange(len(recording.positions)) / rate if count is None else (count - 1) / rate
    positions = _sane(recording.positions) @ axes.T * metres
    rotations = _turned(recording, axes)
    lost = np.logical_not(np.isfinite(positions).all(axis=1))
    if rotations is not None:
        lost = np.asarray(lost | ~np.isfinite(rotations).all(axis=1))
        rotations[lost] = np.nan
    positions[lost] = np.nan
    return Take(
        times=times,
        positions=positions,
        rotations=rotations,
        lost=lost,
        subject=recording.subject,
        path=spec.file,
        lines=recording.lines,
        is_curve=recording.is_curve,
        notices=(*recording.notices, *_other_rates(recording, spec, times)),
    )


def _other_rates(recording: Recording, spec: RecordedSpec, times: FloatArray) -> Iterator[str]:
    """What is said of rates, stated by the file or the job, that are not those of the samples."""
    if recording.times is None:
        if spec.rate is not None and recording.rate is not None and _apart(spec.rate, recording.rate):
            yield f"states {recording.rate:.6g} samples a second, the job {spec.rate:.6g}, which holds"
        return
    steps = np.diff(times)
    steps = steps[steps > 0]
    if steps.size:
        # The mean of the usual steps: stamps may be rounded to milliseconds, and samples be lost.
        found = 1 / float(steps[steps <= 1.5 * np.median(steps)].mean())
        for who, rate in (("states", recording.rate), ("is said by the job to have", spec.rate)):
            if rate is not None and _apart(rate, found):
                yield f"{who} {rate:.6g} samples a second, but its stamps come {found:.4g} a second"


def _apart(one: float, other: float) -> bool:
    """Whether two rates are more than two hundredths apart."""
    return abs(one - other) > 0.02 * other


def _unsettled(
    recording: Recording, spec: RecordedSpec, axes: FloatArray | None, metres: float | None
) -> list[Problem]:
    """What neither the file nor the job says of units and axes."""
    problems = []
    if metres is None:
        words = f"{spec.file} does not say what it is measured in (state units: m, cm, mm, in, ft or metres)"
        problems.append(spec.source.problem("units", words))
    if recording.settled and spec.metres is not None and recording.metres is not None:
        apart = abs(spec.metres - recording.metres) > 1e-9 * recording.metres
        if apart:
            words = f"{spec.file} says itself that its unit is {recording.metres:g} m (leave units out)"
            problems.append(spec.source.problem("units", words))
    if axes is None:
        words = f"{spec.file} does not say which way is up (state up_axis: y or z, or axes)"
        problems.append(spec.source.problem("up_axis", words))
    return problems


def _sane(values: FloatArray) -> FloatArray:
    """Values (N, C), those of a sample not numbers where one of them is none that anything has."""
    with np.errstate(invalid="ignore"):
        good = (np.abs(values) < _ANYWHERE).all(axis=1, keepdims=True)
    return np.where(good, values, np.nan)


def _turned(recording: Recording, axes: FloatArray) -> FloatArray | None:
    """Rotations with Y up: a camera's own axes stay, those of a body change with the file's."""
    if recording.rotations is None:
        return None
    q = quaternions.unit(_sane(recording.rotations))
    # A change of axes C makes C·R·Cᵀ of a rotation: its axis is turned along, and reversed where C mirrors.
    hand = float(np.sign(np.linalg.det(axes)))
    turned = np.concatenate((hand * (q[:, :3] @ axes.T), q[:, 3:]), axis=1)
    if recording.is_camera and hand > 0:
        turned = quaternions.product(turned, quaternions.from_matrices(axes))
    return turned


def wrong(path: Path, words: str, line: int = 0, column: int = 0) -> ViewerError:
    """An error at a place of a take's file."""
    return ViewerError(Problem(words, str(path), line, column))


def choose(spec: RecordedSpec, names: list[str], what: str) -> int:
    """Index of the subject that is asked for, or of the only one.

    Args:
        spec: the job's wishes.
        names: of all subjects there are.
        what: they are, in words.

    Raises:
        ViewerError: there is none of that name, or there are several and none is named.
    """
    from quiltcli.job.model import suggest

    shown = ", ".join(repr(name) for name in names[:12]) + (" …" if len(names) > 12 else "")
    if spec.subject is None:
        if len(names) == 1:
            return 0
        words = f"{spec.file} holds {len(names)} {what}: {shown} (state which)"
        if not names:
            words = f"{spec.file} holds no {what}"
        raise ViewerError(spec.source.problem("subject", words))
    found = [k for k, name in enumerate(names) if name == spec.subject]
    if not found:
        # "Head" is enough for "Visitor:Head" where nobody else has a head.
        found = [k for k, name in enumerate(names) if spec.subject in name.replace("/", ":").split(":")]
    if len(found) != 1:
        near = suggest(spec.subject, names)
        hint = f"did you mean {near!r}?" if near else f"it holds {shown}"
        how = "no" if not found else f"{len(found)} of"
        words = f"{spec.file} has {how} {what} named {spec.subject!r} ({hint})"
        raise ViewerError(spec.source.problem("subject", words))
    return found[0]
