"""What a glTF file holds, as records of arrays; numbers are the file's own, nothing is placed yet."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from quiltcli.formats.gltf.images import Images
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Primitive:
    """A piece of a mesh with one material: V vertices, T triangles, M morph targets.

    Attributes:
        positions: (V, 3).
        triangles: (T, 3) indices, strips and fans taken apart.
        normals: (V, 3), or None.
        tangents: (V, 4), the last of a row 1 or -1 for the bitangent's side, or None.
        uv: (V, 2) of each of the two sets, v down from the image's upper edge, or None.
        colors: (V, 4) linear, or None.
        joints: (V, K) rows of the skin's joints, or None.
        weights: (V, K) how much each joint moves the vertex, rows that sum to 1; None without joints.
        moved: (M, V, 3) what each morph target adds to the positions.
        turned: (M, V, 3) what each adds to the normals.
        material: index of its material, -1 for the default one.
        path: where it stands in the file.
    """

    positions: FloatArray
    triangles: IntArray
    normals: FloatArray | None
    tangents: FloatArray | None
    uv: tuple[FloatArray | None, FloatArray | None]
    colors: Float32Array | None
    joints: IntArray | None
    weights: FloatArray | None
    moved: FloatArray
    turned: FloatArray
    material: int
    path: str


@dataclass(frozen=True, eq=False)
class Nodes:
    """The N nodes of a file as trees.

    Attributes:
        parent: (N,) index of the parent, -1 for a root.
        levels: indices of the nodes at each depth, the roots first.
        translation: (N, 3).
        rotation: (N, 4) quaternions x, y, z, w.
        scale: (N, 3).
        matrix: (N, 4, 4) local placement of the nodes that give one instead of the three.
        has_matrix: (N,) those nodes.
        drawn: indices of the nodes of the scene that is shown.
    """

    parent: IntArray
    levels: tuple[IntArray, ...]
    translation: FloatArray
    rotation: FloatArray
    scale: FloatArray
    matrix: FloatArray
    has_matrix: BoolArray
    drawn: IntArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints that move vertices.

    Attributes:
        joints: (J,) node indices.
        inverse_bind: (J, 4, 4) from the mesh's space to each joint's at rest.
    """

    joints: IntArray
    inverse_bind: FloatArray


@dataclass(frozen=True, eq=False)
class Shape:
    """A mesh as a node shows it.

    Attributes:
        node: index of the node.
        mesh: index of the mesh.
        skin: index of the skin, -1 for none.
        weights: (M,) of the morph targets while nothing moves them.
        instances: (I, 4, 4) places in the node's space.
    """

    node: int
    mesh: int
    skin: int
    weights: FloatArray
    instances: FloatArray


@dataclass(frozen=True)
class TextureUse:
    """How a material looks a picture up.

    Attributes:
        image: index of the image.
        uv_set: which texture coordinates, 0 or 1.
        wrap: `repeat`, `clamp` or `mirror` along u and v.
        nearest: whether a magnified picture shows its texels as squares.
        mipmaps: whether a minified one is filtered.
        matrix: 2 × 3, row by row: u, v of the picture from those of the vertices, both with v down.
        strength: scale of a normal map or strength of an occlusion map, else 1.
        path: where it stands in the file.
    """

    image: int
    uv_set: int
    wrap: tuple[str, str]
    nearest: bool
    mipmaps: bool
    matrix: tuple[float, float, float, float, float, float]
    strength: float
    path: str


@dataclass(frozen=True)
class Material:
    """A metallic-roughness material; colours are linear.

    Attributes:
        name: its name, empty where it has none.
        color: base colour and alpha.
        metallic: 0 to 1.
        roughness: 0 to 1.
        emission: light given off, strength included.
        unlit: whether lights make no difference.
        alpha_mode: `OPAQUE`, `MASK` or `BLEND`.
        cutoff: the least alpha that `MASK` shows.
        double_sided: whether its back is seen.
        textures: by slot: `color`, `metallic_roughness`, `normal`, `occlusion`, `emission`.
        path: where it stands in the file.
        specular: 0 to 1, strength of the layer that reflects; metals reflect all the same.
    """

    name: str = ""
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    unlit: bool = False
    alpha_mode: str = "OPAQUE"
    cutoff: float = 0.5
    double_sided: bool = False
    textures: dict[str, TextureUse] = field(default_factory=dict, hash=False)
    path: str = ""
    specular: float = 1.0


@dataclass(frozen=True)
class PunctualLight:
    """A light of KHR_lights_punctual at a node; it shines along the node's -Z.

    Attributes:
        name: its name, empty where it has none.
        node: index of the node.
        kind: `directional`, `point` or `spot`.
        color: linear, 0 to 1.
        intensity: lux of a directional light, candela of the others.
        reach: metres it shines, infinite where the file says nothing.
        inner: radians from a spot's axis to where it begins to fade.
        outer: radians to where it is dark.
    """

    name: str
    node: int
    kind: str
    color: tuple[float, float, float]
    intensity: float
    reach: float
    inner: float
    outer: float


@dataclass(frozen=True, eq=False)
class Channel:
    """What moves one property of one node.

    Attributes:
        node: index of the node.
        target: `translation`, `rotation`, `scale` or `weights`.
        interpolation: `LINEAR`, `STEP` or `CUBICSPLINE`.
        times: (K,) seconds, ascending.
        values: (K, n) at those times.
        tangents: (2, K, n) in and out, of a cubic spline; empty otherwise.
    """

    node: int
    target: str
    interpolation: str
    times: FloatArray
    values: FloatArray
    tangents: FloatArray


@dataclass(frozen=True, eq=False)
class Clip:
    """A named animation.

    Attributes:
        name: its name, or `animation N` (from 1) where it has none.
        channels: what it moves.
        end: time of its last key, seconds.
    """

    name: str
    channels: tuple[Channel, ...]
    end: float


@dataclass(frozen=True, eq=False)
class Gltf:
    """The scene that a file shows.

    Attributes:
        path: the file.
        nodes: its nodes.
        shapes: the meshes its nodes show, in the order of the nodes.
        meshes: primitives by index of the mesh, for the meshes that are shown.
        skins: by index, likewise.
        materials: by index, those that are shown; -1 is the default one.
        lights: those at nodes of the scene.
        clips: the animations.
        images: the pictures that materials use, read when they are asked for.
        notices: what the file holds that was left out.
        cameras: cameras at nodes of the scene.
    """

    path: Path
    nodes: Nodes
    shapes: tuple[Shape, ...]
    meshes: dict[int, tuple[Primitive, ...]]
    skins: dict[int, Skin]
    materials: dict[int, Material]
    lights: tuple[PunctualLight, ...]
    clips: tuple[Clip, ...]
    images: Images
    notices: tuple[str, ...]
    cameras: int
