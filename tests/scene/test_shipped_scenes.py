"""The scenes that come with the program: made by their generator, loadable, and of the right size."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from quiltcli.formats.exr.image import read_exr
from quiltcli.scene import load_scene

SCENES = Path(__file__).parents[2] / "scenes"


def test_the_generator_wrote_the_meshes(tmp_path):
    program = (
        f"import sys; sys.path.insert(0, {str(SCENES)!r}); import generate, pathlib;"
        f"generate.write(pathlib.Path({str(tmp_path)!r}), generate.MESHES)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
    made = sorted(path.name for path in tmp_path.iterdir())
    assert made == sorted(p.name for p in SCENES.iterdir() if p.suffix in (".obj", ".mtl"))
    for name in made:
        assert (tmp_path / name).read_bytes() == (SCENES / name).read_bytes()


def test_the_generator_drew_the_pictures(tmp_path):
    program = f"import sys; sys.path.insert(0, {str(SCENES)!r}); import pictures, pathlib;"
    subprocess.run(
        [sys.executable, "-c", f"{program} pictures.write(pathlib.Path({str(tmp_path)!r}))"], check=True
    )
    made = sorted(path.name for path in tmp_path.iterdir())
    assert made == sorted(path.name for path in SCENES.glob("*.png") if path.name != "mosaic.png")
    for name in made:
        new, old = (np.asarray(Image.open(folder / name)).astype(int) for folder in (tmp_path, SCENES))
        assert np.abs(new - old).max() <= 1  # functions of other machines may round otherwise


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("teapot_and_solids", (-0.26, 0, -0.26), (0.26, 0.29, 0.26)),
        ("teapot_in_sphere", (-0.3, 0, -0.3), (0.3, 0.6, 0.3)),
        ("plates_and_sphere", (-0.26, 0, -0.26), (0.26, 0.3, 0.26)),
        ("room", (-3, 0, -3), (3, 3.2, 3)),
        ("pavilion", (-0.265, 0, -0.265), (0.265, 0.29, 0.265)),
        ("pavilion_in_sphere", (-0.3, 0, -0.3), (0.3, 0.6, 0.3)),
        ("pavilion_on_corner", (-4.5, 3, -9.5), (4.5, 10, 0)),
        ("hall", (-3, 0, -3), (3, 3.2, 3)),
    ],
)
def test_scenes_load_quietly_and_fit(name, low, high):
    scene = load_scene(SCENES / f"{name}.yaml")
    assert scene.notices == ()
    assert (scene.vertices >= np.array(low) - 1e-9).all()
    assert (scene.vertices <= np.array(high) + 1e-9).all()
    assert len(scene.triangles) < 20_000


def test_the_generator_wrote_the_sky_and_the_floor(tmp_path):
    program = (
        f"import sys; sys.path.insert(0, {str(SCENES)!r}); import generate_sky, pathlib;"
        f"generate_sky.write(pathlib.Path({str(tmp_path)!r}))"
    )
    environment = {**os.environ, "PYTHONPATH": str(SCENES.parent)}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    made, kept = (read_exr(folder / "evening.exr").channels for folder in (tmp_path, SCENES))
    for name in "RGB":
        np.testing.assert_allclose(made[name].astype(float), kept[name], rtol=2e-3)
    made, kept = (Image.open(folder / "mosaic.png").convert("RGB") for folder in (tmp_path, SCENES))
    np.testing.assert_array_equal(np.asarray(made), np.asarray(kept))


def test_the_sphere_scene_stays_inside_its_sphere():
    vertices = load_scene(SCENES / "teapot_in_sphere.yaml").vertices
    assert np.linalg.norm(vertices - (0, 0.3, 0), axis=1).max() < 0.285


def test_everything_stands_on_the_board():
    scene = load_scene(SCENES / "teapot_and_solids.yaml")
    for index, name in enumerate(scene.objects):
        lowest = scene.vertices[scene.triangles[scene.object == index]][..., 1].min()
        assert lowest > 0.0155 or name == "board"


def test_scenes_are_small():
    assert sum(path.stat().st_size for path in SCENES.glob("*.*")) < 3_000_000
