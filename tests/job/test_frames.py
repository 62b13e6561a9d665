from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quiltcli.errors import JobError
from quiltcli.job.frames import format_frames, frame_text, parse_facets, parse_frames


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1-4", (1, 2, 3, 4)),
        ("1-9x2", (1, 3, 5, 7, 9)),
        ("1-10x4", (1, 5, 9)),
        ("20-22,5,1", (1, 5, 20, 21, 22)),
        ("5-5", (5,)),
        ("7", (7,)),
        ("-3", (-3,)),
        ("-5--3", (-5, -4, -3)),
        ("-1-1", (-1, 0, 1)),
        (" 1 - 3 , 8 x 1 ", (1, 2, 3, 8)),
        ("0001-0003", (1, 2, 3)),
        ("1-9x2,2-8x2", tuple(range(1, 10))),
    ],
)
def test_range(text: str, frames: tuple[int, ...]) -> None:
    assert parse_frames(text) == frames


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the frame range is empty (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
        ("1-", "cannot read '1-' in '1-' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
        ("1,,2", "cannot read '' in '1,,2' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
        ("1..5", "cannot read '1..5' in '1..5' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
        (
            "1-5y2",
            "cannot read '1-5y2' in '1-5y2' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)",
        ),
        ("²", "cannot read '²' in '²' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
        ("1 2", "cannot read '1 2' in '1 2' (separate numbers by commas)"),
        (
            "1-10:4",
            "':' means different things to different farms, in '1-10:4' (write the step with x: 1-9x2)",
        ),
        ("9-1", "'9-1' goes backwards (write 1-9)"),
        ("1-9x0", "the step of '1-9x0' is 0 (expected 1 or more)"),
        ("1-9,5", "frame 5 is named twice in '1-9,5'"),
        ("3,3", "frame 3 is named twice in '3,3'"),
        ("1-2000000", "'1-2000000' names more than 1000000 frames"),
        ("1-600000,600001-1200000", "'1-600000,600001-1200000' names more than 1000000 frames"),
    ],
)
def test_message(text: str, message: str) -> None:
    with pytest.raises(JobError) as caught:
        parse_frames(text)
    assert str(caught.value) == message


def test_facet_lists() -> None:
    assert parse_facets("3,7-9") == (3, 7, 8, 9)
    with pytest.raises(JobError) as caught:
        parse_facets("0-2")
    assert str(caught.value) == "there is no facet 0 (facet ids start at 1)"
    with pytest.raises(JobError) as caught:
        parse_facets("top")
    assert str(caught.value) == "cannot read 'top' in 'top' (expected facet ids such as 3,7-9)"


@given(st.sets(st.integers(-9999, 9999), min_size=1, max_size=30))
def test_formatting_reads_back(frames: set[int]) -> None:
    assert parse_frames(format_frames(frames)) == tuple(sorted(frames))


@pytest.mark.parametrize(
    ("frames", "text"),
    [((1, 2, 3), "1-3"), ((1, 3, 5), "1-5x2"), ((1, 9), "1,9"), ((4, 5), "4-5"), ((-2, -1, 7), "-2--1,7")],
)
def test_format(frames: tuple[int, ...], text: str) -> None:
    assert format_frames(frames) == text


@pytest.mark.parametrize(("frame", "text"), [(1, "0001"), (0, "0000"), (-5, "-0005"), (12345, "12345")])
def test_frame_text(frame: int, text: str) -> None:
    assert frame_text(frame) == text
