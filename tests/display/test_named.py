"""Facets by their names."""

import pytest

from quiltcli.display.named import facet_ids
from quiltcli.errors import JobError

NAMES = ("left", "right", "", "tread", "tread")


def test_names_and_ids_stand_together():
    assert facet_ids("right,left", NAMES) == (1, 2)
    assert facet_ids("right, 3-4", NAMES) == (2, 3, 4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lef", "there is no facet named 'lef' (did you mean 'left'?)"),
        ("tread", "2 facets are named 'tread' (give their ids)"),
        ("left,1", "facet 1 is named twice in 'left,1'"),
        ("left,", "a facet is missing in 'left,'"),
    ],
)
def test_names_that_mean_no_facet_or_several(text, words):
    with pytest.raises(JobError) as caught:
        facet_ids(text, NAMES)
    assert words in str(caught.value)
