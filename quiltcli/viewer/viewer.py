"""Where the viewer's eye is in a frame, and which way it looks.

A pose is a pure function of the frame number, so any chunk of a sequence can be rendered anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.geometry import FloatArray, cross, normalized
from quiltcli.job import PathSpec, ViewerSpec
from quiltcli.viewer.paths import PATHS, Pose


@dataclass(frozen=True)
class Viewer:
    """The viewer camera of one frame.

    Attributes:
        frame: frame number.
        eye: (3,) world position, metres.
        look: (3,) unit view direction.
        up: (3,) unit vector, orthogonal to `look`.
        near: nearest depth that is drawn, metres.
        far: farthest depth that is drawn, metres.
        depth: `planar` measures Z along `look`; `radial` is the distance from the eye.
        clip: whether near and far cut along `look` (`planar`) or by the distance from the eye (`distance`);
            None for as depth is measured.
        head: (3,) place between the eyes, world metres; None where there is one eye, at the head's place.
        name: of whoever looks, empty where there is nobody else.
        facets: ids of the only facets that are theirs; None for all.
        aimed: whether the path says how the head is turned; otherwise `look` goes to the display's middle.
        then: (3,) where the eye is a frame later, world metres; None for at the same place.
        then_turn: (3, 3) `camera_from_world` a frame later; None for the same.
    """

    frame: int
    eye: FloatArray
    look: FloatArray
    up: FloatArray
    near: float
    far: float
    depth: str
    clip: str | None = None
    head: FloatArray | None = None
    name: str = ""
    facets: tuple[int, ...] | None = None
    aimed: bool = True
    then: FloatArray | None = None
    then_turn: FloatArray | None = None

    @property
    def camera_from_world(self) -> FloatArray:
        """Rotation (3, 3) with the rows right, up, −look; apply it to world minus eye."""
        return np.stack((cross(self.look, self.up), self.up, -self.look))

    def depth_of(self, position: FloatArray) -> FloatArray:
        """Depth (...) float64 of points (3, ...) given relative to the eye, metres.

        Along the look direction, or the distance from the eye where depth is `radial`.
        """
        return self._measured(position, by_distance=self.depth == "radial")

    def sees(self, facet: int) -> bool:
        """Whether a facet (1-based id) is theirs."""
        return self.facets is None or facet in self.facets

    @property
    def by_distance(self) -> bool:
        """Whether near and far cut by the distance from the eye."""
        return (self.clip == "distance") if self.clip else self.depth == "radial"

    def reach_of(self, position: FloatArray) -> FloatArray:
        """What near and far cut, (...) float64 of points (3, ...) given relative to the eye, metres."""
        return self._measured(position, by_distance=self.by_distance)

    def _measured(self, position: FloatArray, *, by_distance: bool) -> FloatArray:
        x, y, z = position
        if by_distance:
            return np.asarray(np.sqrt(x * x + y * y + z * z))
        return np.asarray(x * self.look[0] + y * self.look[1] + z * self.look[2])


def viewer_at(
    spec: ViewerSpec, frame: float, depth: str, fps: float, middle: Callable[[], FloatArray] | None = None
) -> Viewer:
    """The viewer of one frame, or at a time between two.

    Args:
        spec: the job's `viewer`.
        frame: frame number, or a time in frames; nothing else enters the pose.
        depth: the job's `render.depth`.
        fps: frames a second, the clock of takes.
        middle: the display's middle (3,), asked for where the path says nothing of a direction: a picture
            for one eye does not depend on where the head looks. None where a direction is needed.

    Raises:
        ViewerError: the path gives no usable pose at this frame.
    """
    pose = _pose(spec.path, frame, fps)
    blame = spec.path.source.at(*pose.blame)
    if pose.look is None:
        if middle is None:
            raise ViewerError(blame.problem((), pose.unaimed))
        look, up = towards(pose.eye, middle())
        return Viewer(int(frame), pose.eye, look, up, spec.near, spec.far, depth, aimed=False)
    distance = float(np.linalg.norm(pose.look))
    if not distance > 1e-9:
        why = (
            "turns right round"
            if spec.path.keyframes and spec.path.keyframes[0].look
            else "is where it looks at"
        )
        raise ViewerError(
            blame.problem((), f"at frame {frame:g} the viewer {why}: there is no direction of view")
        )
    look = pose.look / distance
    right = cross(look, normalized(pose.up))
    if not float(np.linalg.norm(right)) > 1e-6:
        raise ViewerError(
            blame.problem((), f"at frame {frame:g} the viewer looks along up (turn up elsewhere)")
        )
    up = normalized(cross(normalized(right), look))
    return Viewer(int(frame), pose.eye, look, up, spec.near, spec.far, depth)


def towards(eye: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction of view (3,) from an eye to a point and up (3,), whatever the two: −Z where they are one."""
    way = point - eye
    look = normalized(way) if float(np.linalg.norm(way)) > 1e-6 else np.array([0.0, 0.0, -1.0])
    # Who looks straight up or down has the world's −Z or +Z above.
    steep = abs(float(look[1])) > 1 - 1e-9
    up = np.array([0.0, 0.0, np.sign(look[1])]) if steep else np.array([0.0, 1.0, 0.0])
    right = normalized(cross(look, up))
    return look, normalized(cross(right, look))


def _pose(path: PathSpec, frame: float, fps: float) -> Pose:
    """Pose by the kind of path that was given."""
    for kind, pose_of in PATHS.items():
        if getattr(path, kind) is not None:
            return pose_of(path, frame, fps)
    raise ViewerError(path.source.problem((), f"expected one of {', '.join(PATHS)}"))
