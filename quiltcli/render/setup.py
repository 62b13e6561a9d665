"""The stage: what the viewer cannot change, set up once a job."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, load_display, scaled
from quiltcli.errors import JobError, Problem, SceneError, raise_all
from quiltcli.geometry import BoolArray, OwnerArray
from quiltcli.images.names import Names, layout_path, names_of, names_problems
from quiltcli.job import JobFile, PackSpec, SceneFile, UvLayoutSpec, load_display_file, load_scene_file
from quiltcli.layout import Layout, pixel_owners
from quiltcli.layout.from_job import layout_for
from quiltcli.projection.patches import Patches, patched
from quiltcli.projection.planar import QuiltRays, viewer_rays
from quiltcli.render.needs import demand_memory, method_problems
from quiltcli.scene import Scene
from quiltcli.scene.motion import load_moving_scene
from quiltcli.scene.source import SceneSource
from quiltcli.scene.textures.pool import TextureLimits, TextureStore
from quiltcli.shading.lights import demand_shadows
from quiltcli.viewer.clip import settled_clip
from quiltcli.viewer.view import View, facet_problems, views_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.pairs import Parts, facet_parts
from quiltcli.visibility.draw import Blocks, cut_blocks
from quiltcli.visibility.setup.patches import with_patches


@dataclass(frozen=True)
class Stage:
    """What the viewer cannot change: everything above the loop over frames.

    Attributes:
        job: the job.
        facets: the display.
        layout: the facets' pixels and their places, one row a facet.
        scene: the scene.
        parts: convex pieces of the facets.
        blocks: the facets' rectangles, cut for the rasterizer.
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
        fill: share of the quilt's pixels that lie in facets.
        source: gives the scene of each frame; None where nothing moves.
        patches: of curved facets, the last of the blocks; None where all are flat.
    """

    job: JobFile
    facets: Facets
    layout: Layout
    scene: Scene
    parts: Parts
    blocks: Blocks
    owners: OwnerArray
    fill: float
    source: SceneSource | None = None
    patches: Patches | None = None

    @cached_property
    def clip(self) -> str:
        """What near and far cut in all frames, `planar` or `distance`."""
        return settled_clip(self.job, self.facets)

    @cached_property
    def names(self) -> Names:
        """How the images are called."""
        return names_of(self.job, self.facets.names)

    def views(self, frames: Iterable[int]) -> list[View]:
        """The views of some frames.

        Raises:
            ViewerError: as for `viewer.view.views_of`.
            SceneError: the scene has nothing to show in one of the frames.
        """
        frames = list(frames)
        raise_all(SceneError, self.source.problems(frames) if self.source else ())
        return views_of(self.job, frames, self.clip)

    def rays(self, lit: BoolArray, viewer: Viewer) -> QuiltRays:
        """Rays of a viewer's eye through the facets that are `lit` (F,), curved ones in patches."""
        rays = viewer_rays(self.layout, self.facets, lit, viewer)
        return rays if self.patches is None else patched(rays, self.patches)

    def at(self, frame: float) -> Stage:
        """The stage with its scene as it is in a frame; itself where nothing moves."""
        scene = self.source.scene_at(frame) if self.source else self.scene
        return self if scene is self.scene else replace(self, scene=scene)


def set_stage(job: JobFile, folder: Path | None = None) -> Stage:
    """Load everything a job names and prepare what all of its frames share.

    Args:
        job: the job.
        folder: output folder instead of the job's; the layout of an earlier run is kept there.

    Raises:
        QuiltError: a file is wrong, the layout does not belong to the display, or there is no Embree for
            shadows.
    """
    kept = layout_path(folder or job.output.directory)
    facets, choice = facets_and_layout(job)
    raise_all(JobError, facet_problems(job, facets.count) + method_problems(job, facets))
    layout = layout_for(choice, facets, kept)
    raise_all(JobError, names_problems(job, len(layout.pages), facets.count))
    demand_memory(job, layout)
    store = TextureStore(texture_limits(job))
    scene, source = load_moving_scene(scene_spec(job), float(job.fps), store)
    if job.render.method == "tessellate" and scene.soft is not None:
        words = "has surfaces that light passes, which tessellate does not show (expected opaque ones)"
        raise SceneError(Problem(words, file=str(job.scene)))
    demand_shadows(scene)
    return replace(stage_of(job, facets, layout, scene, job.render.bleed), source=source)


def scene_spec(job: JobFile) -> SceneFile:
    """The scene file of a job, as the job wants it drawn."""
    spec = load_scene_file(job.scene)
    near = job.render.ambient_occlusion
    if not job.render.shadows:
        spec = spec.without_shadows()
    return spec if near is None else spec.with_ambient_occlusion(near.distance, near.samples)


def texture_limits(job: JobFile) -> TextureLimits:
    """What the textures of a job may take, and how well they are filtered."""
    how = job.render
    return TextureLimits(how.texture_memory, how.max_texture, how.anisotropy)


def facets_and_layout(job: JobFile) -> tuple[Facets, Path | PackSpec | UvLayoutSpec]:
    """The facets of a job, and what it says of their layout; of a proxy with fewer pixels, packed anew."""
    facets, choice = load_display(load_display_file(job.display)), job.layout or PackSpec()
    if job.render.scale == 1:
        return facets, choice
    wishes = choice.model_copy(update={"size": None, "pins": None}) if isinstance(choice, PackSpec) else None
    return scaled(facets, job.render.scale), wishes or PackSpec()


def stage_of(job: JobFile, facets: Facets, layout: Layout, scene: Scene, bleed: int) -> Stage:
    """The stage of a display, its layout and a scene that are already there."""
    owners = pixel_owners(layout, bleed)
    # What is curved has no part and no block of flat facets.
    flat = (
        replace(layout, page=np.where(facets.curved, np.int32(-1), layout.page)) if facets.charts else layout
    )
    blocks, patches = cut_blocks(flat, bleed, owners), None
    if facets.charts:
        beside = 0.5 if job.render.samples > 1 else 0.0
        blocks, patches = with_patches(blocks, layout, facets.charts, bleed, owners, beside)
    return Stage(
        job=job,
        facets=facets,
        layout=layout,
        scene=scene,
        parts=facet_parts(facets, flat, bleed),
        blocks=blocks,
        owners=owners,
        fill=np.count_nonzero(owners > 0) / owners.size,
        patches=patches,
    )
