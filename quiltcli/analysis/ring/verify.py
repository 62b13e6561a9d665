"""A turn held against what it should be: bits against tones, tones against rays, pixels there and back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.ring.simulate import bits_on_disk
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.exr.image import read_exr
from quiltcli.geometry import dot
from quiltcli.halftone import Sequel, halftone
from quiltcli.job import JobFile
from quiltcli.render.ring.outputs import tones_path
from quiltcli.render.ring.setup import RingStage, set_ring_stage
from quiltcli.ring.cast import Target, aim_at, cast, lines_of, settled
from quiltcli.ring.maps import forward
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.picture import Picture, Show, draw_picture
from quiltcli.ring.raster import Limits
from quiltcli.ring.rig import Pose
from quiltcli.ring.tones import tones_of
from quiltcli.visibility.rays.pixels import OFFSETS
from quiltcli.visibility.setup.planes import LATTICE

SAMPLE = 20_000
_POSITIONS = 12
_TRIP = 1e-9
COLUMNS = ("held against", "looked at", "wrong", "worst", "allowed")


@dataclass
class RingVerdict:
    """What was found of a frame's turn.

    Attributes:
        frame: frame number.
        source: `packed pictures`, or `drawn in memory`.
        positions: mirror positions that were drawn again.
        bits: positions whose bits were compared with the halftone of their tones.
        bits_wrong: bits that differ.
        stray: bits that are on outside of the mirror.
        tones: images of tones on the disk that were compared.
        tones_wrong: pixels of them that differ.
        rays: pixels that were looked at by rays.
        edges: those of them of which not all rays name one triangle; these are met in double precision.
        rays_wrong: pixels that see something else than their ray meets.
        depth_error: worst distance off, over what is allowed.
        trip_error: pixels by which points come back elsewhere.
    """

    frame: int
    source: str
    positions: int = 0
    bits: int = 0
    bits_wrong: int = 0
    stray: int = 0
    tones: int = 0
    tones_wrong: int = 0
    rays: int = 0
    edges: int = 0
    rays_wrong: int = 0
    depth_error: float = 0.0
    trip_error: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        counts = self.bits_wrong + self.stray + self.tones_wrong + self.rays_wrong
        return not counts and self.depth_error <= 1 and self.trip_error <= _TRIP

    def as_json(self) -> dict[str, Any]:
        """For programs."""
        return {"quilt_verify": 1, "kind": "lightfield360", "passed": self.passed, **asdict(self)}

    def rows(self) -> list[tuple[str, ...]]:
        """A table in `COLUMNS`."""
        return [
            ("halftone of tones", f"{self.bits} positions", f"{self.bits_wrong} bits", "", "0"),
            ("the mirror's outline", f"{self.bits} positions", f"{self.stray} bits", "", "0"),
            ("light on the disk", f"{self.tones} images", f"{self.tones_wrong} pixels", "", "0"),
            ("rays", f"{self.rays} pixels", f"{self.rays_wrong}", f"{self.edges} on edges", "0"),
            ("depth", f"{self.rays} pixels", "", f"{self.depth_error:.2g}", "1 (2e-6 Z + 1e-6 m)"),
            ("there and back", f"{self.rays} pixels", "", f"{self.trip_error:.1e} px", f"{_TRIP:g} px"),
        ]


@dataclass(frozen=True)
class RingVerifyOptions:
    """What to look at.

    Attributes:
        frame: the frame; the job's first when None.
        everything: every mirror position and pixel, not a sample.
        pixels: pixels to look at by rays.
        folder: output folder instead of the job's.
        redraw: do not look at what is on the disk.
    """

    frame: int | None = None
    everything: bool = False
    pixels: int = SAMPLE
    folder: Path | None = None
    redraw: bool = False


def verify_turn(job: JobFile, options: RingVerifyOptions | None = None) -> RingVerdict:
    """Verify a turn of a job.

    Raises:
        QuiltError: the job, or a file of its output, is wrong.
    """
    options = options or RingVerifyOptions()
    frame = job.frames[0] if options.frame is None else options.frame
    if frame not in job.frames:
        raise OutputError(Problem(f"frame {frame} is none of the job's"))
    stage = set_ring_stage(job, [frame])
    show, folder = stage.show(frame), options.folder or job.output.directory
    on_disk = not options.redraw and any((folder / "packed").glob("*.png"))
    verdict = RingVerdict(frame, "packed pictures" if on_disk else "drawn in memory")
    target = aim_at(show.mesh)
    positions = list(_chosen(stage, options))
    each = math.ceil(options.pixels / max(len(positions), 1))
    before = None
    for position in positions:
        angle = stage.rig.angle(position)
        pictures = [draw_picture(show, angle, side) for side in range(len(stage.rig.sides))]
        verdict.positions += 1
        if on_disk and (stage.halftone.angle == 0 or options.everything):
            before = _bits(stage, verdict, pictures, position, folder, before)
        if not options.redraw:
            _tones(stage, verdict, pictures, position, folder)
        for side in range(len(stage.rig.sides)):
            _rays(stage, show, target, verdict, position, side, None if options.everything else each)
    return verdict


def _chosen(stage: RingStage, options: RingVerifyOptions) -> Iterator[int]:
    count = stage.rig.positions
    if options.everything or count <= _POSITIONS:
        yield from range(count)
    else:
        yield from (count * k // _POSITIONS for k in range(_POSITIONS))


def _bits(
    stage: RingStage,
    verdict: RingVerdict,
    pictures: list[Picture],
    position: int,
    folder: Path,
    before: Any,
) -> Any:
    """Compare bits with the halftone of tones; with errors handed on, of all tones up to there."""
    found = bits_on_disk(stage, verdict.frame, position, folder)
    tones = tones_of(stage.rig, pictures, stage.halftone, stage.shortest)
    earlier = [] if before is None or not stage.halftone.angle else before
    run = [*earlier, (tones.values, tones.inside)]
    if found is None:
        return run
    sequel = Sequel(range(position - len(run) + 1, position + 1), float(np.degrees(stage.rig.step)))
    values, inside = (np.stack(part) for part in zip(*run, strict=True))
    wanted = [halftone(one, inside, stage.halftone, sequel)[-1] for one in values.swapaxes(0, 1)]
    verdict.bits += 1
    verdict.bits_wrong += int(np.count_nonzero(found != wanted))
    verdict.stray += int(np.count_nonzero(found & ~tones.inside))
    return run


def _tones(
    stage: RingStage, verdict: RingVerdict, pictures: list[Picture], position: int, folder: Path
) -> None:
    """Compare light on the disk with what was drawn."""
    for side, picture in enumerate(pictures):
        path = tones_path(folder, stage.job.frames.index(verdict.frame), position, side)
        if not path.is_file():
            continue
        found = read_exr(path).channels
        verdict.tones += 1
        wrong = np.zeros(picture.lit.shape, dtype=np.bool_)
        for name, values in picture.buffers.items():
            mine = values.reshape(picture.lit.shape)
            if name not in found or found[name].shape != mine.shape:
                wrong[:] = True
            else:
                wrong |= (found[name] != mine) & ~((found[name] != found[name]) & (mine != mine))
        verdict.tones_wrong += int(np.count_nonzero(wrong))


def _rays(
    stage: RingStage,
    show: Show,
    target: Target,
    verdict: RingVerdict,
    position: int,
    side: int,
    count: int | None,
) -> None:
    """Look at pixels of the mirror by rays that are settled in double precision."""
    rig = stage.rig
    pose = rig.at(rig.angle(position), side)
    limits = show.limits or Limits(0.0, math.inf)
    seen = show.see(pose, show.curve, show.mesh, rig.size, show.backface_culling, show.limits)
    triangle = np.full(rig.size[0] * rig.size[1], -1)
    depth = np.full(triangle.size, np.inf)
    row, column = np.divmod(seen.pixel, max(seen.window.width, 1))
    address = (row + seen.window.y) * rig.size[0] + column + seen.window.x
    triangle[address] = seen.triangle
    pixels = np.flatnonzero(lit_pixels(rig, pose))
    if count is not None and pixels.size > count:
        pixels = np.sort(np.random.default_rng(position).choice(pixels, count, replace=False))
    y, x = np.divmod(pixels, rig.size[0]) + np.array([[0.5], [0.5]])
    named = np.stack(
        [
            cast(target, lines_of(pose, show.curve, x + dx, y + dy), show.backface_culling, limits)
            for dx, dy in OFFSETS
        ]
    )
    sure = (named == named[0]).all(axis=0)
    verdict.rays += pixels.size
    verdict.edges += int(np.count_nonzero(~sure))
    wrong = sure & (named[0] != triangle[pixels])
    lines = lines_of(pose, show.curve, x + LATTICE[0], y + LATTICE[1])
    rows = np.flatnonzero(~sure | wrong)
    if rows.size:
        # Of two surfaces in one place either may be named: what counts is how far away it is.
        both = np.concatenate((named[:, rows], triangle[pixels[rows]][None]))
        some = type(lines)(lines.eye[rows], lines.along[rows])
        exact = settled(target, some, both, show.backface_culling, limits)
        mine = triangle[pixels[rows]]
        same = (exact == mine) | _as_far(target, some, exact, mine)
        verdict.rays_wrong += int(np.count_nonzero(~same))
    _depths(pose, show, target, verdict, seen, address, depth, pixels, x, y, triangle)


def _as_far(target: Target, lines: Any, first: Any, second: Any) -> Any:
    """Whether triangles (N,) are equally far along rays."""
    both = (first >= 0) & (second >= 0)
    a, b = (_distance(target, lines, np.maximum(one, 0)) for one in (first, second))
    return both & (np.abs(a - b) <= 2e-9 * np.abs(a))


def _distance(target: Target, lines: Any, triangle: Any) -> Any:
    normal = target.normal[triangle]
    to = dot(normal, target.corners[target.triangles[triangle, 0]] - lines.eye)
    with np.errstate(divide="ignore", invalid="ignore"):
        return to / dot(normal, lines.along)


def _depths(
    pose: Pose,
    show: Show,
    target: Target,
    verdict: RingVerdict,
    seen: Any,
    address: Any,
    depth: Any,
    pixels: Any,
    x: Any,
    y: Any,
    triangle: Any,
) -> None:
    """Compare depths with the rays', and send the points back to their pixels."""
    from quiltcli.ring.hits import met
    from quiltcli.ring.raster import depth as depth_of

    _, s = met(show.mesh, seen, seen.pixel, seen.triangle)
    depth[address] = depth_of(seen.rays, seen.pixel, s)
    hit = np.flatnonzero(triangle[pixels] >= 0)
    if not hit.size:
        return
    lines = lines_of(pose, show.curve, x[hit], y[hit])
    far = _distance(target, lines, triangle[pixels[hit]])
    # Beside the surface's rim depth changes faster than a sample's shift is small.
    normal = target.normal[triangle[pixels[hit]]]
    flat = np.abs(dot(normal, lines.along)) > 0.05 * np.sqrt(dot(normal, normal))
    off = np.abs(depth[pixels[hit]] - far) / (2e-6 * far + 1e-6)
    verdict.depth_error = max(verdict.depth_error, float(off[flat].max(initial=0.0)))
    points = lines.eye + far[:, None] * lines.along
    back = forward(pose, show.curve, pose.from_world(points).T)
    trip = np.hypot(back[0] - x[hit], back[1] - y[hit])
    verdict.trip_error = max(verdict.trip_error, float(trip[np.isfinite(far) & flat].max(initial=0.0)))
