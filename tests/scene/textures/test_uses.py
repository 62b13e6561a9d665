"""What becomes of pictures beyond a frame: in checks, tables, ghosts of scenes, hashes and moving scenes."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.cli.group import main
from quiltcli.exchange.web.ghost import ghost
from quiltcli.job import load_job
from quiltcli.job.digest import job_sha256
from quiltcli.render.setup import set_stage
from tests.helpers.textured_floor import checker, write_floor_job


@pytest.fixture
def job(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_floor_job(tmp_path, checker())


def run(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def test_check_and_render_refuse_textures_that_take_too_much(job):
    job.write_text(job.read_text().replace("render: {}", "render: {texture_memory: 0.01}"))
    for command, code in (("check", 1), ("render", 2)):
        result = run(command, job)
        assert result.exit_code == code
        assert "the textures would take" in result.output
        assert "floor.png, 64 × 64 pixels" in result.output
    assert not (job.parent / "out").exists()


def test_check_and_render_refuse_a_picture_that_is_damaged(job):
    data = (job.parent / "floor.png").read_bytes()
    (job.parent / "floor.png").write_bytes(data[:-20])
    for command, code in (("check", 1), ("render", 2)):
        result = run(command, job)
        assert result.exit_code == code
        assert "material.textures.color: cannot be read: it is damaged or cut off" in result.output


def test_wrong_keys_are_told_with_their_line(job):
    scene = job.parent / "scene.yaml"
    text = scene.read_text()
    for wrong, message in (
        ("colour: floor.png", "unknown key"),
        ("color: gone.png", "no such file"),
        ("color: floor.png, wrap: tile", "expected repeat, clamp or mirror"),
        ("wrap: clamp", "names no picture"),
        ("color: floor.png, uv_set: 2", "uv_set"),
    ):
        scene.write_text(text.replace("color: floor.png", wrong))
        result = run("check", scene)
        assert result.exit_code == 1
        assert "scene.yaml:4" in result.output
        assert "objects[0].material.textures" in result.output
        assert message in result.output


def test_a_table_says_what_pictures_there_are(job):
    result = run("info", job.parent / "scene.yaml", "--json")
    (found,) = json.loads(result.stdout)["textures"]
    assert (found["width"], found["height"], found["varies"]) == (64, 64, ["color"])
    assert "1: 64 × 64 (color)" in run("info", job.parent / "scene.yaml").stdout


def test_the_ghost_of_a_scene_has_the_mean_of_its_pictures(job):
    Image.fromarray(np.full((8, 8, 3), (255, 128, 0), np.uint8)).save(job.parent / "floor.png")
    found = ghost(set_stage(load_job(job)).scene, np.zeros(3), 100)
    np.testing.assert_allclose(found.color, np.tile([1, 0.2158, 0], (4, 1)), atol=1e-3)


def test_the_hash_of_a_job_knows_its_pictures_but_not_the_memory_they_may_take(job):
    first = job_sha256(load_job(job))
    job.write_text(job.read_text().replace("render: {}", "render: {texture_memory: 100}"))
    assert job_sha256(load_job(job)) == first
    job.write_text(job.read_text().replace("texture_memory: 100", "anisotropy: 2"))
    assert job_sha256(load_job(job)) != first
    job.write_text(job.read_text().replace("anisotropy: 2", "texture_memory: 100"))
    Image.new("RGB", (2, 2)).save(job.parent / "floor.png")
    assert job_sha256(load_job(job)) != first


def test_the_hash_knows_pictures_that_material_files_name_whatever_their_names(tmp_path):
    job = write_floor_job(tmp_path, checker())
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd -s 2 2 1 a b.png\n")
    text = (tmp_path / "floor.obj").read_text()
    (tmp_path / "floor.obj").write_text("mtllib m.mtl\nusemtl a\n" + text)
    Image.new("RGB", (2, 2)).save(tmp_path / "a b.png")
    first = job_sha256(load_job(job))
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "a b.png")
    assert job_sha256(load_job(job)) != first


def test_workers_draw_a_sequence_of_textured_files_as_one_process_does(tmp_path, monkeypatch):
    """Its topology and pictures change from frame to frame."""
    monkeypatch.chdir(tmp_path)
    job = write_floor_job(tmp_path, checker())
    for number, squares in ((1, 2), (2, 4)):
        Image.fromarray(checker(64, squares)).save(tmp_path / f"{number}.png")
        more = "" if number == 1 else "0 1 0 0 0\n"
        (tmp_path / f"floor.{number}.ply").write_text(
            f"ply\nformat ascii 1.0\ncomment TextureFile {number}.png\nelement vertex {3 + number}\n"
            "property float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n"
            "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
            "-40 0 30 0 0\n40 0 30 40 0\n40 0 -210 40 120\n-40 0 -210 0 120\n" + more
            + "3 0 1 2\n3 0 2 3\n"
        )  # fmt: skip
    (tmp_path / "scene.yaml").write_text("quilt_scene: 1\nobjects:\n- {mesh: 'floor.#.ply', frames: 1-2}\n")
    job.write_text(job.read_text().replace("frames: 1\n", "frames: 1-2\n"))
    pictures = []
    for workers in (1, 2):
        assert run("render", job, "-j", workers, "-o", f"out{workers}").exit_code == 0
        files = sorted((tmp_path / f"out{workers}" / "facets").iterdir())
        assert len(files) == 2
        pictures.append([file.read_bytes() for file in files])
    assert pictures[0] == pictures[1]
    assert pictures[0][0] != pictures[0][1]


def test_a_picture_that_lies_nowhere_shows_one_place(job):
    mesh = job.parent / "floor.obj"
    mesh.write_text(re.sub(r"^vt .*$", "vt 1e300 -1e300", mesh.read_text(), count=1, flags=re.MULTILINE))
    result = run("render", job, "-f", "1", "-j", "1")
    assert result.exit_code == 0, result.output
