from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.layout import layout_text, write_layout
from quiltcli.layout.from_job import layout_for
from tests.helpers.flat_displays import flat_display, rectangle
from tests.helpers.packed_layouts import pack

TWO = flat_display([rectangle(4, 3)] * 2, enabled=[True, False])


def test_a_job_may_say_how_to_pack():
    layout = layout_for(PackSpec(method="rows", size=(16, 12), padding=1), TWO)
    assert (layout.method, layout.padding, layout.pages.tolist()) == ("rows", 1, [[16, 12]])
    assert layout.page.tolist() == [0, -1]
    assert layout.size.tolist() == TWO.size.tolist()


def test_a_job_may_name_a_layout_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = pack(TWO, "rows", (16, 12))
    write_layout(made, "layout.yaml")
    assert layout_text(layout_for(tmp_path / "layout.yaml", TWO), tmp_path) == layout_text(made)


def test_a_job_may_take_the_layout_from_texture_coordinates():
    uv = np.array(rectangle(0.25, 0.25) * 2) + 0.5
    layout = layout_for(UvLayoutSpec(from_uv=True, size=(16, 12)), replace(TWO, uv=uv))
    assert layout.quilt_from_facet[0].tolist() == [[1, 0, 8], [0, -1, 6]]
    assert layout.size.tolist() == [[4, 3], [4, 3]]


def test_a_job_may_say_all_that_the_command_takes(tmp_path):
    write_layout(pack(TWO, "rows", (16, 12)), tmp_path / "pins.yaml")
    both = replace(TWO, enabled=np.ones(2, dtype=np.bool_))
    spec = PackSpec(method="nest", pins=tmp_path / "pins.yaml", align=4, padding=1, seconds=0.1)
    layout = layout_for(spec, both)
    assert layout.pages.tolist() == [[16, 12]]
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 1, 4]]]
    assert layout_for(PackSpec(aspect="4:1", seconds=0.1), both).pages.tolist() == [[16, 4]]
    assert layout_for(PackSpec(size=(16, 12), page_facets=1), both).page.tolist() == [0, 1]
    assert layout_for(PackSpec(size=(16, 12), page_pixels=12), both).page.tolist() == [0, 1]
