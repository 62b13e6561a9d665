"""What all turns of a job share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from quiltcli.errors import JobError, Problem, SceneError, ViewerError, raise_all
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.job import JobFile, load_lightfield_file, load_scene_file
from quiltcli.job.halftone import HalftoneSpec
from quiltcli.job.job import RenderSpec
from quiltcli.job.load import load_mirror_file
from quiltcli.job.mirror import MirrorDisplayFile
from quiltcli.job.ring import RingSpec
from quiltcli.lightfield import Field, load_field
from quiltcli.render.antialiasing import cell_of, sample_places
from quiltcli.render.setup import scene_spec, texture_limits
from quiltcli.ring.build import curve_of, rig_of, scene_problems
from quiltcli.ring.cast import see_by_rays
from quiltcli.ring.elevation import WORTH_A_WORD, plane_error
from quiltcli.ring.hits import Cell
from quiltcli.ring.picture import See, Show
from quiltcli.ring.raster import Mesh, mesh_of, see
from quiltcli.ring.rebin import as_bits
from quiltcli.ring.rig import Rig
from quiltcli.ring.tones import shortest_dwell
from quiltcli.ring.vertexwise import see_by_vertices
from quiltcli.scene import Scene
from quiltcli.scene.bare import empty_scene
from quiltcli.scene.motion import load_moving_scene
from quiltcli.scene.source import SceneSource
from quiltcli.scene.textures.pool import TextureStore
from quiltcli.shading.lights import demand_shadows, prepare_shadows

METHODS: dict[str, See] = {"exact": see, "raycast": see_by_rays, "vertex": see_by_vertices}


@dataclass(frozen=True)
class RingStage:
    """Everything above the loop over frames.

    Attributes:
        job: the job.
        display: its display.
        ring: its viewers.
        rig: projector and mirror.
        scene: the scene as it is at its start.
        source: gives the scene of each frame; None where nothing moves.
        photographs: the light field that is shown instead of the scene, which is empty then.
        shortest: least time that a pixel dwells on a viewer, where that is made up for; else 1.
    """

    job: JobFile
    display: MirrorDisplayFile
    ring: RingSpec
    rig: Rig
    scene: Scene
    source: SceneSource | None
    shortest: float
    photographs: Field | None = None
    _meshes: list[tuple[Scene, Mesh]] = field(default_factory=list)

    @property
    def halftone(self) -> HalftoneSpec:
        """How tones become bits; of photographs that are bits before, by copying them."""
        spec = self.job.halftone or HalftoneSpec()
        return HalftoneSpec(method="none", before=True) if spec.before else spec

    @property
    def positions(self) -> range:
        """Numbers of the mirror positions, from 0."""
        return range(self.rig.positions)

    def show(self, frame: int) -> Show:
        """What the pictures of a frame's turn share.

        Raises:
            QuiltError: viewers or scene of the frame are impossible.
        """
        scene = self.source.scene_at(frame) if self.source else self.scene
        curve = curve_of(self.ring, frame, self.rig)
        problems = list(scene_problems(scene.vertices, self.rig, curve))
        if problems:
            blame = load_scene_file(self.job.scene).source
            told = [blame.problem((), f"at frame {frame} the scene {words}") for words in problems]
            raise SceneError(told)
        prepare_shadows(scene)  # before processes are forked, which share it
        if not self._meshes or self._meshes[0][0] is not scene:
            self._meshes[:] = [(scene, mesh_of(scene.vertices, scene.triangles))]
        render, channels = self.job.render, self.job.output.channels
        places = sample_places(render.samples) if render.samples > 1 else ((0.0, 0.0),)
        return Show(
            rig=self.rig,
            curve=curve,
            scene=scene,
            mesh=self._meshes[0][1],
            channels=channels,
            samples=places,
            cells=tuple(Cell(*cell_of(place, render.samples)) for place in places),
            backface_culling=render.backface_culling,
            near=self.ring.near,
            far=self.ring.farthest,
            see=_way_to_see(render),
            field=self.photographs,
            frame=frame,
        )


def _way_to_see(render: RenderSpec) -> See:
    """What finds what pixels see, as the job wants it."""
    if render.method == "vertex" and render.tessellate is not None:
        return partial(see_by_vertices, tessellate=render.tessellate)
    return METHODS[render.method]


def set_ring_stage(job: JobFile, frames: Sequence[int] | None = None) -> RingStage:
    """Load everything a job names, and look whether its frames are possible.

    Raises:
        QuiltError: something is wrong.
    """
    assert job.ring is not None
    display = load_mirror_file(job.display)
    rig = rig_of(display)
    _demand_memory(display, rig)
    frames = list(job.frames if frames is None else frames)
    photographs = None
    if job.lightfield is not None:
        photographs = load_field(load_lightfield_file(job.lightfield), frames)
        if job.halftone is not None and job.halftone.before:
            photographs = as_bits(photographs, job.halftone, colours=len(rig.streams) > 1)
        scene, source = empty_scene(), None
    else:
        store = TextureStore(texture_limits(job))
        scene, source = load_moving_scene(scene_spec(job), float(job.fps), store)
        demand_shadows(scene)
    raise_all(SceneError, source.problems(frames) if source else ())
    compensate = job.halftone is not None and job.halftone.compensate == "dwell"
    shortest = shortest_dwell(rig) if compensate else 1.0
    raise_all(JobError, _foreign(job))
    if scene.soft is not None and job.render.method == "raycast":
        words = "has surfaces that light passes, which rays do not show (expected method exact or vertex)"
        raise SceneError(Problem(words, file=str(job.scene)))
    stage = RingStage(job, display, job.ring, rig, scene, source, shortest, photographs)
    problems: list[Problem] = []
    for frame in frames if job.ring.heads is not None else frames[:1]:
        try:
            curve_of(job.ring, frame, rig)
        except ViewerError as error:
            problems += error.problems
    raise_all(ViewerError, list(dict.fromkeys(problems))[:20])
    if frames:
        stage.show(frames[0])
    return stage


def _demand_memory(display: MirrorDisplayFile, rig: Rig) -> None:
    """Raise unless a turn's pictures fit into the memory that is free."""
    pixels, streams = rig.positions * rig.size[0] * rig.size[1], len(rig.streams)
    # Tones, bits and what is on the mirror; one stream of tones as halftones take them.
    needed, free = pixels * (3 * streams + 1 + 4), free_memory()
    if free is not None and needed > free:
        words = (
            f"{rig.positions:,} pictures of {rig.size[0]}×{rig.size[1]} would take {bytes_text(needed)} of"
        )
        raise JobError(
            display.source.problem(
                ("image",), f"{words} memory, but {bytes_text(free)} are free (smaller ones take less)"
            )
        )


def _foreign(job: JobFile) -> Iterator[Problem]:
    """Problems with channels of facets that a mirror does not have."""
    if "motion" in job.output.channels:
        words = (
            "motion is in pixels of a film, and pictures of mirror positions are none (expected no motion)"
        )
        yield job.output.source.problem(("channels",), words)


def _elevated(stage: RingStage) -> Iterator[str]:
    """A word about viewers so high over the mirror that planes are not where its light goes."""
    if stage.rig.cone:
        return
    places = [(stage.ring.height, stage.ring.distance)]
    places += [(user.height, user.distance) for user in stage.ring.users]
    off, height, distance = max((plane_error(stage.rig, d, h), h, d) for h, d in places)
    if off > WORTH_A_WORD:
        yield (
            f"from {height:g} m high, {distance:g} m away things are drawn {off:.2g} pixels off, for light"
            " leaves the mirror in planes only nearly (reflection: cone draws them right, and takes longer)"
        )


def with_mesh(show: Show, mesh: Mesh) -> Show:
    """The same pictures of other triangles."""
    return replace(show, mesh=mesh)


def notices(stage: RingStage) -> Iterable[str]:
    """What is worth a word before a render."""
    yield from stage.display.timing.notices()
    yield from _elevated(stage)
    points = stage.scene.vertices
    radius = float(np.sqrt((points[:, [0, 2]] ** 2).sum(axis=1).max(initial=0.0)))
    if radius > stage.rig.radius:
        yield (
            f"the scene reaches {radius:.3g} m from the axis and the mirror {stage.rig.radius:.3g} m: "
            "what is beyond is cut off"
        )
