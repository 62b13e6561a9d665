"""Pages and settings beside the code: links lead somewhere, versions agree, files can be read."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml

from quiltcli import __version__

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / ".github").rglob("*.md")]


def anchors(page: Path) -> set[str]:
    """Names of a page's headings, as the web shows them."""
    headings = re.findall(r"^##* (.*)", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-")) for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files_and_headings_that_are_there(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        if link.startswith("http") or (anchor and "reference" in str(target)):
            continue
        if not target.exists() or (anchor and anchor not in anchors(target)):
            lost.append(link)
    assert lost == []


def test_the_index_names_every_page() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert {page for page in pages if f"({page})" not in text} == {"index.md"}


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == __version__
    assert citation["license"] == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["license"]


def test_settings_of_other_services_are_yaml() -> None:
    files = [ROOT / ".pre-commit-config.yaml", *(ROOT / ".github").rglob("*.yml")]
    assert len(files) >= 3
    assert all(isinstance(yaml.safe_load(path.read_text(encoding="utf-8")), dict) for path in files)


def test_workflows_try_every_python_that_is_promised() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "test.yml").read_text())
    tried = workflow["jobs"]["test"]["strategy"]["matrix"]["python"]
    promised = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    assert tried == promised
    assert project["requires-python"] == f">={tried[0]}"


def test_files_and_tables_that_the_architecture_names_are_there() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:quiltcli|display_models|tests|render|viewer|cli)/[\w/.]*)`", text))
    assert len(named) > 20
    lost = {name for name in named if not ((ROOT / name).exists() or (ROOT / "quiltcli" / name).exists())}
    assert lost == set()
    tables = re.findall(r"`([A-Z]{4,})`[^`]*?`(quiltcli/[\w/]+\.py)`", text)
    assert {name for name, file in tables if name not in (ROOT / file).read_text(encoding="utf-8")} == set()


def test_the_architecture_lists_the_rooms_in_their_order() -> None:
    from tests.system.test_architecture import ORDER

    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rooms = text.partition("## The rooms")[2].partition("## The words")[0]
    rows = re.findall(r"^\| (`.*?) \|", rooms, re.MULTILINE)
    assert re.findall(r"`(\w+)`", " ".join(rows)) == [room for room in ORDER if room != "__main__"]
