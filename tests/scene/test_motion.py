"""Scenes that move: where things are between keyframes, which file is shown, and what stays the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.check import check_files
from quiltcli.analysis.info import describe
from quiltcli.analysis.verify import VerifyOptions, verify
from quiltcli.errors import JobError, SceneError
from quiltcli.job import job_sha256, load_job, load_scene_file
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import set_stage
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from quiltcli.scene import load_scene
from quiltcli.scene.lights import Point
from quiltcli.scene.motion import MovingScene, load_moving_scene
from tests.helpers.gltf_files import one_square
from tests.helpers.in_memory import CUBE, CUBE_FACES, icosphere
from tests.helpers.tiny_job import replaced, write_tiny_job
from tests.helpers.verified_jobs import ball, found, obj, write_job

FPS = 24.0
LIT = "lights: [{type: ambient}]\n"


def moving(folder: Path, *objects: str, lights: str = LIT) -> MovingScene:
    """A scene of these objects beside a unit cube, a ball and what is there already."""
    (folder / "cube.obj").write_text(obj(CUBE, CUBE_FACES))
    (folder / "ball.obj").write_text(obj(*ball(1.0, 1)))
    lines = "".join(f"- {one}\n" for one in objects)
    (folder / "moving.yaml").write_text(f"quilt_scene: 1\nobjects:\n{lines}{lights}")
    source = load_moving_scene(load_scene_file(folder / "moving.yaml"), FPS)[1]
    assert source is not None
    return source


def sequence(folder: Path, numbers) -> None:
    """Balls of ever more triangles that grow."""
    for number in numbers:
        vertices, triangles = icosphere(number % 3)
        (folder / f"boat.{number:04d}.obj").write_text(obj(vertices * (1 + 0.01 * number), triangles))


def fault(folder: Path, *objects: str) -> str:
    with pytest.raises((SceneError, JobError)) as caught:
        moving(folder, *objects)
    return str(caught.value).replace(f"{folder}/", "")


# --- keyframes

WAY = "{frame: 1, translate: [0, 0, 0]}, {frame: 5, translate: [4, 0, 8]}"


def test_an_object_is_half_way_at_half_time(tmp_path):
    source = moving(tmp_path, f"{{mesh: cube.obj, transform: {{keyframes: [{WAY}]}}}}")
    for frame, shift in ((3, [2, 0, 4]), (1.5, [0.5, 0, 1]), (-7, [0, 0, 0]), (99, [4, 0, 8])):
        np.testing.assert_array_equal(source.scene_at(frame).vertices, source.base.vertices + shift)


@pytest.mark.parametrize(("kind", "x"), [("hold", 0), ("linear", 1), ("smooth", 0.25)])
def test_interpolations_between_keyframes_on_a_parabola(tmp_path, kind, x):
    keys = ", ".join(f"{{frame: {f}, translate: [{f * f / 4}, 0, 0]}}" for f in (0, 2, 4))
    source = moving(
        tmp_path, f"{{mesh: cube.obj, transform: {{interpolation: {kind}, keyframes: [{keys}]}}}}"
    )
    found = source.scene_at(1).vertices - source.base.vertices
    assert found[:, 0] == pytest.approx({"hold": 0, "linear": 0.5, "smooth": 0.25}[kind])


def test_a_rotation_takes_the_shorter_arc_at_an_even_pace(tmp_path):
    keys = "{frame: 0, rotate_deg: [0, 350, 0]}, {frame: 9, rotate_deg: [0, 80, 0]}"
    source = moving(tmp_path, f"{{mesh: ball.obj, transform: {{keyframes: [{keys}]}}}}")
    (tmp_path / "still.yaml").write_text(
        f"quilt_scene: 1\nobjects: [{{mesh: ball.obj, transform: {{rotate_deg: [0, 20, 0]}}}}]\n{LIT}"
    )
    expected, scene = load_scene(tmp_path / "still.yaml"), source.scene_at(3)
    np.testing.assert_allclose(scene.vertices, expected.vertices, atol=1e-11)
    np.testing.assert_allclose(scene.normals, expected.normals, atol=1e-6)


def test_normals_go_by_the_inverse_transpose_and_a_mirror_keeps_its_outside(tmp_path):
    keys = "{frame: 0, scale: [-1, 1, 1]}, {frame: 2, scale: [-3, 1, 1]}"
    source = moving(tmp_path, f"{{mesh: ball.obj, transform: {{keyframes: [{keys}]}}}}")
    scene = source.scene_at(1)
    expected = source.base.normals / [2, 1, 1]
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    np.testing.assert_allclose(scene.normals, expected, atol=1e-6)
    centre = scene.vertices[scene.triangles].mean(axis=1)
    assert ((scene.planes[:3].T * centre).sum(axis=1) > 0).all()


def test_what_does_not_move_stays_the_same_object(tmp_path):
    source = moving(tmp_path, f"{{mesh: cube.obj, transform: {{keyframes: [{WAY}]}}}}", "{mesh: ball.obj}")
    base, scene = source.base, source.scene_at(2)
    assert source.scene_at(1) is base
    assert source.scene_at(2) is scene
    assert source.scene_at(5) is source.scene_at(6)
    for name in ("triangles", "colors", "flat", "object", "material", "materials", "lights", "uv"):
        assert getattr(scene, name) is getattr(base, name)
    still = np.unique(base.triangles[base.object == 1])
    np.testing.assert_array_equal(scene.vertices[still], base.vertices[still])


def test_a_frame_is_the_same_whatever_was_drawn_before(tmp_path):
    sequence(tmp_path, (1, 2, 3, 4))
    objects = (
        f"{{mesh: cube.obj, transform: {{keyframes: [{WAY}]}}}}",
        "{mesh: boat.####.obj, frames: 1-4}",
    )
    source = moving(tmp_path, *objects)
    for frame in (4, 2, 2.5, 1, 3, 4):
        scene, alone = source.scene_at(frame), moving(tmp_path, *objects).scene_at(frame)
        for name in ("vertices", "triangles", "normals", "object"):
            np.testing.assert_array_equal(getattr(scene, name), getattr(alone, name))


def test_keyframes_carry_a_mesh_in_its_own_units_and_axes(tmp_path):
    source = moving(tmp_path, f"{{mesh: cube.obj, units: cm, up_axis: z, transform: {{keyframes: [{WAY}]}}}}")
    assert abs(source.base.vertices).max() == pytest.approx(0.01)
    np.testing.assert_allclose(source.scene_at(3).vertices, source.base.vertices + [2, 0, 4], atol=1e-12)


@pytest.mark.parametrize(
    ("transform", "words"),
    [
        ("keyframes: []", "transform.keyframes: "),
        ("keyframes: [{frame: 1, scale: 0}]", "keyframes[0].scale: must not be 0"),
        ("keyframes: [{frame: 1}], scale: 2", "scale: cannot stand beside keyframes"),
        ("interpolation: smooth", "belongs to keyframes, and there are none"),
        ("keyframes: [{frame: 1}, {frame: 1}]", "frame 1 is already given by keyframes[0]"),
        ("keyframes: [{frame: 1}, {frame: 2, scale: [1, -1, 1]}]", "mirrors otherwise than keyframes[0]"),
    ],
)
def test_keyframes_that_are_wrong(tmp_path, transform, words):
    assert words in fault(tmp_path, f"{{mesh: cube.obj, transform: {{{transform}}}}}")


# --- animations of glTF


def test_an_animation_is_played_in_the_job_s_time(tmp_path):
    file = one_square()
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (4, 0, 0)])
    file.write(tmp_path / "m.glb")
    source = moving(tmp_path, "{mesh: m.glb, animation: {start_frame: 10}}")
    assert source.scene_at(10) is source.base
    assert source.scene_at(34).vertices.min(axis=0).tolist() == [2, 0, 0]
    assert source.scene_at(34.5).vertices.min(axis=0) == pytest.approx([2 + 1 / 24, 0, 0])


def test_an_animated_object_may_be_on_keyframes_too(tmp_path):
    file = one_square()
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (4, 0, 0)])
    file.write(tmp_path / "m.glb")
    source = moving(tmp_path, f"{{mesh: m.glb, animation: {{}}, transform: {{keyframes: [{WAY}]}}}}")
    assert source.scene_at(3).vertices.min(axis=0) == pytest.approx([2 + 0.25, 0, 4])


def test_lights_of_the_file_move_with_it(tmp_path):
    file = one_square()
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 683}]}}
    file.node(extensions={"KHR_lights_punctual": {"light": 0}})
    file.animation(1, "translation", [0, 1], [(0, 0, 0), (0, 6, 0)])
    file.write(tmp_path / "m.glb")
    for how, place in (("animation: {}", [0, 3, 0]), (f"transform: {{keyframes: [{WAY}]}}", [4, 0, 8])):
        source = moving(tmp_path, f"{{mesh: m.glb, {how}}}", lights="lights: file\n")
        lamp = source.scene_at(12).lights[0]
        assert isinstance(lamp, Point)
        assert lamp.position == pytest.approx(np.array(place))


def test_an_object_that_grows_from_nothing_is_there_later(tmp_path):
    file = one_square()
    file.animation(0, "scale", [0, 1], [(0, 0, 0), (1, 1, 1)])
    file.write(tmp_path / "m.glb")
    source = moving(tmp_path, "{mesh: m.glb, animation: {}}")
    assert source.base.vertices.max() == 0
    assert source.scene_at(12).vertices.max() == pytest.approx(0.5)


# --- sequences


def test_a_sequence_shows_the_file_of_the_frame(tmp_path):
    sequence(tmp_path, (1, 2, 3))
    source = moving(tmp_path, "{mesh: cube.obj}", "{mesh: boat.####.obj, frames: 1-3}")
    assert source.base.objects == ("cube", "boat")
    for frame in (3, 1, 2):
        scene = source.scene_at(frame + 0.5)
        alone = load_scene(tmp_path / f"boat.{frame:04d}.obj")
        assert len(scene.triangles) == 12 + len(alone.triangles)
        ours = scene.triangles[scene.object == 1]
        np.testing.assert_array_equal(scene.vertices[ours], alone.vertices[alone.triangles])


@pytest.mark.parametrize(("hold", "shown"), [("nearest", [2, 2, 2, 5, 5, 5]), ("last", [2, 2, 2, 2, 5, 5])])
def test_missing_files_may_be_held(tmp_path, hold, shown):
    sequence(tmp_path, (2, 5))
    source = moving(tmp_path, f"{{mesh: boat.####.obj, frames: 1-6, hold: {hold}}}")
    sizes = [np.linalg.norm(source.scene_at(frame).vertices[0]) for frame in range(1, 7)]
    assert sizes == pytest.approx([1 + 0.01 * number for number in shown])


def test_missing_files_are_an_error_that_names_them(tmp_path):
    sequence(tmp_path, (1, 2, 3, 9))
    assert fault(tmp_path, "{mesh: boat.####.obj, frames: 1-9}") == (
        "moving.yaml:3:10: objects[0].mesh: boat.0004.obj, boat.0005.obj, boat.0006.obj and 2 more"
        " are missing from boat.####.obj (hold: nearest or hold: last shows others instead)"
    )


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("mesh: boat.####.obj", "objects[0].mesh: is a sequence (expected frames"),
        ("mesh: cube.obj, frames: 1-3", "frames: belongs to a sequence"),
        ("mesh: cube.obj, hold: last", "hold: belongs to a sequence"),
        ("mesh: boat.####.obj, frames: 3-1", "goes backwards"),
        ("mesh: boat.####.txt, frames: 1-3", "expected a mesh"),
    ],
)
def test_sequences_that_are_wrong(tmp_path, keys, words):
    assert words in fault(tmp_path, f"{{{keys}}}")


def test_frames_beyond_a_sequence_are_told_before_anything_is_drawn(tmp_path):
    job = tiny_sequence(tmp_path)
    stage = set_stage(load_job(job))
    with pytest.raises(SceneError, match=r"scene.yaml:3:\d+: objects\[0\].frames: frame 9 has no file of"):
        stage.views([1, 9])


def test_a_sequence_keeps_few_files(tmp_path):
    sequence(tmp_path, range(1, 9))
    source = moving(tmp_path, "{mesh: boat.####.obj, frames: 1-8}")
    for frame in range(1, 9):
        source.scene_at(frame)
    assert len(source.objects[0]._kept) == 2  # type: ignore[attr-defined]


# --- jobs


def tiny_sequence(folder: Path) -> Path:
    """The tiny job, with a ball of its own file in each frame."""
    job = write_tiny_job(folder)
    sequence(folder, range(1, 5))
    replaced(folder, "scene.yaml", "mesh: ball.obj", 'mesh: "boat.####.obj", frames: 1-4')
    return job


def test_every_file_of_a_sequence_counts_in_the_hash(tmp_path):
    job = load_job(tiny_sequence(tmp_path))
    before = job_sha256(job)
    assert job_sha256(job) == before
    (tmp_path / "boat.0003.obj").write_text(obj(CUBE, CUBE_FACES))
    assert job_sha256(job) != before


@pytest.mark.skipif(not can_fork(), reason="processes cannot fork here")
def test_workers_and_one_process_draw_the_same_moving_scene_in_bounded_memory(tmp_path):
    sequence(tmp_path, range(1, 7))
    source = moving(
        tmp_path,
        f"{{mesh: cube.obj, transform: {{keyframes: [{WAY}]}}}}",
        "{mesh: boat.####.obj, frames: 1-6, transform: {scale: 0.5}}",
    )
    job = write_job(tmp_path, (CUBE, CUBE_FACES), ball(), (2.1, 1.7, 2.9))
    (tmp_path / "job.yaml").write_text(
        (tmp_path / "job.yaml").read_text().replace("scene.obj", "moving.yaml")
    )
    stage = set_stage(load_job(tmp_path / "job.yaml"))
    assert source.base.objects == stage.scene.objects
    viewer = stage.views(job.frames)[0].viewer
    alone, together, made = new_buffers(stage), shared_buffers(stage), []
    with Pool(stage, [together], 2) as pool:
        for frame in (*range(1, 7), *range(1, 7)):
            draw_frame(stage.at(frame), viewer, alone)
            draw_frame(stage.at(frame), viewer, together, crew=pool)
            made.append(pool._arrays._made)
            for name in alone:
                np.testing.assert_array_equal(alone[name], together[name], err_msg=name)
    assert made[5] == made[-1]


def test_frames_of_a_moving_scene_hold_against_rays(tmp_path):
    write_job(tmp_path, (CUBE, CUBE_FACES), ball(0.5), (2.1, 1.7, 2.9), density=20)
    (tmp_path / "moving.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- mesh: scene.obj\n  transform:\n    keyframes:\n"
        "    - {frame: 1, scale: [1, 2, 1]}\n"
        "    - {frame: 4, translate: [0.4, 0, 0], rotate_deg: [0, 0, 90], scale: [1, 1, 2]}\n"
    )
    text = (tmp_path / "job.yaml").read_text().replace("scene.obj", "moving.yaml")
    (tmp_path / "job.yaml").write_text(text.replace("frames: 1", "frames: 1-4"))
    covered = []
    for frame in (2, 3):
        options = VerifyOptions(everything=True, threads=1, frame=frame)
        for one in verify(load_job(tmp_path / "job.yaml"), options):
            assert found(one.verdict) == {}
            covered.append(np.isfinite(one.images.channels["Z"]).tobytes())
    assert covered[0] != covered[1]


def test_info_says_what_moves(tmp_path):
    sequence(tmp_path, (1, 2, 3))
    moving(
        tmp_path,
        f"{{mesh: cube.obj, transform: {{keyframes: [{WAY}]}}}}",
        "{mesh: ball.obj}",
        "{mesh: boat.####.obj, frames: 1-3}",
    )
    info = describe(tmp_path / "moving.yaml")
    assert [value for key, value in info.lines if key == "moves"] == [
        "cube: 2 keyframes, frames 1 to 5",
        "boat: 3 numbered files, frames 1-3",
    ]
    assert "moves" in json.dumps(info.data)


def test_check_tells_the_frames_of_a_job_that_a_sequence_lacks(tmp_path):
    job = tiny_sequence(tmp_path)
    assert check_files([job]) == []
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-6")
    assert [problem.message.split(" of ")[0] for problem in check_files([job])] == ["frames 5-6 have no file"]
