"""The walk from a job to the comparison of the methods on one of its frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.analysis.methods.eyeviews import (
    EyeView,
    close_view,
    crop,
    direct_picture,
    marked,
    seen_against,
    whole_view,
)
from quiltcli.analysis.methods.findings import (
    IMAGED,
    REFERENCE,
    VARIANTS,
    Difference,
    Findings,
    Variant,
    decibels,
    difference,
    errors_of,
)
from quiltcli.analysis.methods.profile import Profile, best_profile
from quiltcli.analysis.verify.frame import make_trial
from quiltcli.analysis.verify.images import Images
from quiltcli.analysis.verify.pixels import Trial
from quiltcli.analysis.verify.seams import SeamPoints, check_seams, seam_points
from quiltcli.display import shared_edges
from quiltcli.errors import JobError, raise_all
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray
from quiltcli.images.preview import Bytes
from quiltcli.job import JobFile
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.methods import draw_frame
from quiltcli.render.needs import method_problems
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.view import viewers_of
from quiltcli.viewer.viewer import Viewer

_CHANNELS = ("rgba", "Z", "triangle")
_SEAM_POINTS = 256
# Where depth goes wrong is looked for with the first of these that is compared.
_COARSE = tuple(Variant(method, "16") for method in ("raskar", "zscale", "offaxis", "homography"))


@dataclass(frozen=True)
class CompareOptions:
    """How methods are compared.

    Attributes:
        frame: the frame; the job's first when None.
        variants: what to compare; None for all that suit the display. The reference is always drawn.
        threads: batches drawn at a time; 0 takes every core.
        begin: told of the name of each method before it is drawn.
    """

    frame: int | None = None
    variants: Sequence[Variant] | None = None
    threads: int = 0
    begin: Callable[[str], None] = lambda name: None


@dataclass(frozen=True)
class Study:
    """The comparison of a frame.

    Attributes:
        frame: frame number.
        pixels: pixels of lit facets that are compared.
        lit: facets whose lit side faces the eye.
        near: of the viewer, metres.
        far: of the viewer, metres.
        findings: of every variant, the reference first.
        profile: the line across a seam; None where there is none to be had.
        depths: Z along it, (variants, N).
        crops: of every variant a close view of the spot where depth goes most wrong.
        marks: the same with what is wrong in red; None where nothing can be.
    """

    frame: int
    pixels: int
    lit: int
    near: float
    far: float
    findings: tuple[Findings, ...]
    profile: Profile | None
    depths: FloatArray
    crops: tuple[Bytes, ...]
    marks: tuple[Bytes | None, ...]


@dataclass(frozen=True)
class _Bench:
    """What all variants are held against."""

    stage: Stage
    viewer: Viewer
    trial: Trial
    points: SeamPoints
    truth: Buffers
    whole: EyeView
    direct: Float32Array
    close: EyeView
    address: IntArray
    profile: Profile | None
    threads: int


def compare(job: JobFile, options: CompareOptions | None = None) -> Study:
    """Draw one frame of a job by every method and hold each against rays.

    Raises:
        QuiltError: the job cannot be rendered, no facet is lit, or this machine has no Embree.
    """
    options = options or CompareOptions()
    frame = job.frames[0] if options.frame is None else options.frame
    viewers_of(job, [frame])
    stage = set_stage(with_variant(job, REFERENCE)).at(frame)
    viewers = stage.views([frame])[0].viewers
    variants = (REFERENCE, *(v for v in dict.fromkeys(_suiting(stage, options.variants)) if v != REFERENCE))
    threads = options.threads or default_threads()
    options.begin(REFERENCE.name)
    truth, seconds = _drawn(stage, viewers[0], REFERENCE, threads)
    bench = _bench(stage, viewers[0], truth, variants, threads)
    results = [_findings(bench, REFERENCE, truth, seconds)]
    for variant in variants[1:]:
        options.begin(variant.name)
        results.append(_findings(bench, variant, *_drawn(stage, viewers[0], variant, threads)))
    findings, depths, crops, marks = zip(*results, strict=True)
    return Study(
        frame=frame,
        pixels=int(np.count_nonzero(np.append(False, bench.trial.rays.lit)[np.maximum(stage.owners, 0)])),
        lit=int(np.count_nonzero(bench.trial.rays.lit)),
        near=viewers[0].near,
        far=viewers[0].far,
        findings=findings,
        profile=bench.profile,
        depths=np.stack(depths),
        crops=crops,
        marks=marks,
    )


def _suiting(stage: Stage, asked: Sequence[Variant] | None) -> Sequence[Variant]:
    """The variants that are asked for, or all that suit the display.

    Raises:
        JobError: one that is asked for does not.
    """
    if asked is None and not stage.facets.charts:
        return VARIANTS
    chosen = (*VARIANTS, *IMAGED) if asked is None else asked
    problems = {
        variant: method_problems(with_variant(stage.job, variant), stage.facets) for variant in chosen
    }
    if asked is not None:
        raise_all(JobError, [problem for found in problems.values() for problem in found])
    # With curved facets only what is exact, and what makes pictures of them.
    return [variant for variant in chosen if not problems[variant]]


def with_variant(job: JobFile, variant: Variant) -> JobFile:
    """The job by another method, one sample a pixel, with the channels that are compared."""
    render = {"method": variant.method, "depth_bits": variant.bits, "samples": 1}
    return job.model_copy(
        update={
            "render": job.render.model_copy(update=render),
            "output": job.output.model_copy(update={"channels": _CHANNELS}),
        }
    )


def _drawn(stage: Stage, viewer: Viewer, variant: Variant, threads: int) -> tuple[Buffers, dict[str, float]]:
    """The buffers of a variant, and the seconds its stages took."""
    other = replace(stage, job=with_variant(stage.job, variant))
    buffers = new_buffers(other)
    record = draw_frame(other, viewer, buffers, threads)
    return buffers, dict(record.seconds)


def _bench(stage: Stage, viewer: Viewer, truth: Buffers, variants: Sequence[Variant], threads: int) -> _Bench:
    trial = make_trial(stage, viewer, Images("", truth))
    lit = trial.rays.lit
    if not lit.any():
        raise JobError(f"at frame {viewer.frame} no facet is lit: there is nothing to compare")
    whole = whole_view(stage, viewer, lit, threads)
    coarse = next((variant for variant in _COARSE if variant in variants), None)
    close = close_view(stage, whole, _worst(stage, viewer, trial, truth, coarse, threads), threads)
    return _Bench(
        stage,
        viewer,
        trial,
        seam_points(trial, shared_edges(stage.facets), _SEAM_POINTS),
        truth,
        whole,
        direct_picture(stage, viewer, whole, threads),
        close,
        close.addresses(stage),
        best_profile(stage, trial.rays, truth),
        threads,
    )


def _worst(
    stage: Stage, viewer: Viewer, trial: Trial, truth: Buffers, coarse: Variant | None, threads: int
) -> BoolArray:
    """Quilt pixels (pixels,) at which a coarse depth buffer goes wrong."""
    if coarse is None:
        return np.zeros(stage.owners.size, dtype=np.bool_)
    shown, _ = _drawn(stage, viewer, coarse, threads)
    return _mask(stage, difference(stage, trial.rays, trial.target, shown, truth))


def _mask(stage: Stage, found: Difference) -> BoolArray:
    """Quilt pixels (pixels,) that are wrong or lost."""
    mask = np.zeros(stage.owners.size, dtype=np.bool_)
    mask[found.pixel[found.wrong | found.lost]] = True
    return mask


def _findings(
    bench: _Bench, variant: Variant, shown: Buffers, seconds: dict[str, float]
) -> tuple[Findings, FloatArray, Bytes, Bytes | None]:
    """What is found of a variant, its depths along the profile, its close view and that with marks."""
    stage = bench.stage
    found = difference(stage, bench.trial.rays, bench.trial.target, shown, bench.truth)
    mixed = variant.method == "twopass"
    findings = Findings(
        variant=variant,
        image=errors_of(found.light),
        psnr=decibels(found.square),
        depth=errors_of(found.depth),
        wrong=None if mixed else int(np.count_nonzero(found.wrong)),
        lost=None if mixed else int(np.count_nonzero(found.lost)),
        behind=0.0 if mixed else float(found.behind.max(initial=0.0)),
        seams=check_seams(replace(bench.trial, images=Images("", shown)), bench.points),
        seen=seen_against(stage, bench.whole, shown, bench.direct),
        seconds=seconds,
    )
    picture = crop(stage, bench.close, shown)
    mark = None if mixed else marked(bench.close, bench.address, picture, _mask(stage, found))
    depths = np.zeros(0) if bench.profile is None else bench.profile.depths(shown)
    return findings, depths, picture, mark
