"""The pavilion of scenes/pavilion.yaml as a USD stage, drawn in cube5 (extra `usd`).

python docs/pictures/usd.py -o PICTURE.png [--keep FOLDER]
"""

import argparse
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

from quiltcli.geometry import rotation_deg
from quiltcli.job import load_scene_file
from quiltcli.scene.importers.asset import read_asset

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes/pavilion.yaml"
JOB = ROOT / "scenes/show_box.yaml"
CLAY = {"color": (0.8, 0.8, 0.8), "metallic": 0.0, "roughness": 0.5}


def material(stage, name, spec, picture):
    """A UsdPreviewSurface of an object's material."""
    base = f"/World/Looks/{name}"
    found = UsdShade.Material.Define(stage, base)
    surface = UsdShade.Shader.Define(stage, f"{base}/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    found.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    for key in ("metallic", "roughness"):
        surface.CreateInput(key, Sdf.ValueTypeNames.Float).Set(float(spec[key]))
    color = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    if picture is None:
        color.Set(Gf.Vec3f(*spec["color"]))
        return found
    reader = UsdShade.Shader.Define(stage, f"{base}/st")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    texture = UsdShade.Shader.Define(stage, f"{base}/texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(str(picture))
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    color.ConnectToSource(texture.ConnectableAPI(), "rgb")
    return found


def place(prim, spec):
    """Keyframes of an object as time samples, every frame, so that turns go the way they go here."""
    op = UsdGeom.Xformable(prim).AddTransformOp()
    frames = range(1, 26) if spec.transform.moves else [None]
    for frame in frames:
        matrix = spec.transform.at(spec.transform.start if frame is None else frame)
        value = Gf.Matrix4d(np.ascontiguousarray(matrix.T))
        op.Set(value) if frame is None else op.Set(value, frame)


def write_stage(path):
    """The stage: a mesh for each object, a dome and a sun."""
    spec = load_scene_file(SCENE)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, "Y")
    stage.SetTimeCodesPerSecond(24)
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(25)
    for item in spec.objects:
        name = item.name.replace(" ", "_")
        UsdGeom.Xform.Define(stage, f"/World/{name}")
        place(stage.GetPrimAtPath(f"/World/{name}"), item)
        looks = {**CLAY, **item.material.model_dump(exclude_none=True)}
        pictures = item.material.textures
        bound = material(stage, name, looks, None if pictures is None else pictures.color)
        for number, part in enumerate(read_asset(item.mesh).parts):
            mesh = UsdGeom.Mesh.Define(stage, f"/World/{name}/part_{number}")
            mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(part.vertices.astype(np.float32)))
            mesh.CreateFaceVertexCountsAttr([3] * len(part.triangles))
            mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(part.triangles.astype(np.int32).ravel()))
            mesh.CreateSubdivisionSchemeAttr("none")
            if part.normals is not None:
                mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(part.normals.astype(np.float32)))
                mesh.SetNormalsInterpolation("vertex")
            if part.uv is not None:
                primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
                    "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex"
                )
                primvar.Set(Vt.Vec2fArray.FromNumpy(part.uv.astype(np.float32)))
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(bound)
    for number, light in enumerate(spec.lights):
        if light.type == "environment":
            dome = UsdLux.DomeLight.Define(stage, f"/World/dome_{number}")
            dome.CreateTextureFileAttr(str(light.file))
            dome.CreateIntensityAttr(light.intensity)
            # Its picture has +Z in the middle, and quilt's -Z.
            dome.AddRotateYOp().Set(180 + light.rotate_deg)
        else:
            sun = UsdLux.DistantLight.Define(stage, f"/World/sun_{number}")
            sun.CreateNormalizeAttr(True)
            sun.CreateIntensityAttr(1)
            sun.CreateColorAttr(Gf.Vec3f(*light.color))
            x, y, z = light.direction
            pitch, yaw = math.atan2(y, math.hypot(x, z)), math.atan2(-x, -z)
            turn = rotation_deg((math.degrees(pitch), math.degrees(yaw), 0))
            matrix = np.eye(4)
            matrix[:3, :3] = turn.T
            sun.AddTransformOp().Set(Gf.Matrix4d(matrix))
    stage.Save()


def main():
    """Write the stage, a scene and a job of it, and look at the display."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--size", default="960x720")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) if options.keep is None else options.keep
        folder.mkdir(exist_ok=True)
        write_stage(folder / "pavilion.usdc")
        scene = {
            "quilt_scene": 1,
            "objects": [{"mesh": "pavilion.usdc", "animation": {}}],
            "lights": [{"type": "file", "shadows": True}],
            "background": [0.012, 0.018, 0.04],
        }
        (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
        job = yaml.safe_load(JOB.read_text())
        job |= {"display": str((JOB.parent / job["display"]).resolve()), "scene": "scene.yaml"}
        (folder / "job.yaml").write_text(yaml.safe_dump(job))
        command = ("simulate", str(folder / "job.yaml"), "-f", "9", "-o", str(options.output))
        more = ("--size", options.size, "--supersample", "2")
        subprocess.run([sys.executable, "-m", "quiltcli", *command, *more], check=True)


if __name__ == "__main__":
    main()
