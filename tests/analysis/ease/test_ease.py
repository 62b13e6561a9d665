"""Ease of use: equation 6 and its statistics in closed form, on logs that are made up."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from quiltcli.analysis.ease import ease_of_use, read_log, words_of, write_report
from quiltcli.analysis.ease.ease import interval
from quiltcli.analysis.ease.report import displays_chart, persons_chart, ratings_chart
from quiltcli.analysis.ease.table import study_data
from quiltcli.errors import OutputError

MADE_UP = Path(__file__).parent / "made_up_log.csv"
HEAD = "person,task,display,optimal_length,path_length,undos,motions,seconds"


def study_of(tmp_path: Path, *rows: str, head: str = HEAD, skip: tuple[str, ...] = ()):
    path = tmp_path / "log.csv"
    path.write_text("\n".join((head, *rows)) + "\n")
    return ease_of_use(read_log(path, skip))


def test_each_term_is_a_share_of_twice_its_greatest_value(tmp_path: Path) -> None:
    """10 / (10 + 0) = 1 and 10 / (16 + 4) = 0.5; 30 / 60 = 0.5 and 12 / 120 = 0.1 motions a second."""
    ease = study_of(tmp_path, "a,1,wall,10,10,0,12,120", "b,1,wall,10,16,4,30,60")
    assert ease.perception.tolist() == [0.5, 0.25]
    assert ease.interaction.tolist() == pytest.approx([0.1, 0.5], abs=1e-15)
    assert ease.total.tolist() == pytest.approx([0.6, 0.75], abs=1e-15)


def test_the_greatest_term_counts_half_even_if_nobody_found_the_shortest_path(
    tmp_path: Path,
) -> None:
    ease = study_of(tmp_path, "a,1,wall,10,20,0,1,10", "b,1,wall,10,25,15,4,10")
    assert ease.perception.tolist() == [0.5, 0.25]
    assert ease.interaction.tolist() == [0.125, 0.5]


def test_a_log_without_motions_is_of_the_first_term_alone(tmp_path: Path) -> None:
    ease = study_of(tmp_path, "a,1,wall,10,20,0,0,10", "b,1,ball,10,25,15,0,10")
    assert ease.total.tolist() == [0.5, 0.25]
    assert "nobody moved: the second term is 0 throughout" in list(words_of(ease))


def log_of(pairs: list[tuple[float, float]]) -> list[str]:
    """Rows of people with these first terms, as shares of the best, on a wall and a ball; nobody moves."""
    rows = []
    for k, both in enumerate(pairs):
        for display, term in zip(("wall", "ball"), both, strict=True):
            rows.append(f"p{k},1,{display},1000,{1000 / term!r},0,0,9")
    return rows


def test_the_paired_test_is_students(tmp_path: Path) -> None:
    """Differences 0.1, 0.2, 0.3 of halves: mean 0.1, standard deviation 0.05, t = 0.1 / (0.05 / √3) = 2√3."""
    ease = study_of(tmp_path, *log_of([(0.8, 0.9), (0.8, 1.0), (0.7, 1.0)]))
    (found,) = ease.comparisons
    assert (found.first, found.second, found.better, found.left_out) == ("wall", "ball", 3, ())
    assert found.difference.mean == pytest.approx(0.1, abs=1e-12)
    assert found.effect == pytest.approx(2, abs=1e-9)
    assert found.t == pytest.approx(2 * math.sqrt(3), abs=1e-9)
    # With 2 degrees of freedom Student's distribution is in closed form: F(t) = 1/2 + t / (2 √(2 + t²)).
    assert found.p == pytest.approx(1 - found.t / math.sqrt(2 + found.t**2), abs=1e-9)
    # Its 97.5th percentile is 4.302653.
    half = 4.302652729911275 * 0.05 / math.sqrt(3)
    assert found.difference.low == pytest.approx(0.1 - half, abs=1e-9)
    assert found.difference.high == pytest.approx(0.1 + half, abs=1e-9)
    assert found.p_all == found.p


def test_the_test_agrees_with_scipys(tmp_path: Path) -> None:
    """Another implementation, on the made-up log; of every pair of the means of persons."""
    ease = ease_of_use(read_log(MADE_UP))
    wall, ball = ease.by_person["ease"].T
    (found,) = ease.comparisons
    other = stats.ttest_rel(ball, wall)
    assert (found.t, found.p) == pytest.approx((other.statistic, other.pvalue), rel=1e-9)
    assert found.p_ranks == pytest.approx(stats.wilcoxon(ball - wall).pvalue, rel=1e-9)
    ends = other.confidence_interval(0.95)
    assert (found.difference.low, found.difference.high) == pytest.approx((ends.low, ends.high), rel=1e-9)


def test_means_of_persons_are_over_tasks_and_of_displays_over_persons(tmp_path: Path) -> None:
    rows = ["a,1,w,10,10,0,0,1", "a,2,w,10,20,0,0,1", "b,1,w,10,40,0,0,1", "b,2,w,10,40,0,0,1"]
    ease = study_of(tmp_path, *rows)
    assert ease.by_person["ease"].tolist() == [[0.375], [0.125]]
    (mean,) = ease.by_display["ease"]
    assert (mean.mean, mean.count) == (0.25, 2)
    # One degree of freedom: half the interval is tan(0.475 π) times the standard error, 0.125.
    assert mean.high - mean.mean == pytest.approx(math.tan(0.475 * math.pi) * 0.125, rel=1e-9)


def test_persons_are_compared_by_tasks_they_did_on_both_displays(tmp_path: Path) -> None:
    """b did task 2 on the wall alone, and badly; c never saw the ball."""
    rows = log_of([(1.0, 0.5), (1.0, 0.5)])
    ease = study_of(tmp_path, *rows, "p1,2,wall,1000,9000,0,0,9", "c,1,wall,1000,1000,0,0,9")
    (found,) = ease.comparisons
    assert found.difference.mean == pytest.approx(-0.25, abs=1e-12)
    assert found.left_out == ("c",)
    assert any("no task was done on both displays: c" in words for words in words_of(ease))


def test_displays_without_a_difference_are_alike_for_certain(tmp_path: Path) -> None:
    (found,) = study_of(tmp_path, *log_of([(0.8, 0.8), (1.0, 1.0)])).comparisons
    assert (found.t, found.p, found.better) == (0.0, 1.0, 0)
    assert math.isnan(found.p_ranks)


def test_one_person_is_no_test(tmp_path: Path) -> None:
    ease = study_of(tmp_path, *log_of([(0.8, 1.0)]))
    (words,) = [w for w in words_of(ease) if "ball" in w]
    assert words == "ball and wall cannot be compared: 1 person used both, and a test needs two or more"
    assert study_data(ease)["comparisons"][0]["p"] is None


def test_one_display_has_nothing_to_be_compared_with(tmp_path: Path) -> None:
    ease = study_of(tmp_path, "a,1,wall,10,10,0,1,10")
    assert ease.comparisons == ()
    assert any("nothing to compare it with" in words for words in words_of(ease))


def test_three_displays_are_three_pairs_by_holms_method(tmp_path: Path) -> None:
    rows = log_of([(0.80, 0.90), (0.80, 1.0), (0.70, 1.0), (0.75, 0.91)])
    rows += [f"p{k},1,dome,1000,{1000 / term!r},0,0,9" for k, term in enumerate((0.82, 0.85, 0.66, 0.8))]
    found = study_of(tmp_path, *rows).comparisons
    assert [(one.first, one.second) for one in found] == [
        ("wall", "ball"),
        ("wall", "dome"),
        ("ball", "dome"),
    ]
    order = sorted(found, key=lambda one: one.p)
    expected = [3 * order[0].p, max(3 * order[0].p, 2 * order[1].p)]
    expected.append(max(expected[1], order[2].p))
    assert [one.p_all for one in order] == pytest.approx([min(p, 1) for p in expected], rel=1e-12)


def test_intervals_hold_the_mean_as_often_as_they_say() -> None:
    chance = np.random.default_rng(8)
    held = 0
    for values in chance.normal(0.6, 0.1, (400, 9)):
        found = interval(values)
        held += found.low <= 0.6 <= found.high
    assert 0.92 <= held / 400 <= 0.98


def test_a_task_for_practice_is_left_out_before_terms_are_scaled(tmp_path: Path) -> None:
    rows = ["a,practice,w,5,5,0,90,9", "a,1,w,10,20,0,1,10", "b,1,w,10,40,0,1,20"]
    ease = study_of(tmp_path, *rows, skip=("practice",))
    assert ease.tasks == ("1",)
    assert ease.total.tolist() == [1.0, 0.5]


def test_ratings_are_means_of_what_each_person_gave(tmp_path: Path) -> None:
    rows = ["a,1,w,9,9,0,1,9,4,", "a,2,w,9,9,0,1,9,2,", "b,1,w,9,9,0,1,9,,", "b,1,v,9,9,0,1,9,5,"]
    ease = study_of(tmp_path, *rows, head=HEAD + ",overall,age")
    assert list(ease.ratings) == ["overall"]
    np.testing.assert_equal(ease.ratings["overall"], [[3.0, np.nan], [np.nan, 5.0]])
    assert any(words == "columns that mean nothing here: age" for words in words_of(ease))


def test_the_report_is_a_page_and_data_that_tell_the_same(tmp_path: Path) -> None:
    ease = ease_of_use(read_log(MADE_UP))
    page, data = write_report(ease, tmp_path / "new" / "report.html")
    text, told = page.read_text(encoding="utf-8"), json.loads(data.read_text())
    assert told["trials"][0]["ease"] == pytest.approx(ease.total[0], abs=1e-15)
    assert len(told["trials"]) == 90
    assert f"{ease.total[0]:.3f}" in text
    assert text.count("<svg") == 3
    for chart in (persons_chart(ease), displays_chart(ease), ratings_chart(ease)):
        assert chart in text
    assert sorted(path.name for path in page.parent.iterdir()) == ["report.html", "report.json"]


def test_bars_are_as_long_as_what_they_stand_for(tmp_path: Path) -> None:
    ease = study_of(tmp_path, *log_of([(0.4, 0.8), (0.8, 1.0)]))
    drawn = ET.fromstring(persons_chart(ease))
    bars = [float(r.get("height")) for r in drawn.iter("{http://www.w3.org/2000/svg}rect")][:-2]
    legend = [r.get("height") for r in drawn.iter("{http://www.w3.org/2000/svg}rect")].count("12")
    assert legend == 2
    heights = sorted(
        float(r.get("height"))
        for r in drawn.iter("{http://www.w3.org/2000/svg}rect")
        if r.get("height") != "12"
    )
    assert len(bars) == len(heights) == 4
    assert np.array(heights) / heights[-1] == pytest.approx([0.4, 0.8, 0.8, 1.0], abs=2e-3)


def test_a_report_has_to_end_in_html(tmp_path: Path) -> None:
    ease = study_of(tmp_path, "a,1,wall,10,10,0,1,10")
    with pytest.raises(OutputError, match=r"report.pdf: expected a name that ends in .html"):
        write_report(ease, tmp_path / "report.pdf")


def test_the_made_up_log_says_that_it_is() -> None:
    assert MADE_UP.read_text().startswith("# Made up by a program")
