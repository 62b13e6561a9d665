"""Small jobs from arrays, rendered and held against rays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.analysis.verify import Verdict, VerifyOptions, verify_images
from quiltcli.analysis.verify.frame import make_trial
from quiltcli.analysis.verify.images import Images, draw_images
from quiltcli.analysis.verify.pixels import Trial
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.job import JobFile, load_job
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.viewer import Viewer
from tests.helpers.in_memory import CUBE, CUBE_FACES, icosphere

EVERY = VerifyOptions(everything=True, threads=1)


def obj(vertices: object, polygons: object) -> str:
    points = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices, float).tolist())
    faces = "".join("f " + " ".join(str(k + 1) for k in polygon) + "\n" for polygon in polygons)
    return points + faces


def write_job(
    folder: Path,
    display: tuple[object, object],
    scene: tuple[object, object],
    eye: object,
    at: object = (0, 0, 0),
    density: float = 40,
    near: float = 0.05,
    far: float = 100,
    more: str = "",
    side: str = "front",
) -> JobFile:
    """A job of one frame; `display` and `scene` are vertices and polygons."""
    (folder / "display.obj").write_text(obj(*display))
    (folder / "scene.obj").write_text(obj(*scene))
    (folder / "display.yaml").write_text(
        "quilt_display: 1\nmesh: display.obj\n"
        f"viewing_side: {side}\nresolution: {{pixels_per_metre: {density}}}\n"
    )
    eye, at = (list(map(float, point)) for point in (eye, at))
    up = [0, 1, 0] if abs(eye[0] - at[0]) + abs(eye[2] - at[2]) > 1e-3 else [0, 0, 1]
    (folder / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.obj\nframes: 1\nviewer:\n"
        f"  near: {near!r}\n  far: {far!r}\n  path:\n    keyframes:\n"
        f"    - {{frame: 1, position: {eye}, look_at: {at}, up: {up}}}\n{more}"
    )
    return load_job(folder / "job.yaml")


def ball(radius: float = 0.7, splits: int = 2) -> tuple[FloatArray, IntArray]:
    v, t = icosphere(splits)
    return v * radius, t


def cube_job(folder: Path, more: str = "", **keys: object) -> JobFile:
    """A ball in a cube of side 2, from a place that sees three faces."""
    return write_job(folder, (CUBE, CUBE_FACES), ball(), (2.1, 1.7, 2.9), more=more, **keys)


@dataclass(frozen=True)
class Shot:
    """A frame drawn in memory, to be spoiled and verified."""

    stage: Stage
    viewer: Viewer
    images: Images

    @property
    def trial(self) -> Trial:
        return make_trial(self.stage, self.viewer, self.images)

    @property
    def covered(self) -> IntArray:
        return np.flatnonzero(np.isfinite(self.images.channels["Z"]) & (self.stage.owners > 0))

    @property
    def empty(self) -> IntArray:
        """Pixels of lit facets that show nothing."""
        lit = np.append(False, self.trial.rays.lit)[np.maximum(self.stage.owners, 0)]
        return np.flatnonzero(lit & ~np.isfinite(self.images.channels["Z"]))

    def spoiled(self, pixel: object, z: object = None, triangle: int | None = None) -> Shot:
        """The same with other values at some pixels; `triangle` counts from 0."""
        channels = {name: flat.copy() for name, flat in self.images.channels.items()}
        if z is not None:
            channels["Z"][pixel] = z
        if triangle is not None:
            channels["triangle"][pixel] = triangle + 1
        return replace(self, images=Images(self.images.words, channels))

    def without_triangles(self) -> Shot:
        return replace(self, images=Images(self.images.words, {"Z": self.images.channels["Z"]}))

    def verify(self, options: VerifyOptions = EVERY) -> Verdict:
        return verify_images(self.stage, self.viewer, self.images, options)


def shoot(job: JobFile) -> Shot:
    stage = set_stage(job)
    view = stage.views(list(job.frames))[0]
    return Shot(stage, view.viewer, draw_images(stage, view, threads=1))


def found(verdict: Verdict) -> dict[str, int]:
    """Every kind of fault that was found, with its count; bleed's with a mark."""
    kinds = {kind: n for kind in ("crack", "extra", "stray", "triangle", "depth", "alpha")
             if (n := verdict.inside[kind])}  # fmt: skip
    kinds |= {f"bleed {kind}": n for kind in ("crack", "extra", "stray", "triangle", "depth", "alpha")
              if (n := verdict.bleed[kind])}  # fmt: skip
    kinds |= {"seam": verdict.seams.failures} if verdict.seams.failures else {}
    return kinds | ({"outside": verdict.outside} if verdict.outside else {})
