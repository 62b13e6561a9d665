"""The page to walk around a display with a spinning mirror."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.ring.eye import camera_at
from quiltcli.analysis.ring.simulate import eye_place
from quiltcli.cli.group import main
from quiltcli.errors import OutputError
from quiltcli.exchange.web.turning import Turning, turning_view
from quiltcli.geometry import dot
from tests.helpers.chromium import look
from tests.helpers.ring_job import ring_job

SMALL = Turning(views=6, size=(64, 48))


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A turn of a job that was rendered."""
    job = ring_job(tmp_path_factory.mktemp("ring"), positions=48, lobe=7.5, frames="3-4")
    assert CliRunner().invoke(main, ["render", str(job), "-f", "3"]).exit_code == 0
    return job.with_name("out")


def data_of(page: Path) -> dict[str, object]:
    found = re.search(r'id="data">(.*?)</script>', page.read_text(), re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def pixels(source: str) -> np.ndarray:
    with Image.open(io.BytesIO(base64.b64decode(source.partition(",")[2]))) as image:
        return np.asarray(image.convert("L")).astype(float)


def test_the_page_has_a_picture_from_every_place(out: Path) -> None:
    page = turning_view(out, None, None, SMALL)
    assert page == out / "view.html"
    data = data_of(page)
    assert data["size"] == [64, 48]
    assert data["where"] == "0.4 m high, 1 m away"
    (turn,) = data["turns"]  # type: ignore[misc]
    assert turn["frame"] == 3
    seen = [pixels(source) for source in turn["pictures"]]
    assert len(seen) == 6
    assert all(each.shape == (48, 64) and each.max() > 60 for each in seen)
    assert all(np.abs(seen[0] - each).mean() > 1 for each in seen[1:])


def test_the_page_may_load_nothing(out: Path, tmp_path: Path) -> None:
    text = turning_view(out, [3], tmp_path / "page.html", SMALL).read_text()
    assert "default-src 'none'; img-src data:" in text
    assert not re.search(r"https?://", text)
    assert "@" not in re.sub(r"<style>.*?</style>|<script.*?</script>", "", text, flags=re.DOTALL)


def test_turns_that_are_not_there_and_pages_that_get_too_large_are_told(out: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="has no turn of frame 4"):
        turning_view(out, [4], tmp_path / "page.html", SMALL)
    with pytest.raises(OutputError, match=r"MB, more than 0\.001"):
        turning_view(out, None, tmp_path / "page.html", Turning(views=4, size=(64, 48), size_mb=0.001))
    assert not (tmp_path / "page.html").exists()


def test_a_browser_shows_it(out: Path, tmp_path: Path) -> None:
    page = turning_view(out, None, tmp_path / "page.html", SMALL)
    seen = look(page, "", 400, 400, tmp_path)
    assert seen.console == []
    assert "a turn of the mirror" in seen.title
    assert seen.pixels[60:280].max() > 60  # of the picture, not of the words below it


def azimuth_after(out: Path, folder: Path, deeds: str) -> float:
    """Azimuth that the caption tells, degrees, after a script was run in a page of 24 views.

    The page's clock stands at 0: what it wants to do in time is in `waiting`, for the script to call.
    """
    page = turning_view(out, None, folder / "deeds.html", Turning(views=24, size=(64, 48)))
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text())
    clock = (
        "const waiting = []; requestAnimationFrame = (deed) => waiting.push(deed); performance.now = () => 0;"
    )
    text = text.replace("<body>", f"<body><script>{clock}</script>")
    page.write_text(text.replace("</body>", f"<script>{deeds}</script></body>"))
    seen = look(page, "", 400, 400, folder)
    assert seen.console == []
    found = re.search(r"frame 3, from ([\d.]+)°", seen.text)
    assert found is not None
    return float(found[1])


def test_it_turns_by_itself(out: Path, tmp_path: Path) -> None:
    # A quarter of the time that its data say a turn takes.
    quarter = 'waiting.shift()(250 * JSON.parse(document.getElementById("data").textContent).seconds);'
    assert azimuth_after(out, tmp_path, quarter) == 90


def test_what_is_in_front_follows_the_hand_and_arrows_walk(out: Path, tmp_path: Path) -> None:
    """An eye that goes a little to its left, to a greater azimuth, sees what is in front go to the right."""
    eye = camera_at(eye_place((5, 0, 1)), 0.07, (64, 48))
    assert dot(np.array([0.04, 0, 0]) - eye.eye, eye.right) > 0
    deeds = (
        'const canvas = document.getElementById("picture"); canvas.setPointerCapture = () => {};'
        "const wide = canvas.clientWidth;"
        'for (const [kind, x] of [["down", 0], ["move", wide / 12], ["up", wide / 12]])'
        ' canvas.dispatchEvent(new PointerEvent("pointer" + kind, {clientX: x}));'
        'for (const key of ["ArrowLeft", "ArrowLeft", "ArrowRight"])'
        ' canvas.dispatchEvent(new KeyboardEvent("keydown", {key}));'
    )
    # One of 24 places by hand, two to the left and one to the right again.
    assert azimuth_after(out, tmp_path, deeds) == 30
