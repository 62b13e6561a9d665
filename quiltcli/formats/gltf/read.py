"""Read a glTF file: the scene it shows, and what of it is left out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import counted
from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.animation import read_clips
from quiltcli.formats.gltf.compression import DRACO, MESHOPT
from quiltcli.formats.gltf.container import Container, read_container
from quiltcli.formats.gltf.images import Images
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.lights import LIGHTS, read_lights
from quiltcli.formats.gltf.materials import BASISU, SPECULAR, STRENGTH, TRANSFORM, UNLIT, WEBP, read_material
from quiltcli.formats.gltf.model import Gltf, Material, Primitive, Shape, Skin
from quiltcli.formats.gltf.nodes import INSTANCING, instances, read_nodes
from quiltcli.formats.gltf.primitives import TRIANGLES, mode_of, read_primitive, triangle_count

MOST_TRIANGLES = 2**26
MOST_PIECES = 2**20
_QUANTIZATION = "KHR_mesh_quantization"
READ = (
    *(DRACO, MESHOPT, INSTANCING, _QUANTIZATION, LIGHTS),
    *(UNLIT, STRENGTH, SPECULAR, TRANSFORM, WEBP),
)
# These are spoken of where they stand, or say nothing that is to be seen.
_SPOKEN_OF = ("KHR_animation_pointer", "KHR_xmp_json_ld", "KHR_xmp")


def read_gltf(path: Path | str) -> Gltf:
    """Read a `.gltf` or `.glb` file.

    What the scene does not use is not looked at, and may be broken. Images are read later.

    Raises:
        MeshError: the file is no glTF 2.0, needs an extension that is not read, or is broken where
            the scene uses it; with the file and the path of the value in the document.
    """
    container = read_container(Path(path))
    return _Reader(container, Accessors(container)).read()


@dataclass(eq=False)
class _Reader:
    """What has been read so far."""

    container: Container
    accessors: Accessors
    meshes: dict[int, tuple[Primitive, ...]] = field(default_factory=dict)
    skins: dict[int, Skin] = field(default_factory=dict)
    materials: dict[int, Material] = field(default_factory=dict)
    undrawn: int = 0
    left_over: int = 0

    @property
    def json(self) -> Json:
        """The document."""
        return self.container.json

    def read(self) -> Gltf:
        """The scene."""
        self._check_required()
        nodes = read_nodes(self.json)
        entries = self.json["nodes"]
        drawn = [int(node) for node in nodes.drawn]
        showing = [node for node in drawn if entries.at(node).has("mesh")]
        self._check_size(showing)
        shapes = tuple(self._shape(node, len(nodes.parent)) for node in showing)
        clips, other_channels = read_clips(self.json, self.accessors)
        found_lights = read_lights(self.json, drawn)
        cameras = sum(entries.at(node).has("camera") for node in drawn)
        return Gltf(
            path=self.container.path,
            nodes=nodes,
            shapes=shapes,
            meshes=self.meshes,
            skins=self.skins,
            materials=self.materials,
            lights=found_lights,
            clips=clips,
            images=Images(self.container, self.accessors),
            notices=tuple(self._notices(cameras, other_channels)),
            cameras=cameras,
        )

    def _check_required(self) -> None:
        """Stop at what the file cannot be understood without."""
        for item in self.json["extensionsRequired"].items():
            name = item.text()
            if name == BASISU:
                raise item.error(f"needs {name}: KTX2 images are not read (export them as PNG or JPEG)")
            if name not in READ:
                raise item.error(f"needs {name[:60]}, which is not read")

    def _check_size(self, showing: Sequence[int]) -> None:
        """Count before anything is built: a small file can ask for very much."""
        sizes: dict[int, tuple[int, int]] = {}
        triangles = pieces = 0
        nodes, meshes = self.json["nodes"], self.json["meshes"]
        known = meshes.length()
        for node in showing:
            entry = nodes.at(node)
            mesh = entry["mesh"].index(known, "mesh")
            if mesh not in sizes:
                sizes[mesh] = self._mesh_size(meshes.at(mesh))
            triangles += self._instance_count(entry) * sizes[mesh][0]
            pieces += sizes[mesh][1]
        for count, most, what in (
            (triangles, MOST_TRIANGLES, "triangles"),
            (pieces, MOST_PIECES, "pieces of meshes"),
        ):
            if count > most:
                raise self.json["nodes"].error(f"show {count:,} {what} (expected at most {most:,})")

    def _instance_count(self, entry: Json) -> int:
        """How often a node shows its mesh, by what it says."""
        if not entry.has("extensions"):
            return 1
        attributes = entry.extension(INSTANCING)["attributes"]
        return max((self.accessors.count(attributes[name]) for name in attributes.names()), default=1)

    def _mesh_size(self, mesh: Json) -> tuple[int, int]:
        """Vertices or triangles of a mesh, whichever are more, and primitives."""
        found = []
        for item in mesh["primitives"].items():
            position = item["attributes"]["POSITION"]
            if mode_of(item) < TRIANGLES or not position:
                continue
            found.append(max(triangle_count(item, self.accessors), self.accessors.count(position)))
            if found[-1] > MOST_TRIANGLES:
                raise item.error(
                    f"has {found[-1]:,} vertices or triangles (expected at most {MOST_TRIANGLES:,})"
                )
        return sum(found), len(found)

    def _shape(self, node: int, nodes: int) -> Shape:
        """The mesh of a node; each mesh, skin and material is read once."""
        entry = self.json["nodes"].at(node)
        mesh = int(entry["mesh"].value)
        if mesh not in self.meshes:
            self.meshes[mesh] = tuple(self._primitives(self.json["meshes"].at(mesh)))
        skin = -1
        if entry["skin"]:
            skin = entry["skin"].index(self.json["skins"].length(), "skin")
            if skin not in self.skins:
                self.skins[skin] = _read_skin(self.json["skins"].at(skin), self.accessors, nodes)
            _check_joints(self.meshes[mesh], len(self.skins[skin].joints), self.json)
        weights = entry["weights"] if entry["weights"] else self.json["meshes"].at(mesh)["weights"]
        values = weights.numbers(weights.length(), ())
        targets = max((len(primitive.moved) for primitive in self.meshes[mesh]), default=0)
        if values and len(values) != targets:
            raise weights.error(f"{len(values)} weights for {targets} morph targets")
        return Shape(node, mesh, skin, np.array(values or (0.0,) * targets), instances(entry, self.accessors))

    def _primitives(self, mesh: Json) -> Iterator[Primitive]:
        """The primitives of triangles; points and lines are counted."""
        for item in mesh["primitives"].items():
            if mode_of(item) < TRIANGLES:
                self.undrawn += 1
                continue
            primitive = read_primitive(item, self.accessors, self.json["materials"].length())
            if primitive.material not in self.materials:
                self.materials[primitive.material] = self._material(primitive.material)
            if mode_of(item) == TRIANGLES and not item["indices"]:
                self.left_over += bool(len(primitive.positions) % 3)
            elif mode_of(item) == TRIANGLES:
                self.left_over += bool(self.accessors.count(item["indices"]) % 3)
            yield primitive

    def _material(self, index: int) -> Material:
        if index < 0:
            return Material()
        return read_material(self.json, self.json["materials"].at(index))

    def _notices(self, cameras: int, other_channels: int) -> Iterator[str]:
        """What the file holds and nothing is made of."""
        if self.undrawn:
            yield f"{counted(self.undrawn, 'primitive')} of points or lines left out"
        if self.left_over:
            yield f"{counted(self.left_over, 'primitive')} with corners left over after the last triangle"
        if cameras:
            yield f"{counted(cameras, 'camera')} left out"
        if other_channels:
            yield f"{counted(other_channels, 'animation channel')} left out, which move no node"
        if self.container.repeated:
            yield f"the key {self.container.repeated[0][:40]!r} stands twice in one object (the last counts)"
        said = set(READ) | set(_SPOKEN_OF)
        for name, users in self._material_extensions().items():
            said.add(name)
            yield f"{name[:60]} is not drawn ({_listed(users)})"
        if users := self._colored_layers():
            yield f"{SPECULAR} is drawn by its specularFactor alone ({_listed(users)})"
        for item in self.json["extensionsUsed"].items():
            if item.text() not in said:
                said.add(item.text())
                yield f"the extension {item.text()[:60]} is not read"

    def _colored_layers(self) -> list[str]:
        """Names of shown materials whose layer has a colour or pictures."""
        found = []
        for index, material in sorted(self.materials.items()):
            if index >= 0:
                layer = self.json["materials"].at(index).extension(SPECULAR)
                if layer and set(layer.names()) - {"specularFactor", "extras", "extensions"}:
                    found.append(_name(material, index))
        return found

    def _material_extensions(self) -> dict[str, list[str]]:
        """Extensions of shown materials that are not read, with the materials' names."""
        found: dict[str, list[str]] = {}
        for index, material in sorted(self.materials.items()):
            if index >= 0:
                given = self.json["materials"].at(index)["extensions"].names()
                for name in (name for name in given if name not in READ):
                    found.setdefault(name, []).append(_name(material, index))
        return found


def _name(material: Material, index: int) -> str:
    return repr(material.name[:40]) if material.name else f"material {index}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more


def _read_skin(entry: Json, accessors: Accessors, nodes: int) -> Skin:
    """The joints of a skin and their places at rest."""
    joints = [item.index(nodes, "node") for item in entry["joints"].items()]
    if not joints:
        raise entry["joints"].expected("a list of one or more nodes")
    inverse = np.tile(np.eye(4), (len(joints), 1, 1))
    if entry["inverseBindMatrices"]:
        given = accessors.floats(entry["inverseBindMatrices"], "MAT4")
        if len(given) < len(joints):
            raise entry["inverseBindMatrices"].error(f"{len(given)} matrices for {len(joints)} joints")
        if not np.isfinite(given).all():
            raise entry["inverseBindMatrices"].error("holds numbers that are not finite")
        # The file gives matrices column by column.
        inverse = given[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).copy()
    inverse[:, 3] = (0, 0, 0, 1)
    return Skin(np.array(joints, dtype=np.int64), inverse)


def _check_joints(primitives: Iterable[Primitive], count: int, json: Json) -> None:
    """Every joint that has a weight must be one of the skin's; the others are made harmless."""
    for primitive in primitives:
        if primitive.joints is None or primitive.weights is None:
            continue
        outside = primitive.joints >= count
        if (outside & (primitive.weights > 0)).any():
            worst = int(primitive.joints[outside & (primitive.weights > 0)].max())
            at = Json({}, f"{primitive.path}.attributes.JOINTS_0", json.file)
            raise at.error(f"names joint {worst} of {count} (expected 0 to {count - 1})")
        primitive.joints[outside] = 0
