"""The display as triangles that rays can meet: facets cut in triangles, curved ones as nets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.charts.meet import meet
from quiltcli.charts.rim import net_to_the_rim
from quiltcli.charts.shapes import turned
from quiltcli.display import Facets, triangulate
from quiltcli.geometry import FloatArray, Int32Array, cross, dot
from quiltcli.viewer.viewer import Viewer


@dataclass(frozen=True)
class Skin:
    """T triangles of V corners that stand for a display.

    Attributes:
        vertices: (V, 3) world metres.
        triangles: (T, 3).
        facet: (T,) 0-based.
        pixels: (V, 2) facet pixels of curved facets' corners.
        facets: the display.
        viewer: for whom it is; a projection stands about this eye.
    """

    vertices: FloatArray
    triangles: Int32Array
    facet: Int32Array
    pixels: FloatArray
    facets: Facets
    viewer: Viewer

    def facet_of(self, met: Int32Array) -> Int32Array:
        """The facets (P,) of triangles (P,), −1 for none."""
        return np.concatenate((self.facet, [-1])).astype(np.int32)[np.where(met < len(self.facet), met, -1)]

    def lit_points(self) -> FloatArray:
        """Corners (M, 3) of curved facets that the viewer sees lit, world metres."""
        found = [np.zeros((0, 3))]
        for row, chart in enumerate(self.facets.charts):
            if chart is not None and chart.stands:
                mine = np.unique(self.triangles[self.facet == row])
                x, y = self.pixels[mine].T
                found.append(self.vertices[mine][chart.lit(x, y, self.vertices[mine].T, self.viewer.eye)])
        return np.concatenate(found)

    def curved_places(self, met: Int32Array, rays: FloatArray, eye: FloatArray) -> FloatArray:
        """Facet pixels (2, P) where rays (3, P) from an eye meet curved facets, in triangles `met` (P,)."""
        a, b, c = (self.vertices[self.triangles[met, k]] - eye for k in range(3))
        ray = rays.T
        weights = np.stack([dot(cross(p, q), ray) for p, q in ((b, c), (c, a), (a, b))])
        total = weights.sum(axis=0)
        weights = np.divide(weights, total, out=np.full(weights.shape, 1 / 3), where=total != 0)
        guess = np.einsum("kp,pkc->cp", weights, self.pixels[self.triangles[met]])
        result: FloatArray = guess.copy()
        for facet, chart in enumerate(self.facets.charts):
            mine = np.flatnonzero(self.facet[met] == facet)
            if chart is None or not mine.size:
                continue
            from_viewer, origin = rays[:, mine], eye
            if not chart.stands:
                origin = eye - self.viewer.eye
                if chart.follows == "view":
                    turn = self.viewer.camera_from_world
                    from_viewer, origin = turned(turn, from_viewer), turn @ origin
            result[:, mine] = meet(chart, origin, from_viewer, guess[:, mine])
        return result


def skin_of(facets: Facets, viewer: Viewer) -> Skin:
    """The skin of a display, from a viewer's eye."""
    triangles, facet = triangulate(facets)
    if not facets.charts:
        none = np.zeros((len(facets.corners), 2))
        return Skin(facets.corners, triangles, facet, none, facets, viewer)
    flat = ~facets.curved[facet]
    vertices, pixels = [facets.corners], [np.zeros((len(facets.corners), 2))]
    faces, owner = [triangles[flat]], [facet[flat]]
    count = len(facets.corners)
    for row, chart in enumerate(facets.charts):
        if chart is None or not facets.enabled[row]:
            continue
        points, places, cells = net_to_the_rim(chart)
        if not chart.stands:
            turn = viewer.camera_from_world.T if chart.follows == "view" else np.eye(3)
            points = turned(turn, points.T).T + viewer.eye
        vertices.append(points)
        pixels.append(places)
        faces.append((cells + count).astype(np.int32))
        owner.append(np.full(len(cells), row, dtype=np.int32))
        count += len(points)
    skin = Skin(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(owner),
        np.concatenate(pixels),
        facets,
        viewer,
    )
    used = np.unique(skin.triangles)
    # Corners that stand for curved facets alone are nowhere.
    number = np.zeros(count, dtype=np.int32)
    number[used] = np.arange(used.size)
    return replace(
        skin, vertices=skin.vertices[used], pixels=skin.pixels[used], triangles=number[skin.triangles]
    )
