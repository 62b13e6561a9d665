"""Motion: where everything a pixel shows will be in the next frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from tests.helpers.tiny_job import replaced, write_tiny_job

TURNING = "transform: {keyframes: [{frame: 1}, {frame: 4, rotate_deg: [10, 40, 0], translate: [0.1, 0, 0]}]}"


def stage_in(tmp_path, transform=TURNING, channels="rgba, Z, P, motion, triangle", density=32):
    job = write_tiny_job(tmp_path, f"{5 * density}, {3 * density}")
    replaced(tmp_path, "display.yaml", "pixels_per_metre: 32", f"pixels_per_metre: {density}")
    if transform:
        replaced(tmp_path, "scene.yaml", "mesh: ball.obj", f"mesh: ball.obj, {transform}")
    replaced(tmp_path, "job.yaml", "frames: 1-4", f"frames: 1-4\noutput: {{channels: [{channels}]}}")
    return set_stage(load_job(job))


def drawn(stage, frame):
    now = moment(stage, stage.views([frame])[0])
    buffers = new_buffers(stage)
    record = draw_moment(now, buffers)
    return now, buffers, record


def of_object(stage, frame, points):
    """World points (n, 3) in the space of the object."""
    matrix = stage.source.objects[0].item.world_from_mesh(frame)
    return (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T


def test_a_frame_is_warped_to_the_next_within_a_twentieth_of_a_pixel(tmp_path):
    """A turning object seen by a moving eye: what lies there in the next frame is the same point of it."""
    stage = stage_in(tmp_path, density=128)
    _, first, _ = drawn(stage, 2)
    _, second, _ = drawn(stage, 3)
    width, height = stage.layout.pages[0]
    y, x = np.divmod(np.flatnonzero(np.isfinite(first["Z"])), width)
    seen = y * width + x
    there = np.stack([x + first["motion.X"][seen], y + first["motion.Y"][seen]])
    low = np.floor(there).astype(int)
    share = there - low
    corners = [((low[1] + j) * width + low[0] + i) for j in (0, 1) for i in (0, 1)]
    inside = (low >= 0).all(axis=0) & (low[0] < width - 1) & (low[1] < height - 1)
    corners = [np.where(inside, corner, 0) for corner in corners]
    same = inside.copy()
    for corner in corners:
        same &= second["triangle"][corner] == first["triangle"][seen]
        same &= np.abs(stage.owners[corner]) == np.abs(stage.owners[seen])
    assert np.count_nonzero(same) > 2000
    across, down = [(1 - part, part) for part in share]
    weights = [across[i] * down[j] for j in (0, 1) for i in (0, 1)]

    def points(buffers, at):
        return np.stack([buffers[f"P.{axis}"][at] for axis in "XYZ"], axis=-1).astype(float)

    now = of_object(stage, 2, points(first, seen[same]))
    around = [of_object(stage, 3, points(second, corner[same])) for corner in corners]
    then = sum(weight[same, None] * point for weight, point in zip(weights, around, strict=True))
    step = np.linalg.norm(around[1] - around[0], axis=1).clip(1e-9)
    off = np.linalg.norm(then - now, axis=1) / step
    assert np.abs(there - np.stack((x, y)))[:, same].max() > 1, "nothing moves"
    assert np.quantile(off, 0.99) < 0.05
    assert np.median(off) < 0.01


def test_a_viewer_moving_before_a_still_scene_is_closed_form(tmp_path):
    stage = stage_in(tmp_path, transform="")
    now, buffers, _ = drawn(stage, 2)
    viewer = now.view.viewer
    seen = np.flatnonzero(np.isfinite(buffers["Z"]) & (stage.owners == 1))
    point = np.stack([buffers[f"P.{axis}"][seen] for axis in "XYZ"]).astype(float)
    # Facet 1 lies in the plane z = 0, 32 pixels a metre.
    eyes = (viewer.eye[:, None], viewer.then[:, None])
    pixel = [eye[:2] + (point[:2] - eye[:2]) * eye[2] / (eye[2] - point[2]) for eye in eyes]
    moved = 32 * (pixel[1] - pixel[0]) * [[1], [-1]]
    found = np.stack([buffers["motion.X"][seen], buffers["motion.Y"][seen]])
    turn = stage.layout.quilt_from_facet[0, :, :2]
    np.testing.assert_allclose(found, turn @ moved, atol=1e-4)


def test_what_rests_does_not_move_at_all(tmp_path):
    job = write_tiny_job(tmp_path, "160, 80")
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-4\noutput: {channels: [motion, Z]}")
    stage = set_stage(load_job(job))
    view = stage.views([4])[0]  # after the last keyframe the viewer stays
    buffers = new_buffers(stage)
    draw_moment(moment(stage, view), buffers)
    assert np.isfinite(buffers["Z"]).any()
    assert not buffers["motion.X"].any()
    assert not buffers["motion.Y"].any()


def test_any_number_of_workers_gives_the_same_motion(tmp_path):
    stage_in(tmp_path)
    found = []
    for threads in (1, 2):
        out = tmp_path / f"out{threads}"
        render(load_job(tmp_path / "job.yaml"), RenderOptions(frames=[1, 2], folder=out, threads=threads))
        found.append([(out / f"quilt/page_01.000{frame}.exr").read_bytes() for frame in (1, 2)])
    assert found[0] == found[1]


def sequence_in(tmp_path, second):
    job = write_tiny_job(tmp_path, "160, 80")
    ball = (tmp_path / "ball.obj").read_text()
    (tmp_path / "ball.0001.obj").write_text(ball)
    (tmp_path / "ball.0002.obj").write_text(second(ball))
    replaced(tmp_path, "scene.yaml", "mesh: ball.obj", 'mesh: "ball.####.obj", frames: 1-2')
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-2\noutput: {channels: [motion, Z]}")
    return set_stage(load_job(job))


def test_files_of_the_same_triangles_move(tmp_path):
    stage = sequence_in(tmp_path, lambda text: text.replace("v 0 0 -0.2", "v 0.2 0 -0.3"))
    _, buffers, record = drawn(stage, 1)
    assert np.abs(buffers["motion.X"]).max() > 1
    assert not record.warnings


def test_files_of_other_triangles_are_told_and_their_motion_is_none(tmp_path):
    stage = sequence_in(tmp_path, lambda text: text.replace("f 3 1 4", "f 3 1 4\nf 1 2 3"))
    _, buffers, record = drawn(stage, 1)
    assert not buffers["motion.X"].any()
    assert record.warnings == ("ball: the triangles of the next frame are others, motion is 0 there",)


def test_the_end_of_a_sequence_is_told(tmp_path):
    stage = sequence_in(tmp_path, lambda text: text)
    _, _, record = drawn(stage, 2)
    assert record.warnings == ("a sequence ends here: motion is that of a scene at rest",)


@pytest.mark.parametrize("name", ["motion", "cryptoobject"])
def test_what_cannot_be_resampled_is_refused_by_two_passes(tmp_path, name):
    job = write_tiny_job(tmp_path)
    text = f"render: {{method: twopass}}\noutput: {{channels: [rgba, {name}]}}"
    replaced(tmp_path, "job.yaml", "frames: 1-4", f"frames: 1-4\n{text}")
    with pytest.raises(Exception, match=f"output.channels.*{name} cannot be resampled"):
        load_job(job)


def test_motion_of_rays_is_that_of_triangles(tmp_path):
    stage = stage_in(tmp_path)
    _, buffers, _ = drawn(stage, 2)
    render_spec = stage.job.render.model_copy(update={"method": "raycast"})
    other = replace(stage, job=stage.job.model_copy(update={"render": render_spec}))
    _, rays, _ = drawn(other, 2)
    same = buffers["triangle"] == rays["triangle"]
    assert same.mean() > 0.99
    np.testing.assert_allclose(rays["motion.X"][same], buffers["motion.X"][same], atol=1e-4)


def test_images_of_parts_say_the_same(tmp_path):
    stage_in(tmp_path, channels="rgba, Z, motion, cryptoobject, cryptomaterial")
    job = tmp_path / "job.yaml"
    render(load_job(job), RenderOptions(frames=[1], folder=tmp_path / "layers", threads=1))
    replaced(tmp_path, "job.yaml", "output: {", "output: {parts: parts, ")
    render(load_job(job), RenderOptions(frames=[1], folder=tmp_path / "parts", threads=1))
    from quiltcli.formats.exr.image import read_parts
    from quiltcli.images.layers import read_view

    whole = read_exr(tmp_path / "layers/quilt/page_01.0001.exr")
    parts = read_parts(tmp_path / "parts/quilt/page_01.0001.exr")
    assert [part.name for part in parts] == ["rgba", "Z", "motion", "cryptoobject", "cryptomaterial"]
    assert [sum("cryptomatte/" in key for key in part.attributes) for part in parts] == [0, 0, 0, 4, 4]
    again = read_view(tmp_path / "parts/quilt/page_01.0001.exr")
    assert again.channels.keys() == whole.channels.keys()
    for name, pixels in whole.channels.items():
        np.testing.assert_array_equal(again.channels[name].view(np.uint8), pixels.view(np.uint8))
    assert {k: v for k, v in again.attributes.items() if k.startswith("crypto")} == {
        k: v for k, v in whole.attributes.items() if k.startswith("crypto")
    }
    # Facets are merged into a quilt of parts as into any other.
    render(load_job(job), RenderOptions(frames=[1], folder=tmp_path / "parts", threads=1, facets=[1]))


CURVED = {
    "inside of a cylinder": (
        "surfaces:\n- {kind: cylinder, radius: 1.5, height: 1.6, lit: inside, pixels: [512, 96]}",
        "position: [0.2, 0.1, 0.3], look_at: [0, 0, -1]",
        "position: [0.26, 0.12, 0.25], look_at: [0.1, 0, -1]",
    ),
    "outside of a sphere": (
        "surfaces:\n- {kind: sphere, radius: 0.9, pixels: [512, 256]}",
        "position: [0.3, 0.4, 2.6], look_at: [0, 0, 0]",
        "position: [0.42, 0.38, 2.5], look_at: [0, 0, 0]",
    ),
    "panorama": (
        "projection: {kind: equirect, pixels: [512, 256]}",
        "position: [0.2, 0.1, 0.3], look_at: [0, 0, -1]",
        "position: [0.26, 0.12, 0.25], look_at: [0.1, 0, -1]",
    ),
    "fisheye that turns with the view": (
        "projection: {kind: fisheye, fov_deg: 180, follows: view, pixels: [256, 256]}",
        "position: [0.2, 0.1, 1.3], look_at: [0, 0, -1]",
        "position: [0.2, 0.1, 1.3], look_at: [0.1, 0.05, -1]",
    ),
}


@pytest.mark.parametrize("name", CURVED)
@pytest.mark.parametrize("method", ["homography", "raycast"])
def test_on_curved_facets_a_point_is_found_where_motion_says(tmp_path, name, method):
    """The chart's ray a frame later, through the place motion names, passes the point's later place."""
    display, now_at, then_at = CURVED[name]
    write_tiny_job(tmp_path)
    (tmp_path / "display.yaml").write_text(f"quilt_display: 1\n{display}\n")
    replaced(tmp_path, "scene.yaml", "mesh: ball.obj", f"mesh: ball.obj, {TURNING}")
    far = 0.0 if "sphere" in name else -1.6
    replaced(tmp_path, "scene.yaml", "translate: [0.1, 0, 0]", f"translate: [0.1, 0, {far}]")
    replaced(tmp_path, "scene.yaml", "{frame: 1}", f"{{frame: 1, translate: [0, 0, {far}]}}")
    (tmp_path / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1-2\n"
        "output: {channels: [Z, P, motion, triangle]}\nviewer:\n  near: 0.05\n  far: 20\n  path:\n"
        f"    keyframes:\n    - {{frame: 1, {now_at}}}\n    - {{frame: 2, {then_at}}}\n"
        f"render: {{method: {method}, depth: radial}}\n"
    )
    stage = set_stage(load_job(tmp_path / "job.yaml"))
    _, buffers, _ = drawn(stage, 1)
    seen = np.flatnonzero(np.isfinite(buffers["Z"]) & (stage.owners > 0))
    assert seen.size > 200
    point = np.stack([buffers[f"P.{axis}"][seen] for axis in "XYZ"], axis=-1).astype(float)
    matrix = stage.source.objects[0].item.world_from_mesh(2)
    later = of_object(stage, 1, point) @ matrix[:3, :3].T + matrix[:3, 3]
    then = stage.views([2])[0].viewer
    rays = stage.rays(np.ones(1, bool), then).views[0]
    width = int(stage.layout.pages[0, 0])
    x, y = seen % width + 0.5, seen // width + 0.5
    right, down = buffers["motion.X"][seen], buffers["motion.Y"][seen]
    moved = (right != 0) | (down != 0)
    assert moved.mean() > 0.97
    assert np.hypot(right, down).max() > 2
    way = rays.rays(x + right, y + down)
    way /= np.linalg.norm(way, axis=0)
    to = (later - then.eye).T
    to /= np.linalg.norm(to, axis=0)
    step = rays.rays(x + 0.5, y) - rays.rays(x - 0.5, y)
    pixel = np.linalg.norm(step, axis=0) / np.linalg.norm(rays.rays(x, y), axis=0)
    off = np.linalg.norm(way - to, axis=0) / pixel
    assert off[moved].max() < 0.05


def test_what_rests_before_a_curved_facet_does_not_move_at_all(tmp_path):
    write_tiny_job(tmp_path)
    (tmp_path / "display.yaml").write_text(
        "quilt_display: 1\nsurfaces:\n- {kind: sphere, radius: 0.9, pixels: [128, 64]}\n"
    )
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-4\noutput: {channels: [motion, Z]}")
    _, buffers, _ = drawn(set_stage(load_job(tmp_path / "job.yaml")), 4)
    assert np.isfinite(buffers["Z"]).any()
    assert not buffers["motion.X"].any()
    assert not buffers["motion.Y"].any()
