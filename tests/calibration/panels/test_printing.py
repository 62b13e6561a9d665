"""Boards to print: as large as they were said to be, and found again."""

from __future__ import annotations

import re

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("cv2")

from quiltcli.calibration.dictionaries import dictionary
from quiltcli.calibration.panels.attached import parse_attached
from quiltcli.cli import main
from quiltcli.errors import JobError

RUN = re.compile(r"M([\d.]+) ([\d.]+)h([\d.]+)v([\d.]+)h-[\d.]+z")


def drawn(path, pixels: int) -> np.ndarray:
    """The drawing's grey values, so many pixels a millimetre."""
    text = path.read_text()
    width, height = (float(found) for found in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text).groups())
    assert f'width="{width:.4f}mm" height="{height:.4f}mm"' in text
    image = np.full((round(height * pixels), round(width * pixels)), 255, np.uint8)
    for run in RUN.finditer(text):
        x, y, wide, high = (float(value) * pixels for value in run.groups())
        image[round(y) : round(y + high), round(x) : round(x + wide)] = 0
    return image


@pytest.mark.parametrize(
    "text", ["3x2,40mm,10mm,4x4,20", "2x2,35mm,5mm,5x5,900", "1x1,40mm,0mm,apriltag36h11,7"]
)
def test_a_printed_board_is_found_where_its_words_say(tmp_path, text: str) -> None:
    path = tmp_path / "new" / "board.svg"
    done = CliRunner().invoke(main, ["board", text, "-o", str(path)])
    assert done.exit_code == 0, done.output
    board = parse_attached(text)
    assert f"measure a marker once it is printed: {1000 * board.side:g} mm" in done.output
    assert f">{text}</text>" in path.read_text()
    import cv2

    words = dictionary(board.dictionary)
    detector = cv2.aruco.ArucoDetector(words.words, cv2.aruco.DetectorParameters())
    corners, ids, _ = detector.detectMarkers(drawn(path, 8))
    assert sorted(ids.ravel().tolist()) == list(board.ids)
    margin = 2 * 1000 * board.side / words.modules
    for found, name in zip(corners, ids.ravel().tolist(), strict=True):
        should = 1000 * board.corners[name - board.first][:, :2] + margin
        np.testing.assert_allclose(found[0] / 8, should, atol=0.3)


def test_gaps_without_white_are_refused(tmp_path) -> None:
    from quiltcli.calibration.panels.printing import write_board

    with pytest.raises(JobError, match="the gap of 5 mm is narrower than a module of the markers"):
        write_board(tmp_path / "b.svg", parse_attached("2x2,40mm,5mm,4x4,0"), "")
    done = CliRunner().invoke(main, ["board", "2x2,40mm,10mm,4x4,0", "-o", str(tmp_path / "b.png")])
    assert "b.png: expected a name that ends in .svg" in done.output
    assert done.exit_code == 2
