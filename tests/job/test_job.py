from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

from quiltcli.formats.yaml.source import parse_value
from quiltcli.job import (
    COMPRESSIONS,
    PACKING_METHODS,
    JobFile,
    PackSpec,
    PathSpec,
    TransformSpec,
    UvLayoutSpec,
    ViewerSpec,
    dump_job,
    dump_yaml,
    job_sha256,
    load_display_file,
    load_job,
    load_layout_file,
    load_scene_file,
)
from quiltcli.job.schema import schemas
from tests.helpers.good_files import edited, write_good_files


@pytest.fixture
def job_path(tmp_path: Path) -> Path:
    return write_good_files(tmp_path)


def test_defaults(job_path: Path) -> None:
    job = load_job(job_path)
    folder = job_path.parent
    assert (job.display, job.scene) == (folder / "display.yaml", folder / "mesh.obj")
    assert job.layout == PackSpec(method="auto", size=None, padding=2)
    assert job.frames == tuple(range(1, 121))
    assert job.fps == 30
    assert job.viewer.path.interpolation == "linear"
    assert job.output.directory == folder / "out"
    assert job.output.channels == ("rgba", "Z")
    assert (job.render.samples, job.render.bleed, job.render.depth) == (1, 2, "planar")


def test_contract_like_display(job_path: Path) -> None:
    path = edited(
        job_path.parent,
        "display.yaml",
        "",
        "units: in\nviewing_side: back\n"
        "facets:\n  3: {name: top, facet_pixels: [1920, 1080], up: [0, 0, -1], rotate: -90, mirror: false}\n"
        "transform: {translate: [0, 1.2, 0], rotate_deg: [0, 90, 0], scale: 2}\n",
    )
    display = load_display_file(path)
    assert display.metres == 0.0254
    assert display.facets[3].rotate == 270
    assert display.facets[3].up == (0.0, 0.0, -1.0)
    assert display.transform is not None
    assert display.transform.array[:3, 3].tolist() == [0, 1.2, 0]
    assert display.transform.array[:3, 0] == pytest.approx([0, 0, -2])


def test_units_may_be_a_number(job_path: Path) -> None:
    path = edited(job_path.parent, "display.yaml", "", "units: 1e-3\n")
    assert load_display_file(path).metres == 0.001


def test_matrix_is_the_transform() -> None:
    rows = ((1.0, 0.0, 0.0, 5.0), (0.0, 1.0, 0.0, 6.0), (0.0, 0.0, 1.0, 7.0), (0.0, 0.0, 0.0, 1.0))
    assert TransformSpec(matrix=rows).array.tolist() == [list(row) for row in rows]


def test_layout_choices(job_path: Path) -> None:
    folder = job_path.parent
    edited(folder, "job.yaml", "", "layout: layout.yaml\n")
    assert load_job(job_path).layout == folder / "layout.yaml"
    sets = ["layout={from_uv: true, size: [64, 32]}"]
    assert load_job(job_path, sets).layout == UvLayoutSpec(from_uv=True, size=(64, 32))
    assert load_job(job_path, ["layout={size: [64, 32]}"]).layout == PackSpec(size=(64, 32))


def test_absent_layout_is_the_displays_own(job_path: Path) -> None:
    edited(job_path.parent, "display.yaml", "", "layout: {from_uv: true, size: [64, 32]}\n")
    assert load_job(job_path).layout == UvLayoutSpec(from_uv=True, size=(64, 32))


def test_scene_kinds(job_path: Path) -> None:
    folder = job_path.parent
    edited(
        folder,
        "scene.yaml",
        "",
        "lights:\n- {type: directional, direction: [-1, -2, -1], color: [3, 3, 3]}\n"
        "- {type: point, position: [0, 3, 0]}\n- {type: ambient}\n",
    )
    scene = load_scene_file(folder / "scene.yaml")
    assert [light.type for light in scene.lights] == ["directional", "point", "ambient"]
    assert scene.objects[0].mesh == folder / "mesh.obj"
    assert load_scene_file(folder / "mesh.obj").objects[0].mesh == folder / "mesh.obj"


def test_layout_file(job_path: Path) -> None:
    layout = load_layout_file(job_path.parent / "layout.yaml")
    assert layout.facets[0].quilt_from_facet == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert layout.pages[0].size == (64, 64)


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("30", Fraction(30)),
        ("23.976", Fraction(24000, 1001)),
        ("29.97", Fraction(30000, 1001)),
        ("12.5", Fraction(25, 2)),
        ("30000/1001", Fraction(30000, 1001)),
    ],
)
def test_fps(job_path: Path, text: str, rate: Fraction) -> None:
    assert load_job(job_path, [f"fps={text}"]).fps == rate


def test_set_makes_missing_mappings_and_reaches_into_lists(job_path: Path) -> None:
    job = load_job(job_path, ["render.samples=4", "viewer.path.keyframes.0.position[1]=1e0", "frames=7"])
    assert job.render.samples == 4
    assert job.viewer.path.keyframes is not None
    assert job.viewer.path.keyframes[0].position == (0.0, 1.0, 2.5)
    assert job.frames == (7,)


def test_set_names_files_from_the_working_directory(job_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = job_path.parent / "elsewhere"
    elsewhere.mkdir()
    shutil.copy(job_path.parent / "mesh.obj", elsewhere / "other.obj")
    monkeypatch.chdir(elsewhere)
    assert load_job(job_path, ["scene=other.obj"]).scene == Path("other.obj")


def test_models_do_not_change(job_path: Path) -> None:
    job = load_job(job_path)
    with pytest.raises(ValidationError):
        job.fps = Fraction(1)  # type: ignore[misc]


FULL = """\
layout: {method: rows, size: [64, 64]}
fps: 23.976
render: {depth: radial}
output: {directory: "1e3", facets: false, compression: zstd}
"""
PATHS = {
    "csv": "    csv: {file: track.csv, fill: true, look_at: [0, 0, 1e-5], units: mm}\n",
    "orbit": "    orbit: {center: [0, 1, 0], radius: 2, elevation_deg: 10, frames_per_turn: -100.5}\n",
    "hold": "    keyframes: [{frame: -3, position: [0, 0, 0], look: [0, 0, 1]}]\n    interpolation: hold\n",
}


@pytest.mark.parametrize("kind", PATHS)
def test_dump_loads_to_an_equal_job(kind: str, job_path: Path) -> None:
    text = job_path.read_text()
    job_path.write_text(text[: text.index("    keyframes")] + PATHS[kind] + FULL)
    job = load_job(job_path)
    copy = job_path.parent / "copy.yaml"
    copy.write_text(dump_job(job))
    assert load_job(copy) == job
    nested = job_path.parent / "deep" / "copy.yaml"
    nested.parent.mkdir()
    nested.write_text(dump_job(job, nested.parent))
    assert load_job(nested) == job
    assert str(job_path.parent) not in nested.read_text()
    assert job_sha256(load_job(nested)) == job_sha256(job)


def test_dump_says_everything(job_path: Path) -> None:
    job = load_job(job_path)
    data = yaml.safe_load(dump_job(job, job_path.parent))
    assert set(data) == set(JobFile.model_fields) - {"viewers", "ring", "halftone", "lightfield"}, (
        "which stand for others"
    )
    assert data["output"]["directory"] == "out"
    assert data["frames"] == "1-120"


@pytest.mark.parametrize("text", ["1e3", "on", "true", "0o17", "1:30", "~", "", "a: b", "ä", "007", ".5"])
def test_dumped_text_stays_text(text: str) -> None:
    assert parse_value(dump_yaml({"a": text, "b": [text, 1.5e-7, 3]})) == {"a": text, "b": [text, 1.5e-7, 3]}


def test_source_is_no_part_of_equality(job_path: Path) -> None:
    job = load_job(job_path)
    edited(job_path.parent, "job.yaml", "quilt_job: 1\n", "# a line\n\nquilt_job: 1\n")
    assert load_job(job_path) == job


class TestHash:
    def hash(self, job_path: Path, *sets: str) -> str:
        return job_sha256(load_job(job_path, sets))

    @pytest.mark.parametrize(
        "setting",
        [
            "frames=1-3",
            "output.directory=x",
            "output.facets=false",
            "fps=30.0",
            "render.samples=1",
            "viewer.far=50.0",
        ],
    )
    def test_what_makes_no_pixels_is_left_out(self, setting: str, job_path: Path) -> None:
        assert self.hash(job_path, setting) == self.hash(job_path)

    @pytest.mark.parametrize(
        "setting",
        ["render.samples=4", "viewer.near=0.06", "fps=25", "layout={padding: 3}", "output.compression=piz"],
    )
    def test_what_makes_pixels_counts(self, setting: str, job_path: Path) -> None:
        assert self.hash(job_path, setting) != self.hash(job_path)

    def test_moved_folder_keeps_it(self, job_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
        edited(job_path.parent, "job.yaml", "", "layout: layout.yaml\n")
        moved = tmp_path_factory.mktemp("moved") / "there"
        shutil.copytree(job_path.parent, moved)
        assert self.hash(moved / "job.yaml") == self.hash(job_path)

    def test_renamed_mesh_and_comments_keep_it(self, job_path: Path) -> None:
        before = self.hash(job_path)
        (job_path.parent / "mesh.obj").rename(job_path.parent / "renamed.obj")
        edited(job_path.parent, "job.yaml", "mesh.obj", "renamed.obj  # moved")
        edited(job_path.parent, "display.yaml", "mesh.obj", "renamed.obj")
        assert self.hash(job_path) == before

    @pytest.mark.parametrize(
        ("name", "old", "new"),
        [
            ("mesh.obj", "v 0 1 0", "v 0 2 0"),
            ("display.yaml", "1200", "1201"),
            ("layout.yaml", "[64, 64]", "[65, 64]"),
            ("scene.yaml", "", "background: [1, 1, 1]\n"),
            ("mesh.mtl", "0.5", "0.6"),
            ("skin.png", "red", "blue"),
        ],
    )
    def test_edited_file_changes_it(self, name: str, old: str, new: str, job_path: Path) -> None:
        folder = job_path.parent
        edited(folder, "job.yaml", "scene: mesh.obj", "scene: scene.yaml\nlayout: layout.yaml")
        edited(folder, "mesh.obj", "", "mtllib mesh.mtl\n")
        (folder / "mesh.mtl").write_text("newmtl a\nKd 0.5 0 0\nmap_Kd -s 1 1 1 skin.png\n")
        (folder / "skin.png").write_text("red")
        before = self.hash(job_path)
        edited(folder, name, old, new)
        assert self.hash(job_path) != before

    def test_gltf_buffers_count(self, job_path: Path) -> None:
        folder = job_path.parent
        (folder / "s.gltf").write_text('{"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,x"}], "images": 3}')
        (folder / "a b.bin").write_text("1")
        before = self.hash(job_path, f"scene={folder}/s.gltf")
        (folder / "a b.bin").write_text("2")
        assert self.hash(job_path, f"scene={folder}/s.gltf") != before


def test_schemas_in_the_docs_are_up_to_date() -> None:
    folder = Path(__file__).parents[2] / "docs" / "schema"
    assert {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()} == schemas()


def test_names_shared_with_later_stages() -> None:
    from quiltcli.layout.packing import METHODS

    assert set(PACKING_METHODS.values()) == set(METHODS)
    assert "zip" in COMPRESSIONS


def test_viewer_spec_is_hashable_and_made_in_code() -> None:
    path = PathSpec.model_validate({"orbit": {"center": (0, 0, 0), "radius": 1, "frames_per_turn": 4}})
    spec = ViewerSpec(near=0.1, far=10, path=path)
    assert hash(spec) == hash(spec.model_copy())
    assert str(spec.source.problem("near", "x")) == "near: x"
