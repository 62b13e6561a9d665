"""glTF as parts of a scene: primitives placed, posed and given their surfaces; lights of the file.

A light of the file is photometric (lux, candela) and the scene's are radiometric (W/m², W/sr): one is
divided by 683 lm/W, the greatest luminous efficacy there is and the factor that exporters multiply by.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.gltf import Gltf, Material, read_gltf
from quiltcli.formats.gltf.animation import chosen_clips
from quiltcli.formats.gltf.model import Clip
from quiltcli.formats.gltf.posing import (
    Piece,
    Placed,
    Pose,
    contested,
    pieces,
    placed,
    placed_triangles,
    pose_at,
    rest_pose,
)
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, normalized
from quiltcli.scene.importers.model import NO_SUBDIVISION, FileLight, Playing, triple
from quiltcli.scene.importers.part import Part
from quiltcli.scene.materials import Surface, Texture
from quiltcli.scene.textures.picture import Picture

LUMENS_PER_WATT = 683.0
_SLOTS = {
    "color": "baseColorTexture",
    "metallic_roughness": "metallicRoughnessTexture",
    "normal": "normalTexture",
    "occlusion": "occlusionTexture",
    "emission": "emissiveTexture",
}
_ROLES = {
    "color": (("color", ""),),
    "metallic_roughness": (("roughness", "g"), ("metallic", "b")),
    "normal": (("normal", ""),),
    "occlusion": (("occlusion", "r"),),
    "emission": (("emission", ""),),
}


@dataclass(frozen=True, eq=False)
class GltfModel:
    """A glTF file, ready to be posed at any time.

    Attributes:
        gltf: the file.
        pieces: its primitives, one for each part.
        mirrored: (copies,) of each piece, those that the pose at rest turns inside out; their triangles
            are wound the other way at every time.
    """

    gltf: Gltf
    pieces: tuple[Piece, ...]
    mirrored: tuple[BoolArray, ...]

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the animations."""
        return tuple(clip.name for clip in self.gltf.clips)

    @property
    def notices(self) -> tuple[str, ...]:
        """What the file holds that was left out."""
        return self.gltf.notices

    def chosen(self, playing: Playing) -> tuple[Clip, ...]:
        """The animations that are played.

        Raises:
            MeshError: there is none of a name that is asked for.
        """
        return chosen_clips(str(self.gltf.path), self.gltf.clips, playing.clips)

    def check(self, playing: Playing) -> None:
        """Raise a `MeshError` unless the file has the animations that are asked for."""
        self.chosen(playing)

    def subdivided(self, levels: int) -> GltfModel:
        """Nothing: there are no surfaces to refine."""
        raise MeshError(Problem(NO_SUBDIVISION, str(self.gltf.path)))

    def contested(self, playing: Playing) -> int:
        """Number of channels that are not played, as a clip before theirs moves the same thing."""
        return contested(self.chosen(playing))

    def form(self, seconds: float | None, playing: Playing | None) -> Hashable:
        """Nothing: triangles are the same at every time."""
        return None

    def hidden(self, seconds: float, playing: Playing) -> bool:
        """Whatever a scene shows, it shows at every time."""
        return False

    def parts(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[Part, ...]:
        """A part for each primitive, all its copies in it, at rest or at a time."""
        return gltf_parts(self, seconds, playing)

    def pose(self, seconds: float, playing: Playing) -> tuple[FloatArray, FloatArray]:
        """Vertices and normals (V, 3) of all parts after one another, at a time of the animations."""
        return pose(self, seconds, playing)

    def lights(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[FileLight, ...]:
        """The lights of the file at rest, or at a time of its animations."""
        return gltf_lights(self, seconds, playing)


def read_gltf_model(path: Path) -> GltfModel:
    """Read a glTF file and look at the headers of the images that its materials use.

    Raises:
        MeshError: the file is wrong, or an image is missing, unreadable or too large.
    """
    gltf = read_gltf(path)
    for index, material in sorted(gltf.materials.items()):
        name = repr(material.name[:40]) if material.name else str(index)
        for slot, use in material.textures.items():
            gltf.images.size(use.image, f"material {name}, {_SLOTS[slot]}")
    shown = pieces(gltf)
    rest = rest_pose(gltf)
    return GltfModel(gltf, shown, tuple(placed(gltf, piece, rest).mirrored for piece in shown))


def read_gltf_parts(
    path: Path, time: float | None = None, clips: str | Sequence[str] = "all"
) -> tuple[Part, ...]:
    """The parts of a file at rest, or at a time (seconds) of its animations.

    Raises:
        MeshError: the file is wrong, or has no animation of that name.
    """
    playing = Playing(clips if isinstance(clips, str) else tuple(clips))
    return gltf_parts(read_gltf_model(path), time, playing)


def gltf_parts(
    model: GltfModel, time: float | None = None, playing: Playing | None = None
) -> tuple[Part, ...]:
    """A part for each primitive, all its copies in it, at rest or at a time."""
    at = _pose(model, time, playing)
    return tuple(
        _part(model.gltf, piece, placed(model.gltf, piece, at), mirrored)
        for piece, mirrored in zip(model.pieces, model.mirrored, strict=True)
    )


def pose(model: GltfModel, seconds: float, playing: Playing | None = None) -> tuple[FloatArray, FloatArray]:
    """Vertices and normals (V, 3) of all parts after one another, at a time of the animations.

    Their order is that of `gltf_parts`, at every time. Normals are of any length, zero where the file
    gives none.
    """
    at = _pose(model, seconds, playing)
    found = [placed(model.gltf, piece, at) for piece in model.pieces]
    if not found:
        return np.empty((0, 3)), np.empty((0, 3))
    return (
        np.concatenate([one.vertices for one in found]),
        np.concatenate(
            [np.zeros_like(one.vertices) if one.normals is None else one.normals for one in found]
        ),
    )


def _pose(model: GltfModel, time: float | None, playing: Playing | None) -> Pose:
    if time is None:
        return rest_pose(model.gltf)
    playing = playing or Playing()
    return pose_at(model.gltf, model.chosen(playing), time, playing.after)


def _part(gltf: Gltf, piece: Piece, there: Placed, mirrored: BoolArray) -> Part:
    primitive = piece.primitive
    colors: Float32Array | None = None
    opacities: Float32Array | None = None
    if primitive.colors is not None:
        colors = np.tile(primitive.colors[:, :3], (piece.copies, 1))
        if (primitive.colors[:, 3] < 1).any():
            opacities = np.tile(primitive.colors[:, 3], piece.copies)
    return Part(
        vertices=there.vertices,
        triangles=placed_triangles(piece, mirrored),
        normals=there.normals,
        colors=colors,
        surface=surface_of(gltf.materials[primitive.material], gltf),
        uv=_v_up(primitive.uv[0], piece.copies),
        uv1=_v_up(primitive.uv[1], piece.copies),
        material=gltf.materials[primitive.material].name,
        opacities=opacities,
    )


def _v_up(uv: FloatArray | None, copies: int) -> FloatArray | None:
    """Texture coordinates of all copies with v up; in the file v goes down."""
    return None if uv is None else np.tile(np.stack((uv[:, 0], 1 - uv[:, 1]), axis=1), (copies, 1))


def surface_of(material: Material, gltf: Gltf | None = None) -> Surface:
    """The surface of a material; with its textures where the file that holds them is given."""
    return Surface(
        color=material.color[:3],
        metallic=material.metallic,
        roughness=material.roughness,
        emission=(0.0, 0.0, 0.0) if material.unlit else material.emission,
        unlit=material.unlit,
        opacity=material.color[3],
        alpha=material.alpha_mode.lower(),
        cutoff=material.cutoff,
        double_sided=material.double_sided,
        textures=() if gltf is None else tuple(_textures(gltf, material)),
    )


def _textures(gltf: Gltf, material: Material) -> Iterator[Texture]:
    """The textures of a material by role; one picture holds roughness (green) and metal (blue)."""
    for slot, use in material.textures.items():
        if material.unlit and slot != "color":
            continue
        wrap_u, wrap_v = use.wrap
        for role, channel in _ROLES[slot]:
            yield Texture(
                role=role,
                picture=Picture(str(gltf.path), gltf.images, use.image),
                matrix=use.matrix,
                uv_set=use.uv_set,
                wrap=(wrap_u, wrap_v),
                strength=use.strength,
                channel=channel,
                use=f"material {_name(material)}, {_SLOTS[slot]}",
            )


def _name(material: Material) -> str:
    return repr(material.name[:40]) if material.name else material.path


def gltf_lights(
    model: GltfModel, time: float | None = None, playing: Playing | None = None
) -> tuple[FileLight, ...]:
    """The lights of the file at rest, or at a time of its animations."""
    if not model.gltf.lights:
        return ()
    return tuple(_lights(model.gltf, _pose(model, time, playing).world))


def _lights(gltf: Gltf, world: FloatArray) -> Iterator[FileLight]:
    for light in gltf.lights:
        place = world[light.node]
        # A light shines along its node's -Z.
        red, green, blue = (part * light.intensity / LUMENS_PER_WATT for part in light.color)
        yield FileLight(
            kind=light.kind,
            position=triple(place[:3, 3]),
            direction=triple(normalized(-place[:3, 2])),
            color=(red, green, blue),
            reach=light.reach,
            cone=(light.inner, light.outer),
        )
