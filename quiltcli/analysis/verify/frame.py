"""The walk from a job to the verdict on one of its frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.verify.areas import Areas, display_coverage
from quiltcli.analysis.verify.images import Images, find_images
from quiltcli.analysis.verify.pixels import Trial, check_pixels
from quiltcli.analysis.verify.sample import every_pixel, sampled_pixels
from quiltcli.analysis.verify.seams import Seams, check_seams, seam_points
from quiltcli.analysis.verify.tally import Fault, Tally
from quiltcli.display import shared_edges
from quiltcli.errors import JobError, Problem
from quiltcli.geometry import IntArray
from quiltcli.job import JobFile
from quiltcli.projection.planar import viewer_rays
from quiltcli.render.crew import default_threads
from quiltcli.render.methods.raycast import target_of
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.clip import their_lit_facets
from quiltcli.viewer.view import View, views_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.exact import Neighbours
from quiltcli.visibility.rays.pixels import lit_pixels

SAMPLE = 200_000
_SEAM_POINTS, _ALL_SEAM_POINTS = 16, 4096
_BLOCK = 1 << 22


@dataclass(frozen=True)
class Verdict:
    """What holding a frame against rays has shown.

    Attributes:
        frame: frame number.
        images: where the images come from, in words.
        everything: whether every pixel was looked at, not a sample.
        lit: facets whose lit side faces the eye.
        inside: pixels inside facets.
        bleed: pixels in their bleed.
        outside: pixels of no lit facet that show something all the same.
        seams: the seams between facets.
        areas: polygons of the display and the scene against their triangles.
        eye: `left` or `right`, empty where there is one eye.
        viewer: name of whoever looks, empty where there is nobody else.
    """

    frame: int
    images: str
    everything: bool
    lit: int
    inside: Tally
    bleed: Tally
    outside: int
    seams: Seams
    areas: Areas
    eye: str = ""
    viewer: str = ""

    @property
    def passed(self) -> bool:
        """Whether all tolerances are met."""
        pixels = self.inside.failures or self.bleed.failures or self.outside
        return not (pixels or self.seams.failures or self.areas.failures)

    @property
    def words(self) -> str:
        """The verdict in a few words."""
        if not self.lit and self.passed:
            return "nothing to verify, no facet is lit"
        if not self.passed:
            return "OUT OF TOLERANCE"
        return "within tolerance" + ("" if self.inside["covered"] else ", but no pixel shows the scene")

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The first of all faults."""
        return self.inside.faults + self.bleed.faults + self.seams.faults

    def as_json(self) -> dict[str, Any]:
        """The verdict for programs."""
        return {
            "quilt_verify": 1,
            "frame": self.frame,
            **({"eye": self.eye} if self.eye else {}),
            **({"viewer": self.viewer} if self.viewer else {}),
            "images": self.images,
            "all_pixels": self.everything,
            "lit_facets": self.lit,
            "facets": self.inside.as_json(),
            "bleed": self.bleed.as_json(),
            "outside": self.outside,
            "seams": self.seams.as_json(),
            "areas": self.areas.as_json(),
            "faults": [fault.as_json() for fault in self.faults],
            "passed": self.passed,
        }


@dataclass(frozen=True)
class VerifyOptions:
    """How a frame is verified.

    Attributes:
        frame: the frame; the job's first when None.
        everything: look at every pixel.
        pixels: pixels to look at otherwise.
        folder: where the images are, instead of the job's folder.
        redraw: draw in memory even if there are images.
        threads: blocks looked at at a time; 0 takes every core. The verdict does not depend on it.
        eye: `left` or `right`; empty for every eye there is.
    """

    frame: int | None = None
    everything: bool = False
    pixels: int = SAMPLE
    folder: Path | None = None
    redraw: bool = False
    threads: int = 0
    eye: str = ""


@dataclass(frozen=True)
class Verified:
    """A verdict, and the stage and images it is about."""

    verdict: Verdict
    stage: Stage
    images: Images


def verify(job: JobFile, options: VerifyOptions | None = None) -> Iterator[Verified]:
    """Hold one frame of a job against rays: what each eye of each viewer sees.

    Raises:
        QuiltError: the job cannot be rendered, or this machine has no Embree.
    """
    options = options or VerifyOptions()
    frame = job.frames[0] if options.frame is None else options.frame
    wanted = _wanted_eyes(job, views_of(job, [frame]), options.eye)  # before anything is loaded
    stage = set_stage(job, options.folder)
    views = [view for view in stage.views([frame]) if view.eye in wanted]
    threads = options.threads or default_threads()
    folder = options.folder or job.output.directory
    for view in views:
        now = stage.at(view.time)
        images = find_images(now, view, folder, threads, options.redraw)
        for viewer in view.viewers:
            verdict = verify_images(now, viewer, images, options, view.viewers)
            yield Verified(replace(verdict, eye=view.eye, viewer=viewer.name), now, images)


def _wanted_eyes(job: JobFile, views: Sequence[View], eye: str) -> set[str]:
    """The eyes that are asked for: all where none is named (JobError if there is no such eye)."""
    there = {view.eye for view in views}
    if eye and eye not in there:
        words = f"--eye {eye}: the job has one eye (viewer.stereo gives it two)"
        raise JobError(Problem(words))
    return {eye} if eye else there


def verify_images(
    stage: Stage, viewer: Viewer, images: Images, options: VerifyOptions, everybody: Sequence[Viewer] = ()
) -> Verdict:
    """Hold images of a frame against rays, at the pixels `options` ask for.

    Args:
        stage: what the job's frames share, with the scene of this one.
        viewer: whose facets are looked at.
        images: what is verified.
        options: how.
        everybody: all who see something in these images; the viewer alone by default.
    """
    trial = make_trial(stage, viewer, images)
    most = _ALL_SEAM_POINTS if options.everything else _SEAM_POINTS
    points = seam_points(trial, shared_edges(stage.facets), most)
    if options.everything:
        blocks = every_pixel(stage.owners, trial.rays.lit)
    else:
        bleed = stage.job.render.bleed
        also = np.unique(points.pixel[points.pixel >= 0])
        blocks = sampled_pixels(
            stage.layout, stage.owners, trial.rays.lit, bleed, options.pixels, viewer.frame, also
        )
    unlit = 0
    if stage.facets.charts:
        blocks, unlit = _lit_blocks(trial, blocks)
    inside, bled = _check_blocks(trial, blocks, options.threads or default_threads())
    return Verdict(
        frame=viewer.frame,
        images=images.words,
        everything=options.everything,
        lit=int(np.count_nonzero(trial.rays.lit)),
        inside=inside,
        bleed=bled,
        outside=_shown_outside(stage, everybody or (viewer,), images) + unlit,
        seams=check_seams(trial, points),
        areas=Areas(display_coverage(stage.facets), stage.scene.coverage),
    )


def _lit_blocks(trial: Trial, blocks: Iterator[IntArray]) -> tuple[Iterator[IntArray], int]:
    """Blocks without the pixels that curved facets do not light, and how many of those show something."""
    kept, shown = [], 0
    for block in blocks:
        owned = block[trial.owners[block] != 0]
        lit = lit_pixels(owned, trial.layout, trial.owners, trial.rays)
        shown += int(np.count_nonzero(trial.images.channels["Z"][owned[~lit]] != np.inf))
        if lit.any():
            kept.append(owned[lit])
    return iter(kept), shown


def _check_blocks(trial: Trial, blocks: Iterator[IntArray], threads: int) -> tuple[Tally, Tally]:
    """Tallies of facets and bleed, added up in the order of the blocks, a few of them in memory at a time."""
    inside, bleed = Tally(), Tally()
    with ThreadPoolExecutor(threads) as pool:
        while some := list(islice(blocks, 4 * threads)):
            for facets_tally, bleed_tally in pool.map(partial(check_pixels, trial), some):
                inside, bleed = inside + facets_tally, bleed + bleed_tally
    return inside, bleed


def make_trial(stage: Stage, viewer: Viewer, images: Images) -> Trial:
    """Prepare what the pixels of a frame are verified with."""
    scene = stage.scene
    rays = viewer_rays(stage.layout, stage.facets, their_lit_facets(stage.facets, viewer), viewer)
    target = target_of(stage, viewer)
    neighbours = Neighbours(scene.vertices, scene.triangles)
    return Trial(stage.layout, stage.owners, rays, target, neighbours, images, scene)


def _shown_outside(stage: Stage, viewers: Sequence[Viewer], images: Images) -> int:
    """Pixels with a depth that belong to no lit facet of anybody's."""
    lit = np.logical_or.reduce([their_lit_facets(stage.facets, viewer) for viewer in viewers])
    shown = np.concatenate(([False], lit))
    count = 0
    for start in range(0, stage.owners.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        stray = (images.channels["Z"][part] != np.inf) & ~shown[np.abs(stage.owners[part])]
        count += int(np.count_nonzero(stray))
    return count
