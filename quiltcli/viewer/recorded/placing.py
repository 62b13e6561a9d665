"""A take's place in the world, the eye's on its marker, and its clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.geometry import quaternions, rotation_deg
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.take import Take


def place(take: Take, spec: RecordedSpec) -> Take:
    """The take of the eye in the world, at seconds of the job.

    In this order: `world_from_tracker`; `eye_from_marker`, which turns with the marker; `time_scale`,
    from the first stamp on, and `time_offset`.

    Raises:
        ViewerError: the eye is beside a marker of which nobody knows how it is turned.
    """
    positions, rotations = take.positions, take.rotations
    if spec.world_from_tracker is not None:
        world = spec.world_from_tracker.array
        positions = positions @ world[:3, :3].T + world[:3, 3]
        if rotations is not None:
            turn = world[:3, :3] / np.cbrt(np.linalg.det(world[:3, :3]))
            rotations = quaternions.product(quaternions.from_matrices(turn), rotations)
    marker = spec.eye_from_marker
    if marker is not None:
        if rotations is None:
            words = f"turns with the marker, and {take.path} does not say how that is turned"
            raise ViewerError(spec.source.problem("eye_from_marker", words))
        positions = positions + quaternions.rotated(rotations, np.asarray(marker.translate))
        rotations = quaternions.product(rotations, quaternions.from_matrices(rotation_deg(marker.rotate_deg)))
    first = take.times[0]
    times = first + (take.times - first) * spec.time_scale + spec.time_offset
    return replace(take, positions=positions, rotations=rotations, times=times)
