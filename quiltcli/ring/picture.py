"""The picture of one mirror position: visibility, shading, and every channel of an ordinary render."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as made_by
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import MOST_HALF, empty_buffers
from quiltcli.geometry import BoolArray, IntArray, slices
from quiltcli.lightfield import Field
from quiltcli.projection.gaze import Gaze
from quiltcli.ring.cast import lines_of
from quiltcli.ring.curve import Curve
from quiltcli.ring.hits import EYE, WHOLE, Cell, ring_hits
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.raster import Limits, Mesh, Visible, see
from quiltcli.ring.rays import Window
from quiltcli.ring.rebin import rebinned
from quiltcli.ring.rig import Pose, Rig
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.aovs import fill
from quiltcli.shading.layers import Layer, blended
from quiltcli.shading.shadows import CENTRE, Sample
from quiltcli.shading.sky import sky_at
from quiltcli.shading.sums import Background, Sums, new_sums, summed
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.layers import LayerHits

_CHUNK = 16384
See = Callable[..., Visible]


@dataclass(frozen=True)
class Show:
    """What the pictures of a turn share.

    Attributes:
        rig: projector and mirror.
        curve: the viewers.
        scene: what is seen.
        mesh: its triangles.
        channels: names of the channels.
        samples: places of the samples in a pixel, from its centre; the centre alone where there is one.
        cells: what of the pixel each stands for.
        backface_culling: leave out what is seen from behind.
        near: nearest that is drawn, metres.
        far: farthest that is drawn, metres.
        see: finds what pixels see.
        field: photographs that are shown instead of the scene.
        frame: of these, where they are animated.
    """

    rig: Rig
    curve: Curve
    scene: Scene
    mesh: Mesh
    channels: tuple[str, ...]
    samples: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    cells: tuple[Cell, ...] = (WHOLE,)
    backface_culling: bool = False
    near: float = 0.01
    far: float = 2.0
    see: See = see
    field: Field | None = None
    frame: int = 1

    @property
    def limits(self) -> Limits | None:
        """Near and far; None where the scene lies between them wherever viewers are."""
        points = self.mesh.vertices
        radius = float(np.sqrt((points[0] ** 2 + points[2] ** 2).max(initial=0.0)))
        tall = float(np.abs(points[1]).max(initial=0.0))
        distances = [self.curve.distance, *(user.distance for user in self.curve.users)]
        heights = [abs(self.curve.height), *(abs(user.height) for user in self.curve.users)]
        most = np.hypot(max(distances) + radius, max(heights) + tall)
        if self.near < min(distances) - radius and self.far > most:
            return None
        return Limits(self.near, self.far)

    @property
    def viewer(self) -> Viewer:
        """The viewer that channels are made for: depth is radial, places are the world's."""
        look, up = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
        return Viewer(0, EYE, look, up, self.near, self.far, "radial")


@dataclass
class Counts:
    """What was done for a picture; two add up.

    Attributes:
        candidates: pairs of pixel and triangle that were tried.
        fragments: pairs that met.
        visible: pixels of the mirror that show the scene.
        bend: pixels by which an edge may bend, at most.
        seconds: by stage.
    """

    candidates: int = 0
    fragments: int = 0
    visible: int = 0
    bend: float = 0.0
    seconds: dict[str, float] = made_by(default_factory=dict)

    def add(self, other: Counts) -> None:
        """Add another's."""
        self.candidates += other.candidates
        self.fragments += other.fragments
        self.visible += other.visible
        self.bend = max(self.bend, other.bend)
        for name, seconds in other.seconds.items():
            self.seconds[name] = self.seconds.get(name, 0.0) + seconds


@dataclass(frozen=True)
class Picture:
    """One side of the mirror at one position.

    Attributes:
        pose: where it is.
        lit: (H, W) pixels that light it.
        buffers: flat (H·W,) by EXR channel; empty where it is not lit.
        counts: what was done.
    """

    pose: Pose
    lit: BoolArray
    buffers: dict[str, NDArray[Any]]
    counts: Counts

    def rgb(self) -> NDArray[np.float16]:
        """(H, W, 3) light, a channel after another in memory."""
        light = np.stack([self.buffers[name] for name in "RGB"]).reshape(3, *self.lit.shape)
        return np.moveaxis(light, 0, -1)


def draw_picture(show: Show, angle: float, side: int = 0) -> Picture:
    """Draw one side of the mirror at an angle in radians."""
    pose = show.rig.at(angle, side)
    lit = lit_pixels(show.rig, pose)
    buffers, counts = empty_buffers(show.channels, lit.size), Counts()
    if show.field is not None:
        return Picture(pose, lit, buffers, _photographed(show, show.field, pose, lit, buffers))
    _background(show, pose, lit, buffers)
    several = len(show.samples) > 1
    light = summed(show.channels) if several else ()
    rest = tuple(name for name in show.channels if name not in light)
    if rest:
        counts.add(_centres(show, pose, lit, rest, buffers))
    if light:
        counts.add(_samples(show, pose, lit, light, buffers))
    return Picture(pose, lit, buffers, counts)


def _photographed(
    show: Show, light: Field, pose: Pose, lit: BoolArray, buffers: dict[str, NDArray[Any]]
) -> Counts:
    """The light of a light field; it has no other channels."""
    start = time.perf_counter()
    found = np.minimum(rebinned(light, pose, show.curve, lit, show.frame), MOST_HALF)
    for k, name in enumerate("RGB"):
        buffers[name][:] = found[..., k].reshape(-1)
    buffers["A"][:] = lit.reshape(-1)
    counts = Counts(visible=int(np.count_nonzero(lit)))
    counts.seconds["rebin"] = time.perf_counter() - start
    return counts


def _background(show: Show, pose: Pose, lit: BoolArray, buffers: dict[str, NDArray[Any]]) -> None:
    """The mirror shows the background's colour, or the sky, where it shows nothing else."""
    if show.scene.sky is not None and "rgba" in show.channels:
        address = np.flatnonzero(lit)
        row, column = np.divmod(address, lit.shape[1])
        x, y = column + 0.5, row + 0.5
        ways = [
            np.ascontiguousarray(lines_of(pose, show.curve, x + dx, y + dy).along.T)
            for dx, dy in ((0.0, 0.0), (-0.5, 0.0), (0.5, 0.0), (0.0, -0.5), (0.0, 0.5))
        ]
        colors = sky_at(show.scene.sky, ways[0], ways[2] - ways[1], ways[4] - ways[3])
        for name, values in zip("RGB", np.minimum(colors, MOST_HALF), strict=True):
            buffers[name][address] = values
    if not show.scene.background.any():
        return
    for name, value in zip("RGB", show.scene.background, strict=True):
        buffers[name][lit.reshape(-1)] = min(value, MOST_HALF)


def _centres(
    show: Show, pose: Pose, lit: BoolArray, channels: Sequence[str], buffers: dict[str, NDArray[Any]]
) -> Counts:
    seen, address, counts = _look(show, pose, lit, (0.0, 0.0))
    start, gaze = time.perf_counter(), Gaze(show.viewer, None)
    for part in slices(0, seen.pixel.size, _CHUNK):
        fill(buffers, channels, gaze, _shaded(show, pose, seen, address, part))
    if seen.through is not None:
        light = summed(tuple(channels))
        data = tuple(name for name in channels if name not in light)
        sums = _sums(lit, light)
        for layer in _layers(show, pose, seen):
            sums.add(layer.shaded, layer.weight)
            fill(buffers, data, gaze, layer.shaded, np.flatnonzero(layer.first))
            counts.visible += int(np.count_nonzero(layer.first))
        sums.store(buffers, 1, _behind(show, buffers))
    counts.seconds["shade"] = time.perf_counter() - start
    return counts


def _samples(
    show: Show, pose: Pose, lit: BoolArray, channels: Sequence[str], buffers: dict[str, NDArray[Any]]
) -> Counts:
    """Means of light over the samples; what misses the scene counts as background."""
    sums, counts = _sums(lit, channels), Counts()
    for number, (place, cell) in enumerate(zip(show.samples, show.cells, strict=True)):
        seen, address, some = _look(show, pose, lit, place)
        sample = Sample(number, len(show.samples))
        counts.add(some)
        for part in slices(0, seen.pixel.size, _CHUNK):
            sums.add(_shaded(show, pose, seen, address, part, cell, sample))
        for layer in _layers(show, pose, seen, cell, sample):
            sums.add(layer.shaded, layer.weight)
    counts.visible = sums.covered
    sums.store(buffers, len(show.samples), _behind(show, buffers))
    return counts


def _sums(lit: BoolArray, channels: Sequence[str]) -> Sums:
    return Sums(new_sums(tuple(channels), lambda dtype: np.zeros(lit.size, dtype)), tuple(channels))


def _behind(show: Show, buffers: dict[str, NDArray[Any]]) -> Background:
    """What is seen where the scene is not: the background, or the sky that was laid."""
    if show.scene.sky is None:
        return show.scene.background
    return lambda address: np.stack([buffers[name][address].astype(np.float32) for name in "RGB"])


def _look(
    show: Show, pose: Pose, lit: BoolArray, beside: tuple[float, float]
) -> tuple[Visible, IntArray, Counts]:
    """What the mirror's pixels see, and where they lie in the picture."""
    start = time.perf_counter()
    how = {} if show.scene.soft is None else {"soft": show.scene.soft}
    seen = show.see(
        pose, show.curve, show.mesh, show.rig.size, show.backface_culling, show.limits, beside, **how
    )
    window = seen.window
    address = _addresses(show, window, seen.pixel)
    kept = np.flatnonzero(lit.reshape(-1).take(address))
    found = seen.some(kept)
    if seen.through is not None:
        places = _addresses(show, window, seen.through.fragments.pixel)
        found = replace(found, through=seen.through.some(lit.reshape(-1).take(places)))
    seconds = {"visibility": time.perf_counter() - start}
    counts = Counts(seen.candidates, seen.fragments, kept.size, seen.bend, seconds)
    return found, address[kept], counts


def _addresses(show: Show, window: Window, pixel: IntArray) -> IntArray:
    """Where pixels (P,) of a window lie in the picture."""
    row, column = np.divmod(pixel, max(window.width, 1))
    return (row + window.y) * show.rig.size[0] + column + window.x


def _layers(
    show: Show, pose: Pose, seen: Visible, cell: Cell = WHOLE, sample: Sample = CENTRE
) -> Iterator[Layer]:
    """What is seen through something, from the front to the back."""
    through = seen.through
    if through is None:
        return
    pixel = through.fragments.pixel
    light, address = np.ones(pixel.size, dtype=np.bool_), _addresses(show, seen.window, pixel)

    def found() -> Iterator[LayerHits]:
        for row, triangle in through.layers(light):
            mine = replace(seen, pixel=pixel[row], triangle=triangle)
            for part in slices(0, row.size, _CHUNK):
                hits = ring_hits(pose, show.mesh, show.scene, mine, part, address[row[part]], cell)
                yield LayerHits(row[part], hits, np.ones(hits.triangle.size, dtype=np.bool_))

    yield from blended(found(), light, show.scene, EYE, sample)


def _shaded(
    show: Show,
    pose: Pose,
    seen: Visible,
    address: IntArray,
    part: slice,
    cell: Cell = WHOLE,
    sample: Sample = CENTRE,
) -> Shaded:
    hits = ring_hits(pose, show.mesh, show.scene, seen, part, address[part], cell)
    return Shaded(show.scene, EYE, hits, sample=sample)
