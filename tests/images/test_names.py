"""File names: what is in them, and back."""

import pytest

from quiltcli.images.names import ImageName, facet_path, name_of, quilt_path


@pytest.mark.parametrize(
    ("frame", "expected"),
    [(1, "0001"), (0, "0000"), (12345, "12345"), (-1, "-0001"), (-12345, "-12345")],
)
def test_the_frame_ends_the_name(tmp_path, frame, expected):
    assert tmp_path / "quilt" / f"page_01.{expected}.exr" == quilt_path(tmp_path, 1, frame)
    assert tmp_path / "facets" / f"facet_0012.{expected}.exr" == facet_path(tmp_path, 12, frame)
    assert name_of(quilt_path(tmp_path, 123, frame)) == ImageName("page", 123, frame)
    assert name_of(facet_path(tmp_path, 12345, frame)) == ImageName("facet", 12345, frame)


@pytest.mark.parametrize(
    "name", ["page_01.exr", "page_01.001.exr", "page.0001.exr", ".page_01.0001.exr.9.tmp"]
)
def test_other_names_hold_no_numbers(tmp_path, name):
    assert name_of(tmp_path / name) is None


@pytest.mark.parametrize("eye", ["left", "right"])
def test_the_eye_stands_before_the_frame(tmp_path, eye):
    assert quilt_path(tmp_path, 1, 7, eye).name == f"page_01.{eye}.0007.exr"
    assert facet_path(tmp_path, 2, -7, eye).name == f"facet_0002.{eye}.-0007.exr"
    assert name_of(facet_path(tmp_path, 2, -7, eye)) == ImageName("facet", 2, -7, eye)
