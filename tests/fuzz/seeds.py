"""Good inputs of every kind, small, and the commands that read each kind: what the fuzzer starts from."""

# ruff: noqa: E501 - tables are easier to read unbroken

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from click.testing import CliRunner
from PIL import Image

from quiltcli.cli import main
from quiltcli.job.layout_columns import columns_bytes
from quiltcli.job.layout_table import columns_of
from quiltcli.layout import read_layout
from tests.helpers.tiny_job import write_tiny_job

JOB = """\
quilt_job: 1
display: display.yaml
layout: {method: rows, size: [80, 80], padding: 2}
scene: scene.yaml
frames: 1-4
fps: 30
viewer:
  near: 0.05
  far: 50
  path:
    keyframes:
    - {frame: 1, position: [0, 0, 2], look_at: [0, 0, 0], up: [0, 1, 0]}
    - {frame: 4, position: [-0.5, 0.2, 3], look_at: [0, 0, 0]}
    interpolation: smooth
render: {samples: 1, method: homography, depth: planar, backface_culling: false, bleed: 2}
output: {directory: out, quilts: true, facets: true, channels: [rgba, Z, zv, N], compression: zip}
"""
ORBIT = JOB.partition("    keyframes")[0] + (
    "    orbit: {center: [0, 0, 0], radius: 3, height: 0.5, start_deg: 10, frames_per_turn: 40}\n"
    "render: {samples: 4, depth: radial}\noutput: {channels: [rgba, facet, P], unlit: skip, data_window: tight}\n"
)
TRACKED = JOB.partition("    keyframes")[0] + (
    "    csv: {file: track.csv, units: cm, fill: true, look: [0, 0, -1]}\n"
)
DISPLAY = """\
quilt_display: 1
mesh: walls.obj
units: cm
viewing_side: both
resolution: {pixels_per_metre: 16}
facets:
  1: {name: back, up: [0, 1, 0], rotate: 90, mirror: false, enabled: true}
  2: {name: right, facet_pixels: [20, 24], place: {page: 1, at: [0, 0], rotate: 0}}
transform: {translate: [0, 0.1, 0], rotate_deg: [0, 15, 0], scale: 100}
"""
SCENE = """\
quilt_scene: 1
objects:
- name: ball
  mesh: ball.obj
  transform: {translate: [0, 0, 0], rotate_deg: [0, 90, 0], scale: 2}
  material: {color: [0.8, 0.2, 0.1], metallic: 0, roughness: 0.5, emission: [0, 0, 0], unlit: false}
- {mesh: ball.obj, normals: smooth, transform: {matrix: [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}
lights:
- {type: directional, direction: [-1, -2, -1], color: [3, 3, 3]}
- {type: point, position: [0, 3, 0], color: [20, 20, 20]}
- {type: ambient, color: [0.1, 0.1, 0.1]}
background: [0, 0.1, 0]
"""
TRACK = "frame,x,y,z,look_at_x,look_at_y,look_at_z\n1,0,0,200,0,0,0\n2,1,2,200,0,0,0\n4,2e1,0,300,0,0,-0\n"
OBJ = """\
# a display and a scene
mtllib m.mtl
o one
v -1 -1 0
v 1 -1 0 1 0.5 0.25
v 1 1 0
v -1 1 0
vt 0 0
vt 0.5 0
vt 0.5 0.5
vt 0 0.5
vn 0 0 1
usemtl red
f 1/1/1 2/2/1 3/3/1 4/4/1
g two
v 1 -1 2
v 1 1 2
f 2//1 -2//1 -1//1 3//1
"""
MTL = "newmtl red\nKd 0.8 0.2 0.1\nNs 40\nd 1\nmap_Kd red.png\n"
PLY = """\
ply
format ascii 1.0
comment made by hand
element vertex 6
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
end_header
-1 -1 0 255 0 0
1 -1 0 0 255 0
1 1 0 0 0 255
-1 1 0 9 9 9
1 -1 2 1 2 3
1 1 2 4 5 6
4 0 1 2 3
4 1 4 5 2
"""
OFF = "OFF\n# by hand\n6 2 0\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n1 -1 2\n1 1 2\n4 0 1 2 3 255 0 0\n4 1 4 5 2\n"
STL = """\
solid s
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
facet normal 0 0 1
outer loop
vertex 1 0 0
vertex 1 1 0
vertex 0 1 0
endloop
endfacet
endsolid s
"""
GLTF = """\
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0, "translation": [0, 0, -1], "scale": [1, 1, 1], "children": [1]}, {"mesh": 0, "translation": [2, 0, 0], "rotation": [0, 0, 0, 1]}],
 "meshes": [{"name": "m", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0, "mode": 4}]}],
 "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.2, 1], "metallicFactor": 0}}],
 "buffers": [{"byteLength": 42, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],
 "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
  {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}]}
"""
USD = """\
#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = 1
    endTimeCode = 8
)
def Xform "x"
{
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 8: (0, 1, 0) }
    float xformOp:rotateZ = 30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
    def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        point3f[] points = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        int[] holeIndices = []
        uniform token subdivisionScheme = "none"
        uniform token orientation = "rightHanded"
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        int[] primvars:st:indices = [0, 1, 2, 3]
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "uniform")
        rel material:binding = </looks/red>
    }
}
def PointInstancer "many"
{
    rel prototypes = [</many/p>, </many/q>]
    int[] protoIndices = [0, 1, 0]
    point3f[] positions = [(0, 0, 0), (3, 0, 0), (4, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0)]
    int64[] ids = [1, 2, 3]
    int64[] invisibleIds = [2]
    def Mesh "p"
    {
        point3f[] points.timeSamples = {
            1: [(0, 0, 0), (1, 0, 0), (0, 0, 1)],
            8: [(0, 0, 0), (2, 0, 0), (0, 0, 1)],
        }
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        uniform token subdivisionScheme = "none"
        token visibility.timeSamples = { 1: "inherited", 4: "invisible" }
    }
    def Sphere "q"
    {
        double radius = 0.5
    }
}
def "looks"
{
    def Material "red"
    {
        token outputs:surface.connect = </looks/red/s.outputs:surface>
        def Shader "s"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </looks/red/t.outputs:rgb>
            float inputs:roughness = 0.5
            float inputs:opacity = 0.5
            token outputs:surface
        }
        def Shader "t"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./red.png@
            float2 inputs:st.connect = </looks/red/c.outputs:result>
            float4 inputs:scale = (1, 0.5, 1, 1)
            float3 outputs:rgb
        }
        def Shader "c"
        {
            uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </looks/red/r.outputs:result>
            float inputs:rotation = 30
            float2 outputs:result
        }
        def Shader "r"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }
    }
}
def RectLight "lamp"
{
    float inputs:width = 2
    float inputs:intensity = 3
    float inputs:exposure = 1
}
"""
USD_SCENE = "quilt_scene: 1\nobjects: [{mesh: m.usda, animation: {}}]\nlights: file\n"
POINTS = '[[0, 0, 0], [1, 0.5, -2e-1], null, {"point": [0, 2, 0]}, [0, 0, 3]]\n'
LIGHTS = "quilt_display: 1\npoints: {file: leds.json, size: 8 mm, columns: 3}\nunits: cm\n"
LOG = """\
person,task,display,optimal_length,path_length,undos,motions,seconds,overall
ann,easy,wall,10,12,1,30,60.5,4
ann,easy,ball,10,10,0,40,50,5
bob,easy,wall,10,20,3,10,90,
bob,easy,ball,10,14,1,35,70,3
"""
MESH_DISPLAY = "quilt_display: 1\nmesh: {mesh}\nresolution: {{pixels_per_metre: 8}}\n"


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes:
        name: as the fuzzer tells of it.
        file: the file that is changed.
        how: which mutations fit: `yaml`, `json`, `text`, `bytes`, `exr`, `zip` or `set`.
        commands: what is run on it, one after another in one folder, split at spaces.
        files: other files that are written first, by name.
    """

    name: str
    file: str
    how: str
    commands: tuple[str, ...]
    files: Mapping[str, str] | None = None


_RENDER = "render job.yaml -f 1 -j 1 --overwrite"
_EXPORTS = tuple(f"export layout.yaml -o e.{suffix}" for suffix in ("csv", "json", "svg"))
_IMPORTED = ("check l.yaml",)


def _mesh(suffix: str) -> tuple[str, ...]:
    return (f"info m.{suffix}", "pack m.yaml --method rows -o l.yaml", "check l.yaml")


def _map(suffix: str) -> tuple[str, ...]:
    return (
        f"import map.{suffix} -o l.yaml",
        *_IMPORTED,
        f"import map.{suffix} -o l2.yaml --display display.yaml",
    )


def has_usd() -> bool:
    """Whether the extra `usd` is there."""
    return importlib.util.find_spec("pxr") is not None


# Binary stages are left to their library, which takes memory for whatever counts it is told.
_STAGES = (Kind("usda", "m.usda", "text", ("info m.usda", _RENDER), {"scene.yaml": USD_SCENE}),)
KINDS = (
    Kind("job", "job.yaml", "yaml", ("check job.yaml", _RENDER)),
    Kind("orbit", "job.yaml", "yaml", ("check job.yaml", "info job.yaml", _RENDER), {"job.yaml": ORBIT}),
    Kind("tracked", "job.yaml", "yaml", ("check job.yaml", _RENDER), {"job.yaml": TRACKED}),
    Kind("track", "track.csv", "text", ("check job.yaml", "info job.yaml", _RENDER), {"job.yaml": TRACKED}),
    Kind("display", "display.yaml", "yaml", ("check display.yaml", "info display.yaml", "pack display.yaml --method rows --size 80x80 -o l.yaml", "check l.yaml")),
    Kind("points", "leds.json", "json", ("check display.yaml", "info display.yaml", "pack display.yaml -o l.yaml", "check l.yaml"), {"leds.json": POINTS, "display.yaml": LIGHTS}),
    Kind("lights", "display.yaml", "yaml", ("check display.yaml", "info display.yaml", "pack display.yaml -o l.yaml"), {"leds.json": POINTS, "display.yaml": LIGHTS}),
    Kind("study", "log.csv", "text", ("study log.csv -o r.html", "study log.csv --skip hard"), {"log.csv": LOG}),
    Kind("scene", "scene.yaml", "yaml", ("check scene.yaml", "info scene.yaml", _RENDER)),
    Kind("layout", "layout.yaml", "yaml", ("check layout.yaml", "info layout.yaml", *_EXPORTS)),
    Kind("columns", "c.npz", "bytes", ("check c.yaml", "info c.yaml")),
    Kind("columns-zip", "c.npz", "zip", ("check c.yaml", "info c.yaml")),
    Kind("yaml-text", "job.yaml", "text", ("check job.yaml", "info job.yaml")),
    Kind("set", "", "set", ("render job.yaml --dry-run --overwrite",)),
    Kind("obj", "m.obj", "text", _mesh("obj")),
    Kind("mtl", "m.mtl", "text", ("info m.obj",)),
    Kind("ply", "m.ply", "text", _mesh("ply")),
    Kind("ply-binary", "b.ply", "bytes", ("info b.ply",)),
    Kind("off", "m.off", "text", _mesh("off")),
    Kind("stl", "m.stl", "text", _mesh("stl")),
    Kind("stl-binary", "b.stl", "bytes", ("info b.stl",)),
    Kind("gltf", "m.gltf", "json", _mesh("gltf")),
    Kind("glb", "b.glb", "bytes", ("info b.glb",)),
    *(_STAGES if has_usd() else ()),
    Kind("exr", "out/quilt/page_01.0001.exr", "exr", (
        "info out/quilt/page_01.0001.exr", "info --json out/quilt/page_01.0001.exr",
        "preview out/quilt/page_01.0001.exr -o p.png", "diff out/quilt/page_01.0001.exr out/quilt/page_01.0002.exr",
        "unmap out/quilt/page_01.0001.exr --layout layout.yaml -o cut2", "render job.yaml -f 1 -j 1 --resume")),
    Kind("csv", "map.csv", "text", _map("csv")),
    Kind("json", "map.json", "json", _map("json")),
    Kind("json-text", "map.json", "text", _map("json")),
    Kind("map-obj", "map.obj", "text", _map("obj")),
    Kind("mpcdi", "map.mpcdi", "zip", _map("mpcdi")),
    Kind("mpcdi-bytes", "map.mpcdi", "bytes", _map("mpcdi")),
    Kind("diff-bytes", "out/quilt/page_01.0001.exr", "bytes", ("diff out/quilt/page_01.0001.exr out/quilt/page_01.0002.exr",)),
)  # fmt: skip


def write_seeds(folder: Path) -> None:
    """Write the good inputs of all kinds into an empty folder; `out` is a finished render of two frames."""
    write_tiny_job(folder)
    texts = {
        "job.yaml": JOB, "display.yaml": DISPLAY, "scene.yaml": SCENE, "track.csv": TRACK, "m.obj": OBJ,
        "m.mtl": MTL, "m.ply": PLY, "m.off": OFF, "m.stl": STL, "m.gltf": GLTF,
        "m.usda": USD,
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    Image.new("RGB", (2, 2), (200, 100, 50)).save(folder / "red.png")
    _write_binary_meshes(folder)
    for command in (
        "pack display.yaml --method rows --size 80x80 -o layout.yaml",
        *(f"export layout.yaml -o map.{suffix}" for suffix in ("csv", "json", "obj", "mpcdi")),
        "render job.yaml -f 1-2 -j 1",
        # Run once here, so that their modules need not be imported anew for every input.
        "check job.yaml",
        "info job.yaml",
        "info m.obj",
        "info m.gltf",
        "info b.ply",
        "import map.csv -o l.yaml",
        "import map.mpcdi -o l.yaml",
        "info out/quilt/page_01.0001.exr",
        "export layout.yaml -o l.svg",
        "preview out/quilt/page_01.0001.exr -o p.png",
        "unmap out/quilt/page_01.0001.exr --layout layout.yaml -o cut",
        "diff out/quilt/page_01.0001.exr out/quilt/page_01.0001.exr",
    ):
        words = [str(folder / word) if "." in word or word == "cut" else word for word in command.split()]
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, (command, result.output)
    data, _ = columns_bytes(columns_of(read_layout(folder / "layout.yaml")))
    (folder / "c.npz").write_bytes(data)
    (folder / "c.yaml").write_text("quilt_layout: 1\npages:\n- size: [80, 80]\ncolumns: c.npz\n")


def _write_binary_meshes(folder: Path) -> None:
    import trimesh

    box = trimesh.creation.box()
    for suffix in ("ply", "stl", "glb"):
        box.export(folder / f"b.{suffix}")


def prepare(seeds: Path, folder: Path, kind: Kind) -> None:
    """A fresh folder with the good inputs, and those that the kind wants otherwise."""
    shutil.copytree(seeds, folder)
    for name in [path.name for path in folder.glob("m.*")]:
        mesh = MESH_DISPLAY.format(mesh=name)
        if kind.file == name:
            (folder / "m.yaml").write_text(mesh)
    for name, text in (kind.files or {}).items():
        (folder / name).write_text(text)
