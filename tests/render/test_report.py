import dataclasses
import io
import json
import multiprocessing
from pathlib import Path

import pytest

from quiltcli.cli.progress import frame_line, progress
from quiltcli.errors import OutputError
from quiltcli.render.report import (
    FrameRecord,
    profile_rows,
    summary,
    summary_table,
    summary_warnings,
    write_report,
)

SHA = "ab" * 32


def record(frame, **changes):
    record = FrameRecord(
        frame=frame,
        triangles=1000 * (frame + 10),
        reaching=1000 * (frame + 10),
        pairs=1100 * (frame + 10),
        settled=800 * (frame + 10),
        lit_facets=420 + frame,
        visible_pixels=1_000_000 + frame,
        fill=0.75,
        seconds={"bin": 0.5, "raster": 1.0 + frame},
    )
    return dataclasses.replace(record, **changes)


def frames(path):
    return json.loads(path.read_text())["frames"]


# --- report.json ---


def test_a_report_says_what_made_it_and_how(tmp_path):
    path = tmp_path / "report.json"
    write_report(path, SHA, "0.1.0", [record(3, warnings=("nothing is visible",))])
    assert json.loads(path.read_text()) == {
        "quilt_report": 1,
        "version": "0.1.0",
        "job": SHA,
        "frames": [
            {
                "frame": 3,
                "triangles": 13000,
                "reaching": 13000,
                "pairs": 14300,
                "settled": 10400,
                "lit_facets": 423,
                "visible_pixels": 1000003,
                "fill": 0.75,
                "binned": True,
                "settled_share": 0.8,
                "replication": 1.1,
                "wall_seconds": 0.0,
                "seconds": {"bin": 0.5, "raster": 4.0},
                "write_seconds": {},
                "warnings": ["nothing is visible"],
            }
        ],
    }


def test_pieces_end_as_one_run(tmp_path):
    whole, pieces = tmp_path / "whole.json", tmp_path / "pieces.json"
    write_report(whole, SHA, "0.1.0", [record(frame) for frame in (-1, 2, 3, 10)])
    for frame in (10, 3, -1, 2):
        write_report(pieces, SHA, "0.1.0", [record(frame)])
    assert whole.read_bytes() == pieces.read_bytes()
    assert [entry["frame"] for entry in frames(whole)] == [-1, 2, 3, 10]


def test_a_frame_rendered_again_is_replaced(tmp_path):
    path = tmp_path / "report.json"
    write_report(path, SHA, "0.1.0", [record(1), record(2)])
    write_report(path, SHA, "0.1.0", [record(2, lit_facets=7)])
    assert [entry["lit_facets"] for entry in frames(path)] == [421, 7]


@pytest.mark.parametrize(
    "old",
    [
        "",
        "{",
        "[]",
        "null",
        '{"quilt_report": 1}',
        '{"quilt_report": 1, "job": "other", "frames": [{"frame": 1}]}',
        '{"quilt_report": 9, "job": "' + SHA + '", "frames": [{"frame": 1}]}',
        '{"quilt_report": 1, "job": "' + SHA + '", "frames": [1]}',
    ],
)
def test_what_is_no_report_of_this_job_is_replaced(tmp_path, old):
    path = tmp_path / "report.json"
    path.write_text(old)
    write_report(path, SHA, "0.1.0", [record(2)])
    assert [entry["frame"] for entry in frames(path)] == [2]


def add_one(path, frame):
    write_report(Path(path), SHA, "0.1.0", [record(frame)])


def test_processes_that_finish_at_once_lose_no_frame(tmp_path):
    path = tmp_path / "report.json"
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=add_many, args=(str(path), first)) for first in (0, 100)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    expected = [*range(40), *range(100, 140)]
    assert expected == [entry["frame"] for entry in frames(path)]
    assert [path] == list(tmp_path.iterdir())


def add_many(path, first):
    for frame in range(first, first + 40):
        add_one(path, frame)


def test_a_report_that_cannot_be_written(tmp_path):
    blocker = tmp_path / "out"
    blocker.write_text("mine")
    with pytest.raises(OutputError) as caught:
        write_report(blocker / "report.json", SHA, "0.1.0", [record(1)])
    assert f"{blocker / 'report.json'}: cannot be written: Not a directory" == str(caught.value)
    with pytest.raises(OutputError) as caught:
        write_report(tmp_path / "no" / "report.json", SHA, "0.1.0", [record(1)])
    expected = f"{tmp_path / 'no' / 'report.json'}: cannot be written: No such file or directory"
    assert expected == str(caught.value)


def test_shares_of_an_empty_scene():
    empty = record(1, triangles=0, reaching=0, pairs=0, settled=0)
    assert empty.settled_share == 1.0
    assert empty.replication == 0.0


def test_a_method_that_does_not_bin_has_no_figures_of_it():
    cast = record(1, reaching=0, pairs=0, settled=0, binned=False)
    told = dict(summary([cast]))
    assert not {"settled in pass 1", "replication"} & told.keys()
    assert "lit facets" in told
    assert cast.as_json()["binned"] is False
    assert dict(summary([cast, record(2)]))["settled in pass 1"] == "80.0 % "[:-1]


# --- time ---


def written(frame, **changes):
    """A frame whose writing took 3 s beside the drawing of the next, for one of which this had to wait."""
    seconds = {"bin": 0.5, "raster": 1.5, "write": 3.0, "wait": 1.0}
    return record(frame, seconds=seconds, wall_seconds=3.25, write_seconds={"cut": 1, "store": 3}, **changes)


def test_a_frame_takes_the_time_on_the_wall_not_that_of_its_stages():
    assert written(1).total_seconds == 3.25
    assert summary([written(1), written(2)])[1] == ("time", "6.50 s, 3.25 s a frame")
    assert frame_line(written(1)).startswith("3.25 s, ")


def test_the_summary_says_what_is_done_meanwhile():
    lines = dict(summary([written(1)]))
    assert (lines["  write"], lines["  wait"]) == ("3.00 s meanwhile", "1.00 s for what is written")


def test_a_profile_adds_up_to_the_run():
    first = written(1).after("load", 2.0)
    first = dataclasses.replace(first, wall_seconds=5.25)
    assert profile_rows([first, written(2)]) == [
        ("load", "2.000", "23.5 %", "1.0000"),
        ("bin", "1.000", "11.8 %", "0.5000"),
        ("raster", "3.000", "35.3 %", "1.5000"),
        ("wait", "2.000", "23.5 %", "1.0000"),
        ("other", "0.500", "5.9 %", "0.2500"),
        ("run", "8.500", "100.0 %", "4.2500"),
        ("write, meanwhile", "6.000", "70.6 %", "3.0000"),
        ("  cut", "2.000", "25.0 %", "1.0000"),
        ("  store", "6.000", "75.0 %", "3.0000"),
    ]


def test_a_frame_is_written_and_done():
    plain = record(1)
    assert plain.after("load", 0.0) is plain
    done = plain.written(lambda: {"cut": 0.25}).done(waited=0.5, wall=2.0)
    assert list(done.seconds) == ["bin", "raster", "write", "wait"]
    assert (done.seconds["wait"], done.wall_seconds, done.write_seconds) == (0.5, 2.0, {"cut": 0.25})
    assert plain.seconds == {"bin": 0.5, "raster": 2.0}


# --- the summary ---


def test_summary_of_one_frame():
    assert summary([record(1)]) == [
        ("frames", "1 (1)"),
        ("time", "2.50 s, 2.50 s a frame"),
        ("  bin", "0.50 s"),
        ("  raster", "2.00 s"),
        ("triangles", "11,000"),
        ("settled in pass 1", "80.0 %"),
        ("replication", "1.100"),
        ("lit facets", "421"),
        ("pixels that show it", "1,000,001"),
        ("fill", "75.0 %"),
    ]


def test_summary_of_several_frames():
    lines = dict(summary([record(4), record(1), record(2)]))
    assert lines["frames"] == "3 (1 to 4)"
    assert lines["time"] == "11.50 s, 3.83 s a frame"
    assert lines["  bin"] == "1.50 s"
    assert lines["lit facets"] == "421 to 424"
    assert lines["replication"] == "1.100"


def test_summary_of_nothing():
    assert summary([]) == [("frames", "0")]


def test_warnings_are_told_once():
    one = record(1, warnings=("the eye is behind every facet",))
    two = record(2, warnings=("nothing is visible", "the eye is behind every facet"))
    assert summary_warnings([one, two]) == [
        "the eye is behind every facet (2 of 2 frames)",
        "nothing is visible (1 of 2 frames)",
    ]
    assert summary_warnings([one]) == ["the eye is behind every facet"]


def test_the_table_holds_the_summary():
    from rich.console import Console

    console = Console(file=io.StringIO(), width=80)
    console.print(summary_table([record(1)]))
    text = console.file.getvalue()
    for label, value in summary([record(1)]):
        assert any(label in line and value in line for line in text.splitlines()), label


# --- progress ---


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_plain_line_a_frame():
    stream = io.StringIO()
    with progress(stream) as shown:
        shown.begin(2)
        shown.say("the scene has no lights")
        shown.frame_done(record(7))
        shown.frame_done(record(8, warnings=("a", "b")))
    assert stream.getvalue().splitlines() == [
        "the scene has no lights",
        "frame 7 (1 of 2): 8.50 s, 427 lit facets, 1,000,007 pixels",
        "frame 8 (2 of 2): 9.50 s, 428 lit facets, 1,000,008 pixels, 2 warnings",
    ]


def test_a_bar_on_a_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    stream = Terminal()
    with progress(stream) as shown:
        shown.begin(2)
        shown.say("see [red] facets")
        shown.frame_done(record(7))
        shown.frame_done(record(8))
    text = stream.getvalue()
    assert "see [red] facets" in text
    assert "2/2" in text
    assert f"frame 8: {frame_line(record(8))}" in text


def test_progress_goes_to_stderr(capsys):
    with progress() as shown:
        shown.begin(1)
        shown.frame_done(record(1))
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("frame 1 (1 of 1): ")


def test_an_error_inside_passes_through():
    with pytest.raises(KeyError), progress(Terminal()):
        raise KeyError
