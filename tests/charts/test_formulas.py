"""Formulas are read, not run: what is off the list is an error that says where."""

from __future__ import annotations

import random

import numpy as np
import pytest

from quiltcli.geometry.formulas import FUNCTIONS, FormulaError, parse


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2*s-1", lambda s, t: 2 * s - 1),
        ("-s**2 + t/3", lambda s, t: -(s**2) + t / 3),
        ("a*sin(pi*s)*cos(t)", lambda s, t: 0.5 * np.sin(np.pi * s) * np.cos(t)),
        (
            "atan2(s, t) + min(s, t) - max(s, 0.5)",
            lambda s, t: np.arctan2(s, t) + np.minimum(s, t) - np.maximum(s, 0.5),
        ),
        (
            "sqrt(abs(s - t)) + exp(-s) + log(1 + t) + tan(s)",
            lambda s, t: np.sqrt(abs(s - t)) + np.exp(-s) + np.log(1 + t) + np.tan(s),
        ),
    ],
)
def test_formulas_are_worked_out(text: str, expected: object) -> None:
    s, t = np.meshgrid(np.linspace(0, 1, 7), np.linspace(0.1, 1, 5))
    found = parse(text, ["s", "t", "a"])({"s": s, "t": t, "a": 0.5})
    assert np.abs(found - expected(s, t)).max() < 1e-15  # type: ignore[operator]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("s + q", "at character 5: unknown name 'q'"),
        ("__import__('os')", "at character 1: unknown function '__import__'"),
        ("s.__class__", "at character 1: expected numbers, names"),
        ("s if t else 0", "got IfExp"),
        ("[s]", "got List"),
        ("s @ t", "expected + - * / or **, got MatMult"),
        ("s // 2", "got FloorDiv"),
        ("sin(s, t)", "sin takes 1 value, got 2"),
        ("sin(*s)", "sin takes 1 value"),
        ("(lambda: 0)()", "unknown function something that is no name"),
        ("True", "expected a number, got True"),
        ("'a'", "expected a number"),
        ("1e999", "expected a finite number"),
        ("s +", "cannot be read"),
        ("", "cannot be read"),
        ("-" * 500 + "s", "nested more than"),
        ("s" * 3000, "is 3000 characters long"),
    ],
)
def test_what_is_not_on_the_list_is_refused(text: str, words: str) -> None:
    with pytest.raises(FormulaError) as error:
        parse(text, ["s", "t"])
    assert words in str(error.value)


def test_no_text_does_anything_but_be_read_or_refused() -> None:
    words = [
        *FUNCTIONS,
        "s",
        "t",
        "pi",
        "(",
        ")",
        ",",
        "+",
        "-",
        "*",
        "/",
        "**",
        "1",
        ".5",
        "1e3",
        "__",
        ".",
        "[",
        "]",
        "lambda",
        ":",
        "=",
        "import",
        "\n",
        "\0",
        "é",
    ]
    chance = random.Random(3)
    read, refused = 0, []
    for _ in range(4000):
        text = "".join(chance.choice(words) for _ in range(chance.randrange(1, 9)))
        try:
            formula = parse(text, ["s", "t"])
        except FormulaError as error:
            refused.append(str(error))
            continue
        read += 1
        assert formula({"s": np.zeros(2), "t": np.ones(2)}).dtype == np.float64
    assert read > 50
    assert all(refused)


def test_huge_powers_of_numbers_cost_nothing() -> None:
    assert np.isinf(parse("9**9**9**9", [])({}))
