"""Cameras for other renderers: their pictures are the facets' rasters."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli.group import main
from quiltcli.display import Facets, corner_pixels, load_display
from quiltcli.errors import DisplayError, OutputError
from quiltcli.exchange.cameras import blender, screens, usd
from quiltcli.exchange.cameras.cameras import Camera, Shot, camera_names, shots
from quiltcli.exchange.cameras.json import json_text
from quiltcli.exchange.cameras.write import write_cameras
from quiltcli.job import load_display_file, load_job
from quiltcli.render.setup import Stage, set_stage
from tests.helpers.tiny_job import replaced, write_tiny_job

PANELS = """quilt_display: 1
panels:
- {name: left, pixels: [80, 40], pitch: 5 cm, at: [-2, 1, 0], roll_deg: 30}
- {name: right, pixels: [60, 40], size: [3 m, 1.5 m], at: [1, 1, 1.5], yaw_deg: -90, pitch_deg: 10}
- {name: away, pixels: [60, 40], size: [3 m, 1.5 m], at: [0, 1, -4], yaw_deg: 180}
"""


def stage_of(folder: Path, *changes: tuple[str, str]) -> Stage:
    path = write_tiny_job(folder)
    (folder / "display.yaml").write_text(PANELS)
    for old, new in changes:
        replaced(folder, "job.yaml", old, new)
    return set_stage(load_job(path))


def found(stage: Stage) -> list[Shot]:
    return shots(stage.facets, stage.views(range(1, 5)))


def picture_corners(facets: Facets, facet: int) -> np.ndarray:
    """Normalized device coordinates (n, 2) that the facet's corners ought to have."""
    pixels = corner_pixels(facets)[facets.corner_start[facet] : facets.corner_start[facet + 1]]
    return np.asarray(pixels / facets.size[facet] * (2, -2) + (-1, 1))


def projected(view: Any, projection: Any, points: np.ndarray) -> np.ndarray:
    clip = np.column_stack((points, np.ones(len(points)))) @ (np.array(projection) @ np.array(view)).T
    assert (clip[:, 3] > 0).all()
    return np.asarray(clip[:, :2] / clip[:, 3:])


def test_corners_of_facets_are_corners_of_pictures(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    data = json.loads(json_text(found(stage)))
    assert [(frame["frame"], frame["eye"]) for frame in data["frames"]] == [
        (k, "center") for k in range(1, 5)
    ]
    for frame in data["frames"]:
        assert [camera["name"] for camera in frame["cameras"]] == ["left", "right"]
        for camera in frame["cameras"]:
            facet = camera["facet"] - 1
            corners = stage.facets.polygon(facet)
            seen = projected(camera["view"], camera["projection"], corners)
            np.testing.assert_allclose(seen, picture_corners(stage.facets, facet), atol=1e-9)
            assert camera["pixels"] == stage.facets.size[facet].tolist()


def test_the_window_is_where_the_picture_ends(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    for shot in found(stage):
        for camera in shot.cameras:
            local = stage.facets.polygon(camera.facet - 1) - camera.position
            x, y, ahead = (local @ axis for axis in camera.axes)
            left, right, bottom, top = camera.window
            np.testing.assert_allclose([(x / ahead).min(), (x / ahead).max()], [left, right], atol=1e-9)
            np.testing.assert_allclose([(y / ahead).min(), (y / ahead).max()], [bottom, top], atol=1e-9)
            # A right-handed camera, whose axis stands straight on its facet.
            assert np.linalg.det(camera.view[:3, :3]) == pytest.approx(1)
            np.testing.assert_allclose(camera.axes[2], -stage.facets.normal[camera.facet - 1], atol=1e-12)


@pytest.mark.parametrize("clip", ["planar", "distance"])
def test_what_the_viewer_may_see_lies_between_near_and_far(tmp_path: Path, clip: str) -> None:
    stage = stage_of(tmp_path)
    view = stage.views([1])[0]
    viewer = replace(view.viewer, clip=clip, look=np.array([0.6, 0.0, -0.8]))
    (shot,) = shots(stage.facets, [replace(view, viewers=(viewer,))])
    for camera in shot.cameras:
        left, right, bottom, top = camera.window
        x, y = np.meshgrid(np.linspace(left, right, 9), np.linspace(bottom, top, 9))
        rays = np.stack((x.ravel(), y.ravel(), np.ones(81)), axis=1) @ camera.axes
        reach = viewer.reach_of(rays.T)
        ahead = reach > 0
        # Along each ray: how far along the axis the viewer's own near and far planes lie.
        assert (viewer.near / reach[ahead] >= camera.near * (1 - 1e-12)).all()
        if ahead.all():
            assert (viewer.far / reach <= camera.far * (1 + 1e-12)).all()


def test_each_eye_has_cameras_of_its_own(tmp_path: Path) -> None:
    stage = stage_of(tmp_path, ("  path:", "  stereo: {separation: 0.2}\n  path:"))
    pair = found(stage)[:2]
    assert [shot.eye for shot in pair] == ["left", "right"]
    apart = pair[1].cameras[0].position - pair[0].cameras[0].position
    assert np.linalg.norm(apart) == pytest.approx(0.2)
    text = usd.usda_text(pair, Fraction(24))
    assert 'stereoRole = "left"' in text
    assert 'token productName = "left.right.####.exr"' in text


def test_a_mirrored_facet_is_refused_with_the_reason(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    (tmp_path / "display.yaml").write_text(PANELS.replace("roll_deg: 30", "mirror: true"))
    facets = load_display(load_display_file(tmp_path / "display.yaml"))
    with pytest.raises(DisplayError, match=r"facet 1 \(left\) is mirrored, and no camera makes"):
        shots(facets, stage.views([1]))


def test_names_are_fit_for_files(tmp_path: Path) -> None:
    facets = stage_of(tmp_path).facets
    assert camera_names(replace(facets, names=("a", "b/c", "a"))) == (
        "facet_0001",
        "facet_0002",
        "facet_0003",
    )


def test_usd_cameras_read_back_put_corners_on_corners(tmp_path: Path) -> None:
    pxr = pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom

    assert pxr
    stage = stage_of(tmp_path)
    (tmp_path / "cameras.usda").write_text(usd.usda_text(found(stage), Fraction(30000, 1001)))
    read = Usd.Stage.Open(str(tmp_path / "cameras.usda"))
    assert (read.GetStartTimeCode(), read.GetEndTimeCode()) == (1, 4)
    for name, facet in (("left", 0), ("right", 1)):
        camera = UsdGeom.Camera(read.GetPrimAtPath(f"/cameras/{name}"))
        for frame in (1, 3):
            frustum = camera.GetCamera(frame).frustum
            matrix = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
            for corner, wanted in zip(
                stage.facets.polygon(facet), picture_corners(stage.facets, facet), strict=True
            ):
                seen = matrix.Transform(Gf.Vec3d(*corner.tolist()))
                # Apertures are single precision in USD.
                np.testing.assert_allclose([seen[0], seen[1]], wanted, atol=2e-6)
    product = read.GetPrimAtPath("/Render/right")
    assert tuple(product.GetAttribute("resolution").Get()) == (60, 40)
    assert product.GetAttribute("pixelAspectRatio").Get() == pytest.approx(0.05 / 0.0375)


def blender_projected(track: dict[str, Any], key: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """What Blender's camera model makes of points: lens and shifts, fitted to the picture's width."""
    there = np.column_stack((points[:, 0], -points[:, 2], points[:, 1], np.ones(len(points))))
    local = there @ np.linalg.inv(np.array(key["matrix"])).T
    width, height = track["pixels"]
    tall = height / width * track["aspect"][1] / track["aspect"][0]
    x = local[:, 0] / -local[:, 2] * key["lens"] / key["sensor_width"] - key["shift_x"]
    y = local[:, 1] / -local[:, 2] * key["lens"] / key["sensor_width"] - key["shift_y"]
    return np.column_stack((2 * x, 2 * y / tall))


def test_the_script_for_blender_puts_corners_on_corners(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    text = blender.script(found(stage), Fraction(30000, 1001))
    compile(text, "cameras.py", "exec")
    match = re.search(r'json.loads\(r"""\n(.*)\n"""\)', text)
    assert match is not None
    data = json.loads(match[1])
    assert data["fps"] == [30, pytest.approx(1.001)]
    assert data["frames"] == [1, 4]
    for facet, track in enumerate(data["tracks"]):
        for key in track["keys"]:
            seen = blender_projected(track, key, stage.facets.polygon(facet))
            np.testing.assert_allclose(seen, picture_corners(stage.facets, facet), atol=1e-9)


def test_a_window_too_wide_for_blender_s_shortest_lens_has_a_wider_sensor(tmp_path: Path) -> None:
    """Blender keeps lenses at 1 mm or more: a facet seen from its edge has a window wider than 36."""
    camera = replace(found(stage_of(tmp_path))[0].cameras[0], window=(-50.25, -5.0, 2.0, 3.0))
    key = json.loads(
        re.findall(r'r"""\n(.*)\n"""', blender.script([Shot(1, "center", (camera,))], Fraction(24)))[0]
    )
    found_key = key["tracks"][0]["keys"][0]
    assert found_key["lens"] >= 1
    assert found_key["lens"] / found_key["sensor_width"] == pytest.approx(1 / 45.25, rel=1e-12)


def test_usd_has_the_window_in_doubles_and_in_binary(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom

    stage = stage_of(tmp_path)
    for name in ("a.usda", "a.usdc"):
        write_cameras(stage, range(1, 5), tmp_path / name)
    assert (tmp_path / "a.usdc").read_bytes()[:8] == b"PXR-USDC"
    for name in ("a.usda", "a.usdc"):
        read = Usd.Stage.Open(str(tmp_path / name))
        for shot in found(stage):
            for camera in shot.cameras:
                prim = read.GetPrimAtPath(f"/cameras/{camera.name}")
                view = UsdGeom.Camera(prim).GetCamera(shot.frame).frustum.ComputeViewMatrix()
                left, right, bottom, top = prim.GetAttribute("quilt:window").Get(shot.frame)
                corners = stage.facets.polygon(camera.facet - 1)
                local = np.array([view.Transform(Gf.Vec3d(*corner.tolist())) for corner in corners])
                x, y = local[:, 0] / -local[:, 2], local[:, 1] / -local[:, 2]
                seen = np.column_stack(
                    ((2 * x - left - right) / (right - left), (2 * y - bottom - top) / (top - bottom))
                )
                np.testing.assert_allclose(seen, picture_corners(stage.facets, camera.facet - 1), atol=1e-9)


CANVAS = ("scene: scene.yaml", "scene: scene.yaml\nlayout: {size: [260, 160]}")


def unreal_corners(screen: dict[str, Any]) -> np.ndarray:
    """Lower left, lower right, upper right, upper left, by Unreal's rotator, as points of our world."""
    p, y, r = (np.radians(screen["rotation"][name]) for name in ("pitch", "yaw", "roll"))
    right = np.array([
        np.sin(r) * np.sin(p) * np.cos(y) - np.cos(r) * np.sin(y),
        np.sin(r) * np.sin(p) * np.sin(y) + np.cos(r) * np.cos(y),
        -np.sin(r) * np.cos(p),
    ])  # fmt: skip
    up = np.array([
        -(np.cos(r) * np.sin(p) * np.cos(y) + np.sin(r) * np.sin(y)),
        np.cos(y) * np.sin(r) - np.cos(r) * np.sin(p) * np.sin(y),
        np.cos(r) * np.cos(p),
    ])  # fmt: skip
    middle = np.array([screen["location"][axis] for axis in "xyz"])
    wide, high = screen["size"]["width"] / 2, screen["size"]["height"] / 2
    there = [middle + a * wide * right + b * high * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array([(y, z, -x) for x, y, z in there]) / 100


def test_ndisplay_gets_screens_where_facets_are(tmp_path: Path) -> None:
    stage_of(tmp_path, CANVAS)
    floor = "- {name: floor, pixels: [60, 40], size: [3 m, 2 m], at: [0, 0, 1], pitch_deg: 90, yaw_deg: 30}\n"
    places = iter((0, 80, 140, 200))
    lines = [line.replace("}", f", place: {{at: [{next(places)}, 8]}}}}") if line.startswith("-") else line
             for line in (PANELS + floor).splitlines()]  # fmt: skip
    (tmp_path / "display.yaml").write_text("\n".join(lines))
    stage = set_stage(load_job(tmp_path / "job.yaml"))
    write_cameras(stage, [1], tmp_path / "a.ndisplay")
    data = json.loads((tmp_path / "a.ndisplay").read_text())["nDisplay"]
    screens_found = data["scene"]["screens"]
    assert list(screens_found) == ["screen_left", "screen_right", "screen_away", "screen_floor"]
    for facet, screen in enumerate(screens_found.values()):
        np.testing.assert_allclose(unreal_corners(screen), stage.facets.polygon(facet), atol=1e-9)
    # A wall that faces +Z is looked at along Unreal's X, from centimetres away.
    eye = data["scene"]["cameras"]["DefaultViewPoint"]["location"]
    x, y, z = stage.views([1])[0].viewer.eye * 100
    assert (eye["x"], eye["y"], eye["z"]) == pytest.approx((-z, x, y))
    viewports = data["cluster"]["nodes"]["node_1"]["viewports"]
    for name, viewport in viewports.items():
        assert viewport["projectionPolicy"]["parameters"]["screen"] == f"screen_{name}"
        row = stage.facets.names.index(name)
        region = [viewport["region"][key] for key in ("x", "y", "w", "h")]
        assert region == [*stage.layout.quilt_from_facet[row][:, 2], *stage.layout.size[row]]


def test_ndisplay_has_no_turned_viewports(tmp_path: Path) -> None:
    stage_of(tmp_path, CANVAS)
    turned = PANELS.replace("roll_deg: 30", "place: {at: [0, 0], rotate: 90}")
    (tmp_path / "display.yaml").write_text(turned)
    stage = set_stage(load_job(tmp_path / "job.yaml"))
    with pytest.raises(DisplayError, match=r"facet 1 \(left\) is turned or mirrored in the quilt"):
        write_cameras(stage, [1], tmp_path / "a.ndisplay")


def numbers(text: str | None) -> list[float]:
    assert text is not None
    return list(map(float, text.split()))


def test_paraview_gets_named_corners(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    machines = ElementTree.fromstring(screens.pvx_text(stage.facets)).findall("Machine")
    assert [machine.get("Name") for machine in machines] == ["left", "right", "away"]
    assert machines[1].get("Geometry") == "60x40+0+0"
    polygon = stage.facets.polygon(1)
    for key, corner in (("LowerLeft", 0), ("LowerRight", 1), ("UpperRight", 2)):
        np.testing.assert_allclose(numbers(machines[1].get(key)), polygon[corner], atol=1e-11)


def test_sgct_gets_named_corners_from_the_eye(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    data = json.loads(screens.sgct_text(stage.facets, found(stage)))
    window = data["nodes"][0]["windows"][0]
    assert window["size"] == {"x": 80, "y": 40}
    (viewport,) = window["viewports"]
    plane = viewport["projection"]
    assert plane["type"] == "ProjectionPlane"
    eye = stage.views([1])[0].viewer.eye
    for key, corner in (("lowerleft", 0), ("upperright", 2), ("upperleft", 3)):
        place = [plane[key][axis] for axis in "xyz"]
        np.testing.assert_allclose(place, stage.facets.polygon(0)[corner] - eye, atol=1e-11)


def test_the_command_writes_what_the_name_asks_for(tmp_path: Path) -> None:
    path = write_tiny_job(tmp_path)
    for name in ("a.json", "a.py", "a.usda", "a.pvx", "a.sgct.json"):
        result = CliRunner().invoke(main, ["cameras", str(path), "-f", "2-3", "-o", str(tmp_path / name)])
        assert result.exit_code == 0, result.output
        assert result.output.startswith("4 cameras ")
    assert "ProjectionPlane" in (tmp_path / "a.sgct.json").read_text()
    again = CliRunner().invoke(main, ["cameras", str(path), "-o", str(tmp_path / "a.json")])
    assert again.exit_code == 2
    assert "exists already" in again.output


def test_gltf_is_refused_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="glTF has no cameras whose window is off their axis"):
        write_cameras(stage_of(tmp_path), [1], tmp_path / "a.glb")


def test_a_camera_is_unlike_others_only_where_it_must_be(tmp_path: Path) -> None:
    stage = stage_of(tmp_path)
    first, second = (shot.cameras[0] for shot in found(stage)[:2])
    assert isinstance(first, Camera)
    np.testing.assert_array_equal(first.axes, second.axes)
    assert first.window != second.window
