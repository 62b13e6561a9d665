from __future__ import annotations

from dataclasses import replace

import numpy as np
from flatdisplays import flat_display, rectangle

from quiltcli.job.layout import PackSpec, UvLayoutSpec
from quiltcli.layout import layout_text, write_layout
from quiltcli.packing import layout_for, pack

TWO = flat_display([rectangle(4, 3)] * 2, enabled=[True, False])


def test_a_job_may_say_how_to_pack():
    facets, layout = layout_for(PackSpec(method="rows", size=(16, 12), padding=1), TWO)
    assert (layout.method, layout.padding, layout.pages.tolist()) == ("rows", 1, [[16, 12]])
    assert layout.page.tolist() == [0, -1]
    assert facets.size.tolist() == TWO.size.tolist()


def test_a_job_may_name_a_layout_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = pack(TWO, "rows", (16, 12))
    write_layout(made, "layout.yaml")
    assert layout_text(layout_for(tmp_path / "layout.yaml", TWO)[1], tmp_path) == layout_text(made)


def test_a_job_may_take_the_layout_from_texture_coordinates():
    uv = np.array(rectangle(0.25, 0.25) * 2) + 0.5
    facets, layout = layout_for(UvLayoutSpec(from_uv=True, size=(16, 12)), replace(TWO, uv=uv))
    assert layout.quilt_from_facet[0].tolist() == [[1, 0, 8], [0, -1, 6]]
    assert facets.size.tolist() == [[4, 3], [4, 3]]
