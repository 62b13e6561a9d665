"""`quilt calibrate`: from photos, and from a table, to a corrected display."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from tests.calibration.panels.made_up import MODELS, shipped
from tests.helpers import photos


def run(*words):
    return CliRunner().invoke(main, ["calibrate", *map(str, words)])


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """Photos of a corner that was put up a little wrong, and how it really is."""
    pytest.importorskip("cv2")
    from quiltcli.calibration.markers import place_markers

    facets = shipped("corner_billboard")
    turns, shifts = np.radians([[0, 0, 0], [0.8, -1.2, 0.5]]), np.array([[0, 0, 0], [0.03, -0.02, 0.04]])
    real = photos.moved(facets, turns, shifts)
    markers = place_markers(facets, photo=(640, 480))
    middle, extent = facets.corners.mean(axis=0), np.ptp(facets.corners, axis=0).max()
    towards = facets.normal.sum(axis=0) / np.linalg.norm(facets.normal.sum(axis=0))
    side = np.cross((0.0, 1.0, 0.0), towards)
    pictures = []
    for across, up in ((-0.7, -0.3), (0.7, 0.3), (0, 0.6), (-0.5, 0.2), (0.5, -0.4)):
        eye = middle + extent * (1.3 * towards + across * side + up * np.array((0, 1.0, 0)))
        pose = photos.looking(eye, middle, 0.2 * across)
        pictures.append(photos.photo(real, markers, photos.camera(960, 720, 0.85), pose))
    folder = tmp_path_factory.mktemp("photos")
    return photos.save(folder, pictures), real, folder


def test_photos_correct_a_display(taken, tmp_path):
    paths, real, _ = taken
    out, report = tmp_path / "fixed.yaml", tmp_path / "report"
    words = ("--display", MODELS / "corner_billboard.yaml", "-o", out, "--anchor", 1, "--report", report)
    done = run(*paths, *words, "--eye", "0,1.7,8")
    assert done.exit_code == 0, done.output
    assert "5 photos" in done.output
    assert "stays" in done.output
    assert "facet 2: its corners are known to" in done.output
    found = load_display(load_display_file(out))
    extent = np.ptp(real.corners, axis=0).max()
    assert np.linalg.norm(found.corners - real.corners, axis=1).max() < 0.001 * extent
    turn = Rotation.align_vectors([real.normal[1]], [found.normal[1]])[0].magnitude()
    assert np.degrees(turn) < 0.1
    names = {path.name for path in report.iterdir()}
    assert {"residuals.csv", "camera.yaml", "facets.txt", "photo_01.residuals.png"} <= names
    # The camera that was found is one that can be given.
    again = run(*paths, *words[:-2], "--camera", report / "camera.yaml", "--overwrite")
    assert again.exit_code == 0, again.output
    assert "(given)" in again.output


def test_nothing_is_overwritten_unasked(taken, tmp_path):
    paths, _, _ = taken
    out = tmp_path / "fixed.yaml"
    out.write_text("mine")
    done = run(*paths, "--display", MODELS / "corner_billboard.yaml", "-o", out)
    assert done.exit_code == 2
    assert "exists already" in done.output
    assert out.read_text() == "mine"


def test_files_that_are_no_photos_and_photos_that_do_not_match(taken, tmp_path):
    paths, _, _ = taken
    words = ("--display", MODELS / "corner_billboard.yaml", "-o", tmp_path / "fixed.yaml")
    (tmp_path / "text.jpg").write_text("no photo")
    assert "text.jpg: cannot be read as a photo" in run(tmp_path / "text.jpg", *words).output
    assert "no such file" in run(tmp_path / "none.jpg", *words).output
    from PIL import Image

    with Image.open(paths[0]) as image:
        image.resize((480, 360)).save(tmp_path / "small.png")
    assert "is 480 × 360 pixels (expected 960 × 720" in run(paths[0], tmp_path / "small.png", *words).output
    with Image.open(paths[0]) as image:
        double = Image.new("L", (2 * image.width, image.height))
        double.paste(image, (0, 0))
        double.paste(image, (image.width, 0))
        double.save(tmp_path / "double.png")
    assert "twice" in run(tmp_path / "double.png", *words).output
    assert not (tmp_path / "fixed.yaml").exists()


def test_a_table_of_corners_corrects_a_display(tmp_path):
    facets = shipped("corner_billboard")
    lines = ["facet,corner,x,y,z"]
    for k in range(2):
        for at, point in enumerate(facets.polygon(k), 1):
            lines.append(f"{k + 1},{at},{','.join(map(repr, (point + 0.01).tolist()))}")
    (tmp_path / "corners.csv").write_text("\n".join(lines))
    out = tmp_path / "new" / "fixed.yaml"
    done = run(tmp_path / "corners.csv", "--display", MODELS / "corner_billboard.yaml", "-o", out)
    assert done.exit_code == 0, done.output
    found = load_display(load_display_file(out))
    np.testing.assert_allclose(found.corners, facets.corners + 0.01, atol=1e-8)
    both = run(tmp_path / "corners.csv", tmp_path / "a.jpg", "--display", MODELS / "cube5.yaml", "-o", out)
    assert both.exit_code == 2
    assert "expected photos, or one table of corners" in both.output


def with_a_board(facets, markers, at):
    """The display with a board of 2 × 2 markers of 1.4 m, 0.4 m apart, as one more facet that faces +Z."""
    from dataclasses import replace

    from quiltcli.calibration.markers import Marker

    side, pitch = 36, 0.1
    corner = np.array(at, float)
    more = {
        "corners": corner + side * pitch * np.array([(0, -1, 0), (1, -1, 0), (1, 0, 0), (0, 0, 0)]),
        "origin": corner[None],
        "du": np.array([(pitch, 0, 0)]),
        "dv": np.array([(0, -pitch, 0)]),
        "size": np.array([(side, side)], np.int32),
        "normal": np.array([(0, 0, 1.0)]),
        "enabled": np.array([True]),
        "mirrored": np.array([False]),
    }
    both = {name: np.concatenate((getattr(facets, name), value)) for name, value in more.items()}
    start = np.append(facets.corner_start, facets.corner_start[-1] + 4)
    large = replace(facets, names=(*facets.names, "board"), corner_start=start, **both)
    places = [(2, 2), (20, 2), (2, 20), (20, 20)]
    extra = [Marker(300 + k, facets.count + 1, place, (14, 14)) for k, place in enumerate(places)]
    return large, replace(markers, markers=(*markers.markers, *extra))


def test_a_board_and_a_distance_take_part(taken, tmp_path):
    """Real photos, in which a printed board hangs under the walls."""
    import json

    from quiltcli.calibration.markers import place_markers

    facets = shipped("corner_billboard")
    markers = place_markers(facets, photo=(640, 480))
    at = (-1.8, 3.8, 1.0)
    large, all_markers = with_a_board(taken[1], markers, at)
    middle, extent = facets.corners.mean(axis=0), np.ptp(facets.corners, axis=0).max()
    towards = facets.normal.sum(axis=0) / np.linalg.norm(facets.normal.sum(axis=0))
    side = np.cross((0.0, 1.0, 0.0), towards)
    pictures = []
    for across, up in ((-0.7, -0.3), (0.7, 0.3), (0, 0.6), (0.5, -0.4)):
        eye = middle + extent * (1.5 * towards + across * side + up * np.array((0, 1.0, 0)))
        pose = photos.looking(eye, middle - (0, 1.2, 0), 0.2 * across)
        pictures.append(photos.photo(large, all_markers, photos.camera(720, 540, 0.75), pose))
    paths = photos.save(tmp_path, pictures)
    out, report = tmp_path / "fixed.yaml", tmp_path / "report"
    words = ("--display", MODELS / "corner_billboard.yaml", "-o", out, "--anchor", 1, "--report", report)
    wide = float(np.linalg.norm(facets.polygon(0)[1] - facets.polygon(0)[0]))
    board = "2x2,1.4m,0.4m,5x5,300=1,2"
    done = run(*paths, *words, "--attached", board, "--distance", f"1A-1B={wide:.6f}m")
    assert done.exit_code == 0, done.output
    assert "board 1, in 4 photos: its middle is at" in done.output
    assert "scaled by 1.000000" in done.output
    assert "300" not in done.output.partition("left alone")[2]
    rig = json.loads((report / "rig.json").read_text())["boards"][0]
    found = np.array(rig["corners"])
    np.testing.assert_allclose(found[0, 0], np.array(at) + (0.2, -0.2, 0), atol=0.02)
    np.testing.assert_allclose(found[3, 2], np.array(at) + (3.4, -3.4, 0), atol=0.02)
    assert rig["facets"] == [1, 2]
    again = run(*paths, *words, "--overwrite", "--attached", "2x2,1.4m,0.4m,5x5,400")
    assert again.exit_code == 2
    assert "no photo shows board 1 (expected markers 400 to 403)" in again.output


def test_a_rig_takes_photos_of_boards_and_little_else(tmp_path):
    (tmp_path / "rig.json").write_text("{}")
    words = (
        "--display",
        MODELS / "cube5.yaml",
        "-o",
        tmp_path / "fixed.yaml",
        "--rig",
        tmp_path / "rig.json",
    )
    assert "is no rig (expected the rig.json" in run(tmp_path / "a.jpg", *words).output
    done = run(tmp_path / "a.jpg", *words, "--distance", "1A-1B=1m")
    assert "--rig takes --camera and --anchor, not --distance" in done.output
    assert done.exit_code == 2
