"""Normal maps on surfaces whose bent normals can be written down."""

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

import quiltcli

WALL = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
TILT = (0.6, 0.0, 0.8)


def flat_map(path, normal):
    """A picture of one normal everywhere."""
    value = np.rint((np.array(normal) * 0.5 + 0.5) * 65535).astype(np.uint16)
    image = OpenImageIO.ImageBuf(np.tile(value, (4, 4, 1)))
    assert image.write(str(path))
    return np.round(value / 65535 * 2 - 1, 6)


def seen_normals(folder, mesh, *, eye=(0, 0, 3), keys="", name="n.png", channel="N"):
    """Unit normals (H, W, 3) of what a display shows of a mesh, and where it shows it."""
    (folder / "m.obj").write_text(mesh)
    side = 1 if eye[2] > 0 else -1
    corners = [(-0.8 * side, -0.8), (0.8 * side, -0.8), (0.8 * side, 0.8), (-0.8 * side, 0.8)]
    (folder / "d.obj").write_text("".join(f"v {x} {y} {side}\n" for x, y in corners) + "f 1 2 3 4\n")
    (folder / "d.yaml").write_text("quilt_display: 1\nmesh: d.obj\nresolution: {facet_pixels: [40, 40]}\n")
    (folder / "s.yaml").write_text(
        f"quilt_scene: 1\nobjects:\n- mesh: m.obj\n  material: {{textures: {{normal: {name}{keys}}}}}\n"
    )
    (folder / "j.yaml").write_text(
        "quilt_job: 1\ndisplay: d.yaml\nscene: s.yaml\nframes: 1\noutput: {channels: [rgba, N]}\n"
        "viewer: {near: 0.1, far: 9, path: {keyframes: "
        f"[{{frame: 1, position: {list(eye)}, look_at: [0, 0, 0]}}]}}}}\n"
    )
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    picture = frame.facet(1)
    normals = np.stack([picture[f"N.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float64)
    return normals, picture["A"] > 0


def test_red_goes_along_u_and_green_to_the_upper_edge(tmp_path):
    written = flat_map(tmp_path / "n.png", (0.48, 0.6, 0.64))
    normals, shown = seen_normals(tmp_path, WALL + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
    np.testing.assert_allclose(normals[shown], np.tile(written, (shown.sum(), 1)), atol=1e-3)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ("vt 1 0\nvt 0 0\nvt 0 1\nvt 1 1\n", (-0.48, 0.6, 0.64)),  # seen mirrored
        ("vt 0 1\nvt 0 0\nvt 1 0\nvt 1 1\n", (-0.6, 0.48, 0.64)),  # turned by a quarter: u goes up
        ("vt 0 0\nvt 3 0\nvt 3 1\nvt 0 1\n", (0.48, 0.6, 0.64)),  # stretched
        ("vt 0 0\nvt 0 0\nvt 0 0\nvt 0 0\n", None),  # without any direction: some unit normal
    ],
)
def test_maps_turn_with_texture_coordinates(tmp_path, corners, expected):
    flat_map(tmp_path / "n.png", (0.48, 0.6, 0.64))
    normals, shown = seen_normals(tmp_path, WALL + corners + "f 1/1 2/2 3/3 4/4\n")
    if expected is None:
        np.testing.assert_allclose(np.linalg.norm(normals[shown], axis=-1), 1, atol=2e-3)
    else:
        np.testing.assert_allclose(normals[shown], np.tile(expected, (shown.sum(), 1)), atol=1e-3)


def test_a_hill_seen_from_behind_is_a_hollow(tmp_path):
    """The surface is the same one: its normal is that of the front, the other way."""
    written = flat_map(tmp_path / "n.png", (0.48, 0.6, 0.64))
    mesh = WALL + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    normals, shown = seen_normals(tmp_path, mesh, eye=(0, 0, -3))
    np.testing.assert_allclose(normals[shown], np.tile(-written, (shown.sum(), 1)), atol=1e-3)


def test_strength_multiplies_slopes(tmp_path):
    flat_map(tmp_path / "n.png", TILT)
    mesh = WALL + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    for strength in (0, 0.5, 2):
        normals, shown = seen_normals(tmp_path, mesh, keys=f", strength: {strength}")
        expected = np.array([0.6 * strength, 0, 0.8])
        expected /= np.linalg.norm(expected)
        np.testing.assert_allclose(normals[shown], np.tile(expected, (shown.sum(), 1)), atol=1e-3)


def test_a_flat_map_changes_nothing_and_tangents_are_shared_across_smooth_edges(tmp_path):
    """A bent cylinder's map of one tilt turns with it, without a jump from quad to quad."""
    flat_map(tmp_path / "n.png", TILT)
    turns = np.linspace(-0.5, 0.5, 9)
    text = ""
    for k, t in enumerate(turns):
        x, z = np.sin(t) * 2, np.cos(t) * 2 - 2
        text += f"v {x} -1 {z}\nv {x} 1 {z}\nvt {k / 8} 0\nvt {k / 8} 1\nvn {np.sin(t)} 0 {np.cos(t)}\n"
    for k in range(8):
        a, b = 2 * k, 2 * k + 2
        corners = ((a + 1, k + 1), (b + 1, k + 2), (b + 2, k + 2), (a + 2, k + 1))
        text += "f " + " ".join(f"{vertex}/{vertex}/{normal}" for vertex, normal in corners) + "\n"
    normals, shown = seen_normals(tmp_path, text)
    row = normals[20][shown[20]]
    assert len(row) > 25
    assert np.abs(np.diff(row, axis=0)).max() < 0.06
    # In the middle u goes to +x.
    middle = len(row) // 2
    np.testing.assert_allclose(row[middle - 1 : middle + 1].mean(axis=0), TILT, atol=0.03)
    Image.new("RGB", (4, 4), (128, 128, 255)).save(tmp_path / "even.png")
    even, _ = seen_normals(tmp_path, text, name="even.png")
    (tmp_path / "s.yaml").write_text("quilt_scene: 1\nobjects: [{mesh: m.obj}]\n")
    (frame,) = quiltcli.draw(tmp_path / "j.yaml", threads=1)
    plain = np.stack([frame.facet(1)[f"N.{axis}"] for axis in "XYZ"], axis=-1)
    np.testing.assert_allclose(even, plain, atol=6e-3)


def test_rays_see_the_same_bent_normals(tmp_path):
    """Ray casting shades each pixel alone, with weights of its own."""
    dice = np.random.default_rng(3)
    bumps = dice.normal(0, 0.2, (32, 32, 3)) + (0, 0, 1)
    bumps /= np.linalg.norm(bumps, axis=-1, keepdims=True)
    Image.fromarray(np.rint((bumps * 0.5 + 0.5) * 255).astype(np.uint8)).save(tmp_path / "n.png")
    mesh = "v -1 -1 0\nv 1 -1 -0.5\nv 1 1 0\nv -1 1 0.3\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\nf 1/1 2/2 3/3 4/4\n"
    seen_normals(tmp_path, mesh)
    pictures = []
    for method in ("homography", "raycast"):
        job = tmp_path / f"{method}.yaml"
        job.write_text((tmp_path / "j.yaml").read_text() + f"render: {{method: {method}}}\n")
        (frame,) = quiltcli.draw(job, threads=1)
        pictures.append(frame.stack(1, ("N.X", "N.Y", "N.Z", "R")).astype(np.float64))
    np.testing.assert_allclose(pictures[0], pictures[1], atol=4e-3)
    assert np.ptp(pictures[0][..., 0]) > 0.3


def hills(folder, statement="map_Bump -bm 2", size=64, kind="slope"):
    """A wall with a picture of heights, and what MTL says of it."""
    x = (np.arange(size) + 0.5) / size
    height = np.tile(x, (size, 1)) if kind == "slope" else np.tile((1 + np.sin(2 * np.pi * x)) / 2, (size, 1))
    image = OpenImageIO.ImageBuf(np.rint(height * 65535).astype(np.uint16)[..., None])
    assert image.write(str(folder / "h.png"))
    (folder / "m.mtl").write_text(f"newmtl a\n{statement} h.png\n")
    return "mtllib m.mtl\n" + WALL + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n"


def of_mesh(folder, mesh):
    seen_normals(folder, mesh, keys="", name="h.png")
    (folder / "s.yaml").write_text("quilt_scene: 1\nobjects: [{mesh: m.obj}]\n")
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    picture = frame.facet(1)
    return np.stack([picture[f"N.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float64), picture["A"] > 0


@pytest.mark.parametrize(("statement", "steep"), [("map_Bump -bm 2", 2), ("bump", 1), ("bump -mm 0 3", 3)])
def test_heights_tilt_normals_by_their_slope(tmp_path, statement, steep):
    """White is a hundredth of the picture's width above black, times -bm: a ramp is tilted by as much."""
    normals, shown = of_mesh(tmp_path, hills(tmp_path, statement))
    expected = np.array([-0.01 * steep, 0, 1])
    expected /= np.linalg.norm(expected)
    # Where the picture comes again, at the ramp's end, it falls.
    inner = np.zeros_like(shown)
    inner[6:-6, 6:-6] = shown[6:-6, 6:-6]
    np.testing.assert_allclose(normals[inner], np.tile(expected, (inner.sum(), 1)), atol=1e-3)


def test_heights_of_the_scene_file_and_a_wave(tmp_path):
    mesh = hills(tmp_path, kind="wave").replace("mtllib m.mtl\n", "")
    (tmp_path / "m.obj").write_text(mesh)
    seen_normals(tmp_path, mesh, name="h.png")
    (tmp_path / "s.yaml").write_text(
        "quilt_scene: 1\nobjects: [{mesh: m.obj, material: {textures: {bump: h.png, strength: 20}}}]\n"
    )
    (tmp_path / "j.yaml").write_text((tmp_path / "j.yaml").read_text().replace("[rgba, N]", "[rgba, N, uv]"))
    (frame,) = quiltcli.draw(tmp_path / "j.yaml", threads=1)
    picture = frame.facet(1)
    shown = picture["A"] > 0
    slope = -20 * 0.01 * np.pi * np.cos(2 * np.pi * picture["uv.U"][shown].astype(float))
    np.testing.assert_allclose(picture["N.X"][shown], slope / np.sqrt(1 + slope**2), atol=0.02)
    np.testing.assert_allclose(picture["N.Y"][shown], 0, atol=1e-3)


def test_a_normal_map_that_is_called_a_bump_is_a_normal_map(tmp_path):
    mesh = hills(tmp_path)
    written = flat_map(tmp_path / "h.png", (0.1, 0.05, 0.99))
    normals, shown = of_mesh(tmp_path, mesh.replace("-bm 2", ""))
    (tmp_path / "m.mtl").write_text("newmtl a\nbump h.png\n")
    normals, shown = of_mesh(tmp_path, mesh)
    expected = written / np.linalg.norm(written)
    np.testing.assert_allclose(normals[shown], np.tile(expected, (shown.sum(), 1)), atol=2e-3)


def test_one_kind_of_slopes_is_enough(tmp_path):
    flat_map(tmp_path / "n.png", TILT)
    with pytest.raises(quiltcli.QuiltError, match="cannot stand beside normal"):
        seen_normals(tmp_path, WALL + "f 1 2 3 4\n", keys=", bump: n.png")
