"""Attributes of the images: when, from where, by which job and program."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

from quiltcli.errors import OutputError
from quiltcli.formats.exr.image import read_header
from quiltcli.geometry import FloatArray
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer


def page_attributes(view: View, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    """Attributes of a page of a view: the first viewer's."""
    return _attributes(view, view.viewer, fps, job_sha, version)


def viewer_attributes(view: View, facet: int, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    """Attributes of an image that shows one facet (1-based id) alone: those of the viewer it belongs to."""
    return _attributes(view, view.viewer_of(facet), fps, job_sha, version)


def _attributes(view: View, viewer: Viewer, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    return {
        "framesPerSecond": Fraction(fps),
        "quilt:frame": int(view.frame),
        "quilt:eye": np.asarray(viewer.eye, dtype=np.float32),
        "quilt:look": np.asarray(viewer.look, dtype=np.float32),
        "quilt:up": np.asarray(viewer.up, dtype=np.float32),
        "quilt:near": float(viewer.near),
        "quilt:far": float(viewer.far),
        "quilt:depth": viewer.depth,
        "quilt:job": job_sha,
        "quilt:version": version,
    }


def facet_attributes(facet_id: int, facet_from_world: FloatArray) -> dict[str, object]:
    """What a facet image adds: its 1-based id and its (3, 4) map, written so that it reads back exactly."""
    numbers = " ".join(repr(float(number)) for number in np.asarray(facet_from_world).reshape(12))
    return {"quilt:facet": int(facet_id), "quilt:facet_from_world": numbers}


def is_complete(path: Path, job_sha: str, frame: int) -> bool:
    """Whether `path` is a whole image of this `frame` made by the job with that hash.

    The structure of the file is checked to its last byte; no pixel is decoded.
    """
    try:
        attributes = read_header(path).attributes
    except OutputError:
        return False
    return attributes.get("quilt:job") == job_sha and attributes.get("quilt:frame") == frame
