"""Files of light fields: rings, poses, pictures that are missing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli.group import main
from quiltcli.errors import JobError
from quiltcli.job import check_file, load_lightfield_file
from quiltcli.lightfield import load_field
from quiltcli.lightfield.cameras import ring_cameras
from quiltcli.lightfield.transforms import read_transforms
from tests.helpers.ring_photos import field_text, write_pictures


def drawn(folder: Path, views: int = 6, heights: tuple[float, ...] = (0.0, 0.2), **more: object) -> Path:
    """A small light field on disk; returns its file."""
    path = folder / "field.yaml"
    path.write_text(field_text(views, list(heights), size=8, **more))  # type: ignore[arg-type]
    write_pictures(ring_cameras(load_lightfield_file(path)), folder)
    return path


def test_cameras_stand_on_the_ring_and_look_at_the_axis(tmp_path: Path) -> None:
    cameras = ring_cameras(load_lightfield_file(drawn(tmp_path, 4, (0.0, 0.5))))
    low, high = cameras.rows
    np.testing.assert_allclose(low.position[1], [0, 0, 1], atol=1e-15)  # clockwise: from +X to +Z
    np.testing.assert_allclose(low.rotation[0], [[0, 0, -1], [0, -1, 0], [-1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(high.rotation[0, 2], np.array([-1, -0.5, 0]) / 1.25**0.5)
    assert low.view.tolist() == [0, 1, 2, 3]


def test_a_camera_that_turns_the_other_way_has_its_views_in_the_other_order(tmp_path: Path) -> None:
    path = drawn(tmp_path, 4, (0.0,), camera_turns="anticlockwise", first_deg=90)
    row = ring_cameras(load_lightfield_file(path)).rows[0]
    np.testing.assert_allclose(row.azimuth, np.arange(4) * np.pi / 2, atol=1e-12)
    assert row.view.tolist() == [1, 0, 3, 2]


def test_level_and_tilted_cameras(tmp_path: Path) -> None:
    lens = {"focal": [60.0, 60.0], "size": [8, 8]}
    level = load_lightfield_file(drawn(tmp_path, 4, (0.3,), camera=lens))
    np.testing.assert_allclose(ring_cameras(level).rows[0].rotation[0, 2], [-1, 0, 0], atol=1e-15)
    tilted = load_lightfield_file(drawn(tmp_path, 4, (0.3,), camera={**lens, "tilt_deg": -30}))
    np.testing.assert_allclose(ring_cameras(tilted).rows[0].rotation[0, 2], [-(0.75**0.5), -0.5, 0])


def test_missing_views_are_named(tmp_path: Path) -> None:
    path = drawn(tmp_path)
    for name in ("h01/v0002.png", "h02/v0006.png"):
        (tmp_path / name).unlink()
    with pytest.raises(JobError) as caught:
        load_field(load_lightfield_file(path))
    assert [Path(problem.file).name for problem in caught.value.problems] == ["v0002.png", "v0006.png"]
    run = CliRunner().invoke(main, ["check", str(path)])
    assert run.exit_code == 1
    assert "h02/v0006.png: no such picture of the light field" in run.output


def test_all_pictures_missing_is_one_short_message(tmp_path: Path) -> None:
    path = tmp_path / "field.yaml"
    path.write_text(field_text(288, [0.0]))
    with pytest.raises(JobError, match="and 276 problems more"):
        load_field(load_lightfield_file(path))


def test_numbers_begin_where_the_file_says_and_frames_have_pictures_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "field.yaml"
    name = "f{frame:03}_{row}_{view:02}.png"
    path.write_text(field_text(3, [0.0, 1.0], images=name, first_view=0, first_row=5))
    file = load_lightfield_file(path)
    assert file.is_animated
    with pytest.raises(JobError) as caught:
        load_field(file, (7,))
    found = [Path(problem.file).name for problem in caught.value.problems]
    assert found == [f"f007_{row}_{view:02}.png" for row in (5, 6) for view in (0, 1, 2)]
    assert CliRunner().invoke(main, ["check", str(path)]).exit_code == 0  # the job says which frames


def test_pictures_of_another_size_and_damaged_ones_are_told(tmp_path: Path) -> None:
    path = drawn(tmp_path, 3, (0.0,))
    (tmp_path / "h01/v0001.png").write_bytes(b"no picture")
    field = load_field(load_lightfield_file(path))
    with pytest.raises(JobError, match="is no picture"):
        field.pictures[tmp_path / "h01/v0001.png"]
    path.write_text(path.read_text().replace("[8, 8]", "[9, 8]"))
    field = load_field(load_lightfield_file(path))
    with pytest.raises(JobError, match="has 8 × 8 pixels, expected 9 × 8"):
        field.pictures[tmp_path / "h01/v0002.png"]


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"images": "v0001.png"}, "images: names the same file for every view"),
        ({"images": "v{view:04}.png"}, "images: names the same file for every row"),
        ({"images": "{column}.png"}, "images: expected a name with {row}, {view} and {frame} in it"),
        ({"heights": [0.2, 0.1]}, "heights[1]: must be above the row before (0.2), got 0.1"),
        ({"heights": {"first": 0, "step": 0, "count": 2}}, "heights.step: must be greater than 0"),
        ({"camera": {"size": [8, 8]}}, "camera.focal: missing key (or transforms"),
        ({"focus": "depth"}, "depths: missing key (focus: depth needs depth maps)"),
        (
            {"focus": "axes"},
            "focus: expected mirror, axis or depth, got the text 'axes' (did you mean 'axis'?)",
        ),
        ({"camera_turns": "left"}, "camera_turns: expected clockwise or anticlockwise"),
    ],
)
def test_every_mistake_is_told_with_its_key(tmp_path: Path, more: dict[str, object], expected: str) -> None:
    more = {"heights": [0.0, 0.1], **more}
    (tmp_path / "field.yaml").write_text(field_text(4, **more))  # type: ignore[arg-type]
    assert expected in "\n".join(map(str, check_file(tmp_path / "field.yaml")))


def transforms(folder: Path, up_axis: str = "y", **changes: object) -> Path:
    """The poses of a small light field as transforms.json, and a file that names it."""
    cameras = ring_cameras(load_lightfield_file(drawn(folder)))
    frames = []
    for r, row in enumerate(cameras.rows):
        for k, view in enumerate(row.view.tolist()):
            pose = np.eye(4)
            pose[:3, :3] = (row.rotation[k] * [[1], [-1], [-1]]).T
            pose[:3, 3] = row.position[k]
            if up_axis == "z":
                pose = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]) @ pose
            name = f"h{r + 1:02}/v{view + 1:04}"
            frames.append({"file_path": name, "transform_matrix": pose.tolist()})
    data = {"camera_angle_x": 2 * np.arctan(0.07), "frames": frames[::-1], **changes}
    (folder / "transforms.json").write_text(json.dumps(data))
    path = folder / "posed.yaml"
    path.write_text(f"quilt_lightfield: 1\ncamera: {{transforms: transforms.json, up_axis: {up_axis}}}\n")
    return path


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_poses_say_the_same_as_a_ring(tmp_path: Path, up_axis: str) -> None:
    field = load_field(load_lightfield_file(transforms(tmp_path, up_axis)))
    ring = load_field(load_lightfield_file(tmp_path / "field.yaml"))
    assert field.cameras.distance == pytest.approx(1)
    np.testing.assert_allclose(field.cameras.lens.focal, ring.cameras.lens.focal)
    assert field.cameras.lens.size == (8, 8)  # of the pictures themselves
    for r, (found, expected) in enumerate(zip(field.cameras.rows, ring.cameras.rows, strict=True)):
        np.testing.assert_allclose(found.position, expected.position, atol=1e-12)
        np.testing.assert_allclose(found.rotation, expected.rotation, atol=1e-12)
        files = [field.picture(r, int(view), 1) for view in found.view]
        assert files == [ring.picture(r, int(view), 1) for view in expected.view]


def test_poses_that_lie_on_no_ring_are_refused(tmp_path: Path) -> None:
    transforms(tmp_path)
    path = tmp_path / "transforms.json"
    data = json.loads(path.read_text())
    data["frames"][4]["transform_matrix"][0][3] *= 1.1
    path.write_text(json.dumps(data))
    with pytest.raises(JobError, match=r"frames\[4\]: is .* m from the axis, the ring 1 m"):
        read_transforms(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1]", "is no file of poses"),
        ("{", "is no JSON"),
        ('{"frames": []}', "has no frames"),
        ('{"frames": [{"file_path": "a.png"}]}', "frames[0]: has no transform_matrix"),
        ('{"frames": [{"transform_matrix": [[1,2,3,4],[1,2,3,4],[0,0,0,1]]}]}', "is no rotation and shift"),
        (
            '{"frames": [{"transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,0]], "file_path": "a"}]}',
            "frames[0]: names a, and there is no such picture",
        ),
    ],
)
def test_what_is_no_file_of_poses_is_told(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "transforms.json"
    path.write_text(text)
    with pytest.raises(JobError) as caught:
        read_transforms(path)
    assert message in str(caught.value)


def test_a_lens_is_needed(tmp_path: Path) -> None:
    path = transforms(tmp_path, camera_angle_x=None)
    with pytest.raises(JobError, match="has no lens"):
        load_field(load_lightfield_file(path))


def test_keys_that_a_file_of_poses_says_cannot_stand_beside_it(tmp_path: Path) -> None:
    path = transforms(tmp_path)
    path.write_text(path.read_text() + "views: 6\n")
    assert "views: cannot stand beside camera.transforms" in str(check_file(path)[0])


def test_info_says_what_a_light_field_is(tmp_path: Path) -> None:
    run = CliRunner().invoke(main, ["info", str(drawn(tmp_path))])
    assert run.exit_code == 0, run.output
    assert "12 in 2 rows, 1 m away" in run.output
    assert "60" in run.output.splitlines()[-1]
