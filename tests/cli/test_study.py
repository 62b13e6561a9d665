"""`quilt study`: tables, a report and errors on the command line."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner

from quiltcli.cli import main

MADE_UP = Path(__file__).parents[1] / "analysis" / "ease" / "made_up_log.csv"


def run(*words):
    return CliRunner().invoke(main, ["study", *map(str, words)])


def test_a_log_is_told_in_tables_and_words(tmp_path: Path) -> None:
    done = run(MADE_UP, "-o", tmp_path / "report.html")
    assert done.exit_code == 0, done.output
    assert "person 15" in done.stdout
    assert "sphere less panel: +0.0" in done.stdout
    assert "sphere is easier for 13 of 15 (87 %)" in done.stdout
    assert done.stdout.endswith(
        f"written to {tmp_path / 'report.html'}\nwritten to {tmp_path / 'report.json'}\n"
    )


def test_programs_are_told_everything() -> None:
    done = run(MADE_UP, "--json", "--skip", "easy")
    told = json.loads(done.stdout)
    assert told["tasks"] == ["medium", "hard"]
    assert len(told["trials"]) == 60


def test_a_bad_log_leaves_no_report(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text(MADE_UP.read_text().replace(",10,", ",ten,", 1))
    done = run(log, "-o", tmp_path / "report.html")
    assert done.exit_code == 2
    assert "log.csv:3: optimal_length: expected a number, more than 0, got 'ten'" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["log.csv"]


def test_a_report_of_another_kind_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    done = run(tmp_path / "none.csv", "-o", "report.pdf")
    assert done.exit_code == 2
    assert "report.pdf: expected a name that ends in .html" in done.stderr
