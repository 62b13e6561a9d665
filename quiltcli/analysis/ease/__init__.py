"""Studies of displays: how easy they are to use, from the log of what people did on them."""

from __future__ import annotations

from quiltcli.analysis.ease.ease import Comparison, Ease, Interval, ease_of_use
from quiltcli.analysis.ease.log import StudyLog, Trial, read_log
from quiltcli.analysis.ease.report import write_report
from quiltcli.analysis.ease.table import display_rows, person_rows, words_of

__all__ = [
    "Comparison",
    "Ease",
    "Interval",
    "StudyLog",
    "Trial",
    "display_rows",
    "ease_of_use",
    "person_rows",
    "read_log",
    "words_of",
    "write_report",
]
