"""What a render leaves: unlit facets written, linked or skipped; tight data windows; what resumes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import quiltcli.formats.whole
from quiltcli.cli import main
from quiltcli.formats.exr.image import read_exr, read_header, use_threads, write_exr
from quiltcli.images.diff import diff
from quiltcli.images.window import whole_frame
from quiltcli.job import job_sha256, load_job
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.tiny_job import files_in, replaced, write_tiny_job

WALLS = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 1 -1 2\nv 1 1 2\nv 2 -1 0\nv 2 1 0\nv 2 -1 2\nv 2 1 2\n"
BACKS = ["facets/facet_0002.0001.exr", "facets/facet_0003.0001.exr"]


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A wall that is lit, and two of one size that show the eye their backs."""
    job = write_tiny_job(tmp_path)
    (tmp_path / "walls.obj").write_text(WALLS + "f 1 2 3 4\nf 2 5 6 3\nf 7 9 10 8\n")
    replaced(tmp_path, "job.yaml", "position: [0, 0, 2]", "position: [3, 0, 2]")
    return job


def rendered(job: Path, out: str, *sets: str, **options: object) -> list[str]:
    folder = job.parent / out
    render(load_job(job, sets), RenderOptions([1], folder, threads=1, **options))
    return files_in(folder)


def inode(job: Path, name: str) -> int:
    return (job.parent / name).stat().st_ino


def times(folder: Path) -> dict[str, int]:
    return {name: (folder / name).stat().st_mtime_ns for name in files_in(folder)}


def test_unlit_facets_are_written_by_default(tiny: Path) -> None:
    assert set(BACKS) <= set(rendered(tiny, "a"))
    assert inode(tiny, f"a/{BACKS[0]}") != inode(tiny, f"a/{BACKS[1]}")
    header = read_header(tiny.parent / "a" / BACKS[1])
    assert (header.attributes["quilt:facet"], header.data_window) == (3, ((0, 0), (63, 63)))


def test_unlit_facets_of_one_size_are_one_linked_file(tiny: Path) -> None:
    assert rendered(tiny, "a") == rendered(tiny, "b", "output.unlit=link")
    assert inode(tiny, f"b/{BACKS[0]}") == inode(tiny, f"b/{BACKS[1]}")
    assert diff(tiny.parent / "a", tiny.parent / "b").code == 0
    image = read_exr(tiny.parent / "b" / BACKS[1])
    assert "quilt:facet" not in image.attributes
    assert (image.channels["A"] == 0).all()
    assert np.isposinf(image.channels["Z"]).all()


def test_where_there_are_no_links_there_are_copies(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(quiltcli.formats.whole.os, "link", refuse)
    assert set(BACKS) <= set(rendered(tiny, "a", "output.unlit=link"))
    assert inode(tiny, f"a/{BACKS[0]}") != inode(tiny, f"a/{BACKS[1]}")
    assert diff(tiny.parent / "a" / BACKS[0], tiny.parent / "a" / BACKS[1]).code == 0


def test_rendering_over_links_breaks_none(tiny: Path) -> None:
    rendered(tiny, "a", "output.unlit=link")
    assert rendered(tiny, "a", "output.unlit=link", overwrite=True) == rendered(tiny, "b")
    rendered(tiny, "a", overwrite=True)
    assert inode(tiny, f"a/{BACKS[0]}") != inode(tiny, f"a/{BACKS[1]}")


def test_skipped_facets_have_no_file(tiny: Path) -> None:
    everything = rendered(tiny, "a")
    assert rendered(tiny, "b", "output.unlit=skip") == [name for name in everything if name not in BACKS]


def test_skipping_removes_what_was_there(tiny: Path) -> None:
    rendered(tiny, "a")
    left = rendered(tiny, "a", "output.unlit=skip", overwrite=True)
    assert not set(BACKS) & set(left)


@pytest.mark.parametrize("unlit", ["write", "link", "skip"])
def test_a_complete_frame_is_not_drawn_again(tiny: Path, unlit: str) -> None:
    rendered(tiny, "a", f"output.unlit={unlit}")
    before = times(tiny.parent / "a")
    rendered(tiny, "a", f"output.unlit={unlit}", resume=True)
    assert before == times(tiny.parent / "a")


def test_what_is_skipped_is_missing_to_a_job_that_writes(tiny: Path) -> None:
    rendered(tiny, "a", "output.unlit=skip")
    assert set(BACKS) <= set(rendered(tiny, "a", resume=True))


def test_a_stale_image_of_a_skipped_facet_is_no_complete_frame(tiny: Path) -> None:
    rendered(tiny, "a", "output.unlit=skip")
    write_exr(tiny.parent / "a" / BACKS[0], {"R": np.ones((64, 64), np.float16)}, {})
    assert BACKS[0] not in rendered(tiny, "a", "output.unlit=skip", resume=True)


def test_a_lit_facet_is_missed(tiny: Path) -> None:
    rendered(tiny, "a", "output.unlit=skip")
    lit = tiny.parent / "a/facets/facet_0001.0001.exr"
    lit.unlink()
    rendered(tiny, "a", "output.unlit=skip", resume=True)
    assert lit.exists()


# --- data windows ---


def test_tight_windows_hold_the_same_pixels(tiny: Path) -> None:
    assert rendered(tiny, "a") == rendered(tiny, "b", "output.data_window=tight")
    assert diff(tiny.parent / "a", tiny.parent / "b").code == 0
    found = read_header(tiny.parent / "b/facets/facet_0001.0001.exr")
    (x0, y0), (x1, y1) = found.data_window
    assert found.display_window == ((0, 0), (63, 63))
    assert 0 < x0 <= x1
    assert 0 < y0 <= y1 < 63
    page = read_exr(tiny.parent / "a/quilt/page_01.0001.exr")
    tight = read_exr(tiny.parent / "b/quilt/page_01.0001.exr")
    for name, channel in whole_frame(tight).items():
        np.testing.assert_array_equal(channel, page.channels[name])


def test_tight_quilts_are_merged_into_cut_up_previewed_and_simulated(tiny: Path) -> None:
    here, run = tiny.parent, CliRunner()
    tight = ("--set", "output.data_window=tight")
    rendered(tiny, "a")
    rendered(tiny, "b", "output.data_window=tight", "output.facets=false")
    page = str(here / "b/quilt/page_01.0001.exr")
    commands = [
        ["render", str(tiny), "-f", "1", "-j", "1", "-o", str(here / "b"), "--facets", "1", *tight],
        ["verify", str(tiny), "-f", "1", "-j", "1", "-o", str(here / "b"), *tight],
        ["unmap", page, "--layout", str(here / "b/layout.yaml"), "-o", str(here / "c")],
        ["preview", page, "-o", str(here / "page.png")],
    ]
    for command in commands:
        result = run.invoke(main, command)
        assert result.exit_code == 0, result.output
    assert diff(here / "a/quilt", here / "b/quilt").code == 0
    assert diff(here / "a/facets", here / "c/facets").code == 0


@pytest.mark.parametrize("images", ["output.facets=false", "output.quilts=false"])
def test_a_simulation_takes_tight_and_skipped_images(tiny: Path, images: str) -> None:
    sets = (images, "output.data_window=tight", "output.unlit=skip")
    rendered(tiny, "a", *sets)
    given = [text for each in (*sets, f"output.directory={tiny.parent / 'a'}") for text in ("--set", each)]
    pictures = [str(tiny.parent / name) for name in ("disk.png", "memory.png")]
    for picture, more in zip(pictures, (given, given[:-1] + ["output.directory=none"]), strict=True):
        arguments = ["simulate", str(tiny), "-f", "1", "-j", "1", "-o", picture, "--size", "90x60", *more]
        result = CliRunner().invoke(main, [*arguments, "--filter", "nearest"])
        assert result.exit_code == 0, result.output
        assert ("read from" in result.output) == (picture == pictures[0])
    if "facets=false" in images:  # facets' own images have no bleed
        assert Path(pictures[0]).read_bytes() == Path(pictures[1]).read_bytes()


def test_a_job_is_another_by_its_data_window_but_not_by_unlit_facets(tiny: Path) -> None:
    plain = job_sha256(load_job(tiny))
    assert plain == job_sha256(load_job(tiny, ["output.unlit=skip"]))
    assert plain != job_sha256(load_job(tiny, ["output.data_window=tight"]))


@pytest.mark.parametrize("compression", ["zip", "zstd", "piz"])
def test_bytes_do_not_depend_on_the_library_s_threads(tmp_path: Path, compression: str) -> None:
    rng = np.random.default_rng(1)
    channels = {"Z": rng.random((300, 200)).astype(np.float32)}
    written = []
    for threads in (1, 3):
        use_threads(threads)
        write_exr(tmp_path / "a.exr", channels, {}, compression)
        written.append((tmp_path / "a.exr").read_bytes())
    use_threads(1)
    assert written[0] == written[1]


# --- where the time goes ---


def test_a_profile_is_printed_and_reported(tiny: Path) -> None:
    out = tiny.parent / "a"
    result = CliRunner().invoke(
        main, ["render", str(tiny), "-f", "1-3", "-j", "1", "-o", str(out), "--profile"]
    )
    assert result.exit_code == 0, result.output
    table = [line.split("  ")[0] for line in result.output.split("stage", 1)[1].splitlines()]
    assert table[1:3] == ["load", "bin"]
    assert {"wait", "other", "run", "write, meanwhile"} <= set(table)
    frames = json.loads((out / "report.json").read_text())["frames"]
    assert ["load" in frame["seconds"] for frame in frames] == [True, False, False]
    assert all({"cut", "compress and store"} == frame["write_seconds"].keys() for frame in frames)
    for frame in frames:
        drawing = sum(
            time for stage, time in frame["seconds"].items() if stage not in ("write", "wait", "load")
        )
        assert drawing > 0
    wall = sum(frame["wall_seconds"] for frame in frames)
    assert f"time                    {wall:.2f} s" in result.output
