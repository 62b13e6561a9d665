"""What panels make of their images, and the images that make up for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import load_display
from quiltcli.display.response import Response, white_gain
from quiltcli.errors import DisplayError, JobError
from quiltcli.job import load_display_file
from tests.helpers.even_light import WALLS


def response(folder: Path, corrections: str, display: str = WALLS) -> Response:
    (folder / "display.yaml").write_text(f"quilt_display: 1\n{display}corrections:\n{corrections}")
    found = load_display(load_display_file(folder / "display.yaml")).response
    assert found is not None
    return found


def test_a_cosine_of_a_half_is_made_up_for_by_two_to_the_exponent(tmp_path):
    for exponent in (0.5, 1, 3):
        panel = response(tmp_path, f"  brightness: {{exponent: {exponent}, limit: 100}}\n")
        assert panel.brightening(np.array([1.0, 0.5])) == pytest.approx([1, 2**exponent])


def test_nothing_is_brightened_by_more_than_the_limit(tmp_path):
    panel = response(tmp_path, "  brightness: {exponent: 1}\n")
    assert panel.brightening(np.array([0.3, 0.25, 0.01, 0.0, -1.0])) == pytest.approx([1 / 0.3, 4, 4, 4, 4])


def test_a_table_is_read_in_proportion_between_its_rows_and_for_each_primary(tmp_path):
    panel = response(tmp_path, "  brightness: {table: [[0, 1, 1, 1], [60, 0.5, 0.6, 0.8], [80, 0.1]]}\n")
    at = np.cos(np.radians([0, 30, 60, 70, 89]))
    found = panel.brightness(at)
    assert found[0] == pytest.approx([1, 0.75, 0.5, 0.3, 0.1])
    assert found[2] == pytest.approx([1, 0.9, 0.8, 0.45, 0.1])


def test_panels_show_the_light_that_was_meant(tmp_path):
    text = (
        "  brightness: {table: [[0, 1], [60, 0.5, 0.6, 0.8]]}\n  level: 0.4\n"
        "  facets: {2: {gain: [1, 0.98, 1.03], gamma: 2.6, white: [0.29, 0.30]}}\n"
    )
    panel = response(tmp_path, text)
    rng = np.random.default_rng(1)
    light, cosine = rng.uniform(0, 2, (3, 50)), rng.uniform(0.5, 1, 50)
    for facet in (0, 1):
        image = panel.wanted(facet, light, cosine)
        assert not np.allclose(image, light)
        assert panel.shown(facet, image, cosine) == pytest.approx(0.4 * light, rel=1e-12)


def test_gamma_is_held_against_that_of_the_signal(tmp_path):
    # A panel that raises signals to 2.4, played by 2.2: the signal of the image w is w^(1/2.2).
    panel = response(tmp_path, "  facets: {1: {gamma: 2.4}}\n")
    image = panel.wanted(0, np.full((3, 1), 0.5), np.ones(1))
    assert (image ** (1 / 2.2)) ** 2.4 == pytest.approx(0.5, rel=1e-12)


def test_a_white_is_taken_to_that_of_the_pictures():
    gain = white_gain((0.30, 0.31))
    # Mixed by hand: X, Y, Z of white from the primaries as bright as they are in each white.
    primaries = np.array([[x / y, 1, (1 - x - y) / y] for x, y in ((0.64, 0.33), (0.3, 0.6), (0.15, 0.06))]).T
    own = np.linalg.solve(primaries, [0.30 / 0.31, 1, 0.39 / 0.31])
    shown = primaries @ (own * gain)
    assert shown[0] / shown.sum() == pytest.approx(0.3127)
    assert shown[1] / shown.sum() == pytest.approx(0.3290)
    assert shown[1] == pytest.approx(1)  # as bright as before
    assert white_gain((0.3127, 0.3290)) == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("  brightness: {}\n", "brightness: expected exponent or table, got neither"),
        ("  brightness: {exponent: 1, table: [[0, 1]]}\n", "cannot stand beside exponent"),
        ("  brightness: {exponent: 1, limit: 0.5}\n", "brightness.limit"),
        ("  brightness: {table: [[0, 1], [0, 0.5]]}\n", "must be greater than the angle before, 0, got 0"),
        ("  brightness: {table: [[0, 1], [95, 0.5]]}\n", "must be from 0 to 90 degrees, got 95"),
        (
            "  brightness: {table: [[0, 1, 2]]}\n",
            "expected [degrees, brightness] or [degrees, red, green, blue]",
        ),
        ("  brightness: {table: [[0, 0]]}\n", "brightness.table"),
        ("  facets: {1: {gain: [1, 2]}}\n", "expected a number or 3 numbers, red, green and blue"),
        ("  facets: {1: {gain: 0}}\n", "facets.1.gain"),
        ("  facets: {1: {white: [0.5, 0.6]}}\n", "x + y must be less than 1, got 1.1"),
        ("  facets: {3: {gain: 2}}\n", "there is no facet 3 (the display has facets 1 to 2)"),
        ("  facets: {2: {white: [0.1, 0.8]}}\n", "no mixture of the primaries of Rec.709 is [0.1, 0.8]"),
        ("  level: 1\n", "corrects nothing"),
        ("  levle: 1\n", "unknown key"),
    ],
)
def test_what_cannot_be_is_said_with_its_line_and_key(tmp_path, text, words):
    with pytest.raises((JobError, DisplayError)) as caught:
        response(tmp_path, text)
    message = str(caught.value)
    assert words in message
    assert "display.yaml:" in message


def test_a_projection_is_not_seen_aslant(tmp_path):
    projection = "projection: {kind: equirect, pixels: [32, 16]}\n"
    with pytest.raises(DisplayError, match=r"corrections\.brightness: a projection stands nowhere"):
        response(tmp_path, "  brightness: {exponent: 1}\n", projection)
    assert response(tmp_path, "  level: 0.5\n", projection).level == 0.5
