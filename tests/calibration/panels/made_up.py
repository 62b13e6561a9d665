"""Sightings of a display without photos: what a perfect detector would find, and noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.calibration.markers import MarkerSet, marker_places, place_markers
from quiltcli.calibration.panels.camera import Camera, project
from quiltcli.calibration.panels.sightings import Sightings
from quiltcli.display import Facets, load_display
from quiltcli.job import load_display_file
from tests.helpers.photos import Pose, camera, looking, moved

MODELS = Path(__file__).parents[3] / "display_models"


@dataclass(frozen=True)
class MadeUp:
    """A display, how it really is, and what photos show of it."""

    facets: Facets
    markers: MarkerSet
    seen: Sightings
    lens: Camera
    turns: np.ndarray
    shifts: np.ndarray


def shipped(name: str) -> Facets:
    return load_display(load_display_file(MODELS / f"{name}.yaml"))


def poses(facets: Facets, views: int, *, inside: bool, rng: np.random.Generator) -> Iterator[Pose]:
    """All the way around a display, or about in the middle of a room."""
    middle, extent = facets.corners.mean(axis=0), np.ptp(facets.corners, axis=0).max()
    for k in range(views):
        a = 2 * np.pi * (k + rng.uniform(-0.2, 0.2)) / views
        if inside:
            eye = middle + extent * np.array((0.3 * np.cos(a), 0.2 * np.sin(3 * a), 0.45 + 0.1 * np.sin(a)))
            at = middle + extent * np.array((0.3 * np.cos(2 * a), 0.3 * np.sin(a), -0.4))
        else:
            eye = middle + 1.5 * extent * np.array((np.cos(a), 0.5 + 0.3 * np.sin(2 * a), np.sin(a)))
            at = middle + 0.1 * extent * rng.uniform(-1, 1, 3)
        yield looking(eye, at, rng.uniform(-0.3, 0.3))


def made_up(
    name: str = "cube5",
    seed: int = 0,
    views: int = 12,
    noise: float = 0.3,
    outliers: int = 0,
    wrong: tuple[float, float] = (0.015, 3.0),
) -> MadeUp:
    """A display whose facets are off by metres and degrees, seen in photos with noise, some grossly wrong."""
    rng = np.random.default_rng(seed)
    facets = shipped(name)
    markers = place_markers(facets)
    turns = np.radians(wrong[1]) * rng.uniform(-1, 1, (facets.count, 3))
    shifts = wrong[0] * rng.uniform(-1, 1, (facets.count, 3))
    turns[0] = shifts[0] = 0
    real, lens = moved(facets, turns, shifts), camera(4000, 3000, 0.75 if name != "cave5" else 0.55)
    places = marker_places(real, markers.markers)
    normal = real.normal[[marker.facet - 1 for marker in markers.markers]]
    photo, marker, pixels = [], [], []
    for number, pose in enumerate(poses(facets, views, inside=name == "cave5", rng=rng)):
        towards = pose.eye - places.mean(axis=1)
        slant = (towards * normal).sum(axis=1) / np.linalg.norm(towards, axis=1)
        for row in np.flatnonzero(slant > 0.3).tolist():
            local = places[row] @ pose.axes.T + pose.shift
            if (local[:, 2] < 0.1).any() or (np.abs(local[:, :2]) > 1.5 * local[:, 2:]).any():
                continue
            at = project(lens, local)
            if (at > 5).all() and (at < np.array(lens.size) - 5).all():
                photo.append(number)
                marker.append(row)
                pixels.append(at + noise * rng.normal(size=(4, 2)))
    found = np.array(pixels)
    for row in rng.choice(len(found), outliers, replace=False):
        found[row, rng.integers(4)] += rng.choice((-1, 1), 2) * rng.uniform(8, 60, 2)
    names = tuple(f"photo_{k + 1:02}.jpg" for k in range(views))
    seen = Sightings(names, lens.size, np.array(photo), np.array(marker), found)
    return MadeUp(facets, markers, seen, lens, turns, shifts)
