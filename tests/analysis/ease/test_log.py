"""Logs of studies: how they may look, and what is said of those that are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from quiltcli.analysis.ease import read_log
from quiltcli.errors import JobError

HEAD = "person,task,display,optimal_length,path_length,undos,motions,seconds"
GOOD = "ann,1,wall,10,12,1,30,60"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    return path


def complaints(tmp_path: Path, *lines: str, skip: tuple[str, ...] = ()) -> list[str]:
    with pytest.raises(JobError) as caught:
        read_log(written(tmp_path, "\n".join(lines) + "\n"), skip)
    return [line.removeprefix(f"{tmp_path}/") for line in str(caught.value).splitlines()]


def test_a_log_is_read_whatever_the_order_of_its_columns(tmp_path: Path) -> None:
    text = "Seconds, display,task,person,undos,motions,path_length,optimal_length\n60,wall,1,ann,1,30,12,10\n"
    (trial,) = read_log(written(tmp_path, text)).trials
    assert (trial.person, trial.task, trial.display, trial.line) == ("ann", "1", "wall", 2)
    assert (trial.optimal_length, trial.path_length, trial.undos) == (10, 12, 1)
    assert (trial.motions, trial.seconds, trial.ratings) == (30, 60, {})


def test_a_spreadsheet_of_another_country_is_read(tmp_path: Path) -> None:
    """A byte-order mark, semicolons, decimal commas, empty lines and remarks."""
    lines = [
        "\ufeff# a remark; nothing more",
        HEAD.replace(",", ";"),
        "",
        "ann;1;wall;10;12;1;30;60,5",
        ";;;;;;;",
    ]
    (trial,) = read_log(written(tmp_path, "\r\n".join(lines))).trials
    assert (trial.seconds, trial.line) == (60.5, 4)


@pytest.mark.parametrize(
    ("row", "complaint"),
    [
        ("ann,1,wall,10,12,1,30", "log.csv:2: expected 8 cells, got 7"),
        (",1,wall,10,12,1,30,60", "log.csv:2: person is empty"),
        ("ann,1,wall,10,12,1,30,0", "log.csv:2: seconds: expected a number, more than 0, got '0'"),
        ("ann,1,wall,10,12,-1,30,60", "log.csv:2: undos: expected a number, 0 or more, got '-1'"),
        ("ann,1,wall,10,12,1,many,60", "log.csv:2: motions: expected a number, 0 or more, got 'many'"),
        ("ann,1,wall,10,12,1,nan,60", "log.csv:2: motions: expected a number, 0 or more, got 'nan'"),
        ("ann,1,wall,10,12,1,inf,60", "log.csv:2: motions: expected a number, 0 or more, got 'inf'"),
        (
            "ann,1,wall,10,9,1,30,60",
            "log.csv:2: path_length 9 is shorter than the shortest way, 10 (optimal_length)",
        ),
    ],
)
def test_a_bad_row_is_named_by_its_line(tmp_path: Path, row: str, complaint: str) -> None:
    assert complaints(tmp_path, HEAD, row) == [complaint]


def test_all_that_is_wrong_comes_at_once(tmp_path: Path) -> None:
    rows = ["ann,1,wall,10,x,-1,30,60", GOOD, "bob,1,wall,11,12,1,30,60", GOOD]
    assert complaints(tmp_path, HEAD, *rows) == [
        "log.csv:2: path_length: expected a number, more than 0, got 'x'",
        "log.csv:2: undos: expected a number, 0 or more, got '-1'",
        "log.csv:4: optimal_length of task 1 is 11 here and 10 on line 3",
        "log.csv:5: ann has done task 1 on wall already, on line 3",
    ]


def test_many_faults_are_counted(tmp_path: Path) -> None:
    found = complaints(tmp_path, HEAD, *["a,1,w,1,1,1,1,0"] * 30)
    assert len(found) == 21
    assert found[-1] == "log.csv: and 10 problems more"


def test_columns_that_are_missing_or_doubled_are_named(tmp_path: Path) -> None:
    head = "person,task,display,optimal_length,path_lenght,undos,motions,seconds,seconds"
    assert complaints(tmp_path, head, GOOD) == [
        "log.csv:1: there is no column path_length (is 'path_lenght' meant?)",
        "log.csv:1: column seconds is there 2 times",
    ]


def test_a_table_without_a_first_row_is_said(tmp_path: Path) -> None:
    assert complaints(tmp_path, GOOD) == [f"log.csv:1: expected a first row {HEAD.replace(',', ', ')}, got"
                                          " ann, 1, wall, 10, 12, 1, 30, 60"]  # fmt: skip


def test_nothing_is_no_log(tmp_path: Path) -> None:
    assert "is empty (expected a first row person, task," in complaints(tmp_path, "")[0]
    assert "has no trial to study" in complaints(tmp_path, HEAD)[0]


def test_only_known_tasks_can_be_skipped(tmp_path: Path) -> None:
    assert complaints(tmp_path, HEAD, GOOD, skip=("practice",)) == [
        "log.csv: has no task 'practice' to skip (expected 1)"
    ]
    assert "has no trial to study" in complaints(tmp_path, HEAD, GOOD, skip=("1",))[0]


def test_a_rating_is_a_number_or_nothing(tmp_path: Path) -> None:
    head = HEAD + ",overall"
    assert complaints(tmp_path, head, GOOD + ",good") == ["log.csv:2: overall: expected a number, got 'good'"]


def test_a_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(JobError, match="no such file"):
        read_log(tmp_path / "none.csv")
