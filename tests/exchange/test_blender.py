"""Blender renders flat colours through the exported cameras: assembled, they are what quilt draws.

It needs bpy, Blender as a Python package, which brings a numpy of its own and so works in its own process:

    pip install --target /tmp/bpy bpy
    QUILT_BPY=/tmp/bpy pytest -m long tests/exchange/test_blender.py
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.ndimage import maximum_filter, minimum_filter

from quiltcli.cli import main
from quiltcli.formats.exr.image import read_exr

MODELS = Path(__file__).parents[2] / "display_models"
SHAPES = {
    "a": ((0.5, 0.25, 0.125), "v -0.9 0.2 -0.5\nv 0.9 0.3 -0.4\nv 0.1 1.6 -0.45\nf 1 2 3\n"),
    "b": ((0.125, 0.75, 0.25), "v -0.4 0.5 0.1\nv 0.5 0.6 0.15\nv 0 0.1 0.2\nf 1 2 3\n"),
    "c": ((0.25, 0.25, 1.0), "v -0.3 1.2 -0.9\nv 0.7 1.3 -0.2\nv 0.3 0.7 -0.95\nf 1 2 3\n"),
}
JOBS = {
    "cube5": ("[1.4, 1.7, 2.2]", "[-1.5, 1.9, 2.0]", "[0, 0.8, 0]"),
    "corner_billboard": ("[0.2, -3, 1.5]", "[0.6, -1.5, 0.9]", "[0, 4, 0]"),
}
SETUP = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
for name, color in COLOURS.items():
    bpy.ops.wm.obj_import(filepath=name + ".obj")
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    light, out = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    light.inputs[0].default_value = (*color, 1)
    material.node_tree.links.new(light.outputs[0], out.inputs[0])
    shape = bpy.context.selected_objects[0]
    shape.data.materials.clear()
    shape.data.materials.append(material)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
cycles = scene.cycles
cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 1, False, False
cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
scene.render.film_transparent = True
scene.render.threads_mode, scene.render.threads = "FIXED", 1
bpy.context.view_layer.use_pass_z = True
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "MULTI_LAYER_IMAGE"
settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
sys.argv = ["blender", "--", "--render", "pictures"]
exec(compile(open("cameras.py").read(), "cameras.py", "exec"))
"""


def blender(folder, *words):
    """A Python with bpy, in a process of its own; what it says in the end."""
    path = os.environ.get("QUILT_BPY", "")
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    return done.returncode, (done.stdout + done.stderr)[-2000:]


@pytest.fixture(scope="module")
def with_bpy(tmp_path_factory):
    if blender(tmp_path_factory.mktemp("bpy"), "-c", "import bpy")[0] != 0:
        pytest.skip("no bpy: pip install --target DIR bpy, and set QUILT_BPY=DIR")


def quilt(*words):
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert done.exit_code == 0, done.output


@pytest.mark.long
@pytest.mark.parametrize("display", JOBS)
def test_blender_draws_flat_colours_and_depth_through_the_cameras(with_bpy, tmp_path, monkeypatch, display):
    first, second, aim = JOBS[display]
    objects = []
    for name, (color, text) in SHAPES.items():
        (tmp_path / f"{name}.obj").write_text(text)
        objects.append(
            f"- {{name: {name}, mesh: {name}.obj, material: {{color: {list(color)}, unlit: true}}}}"
        )
    (tmp_path / "scene.yaml").write_text("\n".join(["quilt_scene: 1", "objects:", *objects, ""]))
    (tmp_path / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: {MODELS / display}.yaml\nscene: scene.yaml\nframes: 1-2\n"
        f"viewer: {{near: 0.05, far: 50, path: {{keyframes: [{{frame: 1, position: {first}, look_at: {aim}}},"
        f" {{frame: 2, position: {second}, look_at: {aim}}}]}}}}\n"
        "layout: {method: rows}\n"
    )
    monkeypatch.chdir(tmp_path)
    quilt("render", "job.yaml", "-o", "own")
    quilt("cameras", "own/job.yaml", "-o", "cameras.py")
    colours = {name: color for name, (color, _) in SHAPES.items()}
    (tmp_path / "setup.py").write_text(f"COLOURS = {colours!r}\n{SETUP}")
    code, said = blender(tmp_path, "setup.py")
    assert code == 0, said
    quilt("assemble", "own/job.yaml", "--from", "pictures", "--cameras", "cameras.py", "-o", "got")
    shown, edges = 0, 0
    for path in sorted((tmp_path / "own/facets").iterdir()):
        own, got = (read_exr(tmp_path / out / "facets" / path.name).channels for out in ("own", "got"))
        edge = np.zeros(own["A"].shape, dtype=bool)
        for name in "RGBA":
            light = own[name].astype(np.float32)
            edge |= maximum_filter(light, 3) != minimum_filter(light, 3)
        for name in "RGBA":
            np.testing.assert_array_equal(got[name][~edge], own[name][~edge], err_msg=f"{path.name} {name}")
        seen = ~edge & (own["A"] == 1)
        np.testing.assert_allclose(got["Z"][seen], own["Z"][seen], rtol=2e-5, err_msg=path.name)
        assert np.isinf(got["Z"][~edge & (own["A"] == 0)]).all()
        shown, edges = shown + seen.sum(), edges + edge.sum()
    assert shown > 2 * edges > 0
