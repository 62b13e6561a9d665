"""A curved display at the command line: what works, and what says why it does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.cli import main
from quiltcli.formats.exr.image import read_header
from tests.helpers.curved_jobs import boxes, curved_job

SPHERE = "surfaces:\n- {name: ball, kind: sphere, radius: 1, pixels: [96, 48]}"
PANORAMA = "projection: {kind: dome_master, pixels: [64, 64]}"


def quilt(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    return result.exit_code, result.output + (result.stderr if result.stderr_bytes else "")


@pytest.mark.parametrize("display", [SPHERE, PANORAMA])
def test_a_job_is_checked_packed_rendered_verified_and_cut_up(display: str, tmp_path: Path) -> None:
    curved_job(tmp_path, display, boxes(20, 0.5, 1.5), (0.5, 0.4, 3.0))
    job, out = tmp_path / "job.yaml", tmp_path / "out"
    for arguments in (
        ("check", job),
        ("info", tmp_path / "display.yaml"),
        ("pack", tmp_path / "display.yaml", "-o", tmp_path / "layout.yaml"),
        ("pattern", tmp_path / "layout.yaml", "-o", tmp_path / "pattern"),
        ("render", job, "-j", "1"),
        ("verify", job),
        ("contact", out, "-o", tmp_path / "sheet.png"),
        (
            "unmap",
            out / "quilt" / "page_01.0001.exr",
            "--layout",
            out / "layout.yaml",
            "-o",
            tmp_path / "cut",
        ),
        ("simulate", job, "-o", tmp_path / "seen.png", "--size", "64x48"),
        ("info", out),
    ):
        code, said = quilt(*arguments)
        assert code == 0, (arguments, said)
    record = read_header(out / "facets" / "facet_0001.0001.exr").attributes["quilt:surface"]
    assert '"kind":"sphere"' in record or '"kind":"dome_master"' in record


def test_the_page_compare_and_project_take_curved_displays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quiltcli.analysis.methods.eyeviews.SIZE", (120, 90))
    curved_job(tmp_path, PANORAMA, boxes(5, 0.5, 1.5), (0.5, 0.4, 3.0))
    job, out = tmp_path / "job.yaml", tmp_path / "out"
    assert quilt("render", job, "-j", "1")[0] == 0
    picture = tmp_path / "around.png"
    Image.fromarray(np.full((16, 32, 3), 128, np.uint8)).save(picture)
    for arguments in (
        ("view", out, "-o", tmp_path / "page.html", "--errors"),
        ("compare", job, "--method", "cubemap", "-o", tmp_path / "compare"),
        ("project", job, "--picture", picture, "--as", "equirect", "-o", tmp_path / "put", "--st-map"),
    ):
        code, said = quilt(*arguments)
        assert code == 0, (arguments, said)


@pytest.mark.parametrize(
    ("display", "arguments", "words"),
    [
        (
            SPHERE,
            ("cameras", "job.yaml", "-o", "cameras.json"),
            "no camera makes the image of a curved facet",
        ),
        (
            PANORAMA,
            ("sweetspot", "display.yaml", "--eye", "0,0,3"),
            "this projection goes along with the eye",
        ),
        (
            SPHERE,
            ("compare", "job.yaml", "--method", "offaxis"),
            "offaxis projects onto flat facets, and the display has curved ones",
        ),
        (
            PANORAMA,
            ("compare", "job.yaml", "--method", "tessellate"),
            "tessellate is for displays of curved surfaces and nothing else",
        ),
    ],
)
def test_what_curved_displays_do_not_have_is_said(
    display: str, arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curved_job(tmp_path, display, boxes(5, 0.5, 1.5), (0.5, 0.4, 3.0))
    monkeypatch.chdir(tmp_path)
    code, said = quilt(*arguments)
    assert code == 2, said
    assert words in said


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("render: {method: offaxis}", "render.method: offaxis projects onto flat facets"),
        ("render: {depth_bits: 24}", "render.depth_bits: a depth buffer of so many bits belongs to flat"),
    ],
)
def test_methods_for_flat_facets_are_refused_with_their_line(keys: str, words: str, tmp_path: Path) -> None:
    curved_job(tmp_path, SPHERE, boxes(5, 0.5, 1.5), (0.5, 0.4, 3.0), more=f"{keys}\n")
    for command in ("check", "render"):
        code, said = quilt(command, tmp_path / "job.yaml")
        assert code in (1, 2)
        assert words in said


def test_a_map_is_packed_once_and_rendered_with_that_layout(tmp_path: Path) -> None:
    from tests.helpers.curved_jobs import write_map

    x, y = np.meshgrid(np.linspace(-1, 1, 64), np.linspace(0.5, -0.5, 32))
    write_map(tmp_path / "map.exr", np.stack((x, y, 0.2 * x * x)))
    curved_job(tmp_path, "surfaces:\n- {kind: map, file: map.exr}", boxes(5, 0.5, 1.5), (0.1, 0, 2))
    assert quilt("pack", tmp_path / "display.yaml", "-o", tmp_path / "layout.yaml")[0] == 0
    layout = f"layout={tmp_path / 'layout.yaml'}"
    code, said = quilt("render", tmp_path / "job.yaml", "-j", "1", "--set", layout)
    assert code == 0, said
    # Another map is another display.
    write_map(tmp_path / "map.exr", np.stack((x, y, 0.3 * x * x)))
    code, said = quilt("render", tmp_path / "job.yaml", "-j", "1", "--set", layout, "--overwrite")
    assert code == 2
    assert "made for other geometry" in said


def test_a_layout_that_shears_a_surface_is_refused(tmp_path: Path) -> None:
    curved_job(tmp_path, SPHERE, boxes(5, 0.5, 1.5))
    assert quilt("pack", tmp_path / "display.yaml", "-o", tmp_path / "layout.yaml")[0] == 0
    text = (tmp_path / "layout.yaml").read_text()
    text = text.replace("[[1, 0, ", "[[1, 0.01, ").replace("- size: [96, 48]", "- size: [128, 128]")
    (tmp_path / "layout.yaml").write_text(text)
    code, said = quilt("render", tmp_path / "job.yaml", "--set", f"layout={tmp_path / 'layout.yaml'}")
    assert code == 2
    assert "facet 1 is curved, and must move by whole pixels and quarter turns" in said
