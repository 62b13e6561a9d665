"""Attributes of the images: when, from where, by which job and program."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import numpy as np

from quiltcli.errors import OutputError
from quiltcli.formats.exr.digest import is_sealed
from quiltcli.formats.exr.image import read_header
from quiltcli.geometry import FloatArray
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer


def page_attributes(view: View, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    """Attributes of a page of a view: the first viewer's, and of several what they all are."""
    attributes = _attributes(view, view.viewer, fps, job_sha, version)
    if view.viewer.name:
        attributes["quilt:viewers"] = json.dumps([_told(viewer) for viewer in view.viewers])
    return attributes


def viewer_attributes(view: View, facet: int, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    """Attributes of an image that shows one facet (1-based id) alone: those of the viewer it belongs to."""
    viewer = view.viewer_of(facet)
    name = {"quilt:viewer": viewer.name} if viewer.name and viewer.sees(facet) else {}
    return _attributes(view, viewer, fps, job_sha, version) | name


def _told(viewer: Viewer) -> dict[str, object]:
    """A viewer for programs, in numbers that read back exactly."""
    facets = None if viewer.facets is None else list(viewer.facets)
    return {"name": viewer.name, "facets": facets, **_pose(viewer)}


def _pose(viewer: Viewer) -> dict[str, object]:
    """Where a viewer is and what near and far are, in numbers that read back exactly."""
    places = {"eye": viewer.eye, "look": viewer.look, "up": viewer.up, "head": viewer.head}
    known = {name: place.tolist() for name, place in places.items() if place is not None}
    return {**known, "near": viewer.near, "far": viewer.far}


def _attributes(view: View, viewer: Viewer, fps: Fraction, job_sha: str, version: str) -> dict[str, object]:
    attributes: dict[str, object] = {
        "framesPerSecond": Fraction(fps),
        "quilt:frame": int(view.frame),
        "quilt:eye": np.asarray(viewer.eye, dtype=np.float32),
        "quilt:look": np.asarray(viewer.look, dtype=np.float32),
        "quilt:up": np.asarray(viewer.up, dtype=np.float32),
        "quilt:near": float(viewer.near),
        "quilt:far": float(viewer.far),
        "quilt:depth": viewer.depth,
        "quilt:pose": json.dumps(_pose(viewer)),
        "quilt:job": job_sha,
        "quilt:version": version,
    }
    if viewer.head is not None:
        attributes["quilt:head"] = np.asarray(viewer.head, dtype=np.float32)
    if view.eye:
        # As OpenEXR has it for views in files of their own; parts of one file have no `multiView`.
        attributes |= {"view": view.eye} | ({} if view.in_parts else {"multiView": [view.eye]})
    return attributes


def facet_attributes(facet_id: int, facet_from_world: FloatArray) -> dict[str, object]:
    """What a facet image adds: its 1-based id and its (3, 4) map, written so that it reads back exactly."""
    numbers = " ".join(repr(float(number)) for number in np.asarray(facet_from_world).reshape(12))
    return {"quilt:facet": int(facet_id), "quilt:facet_from_world": numbers}


def surface_attributes(facet_id: int, record: str) -> dict[str, object]:
    """What the image of a curved facet adds: its 1-based id and its surface or projection, as JSON."""
    return {"quilt:facet": int(facet_id), "quilt:surface": record}


def is_complete(path: Path, job_sha: str, frame: int) -> bool:
    """Whether `path` is an image of this `frame` by the job with that hash, and no bit of it wrong."""
    if not is_sealed(path):
        return False
    try:
        attributes = read_header(path).attributes
    except OutputError:
        return False
    return attributes.get("quilt:job") == job_sha and attributes.get("quilt:frame") == frame
