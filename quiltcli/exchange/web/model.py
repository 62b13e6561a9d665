"""The display with its images, the scene as ghost, the viewer and its path: as one binary glTF."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from quiltcli import __version__
from quiltcli.exchange.web.ghost import Ghost
from quiltcli.exchange.web.glb import CLAMP, INDICES, LINE_STRIP, LINEAR, NEAREST, TRIANGLES, VERTICES, Gltf
from quiltcli.exchange.web.mesh import DisplayMesh
from quiltcli.exchange.web.textures import Picture
from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.viewer.viewer import Viewer

_DARK = [0.03, 0.03, 0.03, 1.0]
_GHOST = 0.25  # how much of the ghost is there


def model(
    mesh: DisplayMesh,
    lit: BoolArray,
    pages: Sequence[Picture],
    spans: IntArray,
    viewer: Viewer,
    fov: float,
    path: FloatArray,
    ghost: Ghost | None,
) -> bytes:
    """A GLB of one frame, in world metres.

    Args:
        mesh: the display.
        lit: (F,) facets that show their images.
        pages: a picture a page.
        spans: (G, 2) quilt pixels a picture spans.
        viewer: the camera at the viewer's eye.
        fov: its degrees from top to bottom.
        path: (n, 3) places of the eye, world metres.
        ghost: the scene, or None.
    """
    gltf = Gltf(f"quilt {__version__}")
    place = mesh.centre.tolist()
    shape = _display(gltf, mesh, lit, pages, spans)
    nodes = [gltf.add("nodes", name="display", mesh=shape, translation=place)]
    if ghost is not None:
        nodes.append(gltf.add("nodes", name="scene", mesh=_ghost(gltf, ghost), translation=place))
    nodes.append(_eye(gltf, viewer, fov))
    if len(path) > 1:
        nodes.append(gltf.add("nodes", name="path", mesh=_path(gltf, path - mesh.centre), translation=place))
    return gltf.bytes(nodes)


def _display(gltf: Gltf, mesh: DisplayMesh, lit: BoolArray, pages: Sequence[Picture], spans: IntArray) -> int:
    """The facets: by page where they are lit, grey where they are not and from behind."""
    sampler = gltf.add("samplers", magFilter=NEAREST, minFilter=LINEAR, wrapS=CLAMP, wrapT=CLAMP)
    corner_page = np.repeat(mesh.page, np.diff(mesh.start))
    # A picture's first row is at v = 0 in this format, as in a quilt.
    uv = np.where(corner_page[:, None] >= 0, mesh.quilt / spans[corner_page], 0).astype(np.float32)
    plain = {"POSITION": gltf.array(mesh.position, VERTICES, bounds=True)}
    textured = {**plain, "TEXCOORD_0": gltf.array(uv, VERTICES)}
    shows = lit[mesh.facet]
    parts = []
    for page, picture in enumerate(pages):
        triangles = mesh.triangles[shows & (mesh.page[mesh.facet] == page)]
        if not len(triangles):
            continue
        texture = gltf.add("textures", sampler=sampler, source=gltf.image(picture))
        material = gltf.unlit(
            f"page {page + 1}",
            pbrMetallicRoughness={"baseColorTexture": {"index": texture}},
            doubleSided=mesh.both_sides,
        )
        parts.append((triangles, textured, material))
    dark = gltf.unlit("dark", pbrMetallicRoughness={"baseColorFactor": _DARK}, doubleSided=True)
    parts.append((mesh.triangles[~shows], plain, dark))
    if not mesh.both_sides:
        back = gltf.unlit("back", pbrMetallicRoughness={"baseColorFactor": _DARK})
        parts.append((mesh.triangles[shows][:, ::-1], plain, back))
    primitives = [
        {
            "attributes": attributes,
            "indices": gltf.array(triangles.astype(np.uint32).reshape(-1), INDICES),
            "material": material,
            "mode": TRIANGLES,
        }
        for triangles, attributes, material in parts
        if len(triangles)
    ]
    return gltf.add("meshes", name="display", primitives=primitives)


def _ghost(gltf: Gltf, ghost: Ghost) -> int:
    """The scene, translucent."""
    color = np.full((len(ghost.color), 4), 255, dtype=np.uint8)
    color[:, :3] = np.rint(ghost.color * 255)
    attributes = {
        "POSITION": gltf.array(ghost.position, VERTICES, bounds=True),
        "COLOR_0": gltf.array(color, VERTICES, unit=True),
    }
    material = gltf.add(
        "materials",
        name="ghost",
        pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, _GHOST], "metallicFactor": 0},
        alphaMode="BLEND",
        doubleSided=True,
    )
    indices = gltf.array(ghost.triangles.astype(np.uint32).reshape(-1), INDICES)
    primitive = {"attributes": attributes, "indices": indices, "material": material, "mode": TRIANGLES}
    return gltf.add("meshes", name="scene", primitives=[primitive])


def _eye(gltf: Gltf, viewer: Viewer, fov: float) -> int:
    """A camera where the eye is."""
    perspective = {"yfov": math.radians(fov), "aspectRatio": 4 / 3, "znear": viewer.near, "zfar": viewer.far}
    camera = gltf.add("cameras", type="perspective", perspective=perspective)
    matrix = np.eye(4)
    matrix[:3, :3] = viewer.camera_from_world.T
    matrix[:3, 3] = viewer.eye
    return gltf.add("nodes", name="viewer's eye", camera=camera, matrix=matrix.T.reshape(-1).tolist())


def _path(gltf: Gltf, path: FloatArray) -> int:
    """The viewer's way, as a line."""
    line = gltf.unlit("path", pbrMetallicRoughness={"baseColorFactor": [1.0, 0.6, 0.1, 1.0]})
    attributes = {"POSITION": gltf.array(path.astype(np.float32), VERTICES, bounds=True)}
    primitive = {"attributes": attributes, "material": line, "mode": LINE_STRIP}
    return gltf.add("meshes", name="path", primitives=[primitive])
