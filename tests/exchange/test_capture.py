"""Light fields of scenes: taken from a ring, and shown again from between its places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner, Result

from quiltcli.cli.group import main
from quiltcli.errors import JobError
from quiltcli.exchange.capture import parse_heights
from quiltcli.formats.exr.image import read_exr
from quiltcli.geometry import FloatArray
from quiltcli.job import load_lightfield_file
from quiltcli.lightfield import Rays, load_field, rebin
from quiltcli.lightfield.pictures import read_picture


def write_scene(folder: Path, moves: str = "") -> Path:
    """A smoothly coloured ball of 4 cm that is not in the middle, and a small one beside it."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    mesh.apply_translation([0.01, 0.005, -0.01])
    small = trimesh.creation.icosphere(subdivisions=2, radius=0.012)
    small.apply_translation([0.045, 0.03, 0.01])
    whole = trimesh.util.concatenate([mesh, small])
    colours = np.rint(255 * (0.5 + 0.4 * np.sin(whole.vertices * 90 + [0, 1, 2]))).astype(int)
    head = ["ply", "format ascii 1.0", f"element vertex {len(whole.vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"] + [
        f"property uchar {c}" for c in ("red", "green", "blue")
    ]
    head += [f"element face {len(whole.faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [
        f"{x:.7f} {y:.7f} {z:.7f} {r} {g} {b}"
        for (x, y, z), (r, g, b) in zip(whole.vertices, colours, strict=True)
    ]
    rows += ["3 " + " ".join(map(str, face)) for face in whole.faces.tolist()]
    (folder / "balls.ply").write_text("\n".join(head + rows) + "\n")
    scene = folder / "scene.yaml"
    scene.write_text(f"quilt_scene: 1\nobjects: [{{mesh: balls.ply, material: {{unlit: true}}{moves}}}]\n")
    return scene


def quilt(*words: object) -> Result:
    return CliRunner().invoke(main, ["capture", *map(str, words)])


def captured(folder: Path, name: str, *words: object) -> Path:
    run = quilt(write_scene(folder), "-o", folder / name, "--format", "exr", "--size", "96x96", *words)
    assert run.exit_code == 0, run.output
    return folder / name


def seen_from(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Light (P, 3) of the second of two views, the camera's place, and the rays' ways (P, 3)."""
    field = load_field(load_lightfield_file(folder / "lightfield.yaml"))
    row, lens = field.cameras.rows[0], field.cameras.lens
    y, x = np.mgrid[: lens.size[1], : lens.size[0]] + 0.5
    way = np.stack(
        ((x - lens.centre[0]) / lens.focal[0], (y - lens.centre[1]) / lens.focal[1], np.ones_like(x)), axis=-1
    ).reshape(-1, 3)
    light = read_picture(field.picture(0, 1, 1)).reshape(-1, 3)
    return light, row.position[1], way @ row.rotation[1]


@pytest.mark.parametrize(("focus", "least"), [("mirror", 24.0), ("depth", 27.0)])
def test_what_is_captured_shows_the_scene_from_anywhere_between(
    tmp_path: Path, focus: str, least: float
) -> None:
    """From nearer, between two rows and half-way between two views, against a picture drawn from there."""
    depths = ["--depths"] if focus == "depth" else []
    ring = captured(tmp_path, "ring", "--views", 45, "--heights", "0.15,0.25", *depths)
    # At 180° the 45 views leave a gap whose middle that is.
    light, eye, way = seen_from(captured(tmp_path, "two", "--views", 2, "--distance", 0.8, "--heights", 0.16))
    field = load_field(load_lightfield_file(ring / "lightfield.yaml"))
    assert field.file.focus == focus
    # For want of a mirror, what is nearest to the axis.
    along = -np.sum(eye * way, axis=1) / np.sum(way * way, axis=1)
    rays = Rays(np.broadcast_to(eye, way.shape), eye + along[:, None] * way, eye)
    psnr = -10 * np.log10(np.mean((rebin(field, rays) - light) ** 2))
    assert psnr >= least
    # The same field, turned by 15°, is not what is seen from there: the figure can tell.
    text = (ring / "lightfield.yaml").read_text()
    (ring / "turned.yaml").write_text(text.replace("first_deg: 0\n", "first_deg: 15\n"))
    turned = rebin(load_field(load_lightfield_file(ring / "turned.yaml")), rays)
    assert -10 * np.log10(np.mean((turned - light) ** 2)) < psnr - 6


def test_depth_maps_are_distances_ahead(tmp_path: Path) -> None:
    folder = captured(tmp_path, "ring", "--views", 2, "--heights", "0", "--depths")
    depth = read_exr(folder / "z0001.exr").channels["Z"]
    assert depth[48, 48] == pytest.approx(1 - 0.01 - np.sqrt(0.04**2 - 0.01**2 - 0.005**2), abs=1e-3)


def test_pictures_are_named_as_the_file_says_and_nothing_is_overwritten(tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    words = (scene, "-o", tmp_path / "ring", "--views", 3, "--heights", "0:0.1:0.1", "--size", "16x12")
    run = quilt(*words)
    assert run.exit_code == 0, run.output
    assert run.stdout.strip() == str(tmp_path / "ring" / "lightfield.yaml")
    names = sorted(
        path.relative_to(tmp_path / "ring").as_posix() for path in (tmp_path / "ring").rglob("*.png")
    )
    assert names == [f"h0{row}/v000{view}.png" for row in (1, 2) for view in (1, 2, 3)]
    again = quilt(*words)
    assert again.exit_code == 2
    assert "exists already" in again.output
    assert quilt(*words, "--overwrite").exit_code == 0
    assert CliRunner().invoke(main, ["check", str(tmp_path / "ring" / "lightfield.yaml")]).exit_code == 0


def test_frames_of_a_job_become_an_animated_field(tmp_path: Path) -> None:
    moves = (
        ", transform: {keyframes: [{frame: 1, translate: [0, 0, 0]}, {frame: 3, translate: [0, 0.02, 0]}]}"
    )
    write_scene(tmp_path, moves)
    (tmp_path / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "display.yaml").write_text(
        "quilt_display: 1\nmesh: box.obj\nresolution: {pixels_per_metre: 9}\n"
    )
    job = tmp_path / "job.yaml"
    job.write_text(
        "quilt_job: 1\ndisplay: display.yaml\nscene: scene.yaml\nframes: 1-3\nviewer: {near: 0.1, far: 9,"
        " path: {keyframes: [{frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}]}}\n"
    )
    run = quilt(job, "-o", tmp_path / "ring", "--views", 2, "--size", "24x24", "-f", "1-3", "--fov", 9)
    assert run.exit_code == 0, run.output
    file = load_lightfield_file(tmp_path / "ring" / "lightfield.yaml")
    assert file.is_animated
    field = load_field(file, (1, 2, 3))
    first, last = (read_picture(field.picture(0, 0, frame)) for frame in (1, 3))
    assert np.flatnonzero(first.any(axis=(1, 2)))[0] > np.flatnonzero(last.any(axis=(1, 2)))[0]  # it rises


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--heights", "0.2,0.1"], "expected heights from low to high"),
        (["--heights", "low"], "expected heights such as 0,0.1,0.2"),
        (["--distance", "0"], "expected a distance greater than 0"),
        (["--distance", "0.03"], "to the cameras (move them, or give a fov)"),
        (["--fov", "180"], "expected a field of view from 0 to 170 degrees"),
        (["--format", "gif"], "expected png or exr as format"),
    ],
)
def test_rings_that_cannot_be_are_told(tmp_path: Path, words: list[str], expected: str) -> None:
    run = quilt(write_scene(tmp_path), "-o", tmp_path / "ring", *words)
    assert run.exit_code == 2
    assert expected in run.output
    assert not (tmp_path / "ring").exists()


def test_heights_as_text() -> None:
    assert parse_heights("0.1") == (0.1,)
    assert parse_heights("-0.1,0.2") == (-0.1, 0.2)
    assert parse_heights("0:0.3:0.1") == (0, 0.1, 0.2, 0.3)
    for text in ("0:1", "0:1:0", "1:0:0.1", "a", "inf", "0:9:0.0001"):
        with pytest.raises(JobError):
            parse_heights(text)
