"""The measurements run: they use what the program is made of, and nobody calls them every day."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import benchmarks

ROOT = Path(__file__).parents[2]
_MODULES = sorted(
    path.stem for path in Path(benchmarks.__file__).parent.glob("*.py") if not path.stem.startswith("_")
)


@pytest.mark.parametrize("name", _MODULES)
def test_every_measurement_can_be_imported(name: str) -> None:
    importlib.import_module(f"tests.benchmarks.{name}")


@pytest.mark.long
@pytest.mark.parametrize("part", ["duels", "textures", "shadows", "moving", "sequences", "facets", "sorting"])
def test_measurements_print_their_targets(tmp_path: Path, part: str) -> None:
    command = [sys.executable, "-m", "tests.benchmarks", "--quick", "--rounds", "1", "--only", part]
    done = subprocess.run(
        [*command, "--json", str(tmp_path / "found.json")],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "| target |" in done.stdout
