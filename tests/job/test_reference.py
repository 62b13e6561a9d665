"""The pages of `docs/reference/` and the schemas of `docs/schema/`: fresh, whole, and true."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from quiltcli.job import check_file
from quiltcli.job.load import MODELS
from quiltcli.job.model import Model
from quiltcli.job.reference import EXAMPLES, keys, pages, split_unit
from quiltcli.job.schema import schema_of

DOCS = Path(__file__).parents[2] / "docs"
MEASURES = r"metre|pixel|degree|second|frame|m, cm|megabyte|linear|radian|m/s|Hz"
# Keys whose number is a bare one: counts, ratios, factors, numbers of things, directions.
BARE = {
    *("quilt_display", "quilt_job", "quilt_layout", "quilt_scene", "quilt_lightfield", "quilt_calibration"),
    *("views", "first_view", "first_row", "count"),
    *("id", "page", "max_pages", "page_facets", "samples", "subdivision"),
    *("aspect", "metallic", "roughness", "specular", "opacity", "cutoff", "scale", "matrix", "facets"),
    *("exponents", "weights", "knots_s", "knots_t", "constants", "center", "pieces", "threshold"),
    *("look", "up", "direction", "color", "emission", "orientation", "positions", "images", "rpm"),
    *("uv_set", "offset", "strength", "quilt_camera", "distortion"),
    *("exponent", "limit", "level", "peak", "gain", "gamma", "white", "signal_gamma"),
    *("throw", "shift", "matrix", "black", "weights_gamma"),
}


def test_the_pages_in_the_docs_are_up_to_date() -> None:
    found = {path.name: path.read_text(encoding="utf-8") for path in (DOCS / "reference").iterdir()}
    assert found == pages(), "run: make docs"


def models(model: type[Model]) -> set[str]:
    """Fields of a model and of those within it, by the name that its schema has for them."""
    schema = model.model_json_schema()
    return {key for part in (schema, *schema.get("$defs", {}).values()) for key in part.get("properties", {})}


@pytest.mark.parametrize("kind", MODELS)
def test_every_key_of_a_model_has_a_row(kind: str) -> None:
    name = kind.removeprefix("quilt_")
    rows = set(re.findall(r"^\| `(\w+)` \|", pages()[f"{name}.md"], re.MULTILINE))
    assert rows == models(MODELS[kind]) == {path.rpartition(".")[2] for path, _ in keys(kind)}


@pytest.mark.parametrize("kind", MODELS)
def test_every_key_says_what_it_means(kind: str) -> None:
    mute = [path for path, value in keys(kind) if not value.get("description") and "$ref" not in value]
    assert mute == []


def numeric(value: dict[str, object]) -> bool:
    """Whether a value is a number or a list of them."""
    text = str(value)
    return "'number'" in text or "'integer'" in text


@pytest.mark.parametrize("kind", MODELS)
def test_every_number_says_its_unit(kind: str) -> None:
    silent = [
        path
        for path, value in keys(kind)
        if numeric(value)
        and path.rpartition(".")[2] not in BARE
        and not path.endswith("_deg")
        and not re.search(MEASURES, value.get("description", ""), re.IGNORECASE)
    ]
    assert silent == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Shift, metres.", ("Shift.", "metres")),
        ("Room, if any, pixels. More.", ("Room, if any. More.", "pixels")),
        ("Between keyframes: linear, smooth, hold.", ("Between keyframes: linear, smooth, hold.", "")),
        ("Centre.", ("Centre.", "")),
    ],
)
def test_a_unit_is_what_the_first_sentence_ends_with(text: str, found: tuple[str, str]) -> None:
    assert split_unit(text) == found


def test_links_within_a_page_lead_somewhere() -> None:
    for text in pages().values():
        anchors: list[str] = []
        for heading in re.findall(r"^## (.*)", text, re.MULTILINE):
            anchor = re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-"))
            anchors.append(f"{anchor}-{anchors.count(anchor)}" if anchor in anchors else anchor)
        links = set(re.findall(r"\(#([^)]*)\)", text))
        assert links == set(anchors)


def test_the_examples_load(tmp_path: Path) -> None:
    for name, text in EXAMPLES.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    for mesh in ("sphere.obj", "dragon.ply"):
        (tmp_path / mesh).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for name in EXAMPLES:
        assert check_file(tmp_path / f"{name}.yaml") == []


def test_a_recorded_path_may_be_a_name_alone_in_the_schema_as_in_the_model() -> None:
    csv = schema_of("quilt_job")["$defs"]["PathSpec"]["properties"]["csv"]
    assert "'type': 'string'" in str(csv["anyOf"])
