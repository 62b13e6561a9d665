"""Objects measured in other units and with another axis up."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.scene import load_scene


def test_units_and_the_up_axis_come_before_the_transform(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 1000 0 0\nv 0 2000 0\nv 0 0 3000\nf 1 2 3\n")
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n"
        "- {mesh: a.obj, units: mm, up_axis: z, transform: {scale: 2, translate: [1, 0, 0]}}\n"
    )
    found = load_scene(tmp_path / "scene.yaml").vertices
    np.testing.assert_allclose(found, [[3, 0, 0], [1, 0, -4], [1, 6, 0]], atol=1e-12)
