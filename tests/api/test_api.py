"""The names that Python programs may rely on, and the page that shows them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import quiltcli
from quiltcli import api
from quiltcli.errors import JobError
from quiltcli.job import load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import replaced, write_tiny_job

PAGE = Path(__file__).parents[2] / "docs" / "python.md"


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    return write_tiny_job(tmp_path)


def test_the_package_offers_exactly_the_names_of_the_interface() -> None:
    assert list(quiltcli._API) == api.__all__
    assert set(dir(quiltcli)) == {"__version__", *api.__all__}
    assert all(getattr(quiltcli, name) is getattr(api, name) for name in api.__all__)


def test_no_name_is_one_of_a_room_which_would_hide_it() -> None:
    rooms = {path.stem for path in Path(quiltcli.__file__).parent.iterdir()}
    assert not rooms & set(api.__all__)


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'quiltcli' has no attribute 'load'"):
        quiltcli.load  # noqa: B018 - looked up for the error


def test_importing_the_package_imports_nothing_else() -> None:
    script = "import sys, quiltcli; print(*(n for n in sys.modules if n.startswith(('quiltcli', 'numpy'))))"
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.split() == ["quiltcli"]


def test_the_page_runs_from_top_to_bottom(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    pieces = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(pieces) == 8
    names: dict[str, object] = {}
    for piece in pieces:
        exec(compile(piece, str(PAGE), "exec"), names)
    said = capsys.readouterr().out
    assert "5 facets on 1 page" in said
    assert "viewer.nere – unknown key (did you mean 'near'?)" in said
    assert (tmp_path / "facet_2.png").is_file()


def test_the_page_names_every_name() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in api.__all__ if not re.search(rf"\b{name}\b", text)] == []


def test_drawn_pixels_are_those_of_the_files(tiny: Path, tmp_path: Path) -> None:
    render(load_job(tiny), RenderOptions(frames=(1, 3), folder=tmp_path / "out"))
    for drawn in quiltcli.draw(str(tiny), frames=(1, 3), threads=1):
        number = f"{drawn.view.frame:04}"
        page = quiltcli.read_image(tmp_path / f"out/quilt/page_01.{number}.exr")
        assert drawn.pages[0].keys() == page.channels.keys()
        for name, pixels in page.channels.items():
            assert np.array_equal(drawn.pages[0][name], pixels)
        facet = quiltcli.read_image(tmp_path / f"out/facets/facet_0002.{number}.exr")
        for name, pixels in facet.channels.items():
            assert np.array_equal(drawn.facet(2)[name], pixels)
        assert np.array_equal(drawn.stack(2, ["Z"])[..., 0], facet.channels["Z"])


def test_frames_keep_their_own_arrays(tiny: Path) -> None:
    first, *_, last = quiltcli.draw(tiny)
    assert (first.view.frame, last.view.frame) == (1, 4)
    assert not np.array_equal(first.pages[0]["Z"], last.pages[0]["Z"])


def test_a_set_up_job_is_used_as_it_is(tiny: Path) -> None:
    setup = quiltcli.set_up(quiltcli.load_job(tiny))
    drawn = next(quiltcli.draw(setup, [2]))
    assert drawn.layout is setup.layout
    assert drawn.record.frame == 2


def test_viewers_of_all_frames_or_some(tiny: Path) -> None:
    assert [viewer.frame for viewer in quiltcli.viewers(tiny)] == [1, 2, 3, 4]
    [viewer] = quiltcli.viewers(tiny, [1])
    assert viewer.eye.tolist() == [0, 0, 2]


def test_no_such_facet(tiny: Path) -> None:
    drawn = next(quiltcli.draw(tiny))
    with pytest.raises(JobError, match=r"^there is no facet 3 \(the layout has 1 to 2\)$"):
        drawn.facet(3)


def test_a_facet_is_dark_to_a_viewer_in_its_plane(tiny: Path) -> None:
    replaced(tiny.parent, "job.yaml", "position: [0, 0, 2]", "position: [1, 0, 1]")
    drawn = next(quiltcli.draw(tiny))
    assert not np.isfinite(drawn.facet(2)["Z"]).any()
