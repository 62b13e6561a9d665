"""How fast projector and mirror go together."""

from __future__ import annotations

import pytest

from quiltcli.job.timing import Timing


@pytest.mark.parametrize(
    ("refresh", "images", "turns", "rpm"),
    [
        (60, 1440, 5, 300),
        (120, 2880, 10, 600),
        (180, 4320, 15, 900),
        (200, 4800, 50 / 3, 1000),
        (240, 5760, 20, 1200),
    ],
)
def test_three_of_the_numbers_say_the_fourth(refresh: float, images: float, turns: float, rpm: float) -> None:
    timing = Timing(refresh, 288, 1.25)
    assert (timing.images_a_second, timing.turns_a_second, timing.rpm) == (images, turns, rpm)
    assert list(timing.notices()) == []


def test_turns_a_minute_may_be_off_by_a_thousandth_and_no_more() -> None:
    timing = Timing(200, 288, 1.25)
    assert timing.fault(None) == timing.fault(1000) == timing.fault(1000.9) == timing.fault(999.1) == ""
    words = "does not fit: 24 × 200 pictures a second, 288 a turn, are 1000 turns a minute, got 900"
    assert timing.fault(900) == words
    assert timing.fault(1001.1)


def test_gaps_and_turns_that_begin_within_a_picture_are_told() -> None:
    gaps, begins = Timing(200, 100, 1.25).notices()
    assert "cover 125° of 360°" in gaps
    assert "a turn begins within a picture" in begins
    assert list(Timing(200, 120, 3.0).notices()) == []
